//! Band after band through census, paths and winner, on any number of threads.

use std::ops::Range;

use crate::image::Image;
use crate::simd::{Block, LANES, Level, Simd, dispatch};
use crate::stage::per_thread::PerThread;
use crate::stage::stereo::block::{self, Measure};
use crate::stage::stereo::census::Census;
use crate::stage::stereo::cost::Penalties;
use crate::stage::stereo::horizontal::Horizontal;
use crate::stage::stereo::plan::{Band, Plan, Run};
use crate::stage::stereo::vertical::Direction::{Down, Up};
use crate::stage::stereo::vertical::Vertical;
use crate::stage::stereo::volume::{RunShape, Seeds, Volume, Weight};
use crate::stage::stereo::winner::{RightWinner, winners};
use crate::stage::stereo::{Matches, NO_MATCH};

/// What does not change from frame to frame.
#[derive(Clone, Debug)]
pub struct Settings {
    /// P1 and P2.
    pub penalties: Penalties,
    /// How costs are gathered.
    pub method: Method,
    /// Rows above and below a band that its paths come from.
    pub context: usize,
    /// Disparities searched.
    pub search: Range<usize>,
}

/// How costs are gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Along eight paths.
    EightPaths,
    /// Along five paths: all but those from below.
    FivePaths,
    /// Along the four paths parallel to the image axes.
    FourPaths,
    /// Over a block.
    Block(Measure),
}

/// What is matched.
#[derive(Clone, Copy)]
pub struct Views<'a> {
    /// Left gray view.
    pub left: &'a Image<u8>,
    /// Right gray view.
    pub right: &'a Image<u8>,
    /// Only where this is set, if given.
    pub mask: Option<&'a Image<u8>>,
    /// Coarse disparity at which paths start that come from outside.
    pub coarse: Option<&'a Image<f32>>,
    /// 255/w of eq. 6.
    pub weight: Option<&'a Image<u8>>,
}

/// The matcher and its buffers.
pub struct Engine {
    level: Level,
    settings: Settings,
    scratch: PerThread<Scratch>,
}

#[derive(Default)]
struct Scratch {
    left: Census,
    right: Census,
    horizontal: Horizontal,
    vertical: Vertical,
    volume: Volume,
    right_winner: RightWinner,
}

/// Rows of the result, from image row `y0` on.
struct Rows<'a> {
    y0: usize,
    left: &'a mut [i16],
    right: &'a mut [i16],
    evidence: &'a mut [u8],
    width: usize,
}

impl Rows<'_> {
    /// No match anywhere.
    fn clear(&mut self) {
        self.left.fill(NO_MATCH);
        self.right.fill(NO_MATCH);
        self.evidence.fill(0);
    }

    fn split(self, y: usize) -> (Self, Self) {
        let at = (y - self.y0) * self.width;
        let (left, left_rest) = self.left.split_at_mut(at);
        let (right, right_rest) = self.right.split_at_mut(at);
        let (evidence, evidence_rest) = self.evidence.split_at_mut(at);
        let width = self.width;
        (
            Self { y0: self.y0, left, right, evidence, width },
            Self { y0: y, left: left_rest, right: right_rest, evidence: evidence_rest, width },
        )
    }
}

impl Engine {
    /// An engine without buffers: the first frame makes them.
    pub fn new(settings: Settings, level: Level) -> Self {
        Self { level, settings, scratch: PerThread::new() }
    }

    /// Settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Matches what `plan` says. Pixels outside it get [`NO_MATCH`].
    pub fn run(&mut self, views: &Views<'_>, plan: &Plan, out: &mut Matches) {
        let size = views.left.size();
        out.left.resize(size);
        out.right.resize(size);
        out.evidence.resize(size);
        self.scratch.fit(Scratch::default);
        let rows = Rows {
            y0: 0,
            left: out.left.pixels_mut(),
            right: out.right.pixels_mut(),
            evidence: out.evidence.pixels_mut(),
            width: size.width,
        };
        self.bands(views, plan, &plan.bands, rows);
    }

    fn bands(&self, views: &Views<'_>, plan: &Plan, bands: &[Band], mut rows: Rows<'_>) {
        match bands {
            [] => rows.clear(),
            [band] => self.band(views, plan, band, rows),
            _ => {
                let (upper, lower) = bands.split_at(bands.len() / 2);
                let (upper_rows, lower_rows) = rows.split(lower[0].y0);
                rayon::join(
                    || self.bands(views, plan, upper, upper_rows),
                    || self.bands(views, plan, lower, lower_rows),
                );
            }
        }
    }

    /// Matches one band; all of `rows`, above and below it too, are written.
    fn band(&self, views: &Views<'_>, plan: &Plan, band: &Band, mut rows: Rows<'_>) {
        rows.clear();
        let mut scratch = self.scratch.lock();
        let (_, mut rows) = rows.split(band.y0);
        let settings = &self.settings;
        dispatch!(self.level, simd => scratch.band(simd, settings, views, plan, band, &mut rows));
    }
}

impl Scratch {
    #[inline(always)]
    fn band<S: Simd>(
        &mut self,
        simd: S,
        settings: &Settings,
        views: &Views<'_>,
        plan: &Plan,
        band: &Band,
        rows: &mut Rows<'_>,
    ) {
        let width = views.left.width();
        let height = band.y1 - band.y0;
        self.right_winner.reset(width, height, band.lo, band.hi);
        for run in &plan.runs[band.runs.clone()] {
            self.run(simd, settings, views, plan, band, run, rows);
        }
        for (y, out) in rows.right.chunks_exact_mut(width).take(height).enumerate() {
            self.right_winner.finish(y, out);
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "what a run is made from")]
    fn run<S: Simd>(
        &mut self,
        simd: S,
        settings: &Settings,
        views: &Views<'_>,
        plan: &Plan,
        band: &Band,
        run: &Run,
        rows: &mut Rows<'_>,
    ) {
        let size = views.left.size();
        let shape = RunShape {
            tiles: &plan.tiles[run.tiles.clone()],
            rows: band.y1 - band.y0,
            context_above: settings.context.min(band.y0),
            context_below: settings.context.min(size.height - band.y1),
            lo: run.lo,
            hi: run.hi,
            weight: views.weight.map(|image| Weight { image, x0: run.x0, y0: band.y0 }),
        };
        let y0 = band.y0 - shape.context_above;
        let all_rows = shape.context_above + shape.rows + shape.context_below;
        let x0 = run.x0 as isize;
        self.left.run(simd, views.left, x0, shape.width(), y0, all_rows);
        let right_x0 = x0 + 1 - run.hi as isize;
        self.right.run(simd, views.right, right_x0, shape.right_width(), y0, all_rows);
        self.volume.resize(shape.tiles);
        let seeds = views.coarse.map(|coarse| Seeds {
            coarse,
            x0: run.x0,
            y0: band.y0,
            left: 0,
            right: shape.width() - 1,
        });
        let (left, right, seeds) = (&self.left, &self.right, seeds.as_ref());
        let penalties = settings.penalties;
        let volume = &mut self.volume;
        self.right_winner.start(run.x0, &shape);
        let mut finish = Finish {
            views,
            shape: &shape,
            x0: run.x0,
            y0: band.y0,
            first: settings.search.start,
            right: &mut self.right_winner,
            left: &mut *rows.left,
            evidence: &mut *rows.evidence,
        };
        let h = &mut self.horizontal;
        let v = &mut self.vertical;
        match settings.method {
            Method::EightPaths => {
                h.run(simd, &shape, penalties, left, right, seeds, volume);
                v.sweep::<S, true>(simd, Down, &shape, penalties, left, right, seeds, volume, None);
                let finish = Some(&mut finish);
                v.sweep::<S, true>(simd, Up, &shape, penalties, left, right, seeds, volume, finish);
            }
            Method::FivePaths => {
                h.run(simd, &shape, penalties, left, right, seeds, volume);
                let finish = Some(&mut finish);
                v.sweep::<S, true>(
                    simd, Down, &shape, penalties, left, right, seeds, volume, finish,
                );
            }
            Method::FourPaths => {
                h.run(simd, &shape, penalties, left, right, seeds, volume);
                v.sweep::<S, false>(
                    simd, Down, &shape, penalties, left, right, seeds, volume, None,
                );
                let finish = Some(&mut finish);
                v.sweep::<S, false>(
                    simd, Up, &shape, penalties, left, right, seeds, volume, finish,
                );
            }
            Method::Block(measure) => {
                block::run(simd, measure, &shape, left, right, volume);
                for y in 0..shape.rows {
                    for k in 0..shape.tiles.len() {
                        let floors = *volume.floor_mut(k, y);
                        finish.row(simd, k, y, volume.row(k, y), &floors);
                    }
                    finish.vote(simd, y);
                }
            }
        }
    }
}

/// Where finished sums go.
pub struct Finish<'a> {
    views: &'a Views<'a>,
    shape: &'a RunShape<'a>,
    x0: usize,
    y0: usize,
    /// First column with a partner.
    first: usize,
    right: &'a mut RightWinner,
    left: &'a mut [i16],
    evidence: &'a mut [u8],
}

impl Finish<'_> {
    /// Right winners of row `y`, once all its tiles are finished.
    #[inline(always)]
    pub fn vote<S: Simd>(&mut self, simd: S, y: usize) {
        self.right.vote(simd, y);
    }

    /// Takes the sums of row `y` of tile `k`.
    #[inline(always)]
    pub fn row<S: Simd>(
        &mut self,
        simd: S,
        k: usize,
        y: usize,
        costs: &[Block],
        floors: &[u16; LANES],
    ) {
        let width = self.views.left.width();
        let x = self.x0 + k * LANES;
        let inside = (width - x).min(LANES);
        let lo = self.shape.tiles[k].lo;
        self.right.take(simd, k, lo, inside, costs);
        let found = winners(simd, costs, lo, floors);
        let at = y * width + x;
        let left = &mut self.left[at..at + inside];
        let evidence = &mut self.evidence[at..at + inside];
        left.copy_from_slice(&found.disparity[..inside]);
        evidence.copy_from_slice(&found.evidence[..inside]);
        // The first columns have no partner at any disparity.
        let blind = self.first.saturating_sub(x).min(inside);
        left[..blind].fill(NO_MATCH);
        evidence[..blind].fill(0);
        if let Some(mask) = self.views.mask {
            let mask = &mask.row(self.y0 + y)[x..x + inside];
            // Without a branch, so that it becomes vector code.
            for ((d, e), &m) in left.iter_mut().zip(evidence).zip(mask) {
                *d = if m == 0 { NO_MATCH } else { *d };
                *e = if m == 0 { 0 } else { *e };
            }
        }
    }
}
