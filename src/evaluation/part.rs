//! What is measured of one scene by one method.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::metric::{
    Confusion, DisparityStats, ErrorProfile, MapStats, Mean, SparsificationStats, VideoStats,
};
use crate::output::score::Scores;
use crate::perception::Stage;

/// One scene by one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Kind and folder of the data set, as `kitti2012` or `bag street`.
    pub dataset: String,
    /// Name of the scene in it.
    pub scene: String,
    /// Name of the method.
    pub method: String,
    /// Under which circumstances it was measured.
    pub run: Run,
    /// Frames processed.
    pub frames: u64,
    /// What could not be used, by reason.
    pub skipped: BTreeMap<String, u64>,
    /// Width and height of the first frame in pixels.
    pub size: [usize; 2],
    /// True when the scene has one camera only: no disparity, depth or regions.
    pub monocular: bool,
    /// Milliseconds per stage (in the order of [`Stage::ALL`]) of the frames,
    /// evenly thinned out in long scenes.
    pub times: Vec<[f64; Stage::ALL.len()]>,
    /// Share of the image that was matched.
    pub matched: Mean,
    /// The salient mask (before its dilation) against the true objects, eq. 7-9.
    pub salient: Confusion,
    /// Regions, identities, distances and disparity inside the region of interest.
    pub scores: Scores,
    /// Disparity against the truth of non-occluded pixels, whole frame: where
    /// nothing was matched, density suffers.
    pub frame: DisparityStats,
    /// Disparity against all known truth inside the region of interest after
    /// every hole took the smaller disparity of its row neighbours.
    pub filled_roi: DisparityStats,
    /// The same over the whole frame.
    pub filled_frame: DisparityStats,
    /// Errors by true disparity, inside the region of interest.
    pub errors: ErrorProfile,
    /// What confidence says about errors.
    pub sparsification: SparsificationStats,
    /// The attention map against the true mask, as it is.
    pub map: MapStats,
    /// The same after stretching every map to 0..=255, as referees do.
    pub stretched_map: MapStats,
    /// The salient mask over time against the true masks.
    pub video: VideoStats,
    /// Share of neighbouring pixels of a region whose disparities differ by
    /// less than a pixel.
    pub continuity: Mean,
    /// The same of the truth inside the same regions.
    pub true_continuity: Mean,
    /// Boundary F of the regions against the true objects.
    pub boundary: Mean,
    /// Worst and best frame.
    pub gallery: Vec<Shot>,
}

impl Part {
    /// Adds what was measured of another scene. Data set, scene, method, run
    /// and size stay those of the first one.
    pub fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
        for (reason, count) in &other.skipped {
            *self.skipped.entry(reason.clone()).or_default() += count;
        }
        self.monocular &= other.monocular;
        self.times.extend_from_slice(&other.times);
        self.matched.merge(&other.matched);
        self.salient.merge(&other.salient);
        self.scores.merge(&other.scores);
        self.frame.merge(&other.frame);
        self.filled_roi.merge(&other.filled_roi);
        self.filled_frame.merge(&other.filled_frame);
        self.errors.merge(&other.errors);
        self.sparsification.merge(&other.sparsification);
        self.map.merge(&other.map);
        self.stretched_map.merge(&other.stretched_map);
        self.video.merge(&other.video);
        self.continuity.merge(&other.continuity);
        self.true_continuity.merge(&other.true_continuity);
        self.boundary.merge(&other.boundary);
        self.gallery.extend_from_slice(&other.gallery);
    }
}

/// The circumstances of a measurement.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// Version of the tool.
    pub version: String,
    /// Commit it was built from; empty when unknown.
    pub commit: String,
    /// Fingerprint of the program.
    pub executable: String,
    /// Fingerprint of all parameters.
    pub config: String,
    /// Parameters that differ from their defaults: `name=value`.
    pub changed: Vec<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// Processor, cores, and the instruction set in use.
    pub machine: String,
    /// Threads of the pipeline.
    pub threads: usize,
}

/// A picture of one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// `best` or `worst`.
    pub role: String,
    /// Number of the frame in the scene.
    pub frame: u64,
    /// Name of the measure by which it was chosen.
    pub measure: String,
    /// Its value.
    pub value: f64,
    /// Path of the JPEG; in files of parts, from the folder of the store on.
    pub file: String,
}
