//! `export-bag`: a scene of a data set, or a pair of images, as a ROS 2 bag.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;

use crate::command::print::say;
use crate::command::replay::losses;
use crate::command::watch::{progress_bar, stop_on_signal};
use crate::command::{CommandError, Outcome};
use crate::input::FrameSource;
use crate::input::dataset::{self, DatasetKind, DatasetSource, Opened, PairFiles};
use crate::output::bag::export_bag;

/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// Arguments of `export-bag`.
#[derive(Debug, Args)]
pub struct ExportBagArgs {
    /// Kind of the data set, in its published layout: kitti2012, kitti2015, middlebury, sintel or spring
    #[arg(long, value_name = "KIND", required_unless_present = "left", requires = "path")]
    dataset: Option<DatasetKind>,
    /// Folder of the data set
    path: Option<PathBuf>,
    /// Name of a scene, may be repeated (default: all scenes, one after the other)
    #[arg(long, value_name = "NAME", requires = "dataset")]
    scene: Vec<String>,
    /// Colour images instead of the gray ones of KITTI 2012
    #[arg(long)]
    color: bool,
    /// Truth of occluded pixels too
    #[arg(long)]
    occluded: bool,
    /// Left image of a rectified pair, instead of a data set
    #[arg(long, value_name = "FILE", requires = "right", conflicts_with = "dataset")]
    left: Option<PathBuf>,
    /// Right image of the pair
    #[arg(long, value_name = "FILE", requires = "left")]
    right: Option<PathBuf>,
    /// Focal length of the pair in pixels
    #[arg(long, value_name = "PX", requires = "left")]
    focal: Option<f64>,
    /// Baseline of the pair in metres
    #[arg(long, value_name = "M", requires = "focal")]
    baseline: Option<f64>,
    /// `cx_right - cx_left` of the pair in pixels
    #[arg(long, value_name = "PX", requires = "focal", allow_hyphen_values = true)]
    offset: Option<f64>,
    /// Output bag: a single file when it ends in .mcap, else a bag folder
    #[arg(short, long, value_name = "BAG")]
    output: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// A layout with missing files, images that cannot be read, or a bag that
/// cannot be written.
pub fn run(args: &ExportBagArgs) -> Result<Outcome, CommandError> {
    let (mut source, left_out) = source(args)?;
    let stop = stop_on_signal()?;
    let bar = progress_bar(STEPS);
    let exported = export_bag(&mut source, &args.output, |source| {
        bar.set_position((source.progress().unwrap_or(0.0) * STEPS as f64) as u64);
        !stop.load(Ordering::Relaxed)
    })
    .map_err(CommandError::failed)?;
    bar.finish_and_clear();
    say(format_args!(
        "{}: {} pairs, {} true disparity maps",
        args.output.display(),
        exported.pairs,
        exported.disparities
    ));
    let tally = source.tally();
    for line in losses(tally) {
        eprintln!("{line}");
    }
    let losses = tally.has_losses() || left_out > 0;
    Ok(if losses { Outcome::DoneWithLosses } else { Outcome::Done })
}

/// The frames, and how many scenes are left out of them.
fn source(args: &ExportBagArgs) -> Result<(DatasetSource, usize), CommandError> {
    match (args.dataset, &args.path, &args.left, &args.right) {
        (Some(kind), Some(path), _, _) => {
            let opened = scenes(args, kind, path)?;
            Ok((DatasetSource::new(opened.scenes), opened.skipped.len()))
        }
        (_, _, Some(left), Some(right)) => PairFiles {
            left: left.clone(),
            right: right.clone(),
            focal_px: args.focal,
            baseline_m: args.baseline,
            right_offset_px: args.offset,
            ..PairFiles::default()
        }
        .open()
        .map(|source| (source, 0))
        .map_err(CommandError::failed),
        _ => Err(CommandError::Usage(
            "name a data set (--dataset KIND PATH) or a pair (--left FILE --right FILE)".into(),
        )),
    }
}

fn scenes(args: &ExportBagArgs, kind: DatasetKind, path: &Path) -> Result<Opened, CommandError> {
    let opened = match kind {
        DatasetKind::Kitti2012 if args.color => dataset::open_kitti2012_in_color(path, &args.scene),
        _ => dataset::open(kind, path, &args.scene),
    };
    let mut opened = opened.map_err(CommandError::failed)?;
    for (name, reason) in &opened.skipped {
        eprintln!("scene {name} is left out: {reason}");
    }
    opened.scenes.retain(|scene| !scene.monocular);
    if opened.scenes.is_empty() {
        return Err(CommandError::Usage(format!(
            "{kind} at {} has no stereo pairs",
            path.display()
        )));
    }
    if args.occluded {
        let frames = opened.scenes.iter_mut().flat_map(|scene| &mut scene.frames);
        for truth in frames.map(|frame| &mut frame.truth) {
            truth.disparity = truth.disparity_with_occluded.take().or(truth.disparity.take());
        }
    }
    Ok(opened)
}
