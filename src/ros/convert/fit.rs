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
    let mut tolerance = 2.0;
    while reduction.bytes_after > REGIONS_LIMIT && tolerance <= 64.0 {
        for region in &mut array.regions {
            let before = region.contour.points.len();
            region.contour.points = simplified(&region.contour.points, tolerance);
            reduction.points_dropped += before - region.contour.points.len();
        }
        reduction.bytes_after = len(array);
        tolerance *= 2.0;
    }
    Some(reduction)
}

/// A closed polygon with fewer points, no dropped one farther than `tolerance`
/// from the new outline (Ramer 1972, Douglas and Peucker 1973); three points or
/// fewer stay as they are.
fn simplified(points: &[Point32], tolerance: f32) -> Vec<Point32> {
    if points.len() <= 3 {
        return points.to_vec();
    }
    let n = points.len();
    let distance = |a: Point32, b: Point32| (a.x - b.x).hypot(a.y - b.y);
    // Two fixed points: the first one and the one farthest from it.
    let far = (1..n)
        .max_by(|&i, &j| distance(points[0], points[i]).total_cmp(&distance(points[0], points[j])))
        .unwrap_or(n / 2);
    let mut keep = vec![false; n + 1];
    (keep[0], keep[far], keep[n]) = (true, true, true);
    let mut spans = vec![(0, far), (far, n)];
    while let Some((from, to)) = spans.pop() {
        // Index n is the first point again.
        let (a, b) = (points[from], points[to % n]);
        let worst = (from + 1..to)
            .map(|i| (i, distance_to_segment(points[i], a, b)))
            .max_by(|x, y| x.1.total_cmp(&y.1));
        if let Some((i, d)) = worst
            && d > tolerance
        {
            keep[i] = true;
            spans.extend([(from, i), (i, to)]);
        }
    }
    let kept: Vec<_> =
        points.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(p, _)| *p).collect();
    // Less than a triangle is no outline.
    if kept.len() < 3 { vec![points[0], points[n / 3], points[2 * n / 3]] } else { kept }
}

fn distance_to_segment(p: Point32, a: Point32, b: Point32) -> f32 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length2 = dx * dx + dy * dy;
    let t = if length2 > 0.0 {
        (((p.x - a.x) * dx + (p.y - a.y) * dy) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p.x - a.x - t * dx).hypot(p.y - a.y - t * dy)
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
    fn simplification_keeps_the_outline_within_the_tolerance() {
        let circle: Vec<_> = (0..360)
            .map(|i| {
                let a = (i as f32).to_radians();
                Point32 { x: 50.0 * a.cos(), y: 50.0 * a.sin(), z: 0.0 }
            })
            .collect();
        for tolerance in [0.5, 2.0, 8.0] {
            let simple = simplified(&circle, tolerance);
            assert!(simple.len() < 60, "{}", simple.len());
            for p in &circle {
                let nearest = (0..simple.len())
                    .map(|i| distance_to_segment(*p, simple[i], simple[(i + 1) % simple.len()]))
                    .fold(f32::INFINITY, f32::min);
                assert!(nearest <= tolerance * 1.001, "{nearest} {tolerance}");
            }
        }
        assert_eq!(simplified(&circle, 1000.0).len(), 3);
        assert_eq!(simplified(&circle[..2], 1.0).len(), 2);
        assert_eq!(simplified(&[Point32::default(); 8], 1.0).len(), 3);
    }
}
