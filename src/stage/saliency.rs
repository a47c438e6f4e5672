//! The attention map: where in view something matters.
//!
//! All attention work is done at one value per cell of [`CELL`] pixels; a
//! quarter-size view of the left image is made once per frame and shared by
//! every cue. The map is smoothed over time at the end.

pub mod barrier;
pub mod beside;
pub mod boundary;
mod cells;
pub mod color;
pub mod columns;
pub mod depth;
pub mod ego;
pub mod flow;
pub mod frequency_tuned;
pub mod integral;
pub mod intensity;
pub mod lateral;
pub mod motion;
pub mod nearness;
pub mod normalize;
pub mod orientation;
pub mod paper;
pub mod persistence;
pub mod scene;
pub mod spectral_residual;
pub mod structure;
pub(in crate::stage) mod upsample;

pub use cells::shrink_view;
pub use upsample::upsample;

use crate::camera::StereoRig;
use crate::config::{Config, SaliencyMode};
use crate::image::{Image, Size};
use crate::perception::View;
use crate::simd::Level;
use crate::stage::coarse::{CELL, CoarseDisparity};
use crate::stage::ground::Footing;
use crate::stamp::Stamp;

use flow::Flow;
use frequency_tuned::FrequencyTuned;
use paper::Paper;
use persistence::Persistence;
use scene::SceneSaliency;
use spectral_residual::SpectralResidual;

/// What the stage is given.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Time of the frame.
    pub stamp: Stamp,
    /// Left view, full size.
    pub left: &'a View,
    /// Quarter-size disparity of the same frame.
    pub coarse: &'a CoarseDisparity,
    /// Calibration of the full-size views.
    pub rig: &'a StereoRig,
}

/// What the cues look at: the scene, its quarter-size view, and the frame before.
#[derive(Clone, Copy)]
pub struct AttentionScene<'a> {
    /// Time of the frame.
    pub stamp: Stamp,
    /// Left view, full size.
    pub left: &'a View,
    /// Left view at one pixel per cell: means over [`CELL`] x [`CELL`] pixels.
    pub cells: &'a View,
    /// Disparity per cell of the same frame, in full-size pixels.
    pub coarse: &'a CoarseDisparity,
    /// Calibration of the full-size views.
    pub rig: &'a StereoRig,
    /// The frame before; `None` on the first frame and after a reset, when
    /// whoever keeps a state of its own starts anew.
    pub previous: Option<&'a PreviousFrame>,
    /// Where the cells were in the frame before, for the mode that asks for it.
    pub flow: Option<&'a Flow>,
}

/// What is remembered of one frame.
#[derive(Clone, Debug, Default)]
pub struct PreviousFrame {
    /// Its time.
    pub stamp: Stamp,
    /// Its left gray view, one pixel per cell.
    pub gray: Image<u8>,
    /// Its attention map after smoothing, one value per cell.
    pub attention: Image<f32>,
    /// 1 for the cells that were attended to, else 0; empty where that is not kept.
    pub attended: Image<f32>,
}

/// The register of the previous frame.
#[derive(Debug, Default)]
pub struct Previous {
    frame: PreviousFrame,
    is_set: bool,
}

impl Previous {
    /// Forgets the previous frame.
    pub fn clear(&mut self) {
        self.is_set = false;
    }

    /// The previous frame, if there is one of the wanted cell map size.
    fn get(&self, cells: Size) -> Option<&PreviousFrame> {
        (self.is_set && self.frame.gray.size() == cells && self.frame.attention.size() == cells)
            .then_some(&self.frame)
    }

    fn set(&mut self, stamp: Stamp, gray: &Image<u8>, attention: &Image<f32>) {
        self.frame.stamp = stamp;
        self.frame.gray.copy_from(gray);
        self.frame.attention.copy_from(attention);
        self.is_set = true;
    }
}

/// One conspicuity map.
pub trait Cue {
    /// Writes how conspicuous each cell is, 0..=1 on a fixed physical scale
    /// that the cue documents: never stretched to the map's own range, so that
    /// a cue without evidence stays near 0.
    fn conspicuity(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>);
}

/// One way to make the attention map.
enum Mode {
    Scene(Box<SceneSaliency>),
    Paper(Box<Paper>),
    FrequencyTuned(Box<FrequencyTuned>),
    SpectralResidual(Box<SpectralResidual>),
    FullFrame,
}

/// The attention stage.
pub struct Saliency {
    level: Level,
    size: Size,
    mode: Mode,
    persistence: Persistence,
    cells: View,
    flow: Flow,
}

impl Saliency {
    /// The stage for views of `size`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        let mode = match config.saliency.mode {
            SaliencyMode::Scene => Mode::Scene(Box::new(SceneSaliency::new(level))),
            SaliencyMode::Paper => Mode::Paper(Box::new(Paper::new(&config.saliency.paper, level))),
            SaliencyMode::FrequencyTuned => {
                Mode::FrequencyTuned(Box::new(FrequencyTuned::new(level)))
            }
            SaliencyMode::SpectralResidual => Mode::SpectralResidual(Box::default()),
            SaliencyMode::FullFrame => Mode::FullFrame,
        };
        Self {
            level,
            size,
            mode,
            persistence: Persistence::new(config, level),
            cells: View::default(),
            flow: Flow::new(level),
        }
    }

    /// The plane of the last frame, for the mode that looks for one.
    pub fn footing(&self) -> Option<Footing> {
        match &self.mode {
            Mode::Scene(mode) => Some(mode.footing()),
            _ => None,
        }
    }

    /// Writes S, 0..=1, per cell of [`CELL`] pixels; [`upsample()`] spreads it over pixels.
    pub fn run(&mut self, scene: &Scene<'_>, previous: &mut Previous, attention: &mut Image<f32>) {
        let cells = self.size.divided_by(CELL);
        attention.resize(cells);
        if matches!(self.mode, Mode::FullFrame) {
            attention.fill(1.0);
            return;
        }
        shrink_view(self.level, scene.left, &mut self.cells);
        let before = previous.get(cells);
        let compensates = matches!(self.mode, Mode::Scene(_));
        let Self { mode, flow, cells: view, .. } = self;
        let match_blocks = || {
            if let Some(before) = before.filter(|_| compensates || self.persistence.is_on()) {
                flow.run(&before.gray, &view.gray);
                if compensates {
                    flow.sharpen();
                }
            }
        };
        let prepare = || {
            if let Mode::Scene(mode) = mode {
                mode.prepare(scene, view, before.is_none());
            }
        };
        rayon::join(match_blocks, prepare);
        let scene = AttentionScene {
            stamp: scene.stamp,
            left: scene.left,
            cells: &self.cells,
            coarse: scene.coarse,
            rig: scene.rig,
            previous: before,
            flow: before.filter(|_| compensates).map(|_| &self.flow),
        };
        match &mut self.mode {
            Mode::Scene(mode) => mode.run(&scene, attention),
            Mode::Paper(paper) => paper.run(&scene, attention),
            Mode::FrequencyTuned(frequency_tuned) => frequency_tuned.run(&scene, attention),
            Mode::SpectralResidual(residual) => residual.run(&scene, attention),
            Mode::FullFrame => {}
        }
        if let Some(before) = before.filter(|_| self.persistence.is_on()) {
            self.persistence.smooth(attention, before, &self.flow);
        }
        previous.set(scene.stamp, &self.cells.gray, attention);
        if let Mode::Scene(mode) = &self.mode {
            mode.even_contrast(attention);
        }
        self.persistence.stay(attention, &mut previous.frame.attended);
    }
}
