//! Semi-global matching as its papers write it: one pixel, one path, one
//! disparity at a time.

use std::collections::HashMap;

use salient_stereo::config::{Config, Fill};
use salient_stereo::image::{Image, Size};
use salient_stereo::stage::coarse::CELL;
use salient_stereo::stage::stereo::block::{Measure, RADIUS};
use salient_stereo::stage::stereo::cost::{Edges, MAX_COST};
use salient_stereo::stage::stereo::engine::{Method, Settings, Views};
use salient_stereo::stage::stereo::plan::{Band, Plan, Run};
use salient_stereo::stage::stereo::{Matches, NO_MATCH};

type Point = (isize, isize);

/// Census of every second pixel of 7x7 against the centre; the quantised
/// gradient in the upper byte.
pub fn descriptor(image: &Image<u8>, x: isize, y: isize) -> u32 {
    let (mut bits, mut k) = (0, 0);
    let at = |dx, dy| i32::from(image.get_clamped(x + dx, y + dy));
    for dy in -3..=3 {
        for dx in -3..=3 {
            if (dx + dy) % 2 != 0 {
                bits |= u32::from(at(dx, dy) > at(0, 0)) << k;
                k += 1;
            }
        }
    }
    let sobel: i32 = [(-1, 1), (0, 2), (1, 1)]
        .map(|(dy, weight)| weight * (at(1, dy) - at(-1, dy)))
        .iter()
        .sum();
    bits | ((sobel.clamp(-63, 63) + 63) as u32 / 4) << 24
}

/// One run of one band.
struct Domain<'a> {
    views: &'a Views<'a>,
    settings: &'a Settings,
    plan: &'a Plan,
    band: &'a Band,
    run: &'a Run,
    /// Descriptor of every left and right pixel that is looked at.
    descriptors: HashMap<(bool, isize, isize), u32>,
    rows: (isize, isize),
}

/// Path costs of one pixel by disparity, and their minimum.
#[derive(Clone)]
struct State {
    costs: HashMap<usize, u8>,
    floor: u8,
}

impl Default for State {
    /// Nothing is known: 255 less 255 is a path that begins with nothing.
    fn default() -> Self {
        Self { costs: HashMap::new(), floor: 255 }
    }
}

impl<'a> Domain<'a> {
    fn new(
        views: &'a Views<'a>,
        settings: &'a Settings,
        plan: &'a Plan,
        band: &'a Band,
        run: &'a Run,
    ) -> Self {
        let height = views.left.height();
        let above = settings.context.min(band.y0);
        let below = settings.context.min(height - band.y1);
        let rows = ((band.y0 - above) as isize, (band.y1 + below) as isize);
        let mut descriptors = HashMap::new();
        let (x0, x1) = (run.x0 as isize, run.x0 as isize + 32 * run.tiles.len() as isize);
        for y in rows.0..rows.1 {
            for x in x0 - run.hi as isize - 40..x1 + 40 {
                descriptors.insert((false, x, y), descriptor(views.left, x, y));
                descriptors.insert((true, x, y), descriptor(views.right, x, y));
            }
        }
        Self { views, settings, plan, band, run, descriptors, rows }
    }

    fn columns(&self) -> (isize, isize) {
        (self.run.x0 as isize, self.run.x0 as isize + 32 * self.run.tiles.len() as isize)
    }

    fn range(&self, x: isize) -> std::ops::Range<usize> {
        let k = (x as usize - self.run.x0) / 32;
        let tile = self.plan.tiles[self.run.tiles.start + k];
        tile.lo..tile.lo + tile.n
    }

    fn cost(&self, x: isize, y: isize, d: usize) -> u8 {
        let a = self.descriptors[&(false, x, y)];
        let b = self.descriptors[&(true, x - d as isize, y)];
        let gradients = ((a >> 24).abs_diff(b >> 24)).min(6);
        (((a ^ b) << 8).count_ones() + gradients) as u8
    }

    fn gray(&self, (x, y): Point) -> u8 {
        self.views.left.get_clamped(x, y)
    }

    /// P1, P2 without an edge, and the least P2 of a pixel.
    fn penalties(&self, (x, y): Point) -> (u8, u8, u8) {
        let y = y.clamp(self.band.y0 as isize, self.band.y1 as isize - 1);
        let q = self.views.weight.map_or(255, |weight| u16::from(weight.get_clamped(x, y)));
        let scaled = |p: u8| ((u16::from(p) * q + 127) / 255) as u8;
        let penalties = self.settings.penalties;
        let parts = if penalties.edges == Edges::Sharp { 10 } else { 4 };
        let least = penalties.p1 + (penalties.p2 - penalties.p1) / parts;
        (scaled(penalties.p1), scaled(penalties.p2), scaled(least))
    }

    /// What is known before the first pixel of a path.
    fn seed(&self, p: Point) -> State {
        let Some(coarse) = self.views.coarse else { return State::default() };
        let mut state = State { costs: HashMap::new(), floor: 0 };
        let c = coarse.get_clamped(p.0 / CELL as isize, p.1 / CELL as isize);
        for d in self.range(p.0) {
            // The coarse disparity to the nearest half pixel.
            let slope = (2.0 * c + 0.5).floor() - 2.0 * d as f32;
            let most = f32::from(self.settings.penalties.p2);
            let cost = if c.is_nan() { 0 } else { slope.abs().min(most) as u8 };
            state.costs.insert(d, cost);
        }
        state
    }

    /// The recursion: L(p, d) from the state at `q`, whose brightness is that at `edge`.
    fn step(&self, p: Point, edge: Point, q: &State) -> State {
        let (p1, p2, least) = self.penalties(p);
        let step = self.gray(p).abs_diff(self.gray(edge));
        let times = if self.settings.penalties.edges == Edges::Sharp { 2 } else { 1 };
        let p2 = p2.saturating_sub(step.saturating_mul(times)).max(least);
        let before = |d: Option<usize>| {
            let cost = d.and_then(|d| q.costs.get(&d)).copied().unwrap_or(255);
            cost.saturating_sub(q.floor).min(p2)
        };
        let mut state = State { costs: HashMap::new(), floor: 255 };
        for d in self.range(p.0) {
            let turn = before(d.checked_sub(1)).min(before(Some(d + 1)));
            let cost = self.cost(p.0, p.1, d) + before(Some(d)).min(turn + p1);
            state.floor = state.floor.min(cost);
            state.costs.insert(d, cost);
        }
        state
    }

    /// All states of the path that moves by `(dx, dy)`.
    fn path(&self, dx: isize, dy: isize) -> HashMap<Point, State> {
        let (x0, x1) = self.columns();
        let rows = match dy {
            0 => (self.band.y0 as isize, self.band.y1 as isize),
            1 => (self.rows.0, self.band.y1 as isize),
            _ => (self.band.y0 as isize, self.rows.1),
        };
        let mut states: HashMap<Point, State> = HashMap::new();
        let mut points: Vec<Point> =
            (rows.0..rows.1).flat_map(|y| (x0..x1).map(move |x| (x, y))).collect();
        if dy < 0 || dx < 0 && dy == 0 {
            points.reverse();
        }
        for p in points {
            let q = (p.0 - dx, p.1 - dy);
            let state = if let Some(state) = states.get(&q) {
                self.step(p, q, state)
            } else if dy == 0 {
                self.step(p, p, &self.seed(p))
            } else if q.1 < rows.0 || q.1 >= rows.1 {
                // The first row has no row before it to measure an edge with, and
                // paths from the sides start from what is seeded beside them.
                let edge = (q.0, p.1);
                let seed =
                    if q.0 < x0 || q.0 >= x1 { State::default() } else { self.seed((q.0, p.1)) };
                self.step(p, edge, &seed)
            } else {
                self.step(p, q, &State::default())
            };
            states.insert(p, state);
        }
        states
    }

    /// Summed costs by pixel and disparity, and what was subtracted.
    fn sums(&self) -> HashMap<Point, (HashMap<usize, u8>, u16)> {
        let (x0, x1) = self.columns();
        let mut sums = HashMap::new();
        let band = (self.band.y0 as isize, self.band.y1 as isize);
        let points = || (band.0..band.1).flat_map(move |y| (x0..x1).map(move |x| (x, y)));
        if let Method::Block(measure) = self.settings.method {
            for p in points() {
                let costs = self.range(p.0).map(|d| (d, self.block(measure, p, d))).collect();
                sums.insert(p, (costs, 0));
            }
            return sums;
        }
        let diagonals = self.settings.method != Method::FourPaths;
        let horizontal = [self.path(1, 0), self.path(-1, 0)];
        let directions =
            if self.settings.method == Method::FivePaths { &[1][..] } else { &[1, -1] };
        let sweeps: Vec<_> = directions
            .iter()
            .map(|&dy| {
                let mut paths = vec![self.path(0, dy)];
                if diagonals {
                    paths.push(self.path(1, dy));
                    paths.push(self.path(-1, dy));
                }
                paths
            })
            .collect();
        for p in points() {
            let mut floors = 0;
            let mut costs: HashMap<usize, u8> = self.range(p.0).map(|d| (d, 0)).collect();
            for path in &horizontal {
                let state = &path[&p];
                floors += u16::from(state.floor);
                for (d, sum) in &mut costs {
                    *sum = sum.saturating_add(state.costs[d] - state.floor);
                }
            }
            for paths in &sweeps {
                let floor = paths.iter().fold(0_u8, |sum, path| sum.saturating_add(path[&p].floor));
                floors += u16::from(floor);
                for (d, sum) in &mut costs {
                    let cost =
                        paths.iter().fold(0_u8, |sum, path| sum.saturating_add(path[&p].costs[d]));
                    *sum = sum.saturating_add(cost - floor);
                }
            }
            sums.insert(p, (costs, floors));
        }
        sums
    }

    fn block(&self, measure: Measure, p: Point, d: usize) -> u8 {
        let (x0, x1) = self.columns();
        let radius = RADIUS as isize;
        let mut sum = 0;
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let x = (p.0 + dx).clamp(x0, x1 - 1);
                let y = (p.1 + dy).clamp(self.rows.0, self.rows.1 - 1);
                sum += u32::from(match measure {
                    Measure::Census => self.cost(x, y, d),
                    Measure::Absolute => {
                        let right = self.views.right.get_clamped(x - d as isize, y);
                        self.gray((x, y)).abs_diff(right).min(MAX_COST)
                    }
                });
            }
        }
        let area = (2 * RADIUS as u32 + 1).pow(2);
        ((8 * sum + area / 2) / area) as u8
    }
}

/// What the engine must find.
pub fn matches(views: &Views<'_>, plan: &Plan, settings: &Settings) -> Matches {
    let size = views.left.size();
    let mut out = Matches {
        left: Image::filled(size, NO_MATCH),
        right: Image::filled(size, NO_MATCH),
        evidence: Image::new(size),
    };
    for band in &plan.bands {
        let shift = u32::from(band.hi - band.lo > 256);
        // Of each right pixel: the least cost and its disparity.
        let mut right: HashMap<Point, (u8, usize)> = HashMap::new();
        for run in &plan.runs[band.runs.clone()] {
            let domain = Domain::new(views, settings, plan, band, run);
            let sums = domain.sums();
            for y in band.y0..band.y1 {
                for x in run.x0..(run.x0 + 32 * run.tiles.len()).min(size.width) {
                    let p = (x as isize, y as isize);
                    let (costs, floors) = &sums[&p];
                    let range = domain.range(p.0);
                    if x >= settings.search.start
                        && views.mask.is_none_or(|mask| mask.get(x, y) != 0)
                        && let Some((d, evidence)) = winner(costs, &range, u32::from(*floors))
                    {
                        out.left.set(x, y, d);
                        out.evidence.set(x, y, evidence);
                    }
                }
                // Tile by tile, and in a tile by growing disparity, as ties go
                // to the first.
                for k in 0..run.tiles.len() {
                    for d in domain.range((run.x0 + 32 * k) as isize) {
                        for lane in 0..32 {
                            let x = run.x0 + 32 * k + lane;
                            if x >= size.width {
                                continue;
                            }
                            let q = (x as isize - d as isize, y as isize);
                            let cost = sums[&(x as isize, y as isize)].0[&d];
                            let best = right.entry(q).or_insert((255, 0));
                            if cost < best.0 {
                                *best = (cost, d);
                            }
                        }
                    }
                }
            }
        }
        for ((x, y), (cost, d)) in right {
            if x >= 0 && cost < 255 {
                let d = (((d - band.lo) >> shift) << shift) + band.lo;
                out.right.set(x as usize, y as usize, (32 * d) as i16);
            }
        }
    }
    out
}

/// Disparity in 1/32 px and evidence.
fn winner(
    costs: &HashMap<usize, u8>,
    range: &std::ops::Range<usize>,
    floors: u32,
) -> Option<(i16, u8)> {
    let best = range.clone().min_by_key(|d| costs[d])?;
    let c0 = costs[&best];
    if c0 == 255 {
        return None;
    }
    let second =
        range.clone().filter(|d| d.abs_diff(best) > 1).map(|d| costs[&d]).min().unwrap_or(255);
    let (first, second) = (u32::from(c0) + floors, u32::from(second) + floors);
    let evidence = (255 * (second - first) / second.max(1)).clamp(1, 255) as u8;
    let cost =
        |d: Option<usize>| d.and_then(|d| costs.get(&d)).copied().map_or(f64::from(c0), f64::from);
    // Beyond an end of the range nothing is known: no offset there.
    let inner = range.start < best && best + 1 < range.end;
    let (a, b) = if inner {
        (cost(best.checked_sub(1)), cost(Some(best + 1)))
    } else {
        (f64::from(c0), f64::from(c0))
    };
    let rise = a.max(b) - f64::from(c0);
    let offset = if rise > 0.0 { (32.0 * (a - b) / (2.0 * rise)).round() } else { 0.0 };
    Some((32 * best as i16 + offset as i16, evidence))
}

/// Left-right check, median, speckle filter, confidence, guided median and fill:
/// disparity in px, NaN where none, and its confidence.
pub fn refined(
    matches: &Matches,
    gray: &Image<u8>,
    matched: &Image<u8>,
    config: &Config,
) -> (Image<f32>, Image<f32>) {
    let size = matches.left.size();
    let checked = Image::from_fn(size, |x, y| {
        let d = matches.left.get(x, y);
        if d == NO_MATCH || matches.evidence.get(x, y) == 0 {
            return NO_MATCH;
        }
        if config.stereo.disp12_max_diff < 0 {
            return d;
        }
        let partner = x as f64 - (f64::from(d) / 32.0 + 0.5).floor();
        if partner < 0.0 {
            return d;
        }
        let right = matches.right.get((partner as usize).min(size.width - 1), y);
        let difference = (f64::from(right) - f64::from(d)).abs() / 32.0;
        // Right disparities of wide ranges are known to two pixels only.
        let blur = if config.stereo.disparity_range > 256 { 1.0 } else { 0.5 };
        if difference <= config.stereo.disp12_max_diff as f64 + blur { d } else { NO_MATCH }
    });
    let smooth = Image::from_fn(size, |x, y| {
        let centre = checked.get(x, y);
        if centre == NO_MATCH {
            return NO_MATCH;
        }
        let mut window = Vec::new();
        for dy in -1..=1 {
            for dx in -1..=1 {
                let (x, y) = (x as isize + dx, y as isize + dy);
                let inside =
                    x >= 0 && y >= 0 && (x as usize) < size.width && (y as usize) < size.height;
                let d = if inside { checked.get(x as usize, y as usize) } else { NO_MATCH };
                window.push(if d == NO_MATCH { centre } else { d });
            }
        }
        window.sort_unstable();
        window[4]
    });
    let trust = |x: usize, y: usize| {
        let (mut sum, mut count) = (0, 0);
        for v in y.saturating_sub(4)..(y + 5).min(size.height) {
            for u in x.saturating_sub(4)..(x + 5).min(size.width) {
                if matched.get(u, v) != 0 {
                    count += 1;
                    if checked.get(u, v) != NO_MATCH {
                        sum += u32::from(matches.evidence.get(u, v));
                    }
                }
            }
        }
        let mean = (sum / count.max(1)) as f32;
        let ratio = config.stereo.uniqueness_ratio as f32;
        let confidence = 1.0 - 0.48 * (-mean * (1.0 / 42.0)).exp();
        let enough = mean >= 255.0 * ratio / (100.0 + ratio);
        (enough && confidence >= config.min_confidence as f32).then_some(confidence)
    };
    let trusted = Image::from_fn(size, |x, y| match trust(x, y) {
        Some(_) => smooth.get(x, y),
        None => NO_MATCH,
    });
    let patches = patches(&trusted, (config.stereo.speckle_range * 32.0) as i32);
    let least = config.stereo.speckle_size as usize;
    let valid = |x: usize, y: usize| trusted.get(x, y) != NO_MATCH && patches.get(x, y) >= least;
    let kept = Image::from_fn(size, |x, y| if valid(x, y) { smooth.get(x, y) } else { NO_MATCH });
    let guided = weighted_median(&weighted_median(&kept, gray, (1, 0)), gray, (0, 1));
    let measured = |x, y| f32::from(guided.get(x, y)) / 32.0;
    let mut disparity = Image::filled(size, f32::NAN);
    let mut confidence = Image::new(size);
    for y in 0..size.height {
        for x in 0..size.width {
            if valid(x, y) {
                disparity.set(x, y, measured(x, y));
                confidence.set(x, y, trust(x, y).unwrap_or(0.0));
            } else if config.stereo.fill == Fill::Roi && matched.get(x, y) != 0 {
                let inside = |&x: &usize| matched.get(x, y) != 0;
                let left = (0..x).rev().take_while(inside).find(|&x| valid(x, y));
                let right = (x + 1..size.width).take_while(inside).find(|&x| valid(x, y));
                let beside = left.into_iter().chain(right).map(|x| measured(x, y));
                if let Some(d) = beside.reduce(f32::min) {
                    disparity.set(x, y, d);
                    confidence.set(x, y, 0.5);
                }
            }
        }
    }
    (disparity, confidence)
}

/// Size of the patch around each pixel, by flooding it.
fn patches(image: &Image<i16>, range: i32) -> Image<usize> {
    let size: Size = image.size();
    let mut out = Image::filled(size, 0_usize);
    for y in 0..size.height {
        for x in 0..size.width {
            if image.get(x, y) == NO_MATCH || out.get(x, y) != 0 {
                continue;
            }
            let mut patch = vec![(x, y)];
            out.set(x, y, 1);
            let mut next = 0;
            while let Some(&(px, py)) = patch.get(next) {
                next += 1;
                let here = i32::from(image.get(px, py));
                for (dx, dy) in [(1_isize, 0_isize), (-1, 0), (0, 1), (0, -1)] {
                    let (qx, qy) = (px as isize + dx, py as isize + dy);
                    if qx < 0 || qy < 0 || qx >= size.width as isize || qy >= size.height as isize {
                        continue;
                    }
                    let q = (qx as usize, qy as usize);
                    let there = image.get(q.0, q.1);
                    if there != NO_MATCH
                        && out.get(q.0, q.1) == 0
                        && (i32::from(there) - here).abs() <= range
                    {
                        out.set(q.0, q.1, 1);
                        patch.push(q);
                    }
                }
            }
            for &(px, py) in &patch {
                out.set(px, py, patch.len());
            }
        }
    }
    out
}

/// The weighted median of five pixels along an axis: each disparity stands as often
/// in a list as its pixel weighs, and of that list the (lower) median is taken.
fn weighted_median(disparity: &Image<i16>, gray: &Image<u8>, axis: (isize, isize)) -> Image<i16> {
    let size = disparity.size();
    Image::from_fn(size, |x, y| {
        if disparity.get(x, y) == NO_MATCH {
            return NO_MATCH;
        }
        let mut list = Vec::new();
        for k in [-4, -2, 0, 2, 4] {
            let u = x.checked_add_signed(k * axis.0).filter(|&u| u < size.width);
            let v = y.checked_add_signed(k * axis.1).filter(|&v| v < size.height);
            let (Some(u), Some(v)) = (u, v) else { continue };
            let difference = gray.get(u, v).abs_diff(gray.get(x, y)).min(32);
            if disparity.get(u, v) != NO_MATCH {
                list.extend(vec![disparity.get(u, v); 32 - usize::from(difference)]);
            }
        }
        list.sort_unstable();
        list[(list.len() - 1) / 2]
    })
}
