//! The plane in use, from frame to frame.

use super::Plane;
use crate::camera::StereoRig;

/// Frames without support after which the last plane is given up.
const PATIENCE: u32 = 10;
/// Share of the new plane in the running one: a camera that nods moves the
/// plane, and noise is to be taken out.
const RENEWAL: f32 = 0.5;
/// Relative change of the camera's height over which it is another plane, taken
/// as it is.
const MAX_STEP: f32 = 0.25;

/// A running plane, which outlives a few frames that show none.
#[derive(Debug, Default)]
pub struct RunningPlane {
    plane: Option<Plane>,
    failures: u32,
}

impl RunningPlane {
    /// Forgets the plane.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The plane in use.
    pub const fn get(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// Whether the plane in use is an earlier frame's.
    pub const fn is_held(&self) -> bool {
        self.failures > 0
    }

    /// Takes in the plane that a frame shows, if it does.
    pub fn update(&mut self, shown: Option<Plane>, rig: &StereoRig) {
        match (shown, self.plane) {
            (Some(new), old) => {
                let near = |old: &Plane| {
                    (new.camera_height_m / old.camera_height_m - 1.0).abs() < MAX_STEP
                };
                let next = old.filter(near).map(|old| old.mixed(&new, RENEWAL, rig));
                *self = Self { plane: Some(next.unwrap_or(new)), failures: 0 };
            }
            (None, Some(_)) if self.failures < PATIENCE => self.failures += 1,
            (None, _) => self.reset(),
        }
    }
}
