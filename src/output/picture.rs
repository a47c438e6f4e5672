//! Pictures of a perception, for people: RGB images and their PNG or JPEG bytes.
//!
//! Every picture has the size of the processed view. Pixels without a
//! measurement are [`INVALID`], a neutral gray that no colour map contains.

mod canvas;
mod colormap;
mod font;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use thiserror::Error;

pub use canvas::Canvas;
pub use colormap::{Colormap, Scale, track_color};

use crate::image::{Image, Size};
use crate::perception::{Perception, Region};

/// Colour of pixels without a measurement.
pub const INVALID: [u8; 3] = [112, 117, 125];

/// Colour of what is salient in the picture of the region of interest.
pub const SALIENT: [u8; 3] = [255, 170, 40];

/// Colour of the border that is matched, but not salient.
pub const BORDER: [u8; 3] = [60, 150, 255];

/// Why a picture could not be encoded.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The encoder refused it.
    #[error("a picture of {size} cannot be written as {format}: {source}")]
    Encode {
        /// Size of the picture.
        size: Size,
        /// PNG or JPEG.
        format: &'static str,
        /// What the encoder says.
        source: image::ImageError,
    },
}

/// Disparity in colour: near is warm. `scale` in pixels, [`Scale::of_disparity`]
/// for the whole searched range.
pub fn disparity(perception: &Perception, scale: &Scale, out: &mut Image<[u8; 3]>) {
    let table = Colormap::Turbo.table();
    paint(&perception.disparity, out, |d| if d.is_nan() { INVALID } else { table[scale.index(d)] });
}

/// Depth in colour: near is bright. `scale` in metres; too near (-Inf) and
/// beyond range (+Inf) take the two ends, as REP 117 means them.
pub fn depth(perception: &Perception, scale: &Scale, out: &mut Image<[u8; 3]>) {
    let table = Colormap::Viridis.table();
    paint(
        &perception.depth,
        out,
        |z| {
            if z.is_nan() { INVALID } else { table[255 - scale.index(z)] }
        },
    );
}

/// The attention map as heat over the dimmed gray view.
pub fn saliency(perception: &Perception, out: &mut Image<[u8; 3]>) {
    let table = Colormap::Inferno.table();
    paint(&perception.saliency(), out, |s| table[(unit(s) * 255.0) as usize]);
    for (pixel, &gray) in out.pixels_mut().iter_mut().zip(perception.left.gray.pixels()) {
        *pixel = pixel.map(|c| ((u16::from(c) * 3 + u16::from(gray)) / 4) as u8);
    }
}

/// The region of interest over the view: salient pixels keep their light under
/// a warm tint, the matched border is blue, all the rest is dimmed.
pub fn roi(perception: &Perception, out: &mut Image<[u8; 3]>) {
    out.copy_from(&perception.left.rgb);
    let masks = perception.roi.salient.pixels().iter().zip(perception.roi.matched.pixels());
    for (pixel, (&salient, &matched)) in out.pixels_mut().iter_mut().zip(masks) {
        *pixel = if salient != 0 {
            mix(*pixel, SALIENT, 80)
        } else if matched != 0 {
            mix(*pixel, BORDER, 110)
        } else {
            mix(*pixel, [12, 14, 18], 170)
        };
    }
}

/// The regions over the view: tinted masks, contours, boxes, and labels with
/// track id, distance and confidence.
pub fn regions(perception: &Perception, out: &mut Image<[u8; 3]>) {
    out.copy_from(&perception.left.rgb);
    let mut canvas = Canvas::new(out);
    for region in perception.regions.iter() {
        canvas.tint_mask(region, region_color(region), 90);
    }
    // All the lines after all the tints, all the labels after all the lines:
    // what is read must not be covered by a neighbour.
    for region in perception.regions.iter() {
        let color = region_color(region);
        canvas.polygon(&region.contour, color);
        canvas.frame(region, mix(color, [0, 0, 0], 60));
    }
    for region in perception.regions.iter() {
        canvas.label(region, &label_text(region), region_color(region));
    }
}

/// Colour of a region: that of its track, or of its label without tracking.
pub fn region_color(region: &Region) -> [u8; 3] {
    track_color(if region.track_id == 0 { u32::from(region.label) } else { region.track_id })
}

/// `#7 12.4 m 93%`; the parts without a measurement are left out.
pub fn label_text(region: &Region) -> String {
    let id = if region.track_id == 0 { u32::from(region.label) } else { region.track_id };
    let depth = region.median_depth;
    let decimals = if depth < 10.0 { 2 } else { 1 };
    let distance = if depth.is_finite() { format!(" {depth:.decimals$} m") } else { String::new() };
    let share = unit(region.confidence) * 100.0;
    let confidence =
        if region.confidence.is_finite() { format!(" {share:.0}%") } else { String::new() };
    format!("#{id}{distance}{confidence}")
}

/// PNG bytes of a colour picture.
///
/// # Errors
/// When the picture is empty or too large for the format.
pub fn png(picture: &Image<[u8; 3]>) -> Result<Vec<u8>, PictureError> {
    encode_png(picture.pixels().as_flattened(), picture.size(), ExtendedColorType::Rgb8)
}

/// PNG bytes of a gray picture.
///
/// # Errors
/// When the picture is empty or too large for the format.
pub fn png_gray(picture: &Image<u8>) -> Result<Vec<u8>, PictureError> {
    encode_png(picture.pixels(), picture.size(), ExtendedColorType::L8)
}

fn encode_png(
    pixels: &[u8],
    size: Size,
    color: ExtendedColorType,
) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(pixels, size.width as u32, size.height as u32, color)
        .map_err(|source| PictureError::Encode { size, format: "PNG", source })?;
    Ok(bytes)
}

/// JPEG bytes of a colour picture; `quality` from 1 to 100.
///
/// # Errors
/// When the picture is empty or too large for the format.
pub fn jpeg(picture: &Image<[u8; 3]>, quality: u8) -> Result<Vec<u8>, PictureError> {
    encode_jpeg(picture.pixels().as_flattened(), picture.size(), ExtendedColorType::Rgb8, quality)
}

/// JPEG bytes of a gray picture; `quality` from 1 to 100.
///
/// # Errors
/// When the picture is empty or too large for the format.
pub fn jpeg_gray(picture: &Image<u8>, quality: u8) -> Result<Vec<u8>, PictureError> {
    encode_jpeg(picture.pixels(), picture.size(), ExtendedColorType::L8, quality)
}

fn encode_jpeg(
    pixels: &[u8],
    size: Size,
    color: ExtendedColorType,
    quality: u8,
) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality.clamp(1, 100))
        .write_image(pixels, size.width as u32, size.height as u32, color)
        .map_err(|source| PictureError::Encode { size, format: "JPEG", source })?;
    Ok(bytes)
}

fn paint(values: &Image<f32>, out: &mut Image<[u8; 3]>, color: impl Fn(f32) -> [u8; 3]) {
    out.resize(values.size());
    for (pixel, &value) in out.pixels_mut().iter_mut().zip(values.pixels()) {
        *pixel = color(value);
    }
}

/// `value` clamped to 0..=1; 0 for NaN.
fn unit(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

/// `base` with `share`/255 of `color`.
fn mix(base: [u8; 3], color: [u8; 3], share: u8) -> [u8; 3] {
    let share = u32::from(share);
    std::array::from_fn(|i| {
        ((u32::from(base[i]) * (255 - share) + u32::from(color[i]) * share + 127) / 255) as u8
    })
}
