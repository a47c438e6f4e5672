//! Regions of things that stand on the ground, from the fine disparity.

mod paint;
mod post;
mod shrink;

use super::RegionSource;
use super::candidates::Candidates;
use super::runs::run;
use super::trim::{NARROW_M, Trim};
use crate::image::Image;
use crate::perception::Rejections;
use crate::simd::Level;
use crate::stage::ground::Plane;
use crate::stage::roi::bits::BitMask;
use crate::stage::standing::{HIGH, Standing, Things, WIDE, size_scale};
use paint::Painter;
use post::{Posts, Stump};
use shrink::shrink;

/// Share of a thing's cells that must be salient.
const LEAST_SALIENT: f32 = 0.3;
/// The former of such regions, with its buffers.
#[derive(Debug)]
pub struct Upright {
    level: Level,
    standing: Standing,
    things: Things,
    painter: Painter,
    posts: Posts,
    cells: Image<f32>,
    /// The cells whose disparity is a fine one.
    fine: BitMask,
    salient: Vec<u32>,
    number: Vec<u32>,
}

impl Upright {
    /// The former with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            standing: Standing::new(level),
            things: Things::default(),
            painter: Painter::new(level),
            posts: Posts::default(),
            cells: Image::default(),
            fine: BitMask::default(),
            salient: Vec::new(),
            number: Vec::new(),
        }
    }

    /// Candidates for regions on `plane`, of things of at least `min_area`
    /// pixels; those that are refused here are counted.
    pub fn run(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        min_area: usize,
        out: &mut Candidates,
        rejections: &mut Rejections,
    ) {
        shrink(self.level, source, &mut self.cells, &mut self.fine);
        let least_cells = (min_area / (WIDE * HIGH)).max(1) as u32;
        self.standing.run(&self.cells, plane, source.rig, least_cells, &mut self.things);
        let count = self.choose(&source.roi.salient);
        self.painter.run(plane, source, (&self.things, &self.fine), count, out);
        self.trim(plane, source, out);
        self.follow(plane, source, out);
        rejections.floating = self.things.floating;
        rejections.background = self.things.background;
        rejections.not_salient = (self.things.list.len() - count) as u32;
    }

    /// Numbers the things that are salient; returns how many.
    fn choose(&mut self, salient: &Image<u8>) -> usize {
        self.salient.clear();
        self.salient.resize(self.things.list.len(), 0);
        self.number.clear();
        self.number.resize(self.things.list.len(), 0);
        for cy in 0..self.things.ids.height() {
            let pixels = salient.row((cy * HIGH + HIGH / 2).min(salient.height() - 1));
            let row = self.things.ids.row(cy);
            let mut next = 0;
            while let Some((id, cells)) = run(row, next) {
                next = cells.end;
                self.number[id as usize - 1] += cells.len() as u32;
                // The right pixel of a cell, where there is one.
                let pixels = &pixels[cells.start * WIDE..(cells.end * WIDE).min(pixels.len())];
                let (pairs, cut) = pixels.as_chunks::<WIDE>();
                let salient: u32 = pairs.iter().map(|pair| u32::from(pair[WIDE / 2] != 0)).sum();
                let cut = cut.last().is_some_and(|pixel| *pixel != 0);
                self.salient[id as usize - 1] += salient + u32::from(cut);
            }
        }
        let mut count = 0;
        for (number, &salient) in self.number.iter_mut().zip(&self.salient) {
            let chosen = salient as f32 >= LEAST_SALIENT * *number as f32 && salient > 0;
            count += u32::from(chosen);
            *number = if chosen { count } else { 0 };
        }
        if count as usize == self.number.len() {
            return self.number.len();
        }
        for cy in 0..self.things.ids.height() {
            let row = self.things.ids.row_mut(cy);
            let mut next = 0;
            while let Some((id, cells)) = run(row, next) {
                next = cells.end;
                row[cells].fill(self.number[id as usize - 1]);
            }
        }
        count as usize
    }

    /// Cuts narrow things at the edges that the image shows.
    fn trim(&self, plane: &Plane, source: &RegionSource<'_>, out: &mut Candidates) {
        let narrow = NARROW_M * size_scale(plane);
        for (thing, &id) in self.things.list.iter().zip(&self.number).filter(|(_, id)| **id != 0) {
            let bounds = &out.boxes[id as usize - 1];
            let depth = thing.depth_m[0].midpoint(thing.depth_m[1]);
            let focal = source.rig.focal_px() as f32;
            if bounds.area == 0 || bounds.width() as f32 * depth > narrow * focal {
                continue;
            }
            let surface = source.rig.depth_scale() as f32 / depth;
            let trim = Trim { left: source.left, disparity: source.disparity, surface };
            trim.run(self.level, id, out);
        }
    }

    /// Follows what may be posts up to their ends.
    fn follow(&mut self, plane: &Plane, source: &RegionSource<'_>, out: &mut Candidates) {
        for (thing, &id) in self.things.list.iter().zip(&self.number).filter(|(_, id)| **id != 0) {
            let depth = thing.depth_m[0].midpoint(thing.depth_m[1]);
            let stump = Stump {
                left: source.left,
                plane,
                disparity: source.rig.depth_scale() as f32 / depth,
                metre_px: source.rig.focal_px() as f32 / depth,
            };
            self.posts.run(&stump, id, out);
        }
    }
}
