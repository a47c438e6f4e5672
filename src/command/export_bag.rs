//! `export-bag`: a scene of a data set, or a pair of images, as a ROS 2 bag.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::{Args, ValueEnum};

use crate::command::replay::losses;
use crate::command::watch::{progress_bar, stop_on_signal};
use crate::command::{CommandError, Outcome};
use crate::input::FrameSource;
use crate::input::dataset::{DatasetSource, Kitti, KittiTruth, KittiYear, PairFiles};
use crate::output::bag::export_bag;

/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// Arguments of `export-bag`.
#[derive(Debug, Args)]
pub struct ExportBagArgs {
    /// Kind of the data set, in its published layout
    #[arg(long, value_enum, required_unless_present = "left", requires = "path")]
    dataset: Option<Dataset>,
    /// Folder of the data set
    path: Option<PathBuf>,
    /// Name of one scene (default: all scenes, one after the other)
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// Colour images instead of gray ones
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

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Dataset {
    Kitti2012,
    Kitti2015,
}

/// Runs the command.
///
/// # Errors
/// A layout with missing files, images that cannot be read, or a bag that
/// cannot be written.
pub fn run(args: &ExportBagArgs) -> Result<Outcome, CommandError> {
    let mut source = source(args)?;
    let stop = stop_on_signal()?;
    let bar = progress_bar(STEPS);
    let exported = export_bag(&mut source, &args.output, |source| {
        bar.set_position((source.progress().unwrap_or(0.0) * STEPS as f64) as u64);
        !stop.load(Ordering::Relaxed)
    })
    .map_err(CommandError::failed)?;
    bar.finish_and_clear();
    println!(
        "{}: {} pairs, {} true disparity maps",
        args.output.display(),
        exported.pairs,
        exported.disparities
    );
    let tally = source.tally();
    for line in losses(tally) {
        eprintln!("{line}");
    }
    Ok(if tally.has_losses() { Outcome::DoneWithLosses } else { Outcome::Done })
}

fn source(args: &ExportBagArgs) -> Result<DatasetSource, CommandError> {
    let opened = match (args.dataset, &args.path, &args.left, &args.right) {
        (Some(dataset), Some(path), _, _) => {
            let year = match dataset {
                Dataset::Kitti2012 => KittiYear::Y2012,
                Dataset::Kitti2015 => KittiYear::Y2015,
            };
            let truth = if args.occluded { KittiTruth::All } else { KittiTruth::NonOccluded };
            Kitti { scene: args.scene.clone(), color: args.color, truth, ..Kitti::new(path, year) }
                .open()
        }
        (_, _, Some(left), Some(right)) => PairFiles {
            left: left.clone(),
            right: right.clone(),
            focal_px: args.focal,
            baseline_m: args.baseline,
            right_offset_px: args.offset,
            ..PairFiles::default()
        }
        .open(),
        _ => {
            return Err(CommandError::Usage(
                "name a data set (--dataset KIND PATH) or a pair (--left FILE --right FILE)".into(),
            ));
        }
    };
    opened.map_err(CommandError::failed)
}
