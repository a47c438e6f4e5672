//! What heights above the plane can tell.

/// Height in metres where the following of a surface ends: the crowns of trees
/// begin there.
pub const HIGH_M: f32 = 2.6;
/// Uncertainty of a cell's disparity in pixels; it lifts the lower limit of heights
/// far away.
pub const NOISE_PX: f32 = 0.4;
/// Disparity in pixels below which heights are noise.
pub const LEAST_DISPARITY: f32 = 1.2;
