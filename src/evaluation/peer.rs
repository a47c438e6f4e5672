//! Somebody else's matcher on the same pairs.

use serde::{Deserialize, Serialize};

/// The file that `benches/peers/stereo.py --json` writes:
///
/// ```json
/// {"peers": [{
///     "dataset": "kitti2012", "scene": "000027", "method": "OpenCV SGBM", "version": "5.0.0",
///     "machine": "8 cores", "threads": 1, "matching_ms": 310.5,
///     "known": 96000, "pixels": 79000, "known_with_occluded": 101000, "epe_px": 2.09,
///     "d1": 0.072, "bad_2": 0.1, "density": 0.827, "filled_d1": 0.141
/// }]}
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Peers {
    /// One entry per pair and method.
    pub peers: Vec<Peer>,
}

/// One pair by one of the others' matchers, over the whole frame. Shares are
/// 0..=1, of the pixels that [`crate::metric::DisparityScore`] has them of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Peer {
    /// The data set, named as in [`super::Part::dataset`].
    pub dataset: String,
    /// The scene, named as in [`super::Part::scene`].
    pub scene: String,
    /// Whose matcher, as `OpenCV SGBM`.
    pub method: String,
    /// Its version.
    pub version: String,
    /// Processor and cores; empty when unknown.
    #[serde(default)]
    pub machine: String,
    /// Threads it had; 0 when unknown.
    #[serde(default)]
    pub threads: usize,
    /// Milliseconds from rectified images to disparity.
    pub matching_ms: f64,
    /// Non-occluded pixels with known truth.
    pub known: u64,
    /// Of those, pixels with a disparity.
    pub pixels: u64,
    /// All pixels with known truth.
    pub known_with_occluded: u64,
    /// End-point error in pixels, non-occluded.
    pub epe_px: f64,
    /// Share with an error above 3 px and 5 %.
    pub d1: f64,
    /// Share with an error above 2 px.
    pub bad_2: f64,
    /// Share of the true pixels that have a disparity.
    pub density: f64,
    /// D1 over all true pixels after holes were filled.
    pub filled_d1: f64,
}
