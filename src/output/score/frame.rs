//! One frame's truth laid over its perception.

use std::collections::BTreeMap;

use crate::camera::StereoRig;
use crate::image::{Image, Size};
use crate::metric::{DisparityScore, PixelScore, RegionScore};
use crate::perception::Perception;

/// How one frame fared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameScore {
    /// Region pixels against object pixels.
    pub pixels: Option<PixelScore>,
    /// Regions matched by mask at IoU ≥ 0.5.
    pub regions: Option<RegionScore>,
    /// Disparity inside the region of interest.
    pub disparity: Option<DisparityScore>,
    /// Matched pairs (index of the region, id of the object).
    pub matched: Vec<(usize, u16)>,
}

/// A mask by its measures.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    /// Index of the region (of regions).
    pub index: usize,
    /// Id of the object (of objects).
    pub id: u16,
    /// Pixels.
    pub area: u64,
    /// Pixels inside the matched region of interest (of objects).
    pub covered: u64,
    /// Tight box: x, y, width, height.
    pub bounds: [u32; 4],
}

impl Shape {
    fn grow(&mut self, x: usize, y: usize) {
        let (x, y) = (x as u32, y as u32);
        let [x0, y0, width, height] = self.bounds;
        self.bounds = if self.area == 0 {
            [x, y, 1, 1]
        } else {
            let (left, top) = (x0.min(x), y0.min(y));
            [left, top, (x0 + width).max(x + 1) - left, (y0 + height).max(y + 1) - top]
        };
        self.area += 1;
    }
}

/// Truth in the size of the views, and what overlaps with what.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub objects: Image<u16>,
    pub disparity: Image<f32>,
    pub regions: Vec<Shape>,
    pub truths: Vec<Shape>,
    /// Pixels shared by (region, object).
    shared: BTreeMap<(usize, usize), u64>,
}

impl Layout {
    /// Lays object ids over the regions' masks; false when the sizes do not fit.
    ///
    /// The masks are those that are published with the regions: a coasted one
    /// has no pixel in the label image, but claims the pixels of its mask.
    pub fn measure(&mut self, objects: &Image<u16>, perception: &Perception) -> bool {
        let size = perception.labels.size();
        let Some(factor) = factor(objects.size(), size) else { return false };
        shrink(objects, factor, size, &mut self.objects);
        self.shared.clear();
        self.regions.clear();
        self.truths.clear();
        let mut truth_of: BTreeMap<u16, usize> = BTreeMap::new();
        for y in 0..size.height {
            let row = self.objects.row(y).iter().zip(perception.roi.matched.row(y));
            for (x, (&id, &matched)) in row.enumerate().filter(|(_, (id, _))| **id != 0) {
                let truth = *truth_of.entry(id).or_insert_with(|| {
                    self.truths.push(Shape { id, ..Shape::default() });
                    self.truths.len() - 1
                });
                self.truths[truth].grow(x, y);
                self.truths[truth].covered += u64::from(matched != 0);
            }
        }
        for (index, region) in perception.regions.iter().enumerate() {
            let bounds = [region.x, region.y, region.width, region.height];
            let mut shape = Shape { index, bounds, ..Shape::default() };
            let rows = region.mask.chunks_exact((region.width as usize).max(1));
            for (y, row) in (region.y as usize..size.height).zip(rows) {
                let left = (region.x as usize).min(size.width);
                for (&id, _) in
                    self.objects.row(y)[left..].iter().zip(row).filter(|(_, m)| **m != 0)
                {
                    shape.area += 1;
                    if let Some(truth) = truth_of.get(&id) {
                        *self.shared.entry((index, *truth)).or_default() += 1;
                    }
                }
            }
            self.regions.push(shape);
        }
        true
    }

    /// Takes over the true disparity; false when the sizes do not fit.
    pub fn fit_disparity(&mut self, truth: &Image<f32>, perception: &Perception) -> bool {
        let size = perception.disparity.size();
        let Some(factor) = factor(truth.size(), size) else { return false };
        shrink(truth, factor, size, &mut self.disparity);
        if factor > 1 {
            self.disparity.pixels_mut().iter_mut().for_each(|d| *d /= factor as f32);
        }
        true
    }

    /// IoU of the masks of a region and an object.
    pub fn mask_iou(&self, region: usize, truth: usize) -> f64 {
        let both = self.shared.get(&(region, truth)).copied().unwrap_or(0);
        let either = self.regions[region].area + self.truths[truth].area - both;
        if either == 0 { 0.0 } else { both as f64 / either as f64 }
    }

    /// Distance of an object: f B over the median of its true disparities, metres.
    pub fn true_distance(&self, object: u16, rig: &StereoRig) -> Option<f64> {
        let pairs = self.objects.pixels().iter().zip(self.disparity.pixels());
        let mut values: Vec<f32> = pairs
            .filter(|(id, d)| **id == object && d.is_finite() && **d > 0.0)
            .map(|(_, d)| *d)
            .collect();
        if values.is_empty() {
            return None;
        }
        let middle = values.len() / 2;
        let (_, median, _) = values.select_nth_unstable_by(middle, f32::total_cmp);
        Some(rig.depth_scale() / f64::from(*median))
    }
}

/// An image of a truth in the size of the views, and by how much they are
/// smaller; `None` when the sizes do not fit.
pub fn shrink_to<T: Copy + Default>(from: &Image<T>, size: Size) -> Option<(Image<T>, usize)> {
    let factor = factor(from.size(), size)?;
    let mut to = Image::default();
    shrink(from, factor, size, &mut to);
    Some((to, factor))
}

/// By how much the views are smaller than the truth: 1, 2 or 4.
fn factor(truth: Size, view: Size) -> Option<usize> {
    if view.is_empty() {
        return None;
    }
    [1, 2, 4].into_iter().find(|f| {
        let floor = Size::new(truth.width / f, truth.height / f);
        view == floor || view == truth.divided_by(*f)
    })
}

/// The pixel in the middle of each cell: ids and disparities at object borders
/// must not be averaged.
fn shrink<T: Copy + Default>(from: &Image<T>, factor: usize, size: Size, to: &mut Image<T>) {
    to.resize(size);
    for y in 0..size.height {
        let row = from.row((y * factor + factor / 2).min(from.height() - 1));
        for (x, out) in to.row_mut(y).iter_mut().enumerate() {
            *out = row[(x * factor + factor / 2).min(row.len() - 1)];
        }
    }
}
