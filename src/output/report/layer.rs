//! Indexed pictures that lie over the camera image, whose colours can be
//! changed after they were compressed.
//!
//! A value keeps its colour over all frames of a report, but the range of the
//! values is known only at the end: frames are compressed as indices, and the
//! palette is set when the page is written.

use crate::image::{Image, Size};
use crate::output::picture::{Colormap, INVALID, Scale};

/// Index of pixels outside the region of interest: transparent.
pub const OUTSIDE: u8 = 0;
/// Index of pixels that were matched in vain.
pub const NO_MATCH: u8 = 1;
/// Index of -Inf: nearer than the range.
pub const NEAR: u8 = 254;
/// Index of +Inf: beyond the range.
pub const BEYOND: u8 = 255;
/// Index of the lowest value.
const FIRST: u8 = 2;
/// Steps between the lowest and the highest value.
const STEPS: f32 = (NEAR - 1 - FIRST) as f32;

/// Colour of what is nearer than the range.
pub const NEAR_COLOR: [u8; 3] = [255, 255, 255];
/// Colour of what is beyond the range.
pub const BEYOND_COLOR: [u8; 3] = [24, 26, 44];

/// A compressed PNG with a palette of 256 entries.
#[derive(Clone, Debug)]
pub struct Layer {
    png: Vec<u8>,
}

impl Layer {
    /// Compresses `indices`; palette entry `i` has the opacity `alpha[i]`,
    /// entries beyond the end of `alpha` are opaque.
    pub fn encode(
        indices: &Image<u8>,
        palette: &[[u8; 3]],
        alpha: &[u8],
    ) -> Result<Self, png::EncodingError> {
        let mut png = Vec::new();
        let Size { width, height } = indices.size();
        let mut encoder = png::Encoder::new(&mut png, width as u32, height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(palette.as_flattened());
        encoder.set_trns(alpha);
        encoder.set_compression(png::Compression::Balanced);
        encoder.set_filter(png::Filter::Adaptive);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(indices.pixels())?;
        writer.finish()?;
        Ok(Self { png })
    }

    /// Replaces the palette, when it has the length of the old one.
    pub fn set_palette(&mut self, palette: &[[u8; 3]]) {
        const NAME: &[u8] = b"PLTE";
        let colors = palette.as_flattened();
        let Some(name) = self.png.windows(NAME.len()).position(|four| four == NAME) else { return };
        let end = name + NAME.len() + colors.len();
        let length = name.checked_sub(4).and_then(|at| self.png.get(at..name));
        if length != Some(&(colors.len() as u32).to_be_bytes()[..]) || self.png.len() < end + 4 {
            return;
        }
        self.png[name + NAME.len()..end].copy_from_slice(colors);
        let check = crc32(&self.png[name..end]).to_be_bytes();
        self.png[end..end + 4].copy_from_slice(&check);
    }

    /// The PNG file.
    pub fn bytes(&self) -> &[u8] {
        &self.png
    }
}

/// A compressed map of values.
#[derive(Clone, Debug)]
pub struct ValueLayer {
    /// The picture.
    pub layer: Layer,
    /// What its indices mean; `None` when the map had no finite value.
    pub scale: Option<Scale>,
}

impl ValueLayer {
    /// Compresses `values`, of which `matched` were asked for, each in one of
    /// 252 steps between the 0.5th and the 99.5th percentile. Both images are
    /// read at every `stride`-th pixel.
    pub fn encode(
        values: &Image<f32>,
        matched: &Image<u8>,
        logarithmic: bool,
        stride: usize,
    ) -> Result<Self, png::EncodingError> {
        let size = values.size().divided_by(stride);
        let at = |x: usize, y: usize| (x * stride, y * stride);
        let sampled = Image::from_fn(size, |x, y| {
            let (x, y) = at(x, y);
            values.get(x, y)
        });
        let scale = percentile_scale(sampled.pixels(), logarithmic);
        let indices = Image::from_fn(size, |x, y| {
            let value = sampled.get(x, y);
            let (full_x, full_y) = at(x, y);
            match scale {
                _ if value == f32::INFINITY => BEYOND,
                _ if value == f32::NEG_INFINITY => NEAR,
                Some(scale) if value.is_finite() => {
                    FIRST + (scale.position(value) * STEPS + 0.5) as u8
                }
                _ if matched.get(full_x, full_y) != 0 => NO_MATCH,
                _ => OUTSIDE,
            }
        });
        let layer = Layer::encode(&indices, &[[0; 3]; 256], &[0])?;
        Ok(Self { layer, scale })
    }

    /// Gives every value its colour on the scale `shown`.
    pub fn paint(&mut self, shown: &Scale, colors: Colormap, reversed: bool) {
        let table = colors.table();
        let mut palette = [INVALID; 256];
        if let Some(coded) = &self.scale {
            for index in FIRST..NEAR {
                let value = coded.value(f32::from(index - FIRST) / STEPS);
                let row = shown.index(value);
                palette[usize::from(index)] = table[if reversed { 255 - row } else { row }];
            }
        }
        palette[usize::from(NEAR)] = NEAR_COLOR;
        palette[usize::from(BEYOND)] = BEYOND_COLOR;
        self.layer.set_palette(&palette);
    }
}

fn percentile_scale(values: &[f32], logarithmic: bool) -> Option<Scale> {
    let mut finite: Vec<f32> =
        values.iter().copied().filter(|v| v.is_finite() && (!logarithmic || *v > 0.0)).collect();
    if finite.is_empty() {
        return None;
    }
    let last = finite.len() - 1;
    let low = *finite.select_nth_unstable_by(last / 200, f32::total_cmp).1;
    let high = *finite.select_nth_unstable_by(last - last / 200, f32::total_cmp).1;
    Some(if logarithmic { Scale::logarithmic(low, high) } else { Scale::linear(low, high) })
}

/// CRC-32 of PNG chunks (ISO 3309), bit by bit: palettes are short.
fn crc32(bytes: &[u8]) -> u32 {
    let remainder = bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    });
    !remainder
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(layer: &Layer) -> image::RgbaImage {
        image::load_from_memory(layer.bytes()).unwrap().to_rgba8()
    }

    #[test]
    fn crc_of_the_check_string() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn a_palette_set_late_is_what_decodes() {
        let indices = Image::from_vec(Size::new(3, 1), vec![0, 1, 255]).unwrap();
        let mut layer = Layer::encode(&indices, &[[9; 3]; 256], &[0]).unwrap();
        let mut palette = [[0; 3]; 256];
        palette[1] = [10, 20, 30];
        palette[255] = [40, 50, 60];
        layer.set_palette(&palette);
        let picture = decode(&layer);
        assert_eq!(picture.get_pixel(0, 0).0[3], 0, "transparent");
        assert_eq!(picture.get_pixel(1, 0).0, [10, 20, 30, 255]);
        assert_eq!(picture.get_pixel(2, 0).0, [40, 50, 60, 255]);
        // A palette of another length would not fit: nothing changes.
        layer.set_palette(&[[1; 3]; 3]);
        assert_eq!(decode(&layer), picture);
    }

    #[test]
    fn values_holes_and_ends_are_told_apart() {
        let size = Size::new(6, 1);
        let values = [f32::NAN, f32::NAN, 1.0, 9.0, f32::NEG_INFINITY, f32::INFINITY];
        let values = Image::from_vec(size, values.to_vec()).unwrap();
        let matched = Image::from_vec(size, vec![0, 255, 255, 255, 255, 255]).unwrap();
        let mut map = ValueLayer::encode(&values, &matched, false, 1).unwrap();
        map.paint(&Scale::linear(1.0, 9.0), Colormap::Turbo, false);
        let picture = decode(&map.layer);
        let color = |x| <[u8; 3]>::try_from(&picture.get_pixel(x, 0).0[..3]).unwrap();
        assert_eq!(picture.get_pixel(0, 0).0[3], 0);
        let turbo = Colormap::Turbo.table();
        assert_eq!(
            [color(1), color(2), color(3), color(4), color(5)],
            [INVALID, turbo[0], turbo[255], NEAR_COLOR, BEYOND_COLOR]
        );
    }
}
