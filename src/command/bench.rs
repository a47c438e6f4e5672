//! `bench`: milliseconds per stage.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::command::print::{put, say};
use crate::command::settings::{Settings, bag_options};
use crate::command::summary;
use crate::command::watch::write_json;
use crate::command::{CommandError, Outcome};
use crate::config::Config;
use crate::drive::{Engine, worker_pool};
use crate::input::bag::{BagSource, BagTopics};
use crate::input::dataset::PairFiles;
use crate::input::synthetic::{SceneKind, SceneOptions, SyntheticScene, SyntheticSource};
use crate::input::{FrameSource, Observation};
use crate::metric::StageStats;

/// Frames that fill caches and buffers before anything is measured.
const WARM_UP: usize = 3;
/// Frames of a bag that are held in memory and gone through in turn.
const MOST_FRAMES_HELD: usize = 32;

/// Arguments of `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Bag to take the frames from
    #[arg(conflicts_with_all = ["left", "right", "scene"])]
    bag: Option<PathBuf>,
    /// Left image of a rectified pair (PNG, JPEG, PNM)
    #[arg(long, value_name = "FILE", requires = "right")]
    left: Option<PathBuf>,
    /// Right image of the pair
    #[arg(long, value_name = "FILE", requires = "left")]
    right: Option<PathBuf>,
    /// Scene of the project's own renderer (when no images are given)
    #[arg(long, value_name = "street|tabletop", default_value_t = SceneKind::Street)]
    scene: SceneKind,
    /// Match a centred rectangle of this share of the image, with its border, instead of what is salient
    #[arg(long, value_name = "FRACTION")]
    roi: Option<f32>,
    /// Number of disparities searched (`stereo.disparity_range`)
    #[arg(long, value_name = "N")]
    disparities: Option<i64>,
    /// Frames measured
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Write the result as JSON (`-`: to stdout, instead of the table)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
}

/// Runs the command.
///
/// # Errors
/// Unusable arguments, or images that cannot be read.
pub fn run(args: &BenchArgs) -> Result<Outcome, CommandError> {
    if args.roi.is_some_and(|f| !(f > 0.0 && f <= 1.0)) {
        return Err(CommandError::Usage(
            "--roi wants a share of the image above 0 and up to 1".into(),
        ));
    }
    let mut config = args.settings.config(Config::default())?;
    if let Some(n) = args.disparities {
        config = config
            .with("stereo.disparity_range", &Value::from(n))
            .map_err(|e| CommandError::Usage(e.to_string()))?;
    }
    let observations = frames(args, &config)?;
    let Some(first) = observations.first() else {
        return Err(CommandError::failed("there is no stereo pair to measure on"));
    };
    let size = first.frame.left.size();

    let mut stats = StageStats::default();
    let mut fraction = 0.0;
    let mut engine = Engine::new(config.clone()).with_centred_roi(args.roi);
    let pool = worker_pool(config.threads).map_err(CommandError::failed)?;
    let threads = pool.current_num_threads();
    pool.install(|| {
        let turns = observations.iter().cycle();
        for (i, observation) in turns.take(WARM_UP + args.frames as usize).enumerate() {
            // The turn from the last frame to the first is no jump in time.
            if i % observations.len() == 0 {
                engine.reset();
            }
            let perception = engine.process(&observation.frame);
            if i >= WARM_UP {
                stats.add(&perception.times);
                fraction += f64::from(perception.roi.fraction) / f64::from(args.frames);
            }
        }
    });
    let Some(times) = stats.summary() else {
        return Err(CommandError::failed("no frame was measured"));
    };

    let json = args.json.as_deref();
    if json.is_none_or(|path| path.as_os_str() != "-") {
        say(format_args!(
            "{size}, {} disparities, {:.1} % of the image matched, {threads} threads, {} frames",
            config.stereo.disparity_range,
            100.0 * fraction,
            times.frames,
        ));
        put(format_args!("{}", summary::times(&times)));
    }
    if let Some(path) = json {
        let mut document = serde_json::to_value(times).map_err(CommandError::failed)?;
        document["width"] = json!(size.width);
        document["height"] = json!(size.height);
        document["threads"] = json!(threads);
        document["disparities"] = json!(config.stereo.disparity_range);
        document["matched_fraction"] = json!(fraction);
        write_json(path, &document)?;
    }
    Ok(Outcome::Done)
}

fn frames(args: &BenchArgs, config: &Config) -> Result<Vec<Observation>, CommandError> {
    let wanted = (args.frames as usize).min(MOST_FRAMES_HELD);
    match (&args.bag, &args.left, &args.right) {
        (Some(bag), _, _) => {
            let source = BagSource::open(bag, config, bag_options(config, BagTopics::default())?)
                .map_err(CommandError::failed)?;
            take(source, wanted)
        }
        (None, Some(left), Some(right)) => {
            let files =
                PairFiles { left: left.clone(), right: right.clone(), ..PairFiles::default() };
            let source = files.open().map_err(CommandError::failed)?;
            take(source, wanted)
        }
        _ => {
            let scene = args.scene;
            let options = SceneOptions { frames: wanted, ..scene.defaults() };
            let scene = SyntheticScene::new(scene, options).map_err(CommandError::failed)?;
            take(SyntheticSource::new(scene), wanted)
        }
    }
}

fn take<S: FrameSource>(mut source: S, wanted: usize) -> Result<Vec<Observation>, CommandError> {
    let mut observations = Vec::new();
    while observations.len() < wanted {
        match source.next_observation().map_err(CommandError::failed)? {
            Some(observation) => observations.push(observation),
            None => break,
        }
    }
    Ok(observations)
}
