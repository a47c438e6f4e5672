//! Keeping the region array small enough to arrive everywhere.
//!
//! A best-effort burst of more than about 58 KB overflows the receive buffers
//! that a stock system gives its sockets.

use std::fmt;

use super::region::tighten;
use crate::ros::cdr;
use crate::ros::message::geometry_msgs::Point32;
use crate::ros::message::salient_stereo_msgs::SalientRegionArray;
use crate::ros::message::sensor_msgs::CompressedImage;
use crate::simd;
use crate::stage::regions::simplify::Simplify;

/// Bytes up to which an encoded region array arrives with stock buffers.
pub const REGIONS_LIMIT: usize = 58_000;

/// What was left out of a region array to make it small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reduction {
    /// Encoded bytes before.
    pub bytes_before: usize,
    /// Encoded bytes after.
    pub bytes_after: usize,
    /// Masks left out, those of the least important regions first.
    pub masks_dropped: usize,
    /// Points left out of contours.
    pub points_dropped: usize,
}

impl Reduction {
    /// True when it was enough.
    pub const fn fits(&self) -> bool {
        self.bytes_after <= REGIONS_LIMIT
    }
}

impl fmt::Display for Reduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "regions reduced from {} to {} bytes: {} masks and {} contour points left out",
            self.bytes_before, self.bytes_after, self.masks_dropped, self.points_dropped
        )
    }
}

/// Reduces an array that is larger than [`REGIONS_LIMIT`] when encoded: compresses
/// masks more thoroughly, leaves out those of the least important regions, then
/// simplifies contours.
///
/// `None` when nothing had to be left out.
pub fn fit_regions(array: &mut SalientRegionArray) -> Option<Reduction> {
    let mut bytes = Vec::new();
    let mut len = |array: &SalientRegionArray| {
        cdr::encode_into(array, &mut bytes);
        bytes.len()
    };
    let bytes_before = len(array);
    if bytes_before <= REGIONS_LIMIT {
        return None;
    }
    for region in &mut array.regions {
        tighten(&mut region.mask);
    }
    let bytes_after = len(array);
    if bytes_after <= REGIONS_LIMIT {
        return None;
    }
    let mut reduction = Reduction { bytes_before, bytes_after, ..Default::default() };
    let mut last = array.regions.len();
    while reduction.bytes_after > REGIONS_LIMIT && last > 0 {
        let mut excess = reduction.bytes_after - REGIONS_LIMIT;
        while excess > 0 && last > 0 {
            last -= 1;
            let mask = &mut array.regions[last].mask;
            if !mask.data.is_empty() {
                excess = excess.saturating_sub(mask.data.len());
                *mask = CompressedImage::default();
                reduction.masks_dropped += 1;
            }
        }
        reduction.bytes_after = len(array);
    }
    // Twice as coarse each time; 64 pixels make a triangle of anything.
    let (mut tolerance, mut simplify) = (2.0, Simplify::new(simd::detect()));
    while reduction.bytes_after > REGIONS_LIMIT && tolerance <= 64.0 {
        for region in &mut array.regions {
            let before = region.contour.points.len();
            region.contour.points = simplified(&region.contour.points, tolerance, &mut simplify);
            reduction.points_dropped += before - region.contour.points.len();
        }
        reduction.bytes_after = len(array);
        tolerance *= 2.0;
    }
    Some(reduction)
}

/// A contour with fewer points, but never fewer than a triangle.
fn simplified(points: &[Point32], tolerance: f32, simplify: &mut Simplify) -> Vec<Point32> {
    if points.len() <= 3 {
        return points.to_vec();
    }
    // Contours run through the centres of pixels: nothing is lost by rounding.
    let pixels: Vec<_> = points.iter().map(|p| [p.x.round() as i32, p.y.round() as i32]).collect();
    let keep = simplify.run(&pixels, tolerance);
    let kept: Vec<_> =
        points.iter().zip(keep).filter(|(_, keep)| **keep).map(|(p, _)| *p).collect();
    if kept.len() < 3 {
        return vec![points[0], points[points.len() / 3], points[2 * points.len() / 3]];
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::region::tests::perception;
    use super::super::region_array;
    use super::*;

    #[test]
    fn a_normal_array_is_left_as_it_is() {
        let mut array = region_array(&perception(20, 30), true);
        let before = array.clone();
        assert_eq!(fit_regions(&mut array), None);
        assert_eq!(array, before);
    }

    #[test]
    fn tighter_masks_may_be_enough() {
        let mut array = region_array(&perception(60, 60), true);
        for region in &mut array.regions {
            region.contour.points.truncate(8);
        }
        assert!(cdr::encode(&array).len() > REGIONS_LIMIT);
        assert_eq!(fit_regions(&mut array), None);
        assert!(cdr::encode(&array).len() <= REGIONS_LIMIT);
        assert!(array.regions.iter().all(|r| !r.mask.data.is_empty()));
    }

    #[test]
    fn masks_go_first_and_the_most_important_keep_theirs() {
        let mut array = region_array(&perception(64, 5), false);
        for region in &mut array.regions {
            region.mask.data = vec![7; 800];
        }
        let before = array.clone();
        let reduction = fit_regions(&mut array).unwrap();
        assert!(reduction.fits(), "{reduction}");
        assert_eq!(reduction.bytes_after, cdr::encode(&array).len());
        assert_eq!(reduction.points_dropped, 0);
        let kept = 64 - reduction.masks_dropped;
        assert!(kept > 0 && reduction.masks_dropped > 0, "{reduction}");
        for (i, region) in array.regions.iter().enumerate() {
            assert_eq!(region.mask.data.is_empty(), i >= kept, "{i}");
            assert_eq!(region.contour, before.regions[i].contour);
        }
        // One mask more would have been too much.
        array.regions[kept].mask = before.regions[kept].mask.clone();
        assert!(cdr::encode(&array).len() > REGIONS_LIMIT);
        assert!(reduction.to_string().contains("masks"), "{reduction}");
    }

    #[test]
    fn contours_are_simplified_when_masks_are_not_enough() {
        let mut array = region_array(&perception(64, 100), true);
        let before = array.clone();
        let reduction = fit_regions(&mut array).unwrap();
        assert!(reduction.fits() && reduction.points_dropped > 0, "{reduction}");
        assert_eq!(reduction.masks_dropped, 64);
        for (region, before) in array.regions.iter().zip(&before.regions) {
            assert!(region.contour.points.len() >= 3);
            assert!(region.contour.points.iter().all(|p| before.contour.points.contains(p)));
            assert_eq!(region.roi, before.roi);
        }
    }

    #[test]
    fn more_regions_than_can_fit_are_reported() {
        let mut array = region_array(&perception(400, 2), false);
        let reduction = fit_regions(&mut array).unwrap();
        assert!(!reduction.fits());
        assert_eq!(array.regions.len(), 400);
    }

    #[test]
    fn a_contour_is_at_least_a_triangle() {
        let simplify = &mut Simplify::new(simd::detect());
        let line: Vec<_> = (0..9).map(|i| Point32 { x: i as f32, y: 0.0, z: 0.0 }).collect();
        assert_eq!(simplified(&line, 1.0, simplify).len(), 3);
        assert_eq!(simplified(&line[..2], 1.0, simplify).len(), 2);
        assert_eq!(simplified(&[Point32::default(); 8], 1.0, simplify).len(), 3);
    }
}
