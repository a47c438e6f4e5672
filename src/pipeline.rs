//! The method, frame by frame.

use crate::config::Config;
use crate::image::Size;
use crate::perception::{Clock, Perception, Stage, StageTimes, StereoFrame, View};
use crate::simd::Level;
use crate::stage::coarse::{Coarse, CoarseDisparity};
use crate::stage::depth::Depth;
use crate::stage::ground::Footing;
use crate::stage::pole::Poles;
use crate::stage::preprocess::Preprocess;
use crate::stage::refine::Refine;
use crate::stage::regions::{RegionSource, Regions};
use crate::stage::roi::Roi;
use crate::stage::roi::latency::Latency;
use crate::stage::saliency::{Previous, Saliency, Scene};
use crate::stage::stereo::{Matches, Stereo};
use crate::stage::track::{self, Track};

/// The stages and their buffers for pictures of one size.
///
/// Two registers look back in time: `previous` and `track`; beside them mode `scene`
/// keeps its plane and how much moved lately, which start anew when `previous` does.
/// With a time budget `latency` looks back as well, and what is matched depends on
/// the machine. Everything else depends on the current frame alone.
pub struct Pipeline {
    preprocess: Preprocess,
    coarse: Coarse,
    saliency: Saliency,
    roi: Roi,
    stereo: Stereo,
    poles: Poles,
    refine: Refine,
    depth: Depth,
    regions: Regions,
    track: Track,

    previous: Previous,
    latency: Latency,

    right: View,
    coarse_disparity: CoarseDisparity,
    matches: Matches,
    /// Smallest and largest disparity searched, `x_l - x_r` in pixels.
    searched: [f32; 2],
    clock: Clock,
}

impl Pipeline {
    /// The pipeline for pictures of `size` under a valid `config`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        let preprocess = Preprocess::new(config, size, level);
        let size = preprocess.output_size();
        Self {
            preprocess,
            coarse: Coarse::new(config, size, level),
            saliency: Saliency::new(config, size, level),
            roi: Roi::new(config, size, level),
            stereo: Stereo::new(config, size, level),
            poles: Poles::new(config, level),
            refine: Refine::new(config, size),
            depth: Depth::new(config),
            regions: Regions::new(config, size, level),
            track: Track::new(config),
            previous: Previous::default(),
            latency: Latency::new(config.max_latency),
            right: View::default(),
            coarse_disparity: CoarseDisparity::default(),
            matches: Matches::default(),
            searched: [
                config.stereo.min_disparity as f32,
                (config.stereo.min_disparity + config.stereo.disparity_range - 1) as f32,
            ],
            clock: Clock::none(),
        }
    }

    /// Measures stage times with `clock`.
    #[must_use]
    pub fn with_clock(mut self, clock: Clock) -> Self {
        self.clock = clock;
        self
    }

    /// Matches a centred rectangle of `fraction` of the image (and its border)
    /// instead of what is salient: for measurements of the matcher.
    #[must_use]
    pub fn with_centred_roi(mut self, fraction: f32) -> Self {
        self.roi.set_centred_rectangle(fraction);
        self
    }

    /// The pipeline for other parameters or another size that goes on with the
    /// tracks of this one, so that a parameter changed while running costs no
    /// identity.
    #[must_use]
    pub fn reconfigured(self, config: &Config, size: Size, level: Level) -> Self {
        let old_size = self.output_size();
        let mut next = Self::new(config, size, level).with_clock(self.clock);
        next.track = self.track;
        next.track.configure(config, next.output_size() == old_size);
        next
    }

    /// Size of the processed views: the picture's size divided by `preprocess.scale`.
    pub fn output_size(&self) -> Size {
        self.preprocess.output_size()
    }

    /// The right view of the last frame, rectified as the left one in
    /// [`Perception`]; gray and gradient only.
    pub fn right(&self) -> &View {
        &self.right
    }

    /// The plane that things stand on in the last frame; `None` in modes that look for none.
    pub fn footing(&self) -> Option<Footing> {
        self.saliency.footing()
    }

    /// Forgets the previous frame and all tracks, as after a jump in time.
    pub fn reset(&mut self) {
        self.previous.clear();
        self.track.reset();
    }

    /// One frame through all stages. Allocates nothing once every buffer has
    /// met its largest frame.
    pub fn process(&mut self, frame: &StereoFrame, out: &mut Perception) {
        let mut lap = Lap::start(self.clock);

        self.preprocess.run(frame, out, &mut self.right);
        let offset = out.rig.disparity_offset() as f32;
        [out.min_disparity, out.max_disparity] = self.searched.map(|d| d - offset);
        lap.mark(&mut out.times, Stage::Preprocess);

        self.coarse.run(&out.left, &self.right, &mut self.coarse_disparity);
        lap.mark(&mut out.times, Stage::Coarse);

        let scene = Scene {
            stamp: frame.stamp,
            left: &out.left,
            coarse: &self.coarse_disparity,
            rig: &out.rig,
        };
        self.saliency.run(&scene, &mut self.previous, &mut out.attention);
        let footing = self.saliency.footing().unwrap_or_default();
        out.ground = footing.state;
        lap.mark(&mut out.times, Stage::Saliency);

        self.roi.set_allowance(self.latency.allowance(lap.total_ms));
        self.roi.run(&out.attention, &self.coarse_disparity, &out.rig, &mut out.roi);
        lap.mark(&mut out.times, Stage::Roi);
        let before_matching_ms = lap.total_ms;

        self.stereo.run(
            &out.left,
            &self.right,
            &out.roi,
            &out.attention,
            &self.coarse_disparity,
            &mut self.matches,
        );
        let plane = footing.ground().filter(|_| self.roi.follows_attention());
        self.poles.find(&out.left, &self.right, &out.rig, plane);
        lap.mark(&mut out.times, Stage::Stereo);

        self.refine.run(
            &self.matches,
            &out.left.gray,
            &out.roi,
            &out.rig,
            &mut out.disparity,
            &mut out.confidence,
        );
        // Not before: what is beside them was matched by its own window.
        let included = self.roi.include(self.poles.list(), &mut out.roi);
        self.poles.truncate(included);
        self.poles.raise(&mut out.attention, out.left.gray.width());
        self.poles.paint(&out.roi.matched, &mut out.disparity, &mut out.confidence);
        lap.mark(&mut out.times, Stage::Refine);

        self.depth.run(&out.disparity, &out.rig, &mut out.depth);
        lap.mark(&mut out.times, Stage::Depth);

        let source = RegionSource {
            left: &out.left,
            attention: &out.attention,
            roi: self.roi.masks(),
            disparity: &out.disparity,
            coarse: &self.coarse_disparity,
            confidence: &out.confidence,
            rig: &out.rig,
            plane: footing.ground(),
            poles: self.poles.list(),
            table: footing.table(),
        };
        self.regions.run(&source, &mut out.labels, &mut out.regions, &mut out.rejections);
        lap.mark(&mut out.times, Stage::Regions);

        let views = track::Views { disparity: &out.disparity, labels: &out.labels };
        self.track.run(frame.stamp, &out.rig, views, &mut out.regions, &mut out.rejections);
        lap.mark(&mut out.times, Stage::Track);
        self.latency.learn(lap.total_ms - before_matching_ms, f64::from(out.roi.fraction));
    }
}

/// The time between two marks.
struct Lap {
    clock: Clock,
    last: u64,
    /// Milliseconds from the start to the last mark.
    total_ms: f64,
}

impl Lap {
    fn start(clock: Clock) -> Self {
        Self { clock, last: clock.now(), total_ms: 0.0 }
    }

    fn mark(&mut self, times: &mut StageTimes, stage: Stage) {
        let now = self.clock.now();
        let lap_ms = (now - self.last) as f64 * 1e-6;
        times.set(stage, lap_ms);
        self.total_ms += lap_ms;
        self.last = now;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::image::{Image, Picture};
    use crate::stamp::Stamp;

    #[test]
    fn the_searched_range_is_told_with_the_principal_points_subtracted() {
        let size = Size::new(64, 48);
        let camera = |cx, tx| Camera::pinhole(size, 60.0, cx, 24.0, tx);
        let rig = StereoRig::new(camera(32.0, 0.0), camera(30.0, -6.0), 0.0).unwrap();
        let rig = Arc::new(rig);
        let frame = StereoFrame {
            stamp: Stamp::default(),
            right_stamp: Stamp::default(),
            frame_id: Arc::from("left"),
            left: Picture::Gray(Image::new(size)),
            right: Picture::Gray(Image::new(size)),
            rig: Arc::clone(&rig),
        };
        let mut config = Config::default();
        (config.stereo.min_disparity, config.stereo.disparity_range) = (4, 16);
        let mut pipeline = Pipeline::new(&config, size, crate::simd::detect());
        let mut out = Perception::new(size, rig);
        pipeline.process(&frame, &mut out);
        assert_eq!((out.min_disparity, out.max_disparity), (2.0, 17.0));
    }
}
