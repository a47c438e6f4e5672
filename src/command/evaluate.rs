//! `evaluate`: measured tables from data with truth.

mod job;
mod output;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use indicatif::ProgressBar;

use self::job::{Job, Kind};
use self::output::Outputs;
use crate::command::settings::Settings;
use crate::command::watch::{progress_bar, stop_on_signal};
use crate::command::{CommandError, Outcome};
use crate::config::Config;
use crate::drive::worker_pool;
use crate::evaluation::maps::MapFolder;
use crate::evaluation::method::{METHODS, Method, method};
use crate::evaluation::store::Store;
use crate::evaluation::{Part, Run};

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// Kind of a data set: kitti2012, kitti2015, middlebury, sintel, spring, davis, saliency, bag (one for all paths, or one per path)
    #[arg(long = "dataset", value_name = "KIND", required_unless_present = "merge")]
    datasets: Vec<Kind>,
    /// Folders in the published layout of the data set; bags with truth topics
    #[arg(required_unless_present = "merge")]
    paths: Vec<PathBuf>,
    /// Only this scene (repeatable; default: all)
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
    /// Only this method (repeatable; default: all): `full_frame`, `spectral_residual`, `frequency_tuned`, paper, scene, c1 … c5, centre, rows
    #[arg(long = "method", value_name = "NAME")]
    methods: Vec<String>,
    /// Write every attention map as PNG: DIR/DATASET/METHOD/[SCENE/]IMAGE.png (measures everything again)
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
    /// Folder of the finished parts: what is there already is not measured again
    #[arg(long, value_name = "DIR", default_value = "out/evaluation")]
    work: PathBuf,
    /// Only every Nth scene, from the Ith on (1/4, 2/4, … in a job array)
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Tables of the finished parts in this folder instead of measuring (repeatable)
    #[arg(long, value_name = "DIR", conflicts_with_all = ["datasets", "paths", "shard", "maps"])]
    merge: Vec<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    settings: Settings,
}

/// One of N equal shares of the scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shard {
    index: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || "I/N is wanted with 1 <= I <= N, as in 2/8".to_owned();
        let (index, of) = text.split_once('/').ok_or_else(wanted)?;
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| wanted());
        let shard = Self { index: number(index)?, of: number(of)? };
        (1..=shard.of).contains(&shard.index).then_some(shard).ok_or_else(wanted)
    }
}

/// Runs the command.
///
/// # Errors
/// Unusable arguments, a layout with missing files, or an output that cannot be written.
pub fn run(args: &EvaluateArgs) -> Result<Outcome, CommandError> {
    let outputs = args.outputs.check()?;
    if !args.merge.is_empty() {
        let mut parts = Vec::new();
        for folder in &args.merge {
            parts.extend(Store::new(folder).parts().map_err(CommandError::failed)?);
        }
        outputs.write(parts)?;
        return Ok(Outcome::Done);
    }
    let config = args.settings.config(Config::default())?;
    let methods = wanted_methods(&args.methods)?;
    let mut jobs = Vec::new();
    let mut skipped = Vec::new();
    let pairs = pairs(&args.datasets, &args.paths)?;
    for (kind, path) in &pairs {
        // Folders of one kind are told apart by their names.
        let alone = pairs.iter().filter(|(other, _)| other == kind).count() == 1;
        job::list(*kind, path, alone, &args.scenes, &config, &mut jobs, &mut skipped)?;
    }
    if let Some(shard) = args.shard {
        let mut number = 0;
        jobs.retain(|_| {
            number += 1;
            (number - 1) % shard.of == shard.index - 1
        });
    }

    let stop = stop_on_signal()?;
    let store = Store::new(&args.work);
    let maps = args.maps.as_deref().map(MapFolder::new);
    let session = Session { config, methods, store, maps, here: Run::here(), stop };
    let (parts, complete) = session.run(jobs, &mut skipped)?;
    for (scene, reason) in &skipped {
        eprintln!("skipped {scene}: {reason}");
    }
    if parts.is_empty() {
        return Err(CommandError::failed("nothing was measured"));
    }
    if !complete {
        eprintln!("interrupted: run the same command again to go on from here");
    }
    outputs.write(parts)?;
    Ok(if skipped.is_empty() && complete { Outcome::Done } else { Outcome::DoneWithLosses })
}

/// Each path with its kind.
fn pairs<'a>(
    kinds: &[Kind],
    paths: &'a [PathBuf],
) -> Result<Vec<(Kind, &'a PathBuf)>, CommandError> {
    match kinds {
        [kind] => Ok(paths.iter().map(|path| (*kind, path)).collect()),
        kinds if kinds.len() == paths.len() => Ok(kinds.iter().copied().zip(paths).collect()),
        _ => Err(CommandError::Usage(format!(
            "{} times --dataset and {} paths: give one --dataset for all paths or one for each",
            kinds.len(),
            paths.len()
        ))),
    }
}

fn wanted_methods(names: &[String]) -> Result<Vec<&'static Method>, CommandError> {
    if names.is_empty() {
        return Ok(METHODS.iter().collect());
    }
    let found = names.iter().map(|name| {
        method(name).ok_or_else(|| {
            let known: Vec<_> = METHODS.iter().map(|method| method.name).collect();
            CommandError::Usage(format!("there is no method '{name}'; known: {}", known.join(", ")))
        })
    });
    let mut found: Vec<_> = found.collect::<Result<_, _>>()?;
    // In the order of the tables, each once.
    found.sort_by_key(|found| METHODS.iter().position(|known| known.name == found.name));
    found.dedup_by_key(|found| found.name);
    Ok(found)
}

/// What all scenes of a run have in common.
struct Session {
    config: Config,
    methods: Vec<&'static Method>,
    store: Store,
    maps: Option<MapFolder>,
    here: Run,
    stop: Arc<AtomicBool>,
}

impl Session {
    /// Measures what is not measured yet. Answers with all parts, and whether
    /// the run came to its end.
    fn run(
        &self,
        jobs: Vec<Job>,
        skipped: &mut Vec<(String, String)>,
    ) -> Result<(Vec<Part>, bool), CommandError> {
        let pool = worker_pool(self.config.threads).map_err(CommandError::failed)?;
        let threads = pool.current_num_threads();
        let bar = progress_bar(jobs.len() as u64 * job::STEPS);
        let mut parts = Vec::new();
        for (number, job) in jobs.into_iter().enumerate() {
            bar.set_position(number as u64 * job::STEPS);
            let name = format!("{} {}", job.subject.dataset, job.subject.scene);
            bar.set_message(name.clone());
            let (found, missing) = self.plan(&job, threads)?;
            parts.extend(found);
            if missing.is_empty() {
                continue;
            }
            let measured = pool.install(|| self.measure(job, &missing, threads, &bar))?;
            let Some(measured) = measured else {
                bar.finish_and_clear();
                return Ok((parts, false));
            };
            for reason in measured.skipped.keys() {
                skipped.push((name.clone(), reason.clone()));
            }
            parts.extend(measured.parts);
        }
        bar.finish_and_clear();
        Ok((parts, true))
    }

    /// Parts that are there, and methods that are still to be measured.
    #[allow(clippy::type_complexity, reason = "a pair of lists")]
    fn plan(
        &self,
        job: &Job,
        threads: usize,
    ) -> Result<(Vec<Part>, Vec<(&'static Method, Config)>), CommandError> {
        let (mut found, mut missing) = (Vec::new(), Vec::new());
        let subject = &job.subject;
        for method in &self.methods {
            if !method.applies(subject.monocular, job.has_masks) {
                continue;
            }
            let config = method
                .config(&self.config, subject.monocular)
                .map_err(|e| CommandError::Usage(format!("method {}: {e}", method.name)))?;
            let run = self.here.with_config(&config, threads);
            let part = match self.maps {
                Some(_) => None,
                None => self
                    .store
                    .find(&subject.dataset, &subject.scene, method.name, &run)
                    .map_err(CommandError::failed)?,
            };
            match part {
                Some(part) => found.push(part),
                None => missing.push((*method, config)),
            }
        }
        Ok((found, missing))
    }

    /// Measures one scene by several methods and keeps the parts; `None` when
    /// it was interrupted.
    fn measure(
        &self,
        job: Job,
        methods: &[(&'static Method, Config)],
        threads: usize,
        bar: &ProgressBar,
    ) -> Result<Option<Measured>, CommandError> {
        let start = bar.position();
        let progress = |share: f64| {
            bar.set_position(start + (share * job::STEPS as f64) as u64);
            !self.stop.load(Ordering::Relaxed)
        };
        let maps = self.maps.as_ref();
        let Some((finished, skipped)) =
            job.measure(methods, &self.here, threads, maps, &self.config, progress)?
        else {
            return Ok(None);
        };
        let mut parts = Vec::new();
        for (part, pictures) in finished {
            // What could not be read today may be readable tomorrow.
            parts.push(if skipped.is_empty() {
                self.store.keep(part, &pictures).map_err(CommandError::failed)?
            } else {
                part
            });
        }
        Ok(Some(Measured { parts, skipped }))
    }
}

struct Measured {
    parts: Vec<Part>,
    skipped: BTreeMap<String, u64>,
}
