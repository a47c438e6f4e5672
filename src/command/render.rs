//! `render`: a scene made by calculation, as a bag with its truth.

use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};
use thiserror::Error;

use crate::command::print::say;
use crate::image::Size;
use crate::input::synthetic::{SceneKind, SyntheticError, SyntheticScene};
use crate::output::scene::{SceneBag, SceneMessages, SceneWriteError};

/// The command line behind `render`.
#[derive(Clone, Debug, clap::Args)]
pub struct RenderArgs {
    /// Which scene: street or tabletop
    #[arg(long, value_name = "NAME")]
    pub scene: SceneKind,
    /// The bag to write: a file that ends in .mcap, or a folder
    #[arg(short, long, value_name = "BAG")]
    pub output: PathBuf,
    /// Number of pairs instead of the scene's own
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// Width of the pictures in pixels; the height follows
    #[arg(long, value_name = "PIXELS")]
    pub width: Option<usize>,
    /// Another street: other parked cars, people, posts and trees in other places; 0 is the shipped one
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
}

/// Why no bag was made.
#[derive(Debug, Error)]
pub enum RenderError {
    /// The options.
    #[error(transparent)]
    Scene(#[from] SyntheticError),
    /// The bag.
    #[error(transparent)]
    Write(#[from] SceneWriteError),
}

impl RenderError {
    /// True when the fault is in what the user has written (exit code 2).
    pub const fn is_usage(&self) -> bool {
        matches!(self, Self::Scene(_))
    }
}

/// Renders the scene into the bag. Without options it is the shipped bag, byte
/// for byte.
///
/// # Errors
/// When an option is out of range or the bag cannot be written.
pub fn run(args: &RenderArgs) -> Result<(), RenderError> {
    let mut options = args.scene.defaults();
    if let Some(frames) = args.frames {
        options.frames = frames;
    }
    if let Some(width) = args.width {
        let Size { width: w, height: h } = options.size;
        options.size = Size::new(width, width.saturating_mul(h) / w);
    }
    options.seed = args.seed;
    let scene = SyntheticScene::new(args.scene, options)?;
    let mut bag = SceneBag::create(&args.output)?;
    // Hidden when stderr is no terminal.
    let progress = ProgressBar::new(options.frames as u64);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} pairs {eta}") {
        progress.set_style(style);
    }
    progress.set_message(args.scene.name());
    for index in 0..options.frames {
        bag.write(&SceneMessages::render(&scene, index)?)?;
        progress.inc(1);
    }
    bag.finish()?;
    progress.finish_and_clear();
    say(format_args!(
        "{}: {} pairs of {} at {} Hz, with truth",
        args.output.display(),
        options.frames,
        options.size,
        options.rate_hz
    ));
    Ok(())
}
