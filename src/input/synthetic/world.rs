//! Everything that is there at one instant.

use super::grid::Stage;
use super::part::{Part, Pose};
use super::shape::Vec3;

/// What lies behind everything and is mirrored in smooth surfaces.
#[derive(Clone, Copy, Debug)]
pub enum Backdrop {
    /// Sky over a street of houses.
    Street,
    /// A room with one window.
    Room,
}

/// Parallel light as the sum of directions.
#[derive(Clone, Debug)]
pub struct Lighting {
    /// Directions to points of the main light; each sample asks for one.
    pub sun: Vec<Vec3>,
    /// Its colour and strength.
    pub sun_colour: Vec3,
    /// Directions to the rest of the sky or room, and their colours; each
    /// sample asks for two of them.
    pub ambient: Vec<(Vec3, Vec3)>,
    /// Light that comes from everywhere, strongest from below.
    pub bounce: Vec3,
    /// Depth in metres over which half of the contrast is lost in haze.
    pub haze: f64,
    /// Where shadows are cast.
    pub stage: Stage,
}

/// A scene at one instant.
#[derive(Clone, Debug)]
pub struct World {
    /// All shapes.
    pub parts: Vec<Part>,
    /// The light on them.
    pub lighting: Lighting,
    /// What is behind them.
    pub backdrop: Backdrop,
    /// Optical frame of the left camera: x right, y down, z forward.
    pub camera: Pose,
}

/// A camera at `position` with heading, pitch and roll in radians: all zero
/// looks along +y of the world with z up; positive heading turns left,
/// positive pitch up, positive roll clockwise as seen from behind.
pub fn camera_pose(position: Vec3, heading: f64, pitch: f64, roll: f64) -> Pose {
    let base = Pose {
        rotation: nalgebra::Matrix3::from_columns(&[Vec3::x(), -Vec3::z(), Vec3::y()]),
        position,
    };
    base.turned(1, -heading).turned(0, pitch).turned(2, roll)
}
