//! Regions of things on a plane that is looked down upon, from the fine disparity.

use super::RegionSource;
use super::adjoin::Adjoin;
use super::candidates::{Candidates, PixelBox};
use super::components::Components;
use super::part::Part;
use crate::image::Image;
use crate::simd::Level;
use crate::stage::ground::Plane;
use crate::stage::roi::bits::BitMask;
use crate::stage::roi::morphology::Morphology;
use crate::stage::table::RELIEF_PX;

/// Fewest salient pixels with measured relief that are a thing: the 5x5 cells
/// over which attention pools it.
const LEAST_EVIDENCE: u32 = 400;
/// Radius in pixels of the opening and the closing of what is raised.
const OPENING: usize = 1;
const CLOSING: usize = 2;
/// How far from there what is salient but was not measured belongs to a thing, pixels.
const REACH: usize = 20;

/// The former of such regions, with its buffers.
#[derive(Debug)]
pub struct Raised {
    level: Level,
    relief: Image<f32>,
    high: BitMask,
    morphology: Morphology,
    salient: Image<u8>,
    mask: Image<u8>,
    near: Image<u8>,
    /// Per pixel of a box whether it is connected with the box's edge.
    outside: Vec<bool>,
    queue: Vec<u32>,
    evidence: Vec<u32>,
    adjoin: Adjoin,
    part: Part,
}

impl Raised {
    /// The former at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            relief: Image::default(),
            high: BitMask::default(),
            morphology: Morphology::new(level),
            salient: Image::default(),
            mask: Image::default(),
            near: Image::default(),
            outside: Vec::new(),
            queue: Vec::new(),
            evidence: Vec::new(),
            adjoin: Adjoin::default(),
            part: Part::default(),
        }
    }

    /// Candidates for regions off `plane`: connected pixels of one depth
    /// ([`Components`]) inside the region of interest whose disparity exceeds the
    /// plane's by 1.6 px, the salient ones without disparity beside them, and the
    /// holes without disparity that they enclose; what lies
    /// against a larger one belongs to it ([`Adjoin`]), and necks part ([`Part`]).
    /// Returns how many became a part of another one.
    pub fn run(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        components: &mut Components,
        out: &mut Candidates,
    ) -> u32 {
        let size = source.disparity.size();
        self.relief.resize(size);
        source.roi.salient.write(self.level, &mut self.salient);
        source.roi.matched.write(self.level, &mut self.mask);
        for y in 0..size.height {
            let pixels = source.disparity.row(y).iter().zip(self.mask.row(y));
            let row = self.relief.row_mut(y).iter_mut().zip(pixels);
            for (x, (out, (&d, &matched))) in row.enumerate() {
                let relief = d - plane.disparity(x as f32, y as f32);
                *out = if matched != 0 { relief } else { f32::NAN };
            }
        }
        self.high.set_from(self.level, &self.relief, RELIEF_PX);
        self.morphology.open(&mut self.high, OPENING);
        self.morphology.close(&mut self.high, CLOSING);
        self.high.write(self.level, &mut self.mask);
        self.morphology.dilate(&mut self.high, REACH);
        self.high.write(self.level, &mut self.near);
        for y in 0..size.height {
            let known = self.relief.row(y).iter().zip(self.salient.row(y));
            let row = self.mask.row_mut(y).iter_mut().zip(self.near.row(y)).zip(known);
            for ((out, &near), (&relief, &salient)) in row {
                *out |= if relief.is_nan() { near & salient } else { 0 };
            }
        }
        components.run(&self.mask, source.disparity, out);
        self.drop_unmeasured(out);
        for index in 0..out.boxes.len() {
            let bounds = out.boxes[index];
            if bounds.area > 0 {
                let id = index as u32 + 1;
                out.boxes[index].area += self.fill(id, &bounds, source.disparity, &mut out.ids);
            }
        }
        let joined = self.adjoin.run(out);
        for id in 1..=out.boxes.len() as u32 {
            self.part.run(id, out);
        }
        self.drop_unmeasured(out);
        joined
    }

    /// Of what little was measured nothing is known, however large it is.
    fn drop_unmeasured(&mut self, candidates: &mut Candidates) {
        self.weigh(candidates);
        for (bounds, _) in
            candidates.boxes.iter_mut().zip(&self.evidence).filter(|(_, e)| **e < LEAST_EVIDENCE)
        {
            bounds.area = 0;
        }
    }

    /// Counts the salient pixels of each candidate whose relief was measured.
    fn weigh(&mut self, candidates: &Candidates) {
        self.evidence.clear();
        self.evidence.resize(candidates.boxes.len(), 0);
        for y in 0..self.relief.height() {
            let measured = candidates.ids.row(y).iter().zip(self.relief.row(y));
            for ((&id, &relief), &salient) in measured.zip(self.salient.row(y)) {
                if id != 0 && salient != 0 && relief >= RELIEF_PX {
                    self.evidence[id as usize - 1] += 1;
                }
            }
        }
    }

    /// Gives the holes without disparity inside candidate `id` to it; returns
    /// their pixels.
    fn fill(
        &mut self,
        id: u32,
        bounds: &PixelBox,
        disparity: &Image<f32>,
        ids: &mut Image<u32>,
    ) -> usize {
        let (width, height) = (bounds.width(), bounds.height());
        self.outside.clear();
        self.outside.resize(width * height, false);
        self.queue.clear();
        let (outside, queue) = (&mut self.outside, &mut self.queue);
        let mut reach = |x: usize, y: usize, queue: &mut Vec<u32>| {
            let i = y * width + x;
            if !outside[i] && ids.get(bounds.x0 + x, bounds.y0 + y) != id {
                outside[i] = true;
                queue.push(i as u32);
            }
        };
        for x in 0..width {
            reach(x, 0, queue);
            reach(x, height - 1, queue);
        }
        for y in 0..height {
            reach(0, y, queue);
            reach(width - 1, y, queue);
        }
        while let Some(i) = queue.pop() {
            let (x, y) = (i as usize % width, i as usize / width);
            for (x, y) in [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)] {
                if x < width && y < height {
                    reach(x, y, queue);
                }
            }
        }
        let mut filled = 0;
        for y in 0..height {
            let d = &disparity.row(bounds.y0 + y)[bounds.x0..bounds.x1];
            let row = &mut ids.row_mut(bounds.y0 + y)[bounds.x0..bounds.x1];
            let outside = &self.outside[y * width..(y + 1) * width];
            for ((pixel, &d), &outside) in row.iter_mut().zip(d).zip(outside) {
                if !outside && *pixel == 0 && d.is_nan() {
                    *pixel = id;
                    filled += 1;
                }
            }
        }
        filled
    }
}
