//! The quarter-size view: one pixel per cell.

use rayon::prelude::*;

use crate::image::Size;
use crate::perception::View;
use crate::stage::coarse::CELL;
use crate::stage::preprocess::gradient::gradient;

/// Means of `view` over [`CELL`] x [`CELL`] pixels, rounded to nearest. Cells
/// that the image's edge cuts average the pixels they have. The gradient is
/// that of the small gray image.
///
/// A view without colours gives one without colours.
pub fn shrink_view(view: &View, out: &mut View) {
    let size = view.gray.size().divided_by(CELL);
    out.gray.resize(size);
    let width = view.gray.width();
    shrink::<1>(view.gray.pixels(), width, out.gray.pixels_mut(), size.width);
    if view.rgb.size() == view.gray.size() {
        out.rgb.resize(size);
        let rgb = out.rgb.pixels_mut().as_flattened_mut();
        shrink::<3>(view.rgb.pixels().as_flattened(), width, rgb, size.width);
    } else {
        out.rgb.resize(Size::default());
    }
    gradient(&out.gray, &mut out.gradient);
}

/// Pixels summed at once along a row: a stack buffer of this many column sums.
const STRIP: usize = 64 * CELL;

/// Cell means of `C` interleaved channels.
fn shrink<const C: usize>(pixels: &[u8], width: usize, out: &mut [u8], out_width: usize) {
    if pixels.is_empty() || out.is_empty() {
        return;
    }
    let bands = pixels.par_chunks(width * C * CELL);
    bands.zip(out.par_chunks_exact_mut(out_width * C)).with_min_len(16).for_each(|(band, out)| {
        let height = band.len() / (width * C);
        // Column sums first: they run over whole rows and vectorise.
        let mut sums = [0_u16; STRIP * 3];
        for x in (0..width).step_by(STRIP) {
            let columns = STRIP.min(width - x);
            let sums = &mut sums[..columns * C];
            sums.fill(0);
            for row in band.chunks_exact(width * C) {
                for (sum, &value) in sums.iter_mut().zip(&row[x * C..]) {
                    *sum += u16::from(value);
                }
            }
            let cells = out[x / CELL * C..].chunks_exact_mut(C);
            for (cell, sums) in cells.zip(sums.chunks(CELL * C)) {
                let count = (height * sums.len() / C) as u32;
                for (c, value) in cell.iter_mut().enumerate() {
                    let sum: u32 = sums[c..].iter().step_by(C).map(|&s| u32::from(s)).sum();
                    *value = ((sum + count / 2) / count) as u8;
                }
            }
        }
    });
}
