//! Frames of scenes, decoded one at a time.

use std::path::Path;
use std::sync::Arc;

use super::file;
use super::{Calibration, DatasetError, FrameFiles, Scene};
use crate::camera::StereoRig;
use crate::image::Size;
use crate::input::{FrameSource, Observation, Tally};
use crate::perception::StereoFrame;
use crate::stamp::Stamp;

const NANOSECONDS: f64 = 1e9;
/// Scenes start at whole hours: a second after the last one would do, but round
/// numbers are easier to find in a table.
const HOUR: i64 = 3_600_000_000_000;

/// Frames of scenes.
pub struct DatasetSource {
    scenes: Vec<Scene>,
    /// Stamp of frame number 0 of each scene.
    starts: Vec<i64>,
    scene: usize,
    frame: usize,
    /// Scene and frame that were last taken up.
    current: Option<(usize, usize)>,
    rig: Option<(Calibration, Size, Arc<StereoRig>)>,
    tally: Tally,
}

impl DatasetSource {
    /// The frames of `scenes`, one scene after the other.
    pub fn new(scenes: Vec<Scene>) -> Self {
        let mut next = 1_000_000_000;
        let starts = scenes
            .iter()
            .map(|scene| {
                let start = next;
                let last = scene.frames.iter().map(|files| files.number).max().unwrap_or(0);
                next += HOUR * (1 + since_start(scene, last) / HOUR);
                start
            })
            .collect();
        let tally = Tally::default();
        Self { scenes, starts, scene: 0, frame: 0, current: None, rig: None, tally }
    }

    /// All scenes.
    pub fn scenes(&self) -> &[Scene] {
        &self.scenes
    }

    /// Name of the scene of the last frame.
    pub fn scene(&self) -> &str {
        self.current.and_then(|(scene, _)| self.scenes.get(scene)).map_or("", |scene| &scene.name)
    }

    /// Left image of the last frame, also when that frame could not be read.
    pub fn current_file(&self) -> Option<&Path> {
        let (scene, frame) = self.current?;
        Some(&self.scenes.get(scene)?.frames.get(frame)?.left)
    }

    fn observe(&mut self, number: usize, files: &FrameFiles) -> Result<Observation, DatasetError> {
        let left = file::picture(&files.left)?;
        let size = left.size();
        let right = match &files.right {
            Some(path) => {
                let right = file::picture(path)?;
                file::check_size(path, right.size(), size)?;
                right
            }
            None => left.clone(),
        };
        let rig = self.rig(number, files, size)?;
        let truth = files.truth.read(size, rig.disparity_offset() as f32)?;
        let since = since_start(&self.scenes[number], files.number);
        let stamp = Stamp(self.starts[number] + since);
        let frame = StereoFrame {
            stamp,
            right_stamp: stamp,
            frame_id: Arc::from("left_optical"),
            left,
            right,
            rig,
        };
        Ok(Observation { frame, truth })
    }

    fn rig(
        &mut self,
        number: usize,
        files: &FrameFiles,
        size: Size,
    ) -> Result<Arc<StereoRig>, DatasetError> {
        let scene = &self.scenes[number];
        let calibration = files.calibration.as_ref().unwrap_or(&scene.calibration);
        if let Some((of, for_size, rig)) = &self.rig
            && (of, *for_size) == (calibration, size)
        {
            return Ok(Arc::clone(rig));
        }
        let rig = calibration.rig(size).map_err(|source| DatasetError::Calibration {
            path: scene.calibration_path.clone(),
            source,
        })?;
        let rig = Arc::new(rig);
        self.rig = Some((calibration.clone(), size, Arc::clone(&rig)));
        Ok(rig)
    }
}

/// Nanoseconds from frame number 0 of a scene to frame `number`.
fn since_start(scene: &Scene, number: u32) -> i64 {
    (f64::from(number) * NANOSECONDS / scene.frame_rate_hz).round() as i64
}

impl FrameSource for DatasetSource {
    type Error = DatasetError;

    fn next_observation(&mut self) -> Result<Option<Observation>, DatasetError> {
        while let Some(scene) = self.scenes.get(self.scene) {
            if let Some(files) = scene.frames.get(self.frame) {
                let (files, number) = (files.clone(), self.scene);
                self.current = Some((number, self.frame));
                self.frame += 1;
                let observation = self.observe(number, &files)?;
                self.tally.pairs += 1;
                return Ok(Some(observation));
            }
            self.scene += 1;
            self.frame = 0;
        }
        Ok(None)
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }

    fn progress(&self) -> Option<f64> {
        let all: usize = self.scenes.iter().map(|scene| scene.frames.len()).sum();
        let before: usize =
            self.scenes.iter().take(self.scene).map(|scene| scene.frames.len()).sum();
        Some(if all == 0 { 1.0 } else { (before + self.frame) as f64 / all as f64 })
    }
}
