//! All methods on one data set.

use std::collections::{BTreeMap, BTreeSet};

use super::method::METHODS;
pub use super::method::{ABLATION, FULL_FRAME, OURS};
use super::{Evaluation, Figures, Part, Peer, Run};

/// What the baseline is called on the pairs of the peers alone.
const SAME_PAIRS: &str = "full-frame SGM on the peers' pairs";

/// One method on all scenes of one data set.
#[derive(Clone, Debug)]
pub struct Merged {
    /// Its name.
    pub method: String,
    /// The scenes added up.
    pub total: Part,
    /// Every scene, sorted; one that was added twice stands here twice.
    pub scenes: Vec<String>,
    /// The runs that the scenes are from, without repetition.
    pub runs: Vec<Run>,
    /// What is made of the counts.
    pub figures: Figures,
}

impl Merged {
    fn of(method: &str, mut parts: Vec<&Part>) -> Option<Self> {
        // Sums of floats depend on their order.
        parts.sort_by(|a, b| a.scene.cmp(&b.scene));
        let (first, rest) = parts.split_first()?;
        let mut total = (*first).clone();
        for part in rest {
            total.merge(part);
        }
        let mut runs: Vec<Run> = Vec::new();
        for part in &parts {
            if !runs.contains(&part.run) {
                runs.push(part.run.clone());
            }
        }
        let scenes = parts.iter().map(|part| part.scene.clone()).collect();
        let figures = Figures::of(&total);
        Some(Self { method: method.to_owned(), total, scenes, runs, figures })
    }

    /// What it is called in tables.
    pub fn label(&self) -> &str {
        label(&self.method)
    }

    /// True for a step of the cue ablation.
    pub fn is_ablation(&self) -> bool {
        ABLATION.contains(&self.method.as_str())
    }
}

/// What a method is called in tables.
pub fn label(method: &str) -> &str {
    super::method::method(method).map_or(method, |known| known.label)
}

/// Where a method that is listed stands among the others.
pub fn place(method: &str) -> Option<usize> {
    METHODS.iter().position(|known| known.name == method)
}

/// One of the others' matchers on all pairs of one data set.
#[derive(Clone, Debug)]
pub struct PeerTotal {
    /// Its name and version.
    pub label: String,
    /// The pairs, sorted.
    pub scenes: Vec<String>,
    /// Means over the pixels of all pairs; of the time the median over the pairs.
    pub mean: Peer,
}

impl PeerTotal {
    fn of(method: &str, peers: &[&Peer]) -> Option<Self> {
        let first = *peers.first()?;
        // As our own scores: every pixel counts alike, in whichever pair it is.
        let mean = |weight: fn(&Peer) -> u64, value: fn(&Peer) -> f64| {
            let weights = peers.iter().map(|peer| weight(peer)).sum::<u64>().max(1) as f64;
            peers.iter().map(|peer| weight(peer) as f64 * value(peer)).sum::<f64>() / weights
        };
        let mut times: Vec<f64> = peers.iter().map(|peer| peer.matching_ms).collect();
        times.sort_unstable_by(f64::total_cmp);
        let mean = Peer {
            scene: String::new(),
            matching_ms: *times.get(times.len() / 2)?,
            epe_px: mean(|p| p.pixels, |p| p.epe_px),
            d1: mean(|p| p.pixels, |p| p.d1),
            bad_2: mean(|p| p.pixels, |p| p.bad_2),
            density: mean(|p| p.known, |p| p.density),
            filled_d1: mean(|p| p.known_with_occluded, |p| p.filled_d1),
            ..first.clone()
        };
        let mut scenes: Vec<String> = peers.iter().map(|peer| peer.scene.clone()).collect();
        scenes.sort();
        Some(Self { label: format!("{method} {}", first.version).trim().to_owned(), scenes, mean })
    }
}

/// All methods on one data set. Nothing is ever averaged over data sets.
#[derive(Clone, Debug)]
pub struct Group {
    /// Kind and folder of the data set.
    pub dataset: String,
    /// The methods, in the order of the tables.
    pub methods: Vec<Merged>,
    /// The others' matchers, by name.
    pub peers: Vec<PeerTotal>,
    /// The full-frame baseline on the pairs of the peers, where those are not
    /// all of its own.
    pub same_pairs: Option<Merged>,
}

impl Group {
    /// The groups of an evaluation, by name of the data set.
    pub fn all(evaluation: &Evaluation) -> Vec<Self> {
        let parts = evaluation.parts.iter().map(|part| &part.dataset);
        let peers = evaluation.peers.iter().map(|peer| &peer.dataset);
        let datasets: BTreeSet<&String> = parts.chain(peers).collect();
        datasets.into_iter().map(|dataset| Self::of(evaluation, dataset)).collect()
    }

    fn of(evaluation: &Evaluation, dataset: &str) -> Self {
        let mut by_method: BTreeMap<&str, Vec<&Part>> = BTreeMap::new();
        for part in evaluation.parts.iter().filter(|part| part.dataset == dataset) {
            by_method.entry(&part.method).or_default().push(part);
        }
        let mut same_pairs = by_method.get(FULL_FRAME).cloned().unwrap_or_default();
        let pairs = same_pairs.len();
        let of_peers: BTreeSet<&str> = evaluation
            .peers
            .iter()
            .filter(|peer| peer.dataset == dataset)
            .map(|peer| peer.scene.as_str())
            .collect();
        same_pairs.retain(|part| of_peers.contains(part.scene.as_str()));
        let same_pairs = if same_pairs.len() < pairs { same_pairs } else { Vec::new() };
        let mut methods: Vec<Merged> =
            by_method.into_iter().filter_map(|(name, parts)| Merged::of(name, parts)).collect();
        // Methods that are not listed come after the listed ones, by name.
        methods.sort_by_key(|merged| place(&merged.method).unwrap_or(METHODS.len()));
        let baseline = methods.iter().find(|merged| merged.method == FULL_FRAME);
        if let Some(baseline) = baseline.and_then(|merged| merged.figures.times) {
            for merged in methods.iter_mut().filter(|merged| merged.method != FULL_FRAME) {
                merged.figures.compare_times(&baseline);
            }
        }
        let mut by_peer: BTreeMap<(&str, &str), Vec<&Peer>> = BTreeMap::new();
        for peer in evaluation.peers.iter().filter(|peer| peer.dataset == dataset) {
            by_peer.entry((&peer.method, &peer.version)).or_default().push(peer);
        }
        let peers = by_peer.iter().filter_map(|((name, _), peers)| PeerTotal::of(name, peers));
        Self {
            dataset: dataset.to_owned(),
            peers: peers.collect(),
            methods,
            same_pairs: Merged::of(SAME_PAIRS, same_pairs),
        }
    }

    /// The methods that are compared with each other.
    pub fn compared(&self) -> Vec<&Merged> {
        self.methods.iter().filter(|merged| !merged.is_ablation()).collect()
    }

    /// One method by its name.
    pub fn method(&self, name: &str) -> Option<&Merged> {
        self.methods.iter().find(|merged| merged.method == name)
    }
}
