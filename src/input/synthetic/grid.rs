//! Lists of the parts that a parallel light or a camera tile can meet.

use super::part::Part;
use super::shape::{Ray, Span, Vec3};

/// Lists of part numbers per cell of a rectangular raster, stored end to end.
#[derive(Clone, Debug, Default)]
pub struct Raster {
    columns: usize,
    starts: Vec<u32>,
    items: Vec<u16>,
}

/// The cells a part covers, ends included.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// First and last column.
    pub x: (usize, usize),
    /// First and last row.
    pub y: (usize, usize),
}

impl Raster {
    /// The lists for parts covering `cells` (part number, cells), in that order.
    pub fn new(columns: usize, rows: usize, cells: &[(u16, Cells)]) -> Self {
        let each = |visit: &mut dyn FnMut(usize, u16)| {
            for (item, c) in cells {
                for y in c.y.0..=c.y.1 {
                    for x in c.x.0..=c.x.1 {
                        visit(y * columns + x, *item);
                    }
                }
            }
        };
        let mut starts = vec![0_u32; columns * rows + 1];
        each(&mut |cell, _| starts[cell + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut ends = starts.clone();
        let mut items = vec![0; starts[columns * rows] as usize];
        each(&mut |cell, item| {
            items[ends[cell] as usize] = item;
            ends[cell] += 1;
        });
        Self { columns, starts, items }
    }

    /// The parts of a cell.
    pub fn list(&self, x: usize, y: usize) -> &[u16] {
        let cell = y * self.columns + x;
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// The volume in which shadows are cast, and how finely it is divided.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Least and greatest corner.
    pub low: Vec3,
    /// Greatest corner.
    pub high: Vec3,
    /// Size of a cell in metres.
    pub cell: f64,
}

/// What one part covers across the light, and how far towards it it reaches.
#[derive(Clone, Copy, Debug, Default)]
struct Shade {
    x: (f64, f64),
    y: (f64, f64),
    top: f64,
}

impl Shade {
    fn covers(&self, x: f64, y: f64, height: f64) -> bool {
        x >= self.x.0 && x <= self.x.1 && y >= self.y.0 && y <= self.y.1 && height <= self.top
    }
}

/// What can stand in the way of light from one direction: the parts sorted
/// into cells of a plane across that direction.
#[derive(Clone, Debug)]
pub struct ShadowGrid {
    towards: Vec3,
    across: [Vec3; 2],
    origin: [f64; 2],
    cell: f64,
    size: [usize; 2],
    raster: Raster,
    /// By part number.
    shades: Vec<Shade>,
}

impl ShadowGrid {
    /// The grid for light that comes from `towards`.
    pub fn new(parts: &[Part], towards: Vec3, stage: &Stage) -> Self {
        let side = if towards.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
        let u = towards.cross(&side).normalize();
        let across = [u, towards.cross(&u).normalize()];
        let extent = |axis: &Vec3, points: &[Vec3]| {
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                let value = axis.dot(p);
                (low.min(value), high.max(value))
            })
        };
        let corners: [Vec3; 8] = std::array::from_fn(|i| {
            let side =
                |bit: usize, k: usize| if i & bit == 0 { stage.low[k] } else { stage.high[k] };
            Vec3::new(side(1, 0), side(2, 1), side(4, 2))
        });
        let ranges = across.map(|axis| extent(&axis, &corners));
        let size = ranges.map(|(low, high)| ((high - low) / stage.cell).ceil() as usize + 1);
        let origin = ranges.map(|(low, _)| low);
        let mut shades = vec![Shade::default(); parts.len()];
        let mut cells = Vec::new();
        for (index, part) in parts.iter().enumerate().filter(|(_, part)| part.casts) {
            let corners = part.corners();
            let [x, y] = across.map(|axis| extent(&axis, &corners));
            shades[index] = Shade { x, y, top: extent(&towards, &corners).1 };
            let range = |k: usize, (low, high): (f64, f64)| {
                let low = ((low - origin[k]) / stage.cell).floor();
                let high = ((high - origin[k]) / stage.cell).floor();
                let last = size[k] as f64 - 1.0;
                (high >= 0.0 && low <= last)
                    .then(|| (low.max(0.0) as usize, high.min(last) as usize))
            };
            if let (Ok(index), Some(x), Some(y)) = (u16::try_from(index), range(0, x), range(1, y))
            {
                cells.push((index, Cells { x, y }));
            }
        }
        let raster = Raster::new(size[0], size[1], &cells);
        Self { towards, across, origin, cell: stage.cell, size, raster, shades }
    }

    /// True when nothing stands between `point` and the light.
    pub fn is_lit(&self, parts: &[Part], point: Vec3) -> bool {
        let [u, v] = self.across.map(|axis| axis.dot(&point));
        let place = |k: usize, value: f64| {
            let value = (value - self.origin[k]) / self.cell;
            (value >= 0.0 && value < self.size[k] as f64).then_some(value as usize)
        };
        let (Some(x), Some(y)) = (place(0, u), place(1, v)) else { return true };
        let height = self.towards.dot(&point);
        let ray = Ray { origin: point, direction: self.towards };
        let span = Span { near: 1e-4, far: 1e4 };
        self.raster.list(x, y).iter().all(|index| {
            let index = usize::from(*index);
            let shade = &self.shades[index];
            let part = &parts[index];
            !shade.covers(u, v, height)
                || part.shape.meet(&part.pose.local_ray(&ray), span).is_none()
        })
    }
}
