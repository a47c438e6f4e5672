//! A chain of ridges as one line: how far away it is, how far it reaches and how wide it is.

use std::ops::Range;

use super::band::ROWS;
use super::chain::Link;
use super::cost::{MOST_COST, Views, add, add_costs, least, sample};
use super::{LEAST_CONFIDENCE, MOST_CONFIDENCE, PER_PART, Pole, apart};
use crate::simd::{Level, Simd, dispatch};
use crate::stage::ground::Plane;
use crate::stage::standing::size_scale;

/// Most that a line may lean, columns per row.
const MOST_LEAN: f32 = 0.1;
/// Standard deviations of a pole's lean from what the plane lets expect, columns per row, and of
/// a ridge's place from the line, pixels.
const LEAN_SIGMA: f32 = 0.01;
const PLACE_SIGMA: f32 = 0.5;
/// Pixels beside a line that are matched with it, and what they are worth against its own.
const MARGIN: usize = 2;
const MARGIN_WEIGHT: f32 = 0.3;
/// Least disparity of a pole, pixels: what is farther away is as far as all beside it.
const LEAST_PX: f32 = 4.0;
/// The cost is at most this part of the next best one, that is no neighbour.
const MOST_OF_NEXT: f32 = 0.9;
const NEIGHBOURS: usize = 2;
/// Steps of a pixel in which the disparity is looked for in the end.
const FINER: f32 = 4.0;
/// Columns to either side whose disparity is asked, over how many bands up and down.
const ASIDE: isize = 8;
const BANDS: usize = 2;
/// How many pixels nearer than a line they are looked for.
const NEARER: usize = 6;
/// A band shows the line if it costs less than this part of what is beside, and by so much.
const MOST_OF_BESIDE: f32 = 0.8;
const LESS: f32 = 1.0;
/// Bands in a row that need not show it, and the part of all that must.
const MOST_GAP: usize = 2;
const LEAST_SHOWN: f32 = 0.4;
/// Part of its bands beside which all is farther away.
const LEAST_FREE: f32 = 0.3;
/// Width and height of a pole, metres; the height is that of a road scene.
const WIDTHS_M: [f32; 2] = [0.03, 0.35];
const LEAST_TOP_M: f32 = 1.2;
/// Rows that a pole is high, at least, and that its foot may be beside the ground.
const LEAST_ROWS: usize = 40;
const FOOT_ROWS: f32 = 22.0;
/// Rows below the ground that are cut from its foot, at most.
const CUT_ROWS: f32 = 16.0;
/// Pixels by which what hides its foot is nearer, and in how many bands below its end that begins.
const HIDDEN_BANDS: usize = 4;
const HIDDEN_PX: f32 = 0.7;
/// Steps of a pixel in which its sides are looked for.
const STEPS: f32 = 4.0;
/// Pixels beyond the ridge that are asked for them.
const BEYOND: f32 = 4.0;
/// What is up to so many times as far from its own brightness as from that beside is the pole's:
/// what is round is darker at one side.
const TOWARDS_OWN: f32 = 1.5;

/// The measuring of lines, with its buffers.
#[derive(Debug)]
pub struct Lines {
    level: Level,
    /// Cost per disparity of a line itself and of its margins.
    own: Vec<f32>,
    margin: Vec<f32>,
    /// Per band what is on either side.
    sides: [Vec<f32>; 2],
    costs: Vec<f32>,
    sums: Vec<f32>,
    shown: Vec<bool>,
    profile: Vec<f32>,
}

/// A straight line through the middle of a chain.
#[derive(Clone, Copy)]
struct Axis {
    /// Column at the middle of band 0, and its change from band to band.
    at: f32,
    lean: f32,
    width: f32,
}

impl Axis {
    /// The least squares line; `None` of what leans.
    fn of(chain: &[Link], views: &Views<'_>, widths: &mut Vec<f32>) -> Option<Self> {
        let n = chain.len() as f32;
        let mean = |value: &dyn Fn(&Link) -> f32| chain.iter().map(value).sum::<f32>() / n;
        let (band, centre) = (mean(&|link| link.band as f32), mean(&|link| link.ridge.centre()));
        let across = mean(&|link| (link.band as f32 - band) * (link.ridge.centre() - centre));
        let along = mean(&|link| (link.band as f32 - band).powi(2));
        let lean = across / along.max(f32::MIN_POSITIVE);
        let upright = ROWS as f32 * views.plane.b / views.plane.a;
        let known = 1.0 / (LEAN_SIGMA * ROWS as f32).powi(2);
        let fit = n * along / PLACE_SIGMA.powi(2);
        let lean = (lean * fit + upright * known) / (fit + known);
        widths.clear();
        widths.extend(chain.iter().map(|link| link.ridge.width as f32));
        let middle = widths.len() / 2;
        let width = *widths.select_nth_unstable_by(middle, f32::total_cmp).1;
        let axis = Self { at: centre - lean * band, lean, width };
        (lean.abs() <= MOST_LEAN * ROWS as f32).then_some(axis)
    }

    fn column(&self, band: usize) -> f32 {
        self.at + self.lean * band as f32
    }

    /// First of the whole pixels that are the line in a band.
    fn first(&self, band: usize) -> isize {
        (self.column(band) - self.width / 2.0).round() as isize
    }
}

impl Lines {
    /// The measuring with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            own: Vec::new(),
            margin: Vec::new(),
            sides: Default::default(),
            costs: Vec::new(),
            sums: Vec::new(),
            shown: Vec::new(),
            profile: Vec::new(),
        }
    }

    /// The pole that a chain of ridges is, if it is one.
    pub fn measure(&mut self, chain: &[Link], views: &Views<'_>) -> Option<Pole> {
        dispatch!(self.level, simd => self.measure_at(simd, chain, views))
    }

    #[inline(always)]
    fn measure_at<S: Simd>(&mut self, simd: S, chain: &[Link], views: &Views<'_>) -> Option<Pole> {
        let axis = Axis::of(chain, views, &mut self.profile)?;
        let (found, part) = self.match_line(simd, &axis, chain, views)?;
        let disparity = found - views.rig.disparity_offset() as f32;
        let (first, last) = (chain[0].band, chain[chain.len() - 1].band);
        let Plane { a, b, c, .. } = *views.plane;
        let foot = (disparity - c - b * axis.column(last)) / a;
        let bands = views.bands[0].height();
        let lowest = ((foot / ROWS as f32).max(0.0) as usize).saturating_add(1).min(bands - 1);
        if disparity < LEAST_PX || lowest <= first {
            return None;
        }
        let last = last.min(lowest);
        let farthest = found - apart(disparity);
        // Most are windows and fences: the bands of the chain tell.
        self.look_aside(simd, &axis, first..last + 1, found, views);
        let free = (first..=last).filter(|band| self.is_free(*band, farthest)).count();
        if (free as f32) < LEAST_FREE * (last + 1 - first) as f32 {
            return None;
        }
        self.look_aside(simd, &axis, 0..lowest + 1, found, views);
        self.compare(&axis, found, farthest, views);
        let span = self.extend(first..last + 1);
        let n = span.len() as f32;
        let shown = self.shown[span.clone()].iter().filter(|shown| **shown).count() as f32;
        if shown < LEAST_SHOWN * n {
            return None;
        }
        let rows = span.start * ROWS..span.end * ROWS;
        let low = (rows.end as f32 - foot).abs();
        // What is nearer hides the rest.
        let below = span.end.min(lowest)..(span.end + HIDDEN_BANDS).min(lowest + 1);
        let nearer = |side: &Vec<f32>| side[below.clone()].iter().any(|d| *d > found + HIDDEN_PX);
        let hidden = self.sides.iter().any(nearer);
        if low > FOOT_ROWS && !hidden || rows.len() < LEAST_ROWS {
            return None;
        }
        let sides = self.find_sides(&axis, chain, views);
        let metre_px = disparity / views.rig.baseline_m as f32;
        let top = views.plane.height(axis.column(span.start), rows.start as f32, disparity);
        let wide = (sides[1] - sides[0]) / metre_px;
        if !(WIDTHS_M[0]..=WIDTHS_M[1]).contains(&wide)
            || top < LEAST_TOP_M * size_scale(views.plane)
        {
            return None;
        }
        let end = if low < CUT_ROWS { rows.end.min(foot as usize) } else { rows.end };
        let lean = axis.lean / ROWS as f32;
        Some(Pole {
            column: axis.at - lean * (ROWS as f32 / 2.0) + sides[0],
            lean,
            width: sides[1] - sides[0],
            rows: rows.start..end.min(bands * ROWS),
            disparity,
            confidence: (LEAST_CONFIDENCE + PER_PART * part).min(MOST_CONFIDENCE),
        })
    }

    /// The disparity at which the line costs least, and by which part less than at any other
    /// at which it is as wide as a pole may be.
    #[inline(always)]
    fn match_line<S: Simd>(
        &mut self,
        simd: S,
        axis: &Axis,
        chain: &[Link],
        views: &Views<'_>,
    ) -> Option<(f32, f32)> {
        let Self { own, margin, .. } = self;
        let width = axis.width as usize;
        let widest = axis.width + 1.0;
        let baseline = views.rig.baseline_m as f32;
        let most = widest * baseline / WIDTHS_M[0] + views.rig.disparity_offset() as f32;
        let end = (most as usize).saturating_add(NEIGHBOURS).min(views.search.end);
        let start = views.search.start.min(end);
        for costs in [&mut *own, &mut *margin] {
            costs.clear();
            costs.resize(end, 0.0);
        }
        for &Link { band, .. } in chain {
            let first = axis.first(band);
            for x in first - MARGIN as isize..first + (width + MARGIN) as isize {
                let inside = (first..first + width as isize).contains(&x);
                let costs = if inside { &mut *own } else { &mut *margin };
                add_costs(simd, views, band, x, costs);
            }
        }
        let (n, all) = (1.0 / axis.width, 1.0 / (width + 2 * MARGIN) as f32);
        for (own, margin) in own.iter_mut().zip(&*margin) {
            *own = *own * n + MARGIN_WEIGHT * (*own + *margin) * all;
        }
        own[..start].fill(f32::INFINITY);
        let (best, cost) = least(own)?;
        // At an end of the range nothing is known beyond it.
        if best == start || best + 1 == end {
            return None;
        }
        let next = own[..best.saturating_sub(NEIGHBOURS)].iter();
        let next = next.chain(own.iter().skip(best + NEIGHBOURS + 1));
        let next = next.fold(f32::INFINITY, |least, cost| least.min(*cost));
        if next.is_infinite() || cost > MOST_OF_NEXT * next {
            return None;
        }
        let found = refine(axis, chain, views, best as f32);
        Some((found, 1.0 - cost / next))
    }

    /// Fills `sides` with the disparity of what is to the left and to the right in `bands`.
    #[inline(always)]
    fn look_aside<S: Simd>(
        &mut self,
        simd: S,
        axis: &Axis,
        bands: Range<usize>,
        found: f32,
        views: &Views<'_>,
    ) {
        let Self { sides, costs, sums, .. } = self;
        let searched = (found as usize + NEARER + 1).min(views.search.end);
        for (k, side) in sides.iter_mut().enumerate() {
            costs.clear();
            costs.resize(bands.len() * searched, 0.0);
            for (band, costs) in bands.clone().zip(costs.chunks_exact_mut(searched)) {
                let first = axis.first(band);
                let beside = match k {
                    0 => first - 1 - ASIDE,
                    _ => first + axis.width as isize + 1,
                };
                for x in beside..beside + ASIDE {
                    add_costs(simd, views, band, x, costs);
                }
            }
            side.resize(bands.end, 0.0);
            // The sum over the bands around, from the one before.
            sums.clear();
            sums.resize(searched, 0.0);
            let row = |i: isize| i.clamp(0, bands.len() as isize - 1) as usize * searched;
            let reach = BANDS as isize;
            for i in -reach..reach {
                add(sums, &costs[row(i)..][..searched], 1.0);
            }
            for (i, side) in (0..).zip(&mut side[bands.clone()]) {
                add(sums, &costs[row(i + reach)..][..searched], 1.0);
                *side = least(sums).map_or(0.0, |(d, _)| d as f32);
                add(sums, &costs[row(i - reach)..][..searched], -1.0);
            }
        }
    }

    /// Tells in which bands the line is better explained by its own disparity than by what is
    /// beside, which is farther away.
    fn compare(&mut self, axis: &Axis, found: f32, farthest: f32, views: &Views<'_>) {
        let width = axis.width as isize;
        self.shown.clear();
        for band in 0..self.sides[0].len() {
            let first = axis.first(band);
            let [left, right] = views.bands.map(|view| view.row(band));
            let cost = |d: f32| {
                let difference = |x| (sample(left, x as f32) - sample(right, x as f32 - d)).abs();
                (first..first + width).map(difference).sum::<f32>() / width as f32
            };
            let free = self.is_free(band, farthest);
            let shown = free && {
                let beside = cost(self.sides[0][band]).min(cost(self.sides[1][band]));
                cost(found) < MOST_OF_BESIDE * beside - LESS
            };
            self.shown.push(shown);
        }
    }

    fn is_free(&self, band: usize, farthest: f32) -> bool {
        self.sides.iter().all(|side| side[band] < farthest)
    }

    /// The bands of a chain and those beyond its ends that show the line.
    fn extend(&self, Range { mut start, mut end }: Range<usize>) -> Range<usize> {
        let shows = |bands: &mut dyn Iterator<Item = usize>| {
            bands.take(MOST_GAP + 1).find(|band| self.shown[*band])
        };
        while let Some(band) = shows(&mut (0..start).rev()) {
            start = band;
        }
        while let Some(band) = shows(&mut (end..self.shown.len())) {
            end = band + 1;
        }
        start..end
    }

    /// Where the mean profile across the line comes as near to the brightness of what is beside
    /// as [`TOWARDS_OWN`] allows: columns from the axis to its left and its right side.
    fn find_sides(&mut self, axis: &Axis, chain: &[Link], views: &Views<'_>) -> [f32; 2] {
        let half = axis.width / 2.0;
        let reach = ((half + BEYOND) * STEPS) as isize;
        let place = |i: usize| (i as isize - reach) as f32 / STEPS;
        let profile = &mut self.profile;
        profile.clear();
        profile.resize(2 * reach as usize + 1, 0.0);
        for &Link { band, .. } in chain {
            let row = views.bands[0].row(band);
            // The middle of pixel x is at x + 1/2.
            let middle = axis.column(band) - 0.5;
            for (i, sum) in profile.iter_mut().enumerate() {
                *sum += sample(row, middle + place(i));
            }
        }
        let mean = |inside: &dyn Fn(f32) -> bool| {
            let (sum, n) = (0..profile.len())
                .filter(|i| inside(place(*i)))
                .fold((0.0, 0.0), |(sum, n), i| (sum + profile[i], n + 1.0));
            sum / f32::max(n, 1.0)
        };
        let own = mean(&|at| at.abs() <= (half - 1.0).max(0.5));
        let middle = reach as usize;
        let edge = |beside: f32, i: &dyn Fn(usize) -> usize| {
            let inside = |k: &usize| {
                (profile[i(*k)] - own).abs() < TOWARDS_OWN * (profile[i(*k)] - beside).abs()
            };
            let last = (0..=middle).take_while(inside).last().unwrap_or(0);
            place(i((last + 1).min(middle)))
        };
        let left = edge(mean(&|at| at < -half - 1.0), &|k| middle - k) + 0.5 / STEPS;
        let right = edge(mean(&|at| at > half + 1.0), &|k| middle + k) - 0.5 / STEPS;
        [left, right]
    }
}

/// The disparity within a pixel of `found` at which the line and the pixels next to it cost least.
fn refine(axis: &Axis, chain: &[Link], views: &Views<'_>, found: f32) -> f32 {
    let reach = FINER as isize;
    let costs = (-reach..=reach).map(|step| {
        let d = found + step as f32 / FINER;
        let mut cost = 0.0;
        for &Link { band, .. } in chain {
            let [left, right] = views.bands.map(|view| view.row(band));
            let first = axis.first(band);
            for x in first - 1..=first + axis.width as isize {
                let difference = sample(left, x as f32) - sample(right, x as f32 - d);
                cost += difference.abs().min(MOST_COST);
            }
        }
        (d, cost)
    });
    costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(found, |(d, _)| d)
}
