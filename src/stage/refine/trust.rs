//! Confidence from the evidence around a pixel.

use crate::image::Image;
use crate::simd::Simd;
use crate::stage::refine::Area;

/// Pixels from the centre of the window to its edge.
pub const RADIUS: usize = 4;
const SIDE: usize = 2 * RADIUS + 1;

/// Share of wrong disparities where there is no evidence at all.
const WORST: f32 = 1.0 / 3.0;
/// How fast it falls with the mean peak ratio.
const FALL: f32 = 1.0 / 33.0;

/// The window's mean evidence and the confidence that follows from it.
pub struct Trust {
    /// By mean evidence: `1 - exp(-e / 33) / 3`, the share of disparities with an
    /// error of at most max(3 px, 5 %), as found on road and on indoor scenes alike.
    table: [f32; 256],
    /// Sums over the window's rows, with the window's reach on either side.
    columns: Vec<u16>,
}

impl Default for Trust {
    fn default() -> Self {
        let table = std::array::from_fn(|e| 1.0 - WORST * (-(e as f32) * FALL).exp());
        Self { table, columns: Vec::new() }
    }
}

impl Trust {
    /// Writes the confidence of every pixel of `area`, from the mean of `evidence`
    /// over 9x9 pixels; nothing outside the area counts. A single cost curve says
    /// little: that its neighbours are as clear, and none was rejected, says more.
    #[inline(always)]
    pub fn run<S: Simd>(
        &mut self,
        _: S,
        evidence: &Image<u8>,
        area: &Area,
        confidence: &mut Image<f32>,
    ) {
        let (rows, columns) = (&area.rows, &area.columns);
        self.columns.clear();
        self.columns.resize(columns.len() + 2 * RADIUS, 0);
        let row = |y: usize| &evidence.row(y)[columns.clone()];
        for y in rows.start..(rows.start + RADIUS).min(rows.end) {
            add(&mut self.columns, row(y));
        }
        for y in rows.clone() {
            if y + RADIUS < rows.end {
                add(&mut self.columns, row(y + RADIUS));
            }
            if y > rows.start + RADIUS {
                let sums = &mut self.columns[RADIUS..];
                for (sum, &e) in sums.iter_mut().zip(row(y - RADIUS - 1)) {
                    *sum -= e as u16;
                }
            }
            let out = &mut confidence.row_mut(y)[columns.clone()];
            for (out, window) in out.iter_mut().zip(self.columns.windows(SIDE)) {
                // At most 81 * 255, which fits.
                let sum: u16 = window.iter().sum();
                *out = self.table[(sum / (SIDE * SIDE) as u16) as u8 as usize];
            }
        }
    }
}

#[inline(always)]
fn add(columns: &mut [u16], row: &[u8]) {
    for (sum, &e) in columns[RADIUS..].iter_mut().zip(row) {
        *sum += e as u16;
    }
}
