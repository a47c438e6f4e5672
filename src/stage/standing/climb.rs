//! Upward through sixteen columns of cells at once.

use super::column::{MAX_HOLES, Segment, Top};
use super::{HIGH, WIDE, centre, size_scale};
use crate::image::Image;
use crate::simd::{Simd, f32x16, mask32x16, padded, prelude::*};
use crate::stage::ground::Plane;
use crate::stage::ground::height::{HIGH_M, LEAST_DISPARITY, NOISE_PX};
use crate::stage::regions::components::{TOLERANCE_PART, TOLERANCE_PX};

/// Height in metres (of a road scene) from which a cell is above the ground.
pub const LOW_M: f32 = 0.2;
/// A segment that begins no higher than this stands on the ground, metres.
const CONTACT_M: f32 = 0.6;
/// A surface that reaches higher than a lorry is part of a building, a tree or a pole.
pub const TALL_M: f32 = 4.2;
/// Cells above a segment among which the next disparity is looked for, and those up to
/// which something farther away is hidden by it: what only one camera sees above the
/// edge of a roof was not measured.
const LOOK_UP: f32 = 6.0;
const LOOK_BEHIND: f32 = 4.0;
/// Largest distance of a cell from its segment's mean disparity, in parts: the bonnet
/// of a car and what is parked a metre before it are two.
const SEGMENT_PART: f32 = 0.1;

/// Cells of a segment, at least: what is shorter is a mixture of two surfaces at
/// an edge as a rule, or noise. Of streets half of all segments are.
const LEAST_CELLS: f32 = 3.0;
/// Metres (of a road scene) from which so many cells are enough: what is far away is no higher than
/// that, and what two surfaces mix to at an edge is lower.
const FEW_CELLS: f32 = 2.0;
const FEW_M: f32 = 0.8;

/// Columns that are climbed side by side.
pub const LANES: usize = 16;

/// What is known of some columns below the row that is looked at. Rows and
/// numbers of cells are exact in a float.
struct Climb<S: Simd> {
    simd: S,
    /// First column.
    x: usize,
    camera_height_m: f32,
    /// Height of a row of pixels in metres (of a road scene), times disparity.
    row_m: f32,
    /// Row of the highest cell with disparity so far, and whether that is ground;
    /// to begin with the row below the image, which is.
    row: f32x16<S>,
    on_ground: mask32x16<S>,
    /// Whether it is of a segment: its highest cell, then.
    inside: mask32x16<S>,
    /// The fields of that segment.
    upper: f32x16<S>,
    lower: f32x16<S>,
    cells: f32x16<S>,
    sum: f32x16<S>,
    mean: f32x16<S>,
    last: f32x16<S>,
    bottom_m: f32x16<S>,
    top_m: f32x16<S>,
    contact: mask32x16<S>,
    tall: mask32x16<S>,
}

/// Appends the segments of [`LANES`] columns from `x` on to `out`, those of one
/// column from its lower end upward.
#[inline(always)]
pub fn climb<S: Simd>(
    simd: S,
    x: usize,
    disparity: &Image<f32>,
    plane: &Plane,
    out: &mut Vec<Segment>,
) {
    let scale = size_scale(plane);
    let zero = f32x16::splat(simd, 0.0);
    let none = mask32x16::splat(simd, false);
    let mut state = Climb {
        simd,
        x,
        camera_height_m: plane.camera_height_m,
        row_m: plane.a * plane.camera_height_m / scale,
        row: zero + disparity.height() as f32,
        on_ground: !none,
        inside: none,
        upper: zero,
        lower: zero,
        cells: zero,
        sum: zero,
        mean: zero,
        last: zero,
        bottom_m: zero,
        top_m: zero,
        contact: none,
        tall: none,
    };
    let (lowest, contact) = (LOW_M * scale, CONTACT_M * scale);
    let noise = zero + NOISE_PX * plane.camera_height_m;
    let lane = f32x16::from_fn(simd, |i| (i * WIDE) as f32);
    let slope = (lane + centre(x, 0).0) * plane.b;
    for y in (0..disparity.height()).rev() {
        let d: f32x16<S> = padded(simd, disparity.row(y), x, f32::NAN);
        let known = d.simd_gt(LEAST_DISPARITY);
        if known.any_true() {
            // As `Plane::height` reckons.
            let at = slope + plane.a * centre(0, y).1 + plane.c;
            let height = (d - at) * plane.camera_height_m / d;
            let cells = Row {
                y: y as f32,
                d,
                known,
                ground: height.simd_lt(noise / d + lowest),
                high: !height.simd_le(HIGH_M),
                height,
                low: height.simd_le(contact),
                at,
            };
            // Road or crowns alone: nothing begins, goes on or ends.
            let rises = known & !cells.ground & !cells.high;
            if (state.inside | rises).any_true() {
                state.step(&cells, out);
            }
            state.pass(&cells);
        }
    }
    // At the edge of the image nobody knows how far up it goes.
    state.tall |= state.row.simd_eq(0.0);
    state.give(state.inside, none, out);
}

/// Cells side by side.
struct Row<S: Simd> {
    y: f32,
    d: f32x16<S>,
    /// What has a disparity; the rest is meaningless without.
    known: mask32x16<S>,
    /// No higher than the ground.
    ground: mask32x16<S>,
    /// Higher than [`HIGH_M`].
    high: mask32x16<S>,
    height: f32x16<S>,
    /// No higher than [`CONTACT_M`].
    low: mask32x16<S>,
    /// Disparity of the ground.
    at: f32x16<S>,
}

impl<S: Simd> Climb<S> {
    /// One row further up, before [`Climb::pass`].
    #[inline(always)]
    fn step(&mut self, cells: &Row<S>, out: &mut Vec<Segment>) {
        let &Row { y, d, known, ground, high, height, low, at } = cells;
        let gap = self.row - (y + 1.0);
        let close = gap.simd_le(MAX_HOLES);
        // As `agree` of two disparities.
        let tolerance = (d.max(self.last) * TOLERANCE_PART).max(TOLERANCE_PX);
        let same = (d - self.last).abs().simd_le(tolerance);
        let near = (d - self.mean).abs().simd_le(self.mean * SEGMENT_PART);
        let asked = known & self.inside;
        let on = asked & close & near & same;
        let ended = asked & !on;
        if ended.any_true() {
            let asked = ended & !self.tall & gap.simd_le(LOOK_UP) & !same;
            // Nothing ends at this height by chance: a step in a wall.
            let over = ((self.last - at) * self.camera_height_m / self.last).simd_gt(HIGH_M);
            let next = self.row.simd_eq(y + 1.0) & self.row.simd_eq(self.upper);
            let step = asked & over & next;
            self.tall |= step;
            self.give(ended, asked & !step & d.simd_gt(self.last), out);
        }
        let starts = known & !ground & !high & !on;
        // What is farther away stands on the one below or is hidden by it; directly
        // above a cell of the ground, something stands on that.
        let hidden = ended & d.simd_lt(self.mean);
        let behind = hidden & gap.simd_le(LOOK_BEHIND);
        let carried = behind | (close & self.on_ground & !ended);
        let grows = on & !high;
        let takes = starts | grows;
        self.sum = starts.select(d, grows.select(self.sum + d, self.sum));
        self.cells = starts
            .select(f32x16::splat(self.simd, 1.0), grows.select(self.cells + 1.0, self.cells));
        self.mean = takes.select(self.sum / self.cells, self.mean);
        self.upper = takes.select(f32x16::splat(self.simd, y), self.upper);
        self.lower = starts.select(f32x16::splat(self.simd, y + 1.0), self.lower);
        self.bottom_m = starts.select(height, self.bottom_m);
        self.top_m = starts.select(height, grows.select(self.top_m.max(height), self.top_m));
        self.contact = (starts & (carried | low)) | (self.contact & !starts);
        self.tall = (self.tall & !starts) | (on & height.simd_gt(TALL_M));
        self.inside = starts | (self.inside & !ended);
    }

    /// What a row leaves behind whatever begins or ends in it.
    #[inline(always)]
    fn pass(&mut self, cells: &Row<S>) {
        let &Row { y, d, known, ground, .. } = cells;
        self.last = known.select(d, self.last);
        self.row = known.select(f32x16::splat(self.simd, y), self.row);
        self.on_ground = (known & ground) | (self.on_ground & !known);
    }

    /// Which segments are more than noise.
    #[inline(always)]
    fn long(&self) -> mask32x16<S> {
        // A plate on a post may hang where only a part of it is low enough.
        let whole = self.cells + (self.upper - self.row);
        let row_m = f32x16::splat(self.simd, self.row_m) / self.mean;
        let few_m = row_m * (FEW_CELLS * HIGH as f32);
        let few = self.contact & self.cells.simd_ge(FEW_CELLS) & few_m.simd_ge(FEW_M);
        self.cells.simd_ge(LEAST_CELLS) | (!self.tall & whole.simd_ge(LEAST_CELLS)) | few
    }

    /// Writes those of the segments that are long enough.
    #[inline(always)]
    fn give(&self, ended: mask32x16<S>, covered: mask32x16<S>, out: &mut Vec<Segment>) {
        let mut bits = (ended & self.long()).to_bitmask();
        if bits == 0 {
            return;
        }
        let (tall, covered) = (self.tall.to_bitmask(), covered.to_bitmask());
        let contact = self.contact.to_bitmask();
        let (upper, lower) = (self.upper.to_array(), self.lower.to_array());
        let (reach, cells) = (self.row.to_array(), self.cells.to_array());
        let (sum, bottom_m) = (self.sum.to_array(), self.bottom_m.to_array());
        let top_m = self.top_m.to_array();
        while bits != 0 {
            let i = bits.trailing_zeros() as usize % LANES;
            bits &= bits - 1;
            let is = |bits: u64| bits >> i & 1 == 1;
            out.push(Segment {
                x: (self.x + i) as u32,
                upper: upper[i] as u32,
                lower: lower[i] as u32,
                reach: reach[i] as u32,
                cells: cells[i] as u32,
                sum: sum[i],
                bottom_m: bottom_m[i],
                top_m: top_m[i],
                contact: is(contact),
                top: if is(tall) {
                    Top::Tall
                } else if is(covered) {
                    Top::Covered
                } else {
                    Top::Free
                },
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::image::Size;
    use crate::simd::{self, dispatch};
    use crate::stage::regions::components::agree;

    /// A cell with disparity: row, disparity, height.
    type Cell = (usize, f32, f32);

    /// The segments of one column, cell by cell.
    fn plain(x: usize, disparity: &Image<f32>, plane: &Plane) -> Vec<Segment> {
        let scale = size_scale(plane);
        let height = |y: usize, d: f32| {
            let (u, v) = centre(x, y);
            plane.height(u, v, d)
        };
        let cells: Vec<Cell> = (0..disparity.height())
            .rev()
            .map(|y| (y, disparity.get(x, y)))
            .filter(|(_, d)| *d > LEAST_DISPARITY)
            .map(|(y, d)| (y, d, height(y, d)))
            .collect();
        let low =
            |(_, d, height): Cell| height < LOW_M * scale + NOISE_PX * plane.camera_height_m / d;
        let holes = |below: usize, above: usize| (below - above - 1) as f32;
        let mut out = Vec::new();
        let (mut i, mut ended) = (0, None::<f32>);
        while let Some(&first) = cells.get(i) {
            let below = i.checked_sub(1).map(|j| cells[j]);
            let gap = holes(below.map_or(disparity.height(), |below| below.0), first.0);
            let carried = match ended.take() {
                Some(mean) => gap <= LOOK_BEHIND && first.1 < mean,
                None => gap <= MAX_HOLES && below.is_none_or(low),
            };
            i += 1;
            if low(first) || first.2 > HIGH_M {
                continue;
            }
            let mut s = Segment {
                x: x as u32,
                upper: first.0 as u32,
                lower: first.0 as u32 + 1,
                reach: first.0 as u32,
                cells: 1,
                sum: first.1,
                bottom_m: first.2,
                top_m: first.2,
                contact: carried || first.2 <= CONTACT_M * scale,
                top: Top::Free,
            };
            loop {
                let (_, last, _) = cells[i - 1];
                let Some(&(y, d, above)) = cells.get(i) else {
                    s.top = if s.reach == 0 { Top::Tall } else { s.top };
                    break;
                };
                let gap = holes(s.reach as usize, y);
                let near = (d - s.disparity()).abs() <= SEGMENT_PART * s.disparity();
                if gap > MAX_HOLES || !near || !agree(d, last) {
                    if s.top == Top::Free && gap <= LOOK_UP && !agree(d, last) {
                        let step = s.reach == s.upper && gap == 0.0 && height(y, last) > HIGH_M;
                        let covered = if d > last { Top::Covered } else { Top::Free };
                        s.top = if step { Top::Tall } else { covered };
                    }
                    ended = Some(s.disparity());
                    break;
                }
                s.reach = y as u32;
                if above <= HIGH_M {
                    s.upper = y as u32;
                    s.cells += 1;
                    s.sum += d;
                    s.top_m = s.top_m.max(above);
                } else if above > TALL_M {
                    s.top = Top::Tall;
                }
                i += 1;
            }
            let row_m = plane.a * plane.camera_height_m / scale / s.disparity();
            let whole = (s.cells + s.upper - s.reach) as f32;
            if s.cells as f32 >= LEAST_CELLS
                || s.top != Top::Tall && whole >= LEAST_CELLS
                || s.contact
                    && s.cells as f32 >= FEW_CELLS
                    && FEW_CELLS * HIGH as f32 * row_m >= FEW_M
            {
                out.push(s);
            }
        }
        out
    }

    /// The ground d = .3 v + b u + c, 1.7 m below the camera.
    fn ground(b: f32, c: f32) -> Plane {
        let size = Size::new(640, 376);
        let camera = |tx| Camera::pinhole(size, 500.0, 320.0, 120.0, tx);
        let rig = StereoRig::new(camera(0.0), camera(-250.0), 0.0).unwrap();
        Plane::new(0.3, b, c, &rig).unwrap()
    }

    #[test]
    fn what_is_hidden_below_is_so_across_a_few_missing_cells() {
        let plane = ground(0.0, -36.0);
        // Column by column a wider strip without disparity between a car and a trunk behind it.
        let map = Image::from_fn(Size::new(LANES, 94), |missing, y| match y {
            y if y + missing < 40 && y >= 16 => 12.0,
            0..40 => f32::NAN,
            40..70 => 36.0,
            _ => plane.disparity(centre(missing, y).0, centre(missing, y).1),
        });
        for level in simd::available() {
            let mut found = Vec::new();
            dispatch!(level, simd => climb(simd, 0, &map, &plane, &mut found));
            for missing in 0..9 {
                let of = |s: &&Segment| s.x as usize == missing && s.upper < 40;
                let trunk = found.iter().find(of).expect("a trunk");
                assert_eq!(trunk.contact, missing <= 4, "{missing}");
            }
        }
    }

    #[test]
    fn the_segments_of_many_columns_are_those_of_each() {
        let plane = ground(0.01, -40.0);
        let noise = |x: usize, y: usize, n: usize| (x * 31 + y * 17 + (x * y) % 13) % n;
        // Upright surfaces before each other on a ground, with holes and steps. The
        // columns are no whole number of vectors.
        let map = Image::from_fn(Size::new(77, 94), |x, y| {
            let (u, v) = centre(x, y);
            let ground = plane.disparity(u, v);
            // Rows and disparity: a wall, things before it, and what hangs over them.
            let surfaces =
                [(0..94, 9.0), (30..94, 14.0 + (x % 7) as f32), (50..94, 21.0), (x % 30..30, 30.0)];
            let nearest =
                surfaces.iter().filter(|(rows, _)| rows.contains(&y) && x % 11 > rows.start % 5);
            let d = nearest.fold(ground, |most, (_, d)| most.max(*d));
            match noise(x, y, 23) {
                0..4 => f32::NAN,
                4 => d * 0.7,
                n => d + 0.04 * n as f32,
            }
        });
        let mut expected: Vec<Vec<Segment>> =
            (0..map.width()).map(|x| plain(x, &map, &plane)).collect();
        let count = |is: fn(&Segment) -> bool| expected.iter().flatten().filter(|s| is(s)).count();
        let counts = [
            count(|s| s.contact),
            count(|s| !s.contact),
            count(|s| s.top == Top::Free),
            count(|s| s.top == Top::Covered),
            count(|s| s.top == Top::Tall),
            count(|s| s.reach < s.upper),
            count(|s| s.cells == 2),
            count(|s| s.cells < 3 && s.reach < s.upper),
        ];
        assert!(counts.iter().all(|count| *count > 1), "{counts:?}");
        for level in simd::available() {
            let mut found = Vec::new();
            for x in (0..map.width()).step_by(LANES) {
                dispatch!(level, simd => climb(simd, x, &map, &plane, &mut found));
            }
            for (x, expected) in expected.iter_mut().enumerate() {
                let found: Vec<_> = found.iter().copied().filter(|s| s.x as usize == x).collect();
                assert_eq!(found, *expected, "column {x}, {level:?}");
            }
        }
    }
}
