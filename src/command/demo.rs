//! `demo`: the real node on DDS, a bag played into its topics, its regions
//! printed as they arrive, and an output bag and a report of what it did.

mod recording;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::ProgressBar;
use serde_json::json;

use crate::command::print::{put, say};
use crate::command::settings::Settings;
use crate::command::watch::{progress_bar, stop_on_signal};
use crate::command::{CommandError, Outcome};
use crate::config::Config;
use crate::ros::NODE_NAME;
use crate::ros::environment::Environment;
use crate::ros::message::salient_stereo_msgs::{SalientRegion, SalientRegionArray};
use crate::ros::names::Names;
use crate::ros::node::RosNode;
use crate::ros::play::{RegionsListener, StereoMessages, StereoPlayer};
use crate::ros::runtime::{NodeOptions, NodeRuntime};
use recording::{Recorder, Recording};

/// Longest wait for the topics to find each other.
const DISCOVERY_PATIENCE: Duration = Duration::from_secs(20);
/// Silence after the last pair that ends the demo.
const LAST_PATIENCE: Duration = Duration::from_secs(3);
/// Regions printed per frame; the others are counted.
const PRINTED: usize = 4;

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Bag to play, a single .mcap file [default: the street bag of the project]
    bag: Option<PathBuf>,
    /// Folder for demo.mcap and demo.html
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Play this many times as fast as recorded
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    rate: f64,
    #[command(flatten)]
    settings: Settings,
}

/// Runs the command.
///
/// # Errors
/// A bag that cannot be played, a graph that cannot be joined, or outputs that
/// cannot be written.
pub fn run(args: &DemoArgs) -> Result<Outcome, CommandError> {
    if !(args.rate.is_finite() && (0.01..=100.0).contains(&args.rate)) {
        return Err(CommandError::Usage(format!("--rate {} is not in 0.01 to 100", args.rate)));
    }
    let config = args.settings.config(Config::default())?;
    let path = args.bag.clone().map_or_else(shipped_bag, Ok)?;
    let recording = Recording::read(&path, &config)?;
    let transport = if recording.compressed { "compressed" } else { "raw" };
    let config = config.with("image_transport", &json!(transport)).map_err(CommandError::failed)?;
    let environment = environment()?;
    let stop = stop_on_signal()?;

    let total = recording.messages.len();
    let recorder =
        Arc::new(Mutex::new(Recorder::create(&args.out, &path, &config, recording.truth)?));
    let observer = {
        let recorder = Arc::clone(&recorder);
        Box::new(move |observation: &_, perception: &_| {
            recorder.lock().unwrap_or_else(PoisonError::into_inner).take(observation, perception);
        })
    };

    let names = |node| Names::new("/", node, &[]).map_err(CommandError::failed);
    let options = NodeOptions {
        observer: Some(observer),
        // The recorder writes every result: none may be dropped before it.
        results_waiting: total.max(1),
        ..NodeOptions::new(config, names(NODE_NAME)?, environment.clone())
    };
    let mut node = NodeRuntime::start(options).map_err(CommandError::failed)?;
    let mut camera =
        RosNode::open(names("demo_camera")?, &environment).map_err(CommandError::failed)?;
    let listener =
        RegionsListener::new(&mut camera, node.regions_topic()).map_err(CommandError::failed)?;
    let player = StereoPlayer::with_infos(&mut camera, recording.compressed, recording.infos)
        .map_err(CommandError::failed)?;
    say(format_args!(
        "playing {} ({total} pairs) into left/image_rect and right/image_rect, domain {}{}",
        path.display(),
        environment.domain_id,
        if environment.localhost { ", this machine only" } else { "" }
    ));
    say(format_args!("in another terminal: ros2 topic echo {}", node.regions_topic()));

    let bar = progress_bar(total as u64);
    let arrived = play_and_listen(player, listener, recording.messages, args.rate, &stop, &bar)?;
    bar.finish_and_clear();

    let clean = node.stop();
    let totals = node.status().totals();
    if !clean {
        eprintln!("a thread of the node did not end in time");
    }
    let mut recorder = recorder.lock().unwrap_or_else(PoisonError::into_inner);
    let summary = recorder.finish()?;
    say(format_args!(""));
    say(format_args!(
        "{total} pairs in the bag, {} processed, {arrived} region arrays received over DDS",
        totals.processed
    ));
    put(format_args!("{summary}"));
    say(format_args!("bag     {}", recorder.bag_path().display()));
    say(format_args!("report  {}", recorder.report_path().display()));
    if totals.displaced > 0 {
        eprintln!(
            "{} pairs were replaced by newer ones before they were processed: this machine does not keep up at this rate",
            totals.displaced
        );
    }
    let complete = arrived >= total || stop.load(Ordering::Relaxed);
    Ok(if complete { Outcome::Done } else { Outcome::DoneWithLosses })
}

/// Plays the messages and prints what comes back; returns the number of arrays.
fn play_and_listen(
    mut player: StereoPlayer,
    mut listener: RegionsListener,
    messages: Vec<StereoMessages>,
    rate: f64,
    stop: &AtomicBool,
    bar: &ProgressBar,
) -> Result<usize, CommandError> {
    if !player.wait_for_subscribers(DISCOVERY_PATIENCE, stop) && !stop.load(Ordering::Relaxed) {
        return Err(CommandError::failed(
            "the node's topics were not discovered: is UDP on the loopback device blocked?",
        ));
    }
    let total = messages.len();
    let playing = AtomicBool::new(true);
    let mut arrived = 0;
    thread::scope(|scope| {
        scope.spawn(|| {
            player.play(messages, rate, stop, |_, _| ());
            playing.store(false, Ordering::Release);
        });
        let mut quiet_since = Instant::now();
        while arrived < total {
            if let Some(array) = listener.next(Duration::from_millis(100)) {
                arrived += 1;
                print_array(bar, &array);
                bar.set_position(arrived as u64);
                quiet_since = Instant::now();
            } else if playing.load(Ordering::Acquire) {
                quiet_since = Instant::now();
            } else if quiet_since.elapsed() > LAST_PATIENCE || stop.load(Ordering::Relaxed) {
                break;
            }
        }
    });
    Ok(arrived)
}

fn print_array(bar: &ProgressBar, array: &SalientRegionArray) {
    let stamp = array.header.stamp;
    let line = |text: String| {
        if bar.is_hidden() { say(format_args!("{text}")) } else { bar.println(text) }
    };
    let seen = array.regions.len();
    if seen == 0 {
        line(format!("{}.{:03}  no region", stamp.sec, stamp.nanosec / 1_000_000));
    }
    for (i, region) in array.regions.iter().take(PRINTED).enumerate() {
        let time = if i == 0 {
            format!("{}.{:03}", stamp.sec, stamp.nanosec / 1_000_000)
        } else {
            String::new()
        };
        line(format!("{time:>14}  {}", region_line(region)));
    }
    if seen > PRINTED {
        line(format!("{:>14}  and {} more", "", seen - PRINTED));
    }
}

fn region_line(region: &SalientRegion) -> String {
    let roi = &region.roi;
    let distance = if region.median_depth.is_finite() {
        format!("{:6.2} m", region.median_depth)
    } else {
        "     ? m".to_owned()
    };
    format!(
        "id {:>3}  box {:>3},{:>3} {:>3}x{:<3}  {distance}  confidence {:.2}",
        region.track_id, roi.x_offset, roi.y_offset, roi.width, roi.height, region.confidence
    )
}

/// The environment of the process, kept on this machine unless it says otherwise.
fn environment() -> Result<Environment, CommandError> {
    let variable = |name: &'static str| {
        let value = std::env::var(name).ok().filter(|value| !value.is_empty());
        value.or_else(|| (name == "ROS_AUTOMATIC_DISCOVERY_RANGE").then(|| "LOCALHOST".to_owned()))
    };
    Environment::from_variables(variable, None).map_err(|e| CommandError::Usage(e.to_string()))
}

/// The street bag: beside the working directory, the installed tool, or in the
/// source tree that the tool was built from.
fn shipped_bag() -> Result<PathBuf, CommandError> {
    // PREFIX/bin/tool, or PREFIX/lib/PACKAGE/tool as ament lays it out.
    let exe = std::env::current_exe().unwrap_or_default();
    let installed = exe
        .ancestors()
        .skip(2)
        .take(2)
        .map(|prefix| prefix.join("share/salient_stereo"))
        .find(|share| share.is_dir());
    let roots = [Some(PathBuf::from(".")), installed, Some(env!("CARGO_MANIFEST_DIR").into())];
    roots
        .into_iter()
        .flatten()
        .map(|root| root.join(Path::new("bags/street.mcap")))
        .find(|path| path.is_file())
        .ok_or_else(|| {
            CommandError::failed(
                "bags/street.mcap was not found; name a bag: salient_stereo demo BAG, or make it: salient_stereo render street -o FILE",
            )
        })
}
