//! The quarter-size view: one pixel per cell.

use crate::image::Size;
use crate::perception::View;
use crate::simd::Level;
use crate::stage::coarse::CELL;
use crate::stage::preprocess::luma::spread;
use crate::stage::preprocess::resize::box_mean;

/// Means of `view` over [`CELL`] x [`CELL`] pixels, rounded to nearest. Cells
/// that the image's edge cuts average the pixels they have. Without a gradient.
///
/// A view without colours gives one without colours.
pub fn shrink_view(level: Level, view: &View, out: &mut View) {
    let size = view.gray.size().divided_by(CELL);
    out.gray.resize(size);
    let width = view.gray.width();
    box_mean::<1, CELL>(level, view.gray.pixels(), width, out.gray.pixels_mut(), size.width);
    out.is_gray = view.is_gray;
    if view.is_gray {
        spread(&out.gray, &mut out.rgb);
    } else if view.rgb.size() == view.gray.size() {
        out.rgb.resize(size);
        let rgb = out.rgb.pixels_mut().as_flattened_mut();
        box_mean::<3, CELL>(level, view.rgb.pixels().as_flattened(), width, rgb, size.width);
    } else {
        out.rgb.resize(Size::default());
    }
    // No cue asks for it.
    out.gradient.resize(Size::default());
}
