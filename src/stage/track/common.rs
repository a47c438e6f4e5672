//! What most things do: the camera's own motion, seen from the camera.

use super::follow::Follow;

/// Variance of a velocity, m²/s², below which it counts, and the fewest that tell
/// what is common.
const KNOWN: f64 = 4.0;
const LEAST_TRACKS: usize = 3;

/// The velocity that tracks have in common, with its buffer.
///
/// Where most things stand it is that of the camera turned round, and a thing that
/// was seen once is most likely to follow it. Things that move by themselves are
/// outvoted: it is the median along each axis.
#[derive(Debug, Default)]
pub struct CommonMotion {
    /// m/s in the left optical frame; `None` where too few tracks tell it.
    pub velocity: Option<[f64; 3]>,
    speeds: Vec<f64>,
}

impl CommonMotion {
    /// Finds it anew from the active `tracks` that were seen in this frame.
    pub fn find(&mut self, tracks: &[Follow]) {
        let mut velocity = [0.0; 3];
        for (axis, median) in velocity.iter_mut().enumerate() {
            let seen = tracks.iter().filter(|t| t.is_alive() && t.seen && t.active);
            let known = seen.filter_map(|t| t.kalman.as_ref());
            self.speeds.clear();
            self.speeds.extend(
                known.filter(|k| k.velocity_variance() < KNOWN).map(|k| k.velocity()[axis]),
            );
            if self.speeds.len() < LEAST_TRACKS {
                self.velocity = None;
                return;
            }
            let middle = self.speeds.len() / 2;
            *median = *self.speeds.select_nth_unstable_by(middle, f64::total_cmp).1;
        }
        self.velocity = Some(velocity);
    }
}
