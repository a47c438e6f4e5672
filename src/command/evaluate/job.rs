//! One scene of one data set, to be measured.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::str::FromStr;

use crate::command::CommandError;
use crate::command::settings::bag_options;
use crate::config::Config;
use crate::evaluation::maps::MapFolder;
use crate::evaluation::measure::{Measure, Subject};
use crate::evaluation::method::Method;
use crate::evaluation::store::Picture;
use crate::evaluation::{Part, Run};
use crate::input::FrameSource;
use crate::input::bag::{BagSource, BagTopics};
use crate::input::dataset::{DatasetKind, DatasetSource, Scene, open};

/// Steps of the progress bar per scene.
pub const STEPS: u64 = 1000;

/// Kind of a data set, as on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A folder in a published layout.
    Folder(DatasetKind),
    /// A bag with truth topics.
    Bag,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Folder(kind) => kind.name(),
            Self::Bag => "bag",
        }
    }

    /// True when the data set knows where the objects are.
    fn has_masks(self) -> bool {
        use DatasetKind::{Davis, Kitti2015, Saliency};
        matches!(self, Self::Bag | Self::Folder(Davis | Saliency | Kitti2015))
    }
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "bag" {
            return Ok(Self::Bag);
        }
        text.parse().map(Self::Folder).map_err(|_| {
            let known: Vec<_> = DatasetKind::ALL.iter().map(|kind| kind.name()).collect();
            format!("known are {} and bag", known.join(", "))
        })
    }
}

/// A scene to be measured.
pub struct Job {
    /// What it is.
    pub subject: Subject,
    /// True objects are known.
    pub has_masks: bool,
    frames: Frames,
}

enum Frames {
    Scene(Box<Scene>),
    Bag(std::path::PathBuf),
}

/// What a job yields: parts with their pictures, and what was skipped.
pub type Yield = (Vec<(Part, Vec<Picture>)>, BTreeMap<String, u64>);

/// Adds the scenes of a data set to `jobs`, and those that cannot be read to
/// `skipped` with the reason. Unless it is `alone` of its kind, its folder's
/// name is part of the data set's.
///
/// # Errors
/// When the layout is not the published one, or the bag cannot be read.
pub fn list(
    kind: Kind,
    path: &Path,
    alone: bool,
    scenes: &[String],
    config: &Config,
    jobs: &mut Vec<Job>,
    skipped: &mut Vec<(String, String)>,
) -> Result<(), CommandError> {
    let folder = match kind {
        Kind::Bag => {
            let scene = stem(path);
            // Opened once here, so that a wrong path is told before the work.
            bag(path, config)?;
            if scenes.is_empty() || scenes.contains(&scene) {
                let dataset = format!("bag {scene}");
                let subject = Subject { dataset, scene, ..Subject::default() };
                jobs.push(Job { subject, has_masks: true, frames: Frames::Bag(path.to_owned()) });
            }
            return Ok(());
        }
        Kind::Folder(folder) => folder,
    };
    let opened = open(folder, path, scenes).map_err(CommandError::failed)?;
    skipped.extend(opened.skipped.into_iter().map(|(scene, reason)| (scene, reason.to_string())));
    let dataset =
        if alone { kind.name().to_owned() } else { format!("{} {}", kind.name(), name_of(path)) };
    let notes: BTreeSet<&String> = opened.scenes.iter().flat_map(|scene| &scene.notes).collect();
    for note in notes {
        eprintln!("note: {note}");
    }
    jobs.extend(opened.scenes.into_iter().map(|scene| Job {
        subject: Subject {
            dataset: dataset.clone(),
            scene: scene.name.clone(),
            monocular: scene.monocular,
            stills: scene.stills,
        },
        has_masks: kind.has_masks(),
        frames: Frames::Scene(Box::new(scene)),
    }));
    Ok(())
}

fn bag(path: &Path, config: &Config) -> Result<BagSource, CommandError> {
    let options = bag_options(config, BagTopics::default())?;
    BagSource::open(path, config, options).map_err(CommandError::failed)
}

/// Name of a folder, whatever dots are in it.
fn name_of(path: &Path) -> String {
    path.file_name()
        .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// Name of a file without its extension.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "bag".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

impl Job {
    /// Measures the scene; `None` when `progress`, which gets the share that is
    /// done, says stop. Frames that cannot be read are told among what was
    /// skipped; in a bag nothing can come after one.
    ///
    /// # Errors
    /// When a bag cannot be opened or an output cannot be written.
    pub fn measure(
        self,
        methods: &[(&'static Method, Config)],
        here: &Run,
        threads: usize,
        maps: Option<&MapFolder>,
        config: &Config,
        progress: impl Fn(f64) -> bool,
    ) -> Result<Option<Yield>, CommandError> {
        let measure = Measure::new(self.subject, methods, here, threads, maps);
        match self.frames {
            Frames::Scene(scene) => {
                let source = DatasetSource::new(vec![*scene]);
                let name =
                    |source: &DatasetSource| source.current_file().map_or_else(String::new, stem);
                through(source, measure, name, true, progress)
            }
            Frames::Bag(path) => {
                let source = bag(&path, config)?;
                let name = |source: &BagSource| format!("{:06}", source.tally().pairs - 1);
                through(source, measure, name, false, progress)
            }
        }
    }
}

fn through<S: FrameSource>(
    mut source: S,
    mut measure: Measure<'_>,
    name: impl Fn(&S) -> String,
    goes_on_after_errors: bool,
    progress: impl Fn(f64) -> bool,
) -> Result<Option<Yield>, CommandError> {
    let mut skipped = BTreeMap::new();
    loop {
        match source.next_observation() {
            Ok(Some(observation)) => {
                let image = name(&source);
                measure.frame(&observation, &image).map_err(CommandError::failed)?;
            }
            Ok(None) => break,
            Err(error) => {
                *skipped.entry(error.to_string()).or_default() += 1;
                if !goes_on_after_errors {
                    break;
                }
            }
        }
        if !progress(source.progress().unwrap_or(0.0)) {
            return Ok(None);
        }
    }
    for (reason, count) in &source.tally().skipped {
        *skipped.entry(reason.clone()).or_default() += count;
    }
    Ok(Some((measure.finish(&skipped), skipped)))
}
