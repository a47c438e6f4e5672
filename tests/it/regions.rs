//! Regions against plain references: components by flood fill, statistics by
//! their formulas, contours by filling the polygon again.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::{Region, RegionList, Rejections, View};
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::depth::Depth;
use salient_stereo::stage::ground::Plane;
use salient_stereo::stage::regions::candidates::{Candidates, PixelBox};
use salient_stereo::stage::regions::components::{Components, agree};
use salient_stereo::stage::regions::contour::Contour;
use salient_stereo::stage::regions::measure::Measure;
use salient_stereo::stage::regions::{RegionSource, Regions, priority};
use salient_stereo::stage::roi::Masks;
use salient_stereo::stage::saliency::upsample;

use super::reference::roi::bits;

const F: f64 = 100.0;
const BASELINE: f64 = 0.5;

fn rig(size: Size) -> StereoRig {
    let (cx, cy) = (size.width as f64 / 2.0, size.height as f64 / 2.0);
    StereoRig::new(
        Camera::pinhole(size, F, cx, cy, 0.0),
        Camera::pinhole(size, F, cx, cy, -F * BASELINE),
        0.0,
    )
    .unwrap()
}

fn neighbours(i: usize, size: Size) -> impl Iterator<Item = usize> {
    let (x, y) = ((i % size.width) as isize, (i / size.width) as isize);
    (-1..=1_isize).flat_map(move |dy| (-1..=1_isize).map(move |dx| (dx, dy))).filter_map(
        move |(dx, dy)| {
            let (nx, ny) = (x + dx, y + dy);
            let inside =
                nx >= 0 && ny >= 0 && nx < size.width as isize && ny < size.height as isize;
            (inside && (dx, dy) != (0, 0)).then(|| ny as usize * size.width + nx as usize)
        },
    )
}

/// Flood fill over all pairs of neighbours for which `joined` is true.
fn flood(
    size: Size,
    member: impl Fn(usize) -> bool,
    joined: impl Fn(usize, usize) -> bool,
) -> Vec<usize> {
    let mut set = vec![0; size.area()];
    let mut count = 0;
    for start in 0..size.area() {
        if set[start] != 0 || !member(start) {
            continue;
        }
        count += 1;
        set[start] = count;
        let mut open = vec![start];
        while let Some(i) = open.pop() {
            for j in neighbours(i, size) {
                if set[j] == 0 && member(j) && joined(i, j) {
                    set[j] = count;
                    open.push(j);
                }
            }
        }
    }
    set
}

/// True when two numberings describe the same partition.
fn same_partition(a: &[usize], b: &[usize]) -> bool {
    let (mut forth, mut back) = (BTreeMap::new(), BTreeMap::new());
    a.iter().zip(b).all(|(&a, &b)| {
        (a == 0) == (b == 0)
            && *forth.entry(a).or_insert(b) == b
            && *back.entry(b).or_insert(a) == a
    })
}

fn components(salient: &Image<u8>, disparity: &Image<f32>) -> Candidates {
    let mut out = Candidates::default();
    Components::default().run(salient, disparity, &mut out);
    out
}

/// Components of the measured pixels, merged by median, slowly.
fn plain_components(salient: &Image<u8>, disparity: &Image<f32>) -> Vec<usize> {
    let (mask, d, size) = (salient.pixels(), disparity.pixels(), disparity.size());
    let set = flood(size, |i| mask[i] != 0 && !d[i].is_nan(), |i, j| agree(d[i], d[j]));
    // Waves from the measured pixels into the others.
    let mut filled = set.clone();
    loop {
        let mut next = filled.clone();
        for i in (0..size.area()).filter(|&i| mask[i] != 0 && filled[i] == 0) {
            let options = neighbours(i, size).filter(|&j| filled[j] != 0);
            next[i] = options.map(|j| filled[j]).next().unwrap_or(0);
        }
        if next == filled {
            break;
        }
        filled = next;
    }
    filled
}

fn arbitrary_scene() -> impl Strategy<Value = (Image<u8>, Image<f32>)> {
    (1..24_usize, 1..20_usize).prop_flat_map(|(width, height)| {
        let size = Size::new(width, height);
        // Few values, so that neighbours often agree; one in five is unknown.
        let disparity = prop_oneof![
            1 => Just(f32::NAN),
            4 => prop_oneof![Just(10.0_f32), Just(10.5), Just(11.0), Just(30.0), Just(31.4)],
        ];
        (
            prop::collection::vec(prop_oneof![1 => Just(0_u8), 3 => Just(255_u8)], size.area()),
            prop::collection::vec(disparity, size.area()),
        )
            .prop_map(move |(mask, d)| {
                (Image::from_vec(size, mask).unwrap(), Image::from_vec(size, d).unwrap())
            })
    })
}

proptest! {
    #[test]
    fn measured_pixels_are_together_as_flood_fill_and_medians_say((salient, disparity) in arbitrary_scene()) {
        let found = components(&salient, &disparity);
        let (mask, d, size) = (salient.pixels(), disparity.pixels(), disparity.size());

        // Every salient pixel has exactly one candidate, no other has any.
        for (i, &id) in found.ids.pixels().iter().enumerate() {
            prop_assert_eq!(id != 0, mask[i] != 0);
        }
        // Pixels that flood fill joins are in one candidate.
        let set = flood(size, |i| mask[i] != 0 && !d[i].is_nan(), |i, j| agree(d[i], d[j]));
        let mut candidate_of = BTreeMap::new();
        for (i, &s) in set.iter().enumerate().filter(|(_, s)| **s != 0) {
            let id = *candidate_of.entry(s).or_insert(found.ids.pixels()[i]);
            prop_assert_eq!(id, found.ids.pixels()[i]);
        }
        // Sets in one candidate have a chain of agreeing medians: at 10 and 30
        // px the medians are so far apart that no chain spans them.
        for (&a, &id_a) in &candidate_of {
            for (&b, &id_b) in &candidate_of {
                let near = |s: usize| {
                    let mut values: Vec<_> = (0..size.area()).filter(|&i| set[i] == s).map(|i| d[i]).collect();
                    values.sort_unstable_by(f32::total_cmp);
                    values[values.len() / 2] > 20.0
                };
                prop_assert!(id_a != id_b || near(a) == near(b));
            }
        }
        // Every candidate is one piece, and its box is tight.
        let ids = found.ids.pixels();
        let pieces = flood(size, |i| ids[i] != 0, |i, j| ids[i] == ids[j]);
        let ids: Vec<_> = ids.iter().map(|&id| id as usize).collect();
        prop_assert!(same_partition(&pieces, &ids));
        for (index, b) in found.boxes.iter().enumerate() {
            let of_it: Vec<_> = (0..size.area()).filter(|&i| ids[i] == index + 1).collect();
            prop_assert_eq!(b.area, of_it.len());
            prop_assert_eq!(Some(b.x0), of_it.iter().map(|i| i % size.width).min());
            prop_assert_eq!(Some(b.x1), of_it.iter().map(|i| i % size.width + 1).max());
            prop_assert_eq!(Some(b.y0), of_it.iter().map(|i| i / size.width).min());
            prop_assert_eq!(Some(b.y1), of_it.iter().map(|i| i / size.width + 1).max());
        }
    }

    #[test]
    fn pixels_without_disparity_never_bridge_two_depths((salient, disparity) in arbitrary_scene()) {
        let found = components(&salient, &disparity);
        let reached = plain_components(&salient, &disparity);
        for (i, &id) in found.ids.pixels().iter().enumerate() {
            // What measured pixels can reach belongs to a candidate with measured pixels.
            if reached[i] != 0 {
                let measured = (0..disparity.pixels().len())
                    .any(|j| found.ids.pixels()[j] == id && !disparity.pixels()[j].is_nan());
                prop_assert!(measured);
            }
        }
    }

    #[test]
    fn the_boundary_encloses_exactly_the_mask(width in 1..20_usize, bits in prop::collection::vec(any::<bool>(), 1..260)) {
        let height = bits.len().div_ceil(width);
        let size = Size::new(width, height);
        // The part that is followed: that of the first pixel.
        let bit = |i: usize| bits.get(i).copied().unwrap_or(false);
        let parts = flood(size, bit, |_, _| true);
        let mask: Vec<u8> = parts.iter().map(|&p| u8::from(p == 1) * 255).collect();
        let mut contour = Contour::new(simd::detect());
        let boundary = contour.follow(&mask, width).to_vec();
        if !mask.contains(&255) {
            prop_assert!(boundary.is_empty());
            return Ok(());
        }
        // Filled from outside through 4-neighbours, the border stops the flood:
        // what it does not reach is the mask with its holes filled.
        let wall: BTreeSet<_> = boundary.iter().map(|p| (p[0], p[1])).collect();
        let enclosed = enclosed_by(&wall, size);
        let own: BTreeSet<_> = (0..size.area()).filter(|&i| mask[i] != 0)
            .map(|i| ((i % width) as i32, (i / width) as i32)).collect();
        let full = enclosed_by(&own, size);
        prop_assert_eq!(enclosed, full);
        for pair in boundary.windows(2) {
            prop_assert!((pair[0][0] - pair[1][0]).abs() <= 1 && (pair[0][1] - pair[1][1]).abs() <= 1);
        }

        // Simplified: a subset of the points, and no point is farther than the tolerance.
        for tolerance in [0.0_f32, 1.0, 2.5] {
            let mut polygon = Vec::new();
            contour.run(&mask, width, [7, 9], tolerance, &mut polygon);
            prop_assert!(polygon.len() <= boundary.len());
            for p in &boundary {
                let p = [p[0] as f32 + 7.0, p[1] as f32 + 9.0];
                let distance = (0..polygon.len())
                    .map(|i| segment_distance(p, polygon[i], polygon[(i + 1) % polygon.len()]))
                    .fold(f32::INFINITY, f32::min);
                prop_assert!(distance <= tolerance + 1e-4, "{} > {}", distance, tolerance);
            }
        }
    }
}

#[test]
fn of_a_mask_in_parts_the_largest_is_outlined() {
    // A crumb that comes first in raster order, a ring, and a crumb in its hole.
    let rows = [
        "#........", //
        "...#####.",
        "...#...#.",
        "...#.#.#.",
        "...#...#.",
        "...#####.",
        ".........",
    ];
    let mask: Vec<u8> = rows.concat().bytes().map(|c| u8::from(c == b'#') * 255).collect();
    let mut polygon = Vec::new();
    Contour::new(simd::detect()).run(&mask, 9, [0, 0], 0.5, &mut polygon);
    assert_eq!(polygon, [[3.0, 1.0], [7.0, 1.0], [7.0, 5.0], [3.0, 5.0]]);
}

#[test]
fn a_mask_as_thin_as_a_line_still_has_three_corners() {
    let mut polygon = Vec::new();
    Contour::new(simd::detect()).run(&[255; 12], 12, [0, 0], 1.0, &mut polygon);
    assert_eq!(polygon.len(), 3);
}

/// Pixels that a flood through 4-neighbours from outside the image cannot reach.
fn enclosed_by(wall: &BTreeSet<(i32, i32)>, size: Size) -> BTreeSet<(i32, i32)> {
    let (w, h) = (size.width as i32, size.height as i32);
    let mut outside = BTreeSet::from([(-1, -1)]);
    let mut open = vec![(-1, -1)];
    while let Some((x, y)) = open.pop() {
        for p in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
            let known = (-1..=w).contains(&p.0) && (-1..=h).contains(&p.1);
            if known && !wall.contains(&p) && outside.insert(p) {
                open.push(p);
            }
        }
    }
    (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).filter(|p| !outside.contains(p)).collect()
}

fn segment_distance(p: [f32; 2], a: [f32; 2], b: [f32; 2]) -> f32 {
    let (bx, by) = (b[0] - a[0], b[1] - a[1]);
    let length = bx * bx + by * by;
    let t = if length == 0.0 {
        0.0
    } else {
        (((p[0] - a[0]) * bx + (p[1] - a[1]) * by) / length).clamp(0.0, 1.0)
    };
    (p[0] - a[0] - t * bx).hypot(p[1] - a[1] - t * by)
}

/// A scene of boxes at given disparities on an unsalient background.
struct Boxes {
    size: Size,
    salient: Image<u8>,
    attention: Image<f32>,
    disparity: Image<f32>,
    confidence: Image<f32>,
    left: View,
    coarse: CoarseDisparity,
}

impl Boxes {
    fn new(width: usize, height: usize) -> Self {
        let size = Size::new(width, height);
        Self {
            size,
            salient: Image::new(size),
            attention: Image::filled(size.divided_by(4), 0.8),
            disparity: Image::filled(size, f32::NAN),
            confidence: Image::filled(size, 0.9),
            left: View::default(),
            coarse: CoarseDisparity::default(),
        }
    }

    fn add(&mut self, x: usize, y: usize, w: usize, h: usize, d: impl Fn(usize, usize) -> f32) {
        for v in y..y + h {
            for u in x..x + w {
                self.salient.set(u, v, 255);
                self.disparity.set(u, v, d(u, v));
            }
        }
    }

    fn source<'a>(&'a self, rig: &'a StereoRig, roi: &'a Masks) -> RegionSource<'a> {
        RegionSource {
            left: &self.left,
            attention: &self.attention,
            roi,
            disparity: &self.disparity,
            coarse: &self.coarse,
            confidence: &self.confidence,
            rig,
            plane: None,
            poles: &[],
            table: None,
        }
    }

    fn run(&self, config: &Config) -> (Image<u16>, RegionList, Rejections) {
        let rig = rig(self.size);
        let salient = bits(&Image::from_fn(self.size, |x, y| self.salient.get(x, y) != 0));
        let roi = Masks { matched: salient.clone(), salient };
        let source = self.source(&rig, &roi);
        let mut outs = simd::available().into_iter().map(|level| {
            let mut out = (Image::default(), RegionList::default(), Rejections::default());
            let mut regions = Regions::new(config, self.size, level);
            regions.run(&source, &mut out.0, &mut out.1, &mut out.2);
            out
        });
        let plain = outs.next().expect("there is always a level");
        for out in outs {
            assert_eq!(format!("{:?}", out.1), format!("{:?}", plain.1));
            assert_eq!(out.0.pixels(), plain.0.pixels());
        }
        plain
    }
}

#[test]
fn statistics_follow_their_plain_formulas() {
    let mut scene = Boxes::new(81, 53);
    // A slanted box with holes; 50 px m / 0.5 px is beyond 80 m.
    let hole = |u: usize, v: usize| (u + 3 * v).is_multiple_of(7);
    scene.add(20, 10, 31, 23, |u, v| {
        if hole(u, v) { f32::NAN } else { 12.0 + 0.05 * (u as f32 - 20.0) + 0.02 * v as f32 }
    });
    scene.disparity.set(30, 15, 0.5);
    scene.attention =
        Image::from_fn(scene.attention.size(), |x, y| 0.6 + ((x * 7 + y * 5) % 11) as f32 * 0.03);
    let (labels, regions, rejections) = scene.run(&Config::default());
    assert_eq!(
        (regions.len(), rejections.total()),
        (1, 1),
        "the far pixel is a fragment of its own"
    );
    let r = &regions[0];
    let pixels: Vec<_> = (0..scene.size.area()).filter(|&i| labels.pixels()[i] == 1).collect();
    assert_eq!((r.x, r.y, r.width, r.height, r.label), (20, 10, 31, 23, 1));
    assert_eq!(r.area as usize, pixels.len());
    let mut d: Vec<f64> = pixels
        .iter()
        .map(|&i| f64::from(scene.disparity.pixels()[i]))
        .filter(|d| !d.is_nan())
        .collect();
    let n = d.len() as f64;
    let near = |a: f32, b: f64| assert!((f64::from(a) - b).abs() < 2e-4 * b.abs(), "{a} {b}");
    near(r.valid_fraction, n / pixels.len() as f64);
    let mean = d.iter().sum::<f64>() / n;
    near(r.mean_disparity, mean);
    near(r.disparity_stddev, (d.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt());
    let mut z: Vec<f64> = d.iter().map(|d| F * BASELINE / d).collect();
    z.sort_by(f64::total_cmp);
    d.sort_by(f64::total_cmp);
    let percentile = |part: f64| {
        let rank = part * (z.len() - 1) as f64;
        let low = z[rank as usize];
        low + (z[(rank as usize + 1).min(z.len() - 1)] - low) * rank.fract()
    };
    let mean = z.iter().sum::<f64>() / n;
    near(r.mean_depth, mean);
    near(r.depth_stddev, (z.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / n).sqrt());
    near(r.near_depth, percentile(0.05));
    near(r.median_depth, percentile(0.5));
    near(r.far_depth, percentile(0.95));
    let mut saliency = Image::default();
    upsample(simd::detect(), &scene.attention, scene.size, &mut saliency);
    let s: Vec<f64> = pixels.iter().map(|&i| f64::from(saliency.pixels()[i])).collect();
    near(r.mean_saliency, s.iter().sum::<f64>() / s.len() as f64);
    near(r.max_saliency, s.iter().copied().fold(0.0, f64::max));
    let score = -2.5 + 0.9 * (pixels.len() as f64 / 1000.0).ln() + 4.2 * n / pixels.len() as f64;
    near(r.confidence, 1.0 / (1.0 + (-score).exp()));
    assert_eq!(r.mask.len(), 31 * 23);
    assert_eq!(r.mask.iter().filter(|m| **m != 0).count(), pixels.len());
}

/// Of large regions some rows are looked at; disparity is smooth over them.
#[test]
fn large_regions_have_the_statistics_of_all_their_pixels() {
    for (w, h) in [(96, 83), (97, 107), (152, 127), (40, 301)] {
        let mut scene = Boxes::new(w + 9, h + 11);
        let hole = |u: usize, v: usize| (5 * u + 3 * v).is_multiple_of(11);
        scene.add(5, 7, w, h, |u, v| {
            if hole(u, v) { f32::NAN } else { 12.0 + 0.02 * u as f32 + 0.015 * v as f32 }
        });
        let (labels, regions, _) = scene.run(&Config::default());
        let r = &regions[0];
        assert_eq!((regions.len(), r.area as usize), (1, w * h), "all of {w} x {h}");
        let mut d: Vec<f64> = (0..scene.size.area())
            .filter(|&i| labels.pixels()[i] == 1)
            .map(|i| f64::from(scene.disparity.pixels()[i]))
            .filter(|d| !d.is_nan())
            .collect();
        let n = d.len() as f64;
        let near = |name: &str, a: f64, b: f64, most: f64| {
            assert!((a - b).abs() < most, "{w} x {h}, {name}: {a}, not {b}");
        };
        near("valid", f64::from(r.valid_fraction), n / (w * h) as f64, 0.01);
        let mean = d.iter().sum::<f64>() / n;
        let deviation = (d.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n).sqrt();
        near("mean disparity", f64::from(r.mean_disparity), mean, 0.03);
        near("its deviation", f64::from(r.disparity_stddev), deviation, 0.02);
        d.sort_by(f64::total_cmp);
        for (part, depth) in [(0.95, r.near_depth), (0.5, r.median_depth), (0.05, r.far_depth)] {
            let at = d[(part * (n - 1.0)) as usize];
            near("percentile", F * BASELINE / f64::from(depth), at, 0.1);
        }
        // Means of X = (u - cx) Z / f and of Y over the pixels.
        let (cx, cy) = (scene.size.width as f64 / 2.0, scene.size.height as f64 / 2.0);
        let (mut x, mut y) = (0.0, 0.0);
        for i in (0..scene.size.area()).filter(|&i| labels.pixels()[i] == 1) {
            let z = BASELINE / f64::from(scene.disparity.pixels()[i]);
            if !z.is_nan() {
                x += ((i % scene.size.width) as f64 - cx) * z / n;
                y += ((i / scene.size.width) as f64 - cy) * z / n;
            }
        }
        near("x", r.position[0], x, 0.02);
        near("y", r.position[1], y, 0.02);
    }
}

/// A post whose lower half was matched is where its box is.
#[test]
fn a_post_that_was_followed_is_located_by_its_box() {
    let mut scene = Boxes::new(64, 96);
    scene.add(30, 44, 4, 44, |_, _| 10.0);
    let rig = rig(scene.size);
    let roi = Masks::default();
    let source = scene.source(&rig, &roi);
    let mut candidates =
        Candidates { ids: Image::new(scene.size), first: 1, ..Candidates::default() };
    for y in 8..88 {
        candidates.ids.row_mut(y)[30..34].fill(1);
    }
    let bounds = PixelBox { x0: 30, y0: 8, x1: 34, y1: 88, area: 4 * 80 };
    let measure = |candidates: &Candidates| {
        let mut region = Region::default();
        let depth = Depth::new(&Config::default());
        Measure::new(simd::detect(), depth).run(1, &bounds, candidates, &source, &mut region);
        region
    };
    // Z = 5 m, so that a pixel is 5 cm; the image's middle is row 48.
    let stump = measure(&candidates);
    assert!((stump.position[1] - (65.5 - 48.0) * 0.05).abs() < 1e-3, "{:?}", stump.position);
    candidates.followed.push((1, 4 * 36));
    let post = measure(&candidates);
    assert!((post.position[1] - (48.0 - 48.0) * 0.05).abs() < 0.03, "{:?}", post.position);
    assert!((post.extent[1] - 4.0).abs() < 1e-3 && post.position[2] == stump.position[2]);
}

#[test]
fn position_and_covariance_belong_to_the_object() {
    let mut scene = Boxes::new(101, 61);
    scene.add(60, 20, 21, 21, |_, _| 5.0);
    let (_, regions, _) = scene.run(&Config::default());
    let r = &regions[0];
    // Centre pixel (70, 30), Z = 50 / 5 = 10 m.
    let expected = [(70.0 - 50.5) / F * 10.0, (30.0 - 30.5) / F * 10.0, 10.0];
    for (i, expected) in expected.into_iter().enumerate() {
        assert!((r.position[i] - expected).abs() < 1e-4, "{:?} {expected}", r.position);
    }
    let c = &r.position_covariance;
    for i in 0..3 {
        assert!(c[4 * i] > 0.0);
        for j in 0..3 {
            assert!((c[3 * i + j] - c[3 * j + i]).abs() < 1e-12);
            assert!(c[3 * i + j].powi(2) <= c[4 * i] * c[4 * j] + 1e-12, "not a covariance");
        }
    }
    // sigma Z = Z²/(fB) * sigma d, and depth is what stereo knows least.
    assert!(c[8].sqrt() > 2.0 * 0.1 && c[8] > c[4], "{c:?}");
    assert!((r.extent[0] - 21.0 * 10.0 / F).abs() < 1e-4 && r.extent[2] < 1e-3);
}

#[test]
fn neighbours_at_two_depths_are_two_regions_and_panes_are_one() {
    let mut scene = Boxes::new(120, 60);
    scene.add(10, 10, 30, 30, |_, _| 10.0);
    scene.add(40, 10, 30, 30, |_, _| 20.0);
    // A frame of 12 px with a pane: a hole whose rim was matched to nothing.
    scene.add(80, 10, 36, 40, |u, v| {
        if (90..106).contains(&u) && (16..30).contains(&v) {
            if (91..105).contains(&u) && (17..29).contains(&v) { 12.2 } else { f32::NAN }
        } else {
            12.0
        }
    });
    let (labels, regions, _) = scene.run(&Config::default());
    assert_eq!(regions.len(), 3);
    assert_ne!(labels.get(39, 20), labels.get(40, 20));
    assert_eq!(labels.get(85, 20), labels.get(98, 22));
}

#[test]
fn a_hole_at_the_rim_of_what_stands_belongs_to_what_it_looks_like() {
    let size = Size::new(160, 120);
    let camera = |tx| Camera::pinhole(size, 420.0, 80.0, 40.0, tx);
    let rig = StereoRig::new(camera(0.0), camera(-210.0), 0.0).unwrap();
    let slope = 0.5 / 1.55;
    let plane = Plane::new(slope, 0.0, -40.0 * slope, &rig).unwrap();
    // 15 m away, 1.4 m wide and high; of its two last columns nothing was measured.
    let thing = |x: usize, y: usize| (60..100).contains(&x) && (45..84).contains(&y);
    let disparity = Image::from_fn(size, |x, y| match thing(x, y) {
        true if x >= 98 => f32::NAN,
        true => 14.0,
        false => (slope * (y as f32 - 40.0)).max(2.0),
    });
    let all = bits(&Image::filled(size, true));
    let roi = Masks { matched: all.clone(), salient: all };
    let attention = Image::filled(size.divided_by(4), 0.8);
    let confidence = Image::filled(size, 0.9);
    let nothing = Image::filled(size.divided_by(4), f32::NAN);
    let coarse = CoarseDisparity { checked: nothing.clone(), filled: nothing };
    for (rim, last) in [(80, 99), (140, 97)] {
        let gray = Image::from_fn(size, |x, y| match thing(x, y) {
            true if x >= 98 => rim,
            true => 80,
            false => 140,
        });
        let left = View { gray, is_gray: true, ..View::default() };
        for level in simd::available() {
            let source = RegionSource {
                left: &left,
                attention: &attention,
                roi: &roi,
                disparity: &disparity,
                coarse: &coarse,
                confidence: &confidence,
                rig: &rig,
                plane: Some(&plane),
                poles: &[],
                table: None,
            };
            let mut out = (Image::default(), RegionList::default(), Rejections::default());
            let mut regions = Regions::new(&Config::default(), size, level);
            regions.run(&source, &mut out.0, &mut out.1, &mut out.2);
            assert_eq!(out.1.len(), 1);
            // A quarter of a metre above the ground the thing's foot is not told from it.
            let lowest = (0..size.height).rev().find(|y| out.0.get(70, *y) != 0);
            assert_eq!(lowest, Some(81));
            let row = out.0.row(60);
            let first = row.iter().position(|label| *label != 0);
            assert_eq!((first, row.iter().rposition(|label| *label != 0)), (Some(60), Some(last)));
        }
    }
}

#[test]
fn each_refusal_has_its_reason() {
    let mut scene = Boxes::new(160, 80);
    scene.add(2, 2, 10, 10, |_, _| 9.0);
    scene.add(20, 2, 20, 20, |_, _| f32::NAN);
    scene.add(50, 2, 20, 20, |_, _| 9.0);
    for v in 2..22 {
        for u in 50..70 {
            scene.confidence.set(u, v, 0.02);
        }
    }
    // A ramp from 4 to 24 px: the ground.
    scene.add(80, 2, 40, 70, |_, v| 4.0 + (v - 2) as f32 * 0.3);
    scene.add(130, 2, 20, 20, |_, _| 9.0);
    scene.add(130, 40, 20, 20, |_, _| 30.0);
    let mut config = Config::default();
    config.regions.max_count = 1;
    let (labels, regions, rejections) = scene.run(&config);
    let expected = Rejections {
        small_area: 1,
        low_confidence: 2,
        inconsistent_depth: 1,
        floating: 0,
        background: 0,
        not_salient: 0,
        unstable: 0,
        over_count: 1,
    };
    assert_eq!(rejections, expected);
    assert_eq!(regions.len(), 1);
    assert!((regions[0].mean_disparity - 30.0).abs() < 1e-4, "the nearer one comes first");
    assert_eq!(labels.pixels().iter().filter(|l| **l != 0).count(), 400);
}

#[test]
fn without_a_plane_what_weighs_little_beside_the_weightiest_is_passed_over() {
    let mut scene = Boxes::new(200, 120);
    scene.add(10, 10, 100, 100, |_, _| 30.0);
    scene.add(130, 10, 24, 24, |_, _| 9.0);
    scene.add(130, 60, 20, 20, |_, _| 9.0);
    let (_, regions, rejections) = scene.run(&Config::default());
    assert_eq!(regions.iter().map(|r| r.area).collect::<Vec<_>>(), [10_000, 576]);
    assert_eq!(rejections, Rejections { not_salient: 1, ..Rejections::default() });
    // One that is refused for another reason weighs nothing.
    for v in 10..110 {
        for u in 10..110 {
            scene.confidence.set(u, v, 0.02);
        }
    }
    let (_, regions, rejections) = scene.run(&Config::default());
    assert_eq!(regions.len(), 2);
    assert_eq!(rejections, Rejections { low_confidence: 1, ..Rejections::default() });
}

#[test]
fn labels_follow_priority() {
    let mut scene = Boxes::new(200, 60);
    for (i, d) in [8.0, 30.0, 15.0, 60.0].into_iter().enumerate() {
        scene.add(5 + 45 * i, 10, 30, 30, |_, _| d);
    }
    let (labels, regions, _) = scene.run(&Config::default());
    assert_eq!(regions.iter().map(|r| r.label).collect::<Vec<_>>(), [1, 2, 3, 4]);
    assert!(regions.windows(2).all(|pair| priority(&pair[0]) >= priority(&pair[1])));
    for r in regions.iter() {
        assert_eq!(labels.get(r.x as usize + 1, r.y as usize + 1), r.label);
    }
}

#[test]
fn a_region_up_to_the_image_edges_is_measured_whole() {
    // More rows than are added in single precision, and columns that fill no vector.
    let mut scene = Boxes::new(83, 71);
    let hole = |u: usize, v: usize| (u * u + v).is_multiple_of(5);
    let plane = |u: usize, v: usize| 20.0 + 0.03 * u as f32 + 0.01 * v as f32;
    scene.add(1, 1, 82, 70, |u, v| if hole(u, v) { f32::NAN } else { plane(u, v) });
    let (_, regions, _) = scene.run(&Config::default());
    let r = &regions[0];
    assert_eq!((regions.len(), r.x, r.y, r.width, r.height), (1, 1, 1, 82, 70));
    assert_eq!((r.area, r.mask.iter().all(|m| *m == 255)), (82 * 70, true));
    let mut sums = [0.0_f64; 4];
    for (u, v) in (1..71).flat_map(|v| (1..83).map(move |u| (u, v))).filter(|&(u, v)| !hole(u, v)) {
        let z = F * BASELINE / f64::from(plane(u, v));
        let (cx, cy) = rig(scene.size).principal_point();
        let place = [z * (u as f64 - cx) / F, z * (v as f64 - cy) / F, z];
        sums = [sums[0] + place[0], sums[1] + place[1], sums[2] + place[2], sums[3] + 1.0];
    }
    for axis in 0..3 {
        assert!(
            (r.position[axis] - sums[axis] / sums[3]).abs() < 1e-4,
            "{:?} {sums:?}",
            r.position
        );
    }
    assert!((f64::from(r.valid_fraction) - sums[3] / 5740.0).abs() < 1e-6);
}

#[test]
fn measurements_without_finite_depth_are_not_numbers() {
    let mut scene = Boxes::new(60, 40);
    // Beyond depth.max, but matched.
    scene.add(10, 10, 20, 20, |_, _| 0.25);
    let (_, regions, _) = scene.run(&Config::default());
    let r = &regions[0];
    assert!((r.mean_disparity - 0.25).abs() < 1e-6 && r.valid_fraction == 1.0);
    for z in [r.mean_depth, r.median_depth, r.depth_stddev, r.near_depth, r.far_depth] {
        assert!(z.is_nan());
    }
    assert!(r.position.iter().chain(&r.position_covariance).chain(&r.extent).all(|v| v.is_nan()));
}
