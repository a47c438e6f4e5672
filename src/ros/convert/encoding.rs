//! The image encodings of `sensor_msgs` that can hold a camera's picture.

use super::bayer::Pattern;
use super::yuv;

/// The encodings that [`picture`](super::picture()) reads.
pub const ENCODINGS: [&str; 29] = [
    "mono8",
    "mono16",
    "8UC1",
    "8UC3",
    "8UC4",
    "16UC1",
    "rgb8",
    "bgr8",
    "rgba8",
    "bgra8",
    "rgb16",
    "bgr16",
    "rgba16",
    "bgra16",
    "bayer_rggb8",
    "bayer_bggr8",
    "bayer_gbrg8",
    "bayer_grbg8",
    "bayer_rggb16",
    "bayer_bggr16",
    "bayer_gbrg16",
    "bayer_grbg16",
    "uyvy",
    "yuv422",
    "yuyv",
    "yuv422_yuy2",
    "nv12",
    "nv21",
    "nv24",
];

/// How an encoding lays out its samples, which are `wide` when they have 16 bits.
#[derive(Clone, Copy, Debug)]
pub enum Layout {
    /// One sample.
    Gray { wide: bool },
    /// Three or four samples; `red` is the place of the red one, green is 1.
    Color { wide: bool, channels: usize, red: usize },
    /// One sample of a colour that depends on the place.
    Bayer { wide: bool, pattern: Pattern },
    /// Luma and chroma interleaved.
    Packed(yuv::Packed),
    /// Luma, then chroma.
    SemiPlanar(yuv::SemiPlanar),
}

impl Layout {
    /// The layout of an encoding; `None` when it is not one of [`ENCODINGS`].
    pub fn of(encoding: &str) -> Option<Self> {
        let color = |wide, channels, red| Some(Layout::Color { wide, channels, red });
        match encoding {
            "mono8" | "8UC1" => Some(Layout::Gray { wide: false }),
            "mono16" | "16UC1" => Some(Layout::Gray { wide: true }),
            "rgb8" => color(false, 3, 0),
            "bgr8" | "8UC3" => color(false, 3, 2),
            "rgba8" => color(false, 4, 0),
            "bgra8" | "8UC4" => color(false, 4, 2),
            "rgb16" => color(true, 3, 0),
            "bgr16" => color(true, 3, 2),
            "rgba16" => color(true, 4, 0),
            "bgra16" => color(true, 4, 2),
            "uyvy" | "yuv422" => Some(Layout::Packed(yuv::Packed::Uyvy)),
            "yuyv" | "yuv422_yuy2" => Some(Layout::Packed(yuv::Packed::Yuyv)),
            "nv12" => Some(Layout::SemiPlanar(yuv::SemiPlanar::Nv12)),
            "nv21" => Some(Layout::SemiPlanar(yuv::SemiPlanar::Nv21)),
            "nv24" => Some(Layout::SemiPlanar(yuv::SemiPlanar::Nv24)),
            _ => {
                let name = encoding.strip_prefix("bayer_")?;
                let (name, wide) = match name.strip_suffix("16") {
                    Some(name) => (name, true),
                    None => (name.strip_suffix('8')?, false),
                };
                Some(Layout::Bayer { wide, pattern: Pattern::from_name(name)? })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_encoding_has_a_layout() {
        for encoding in ENCODINGS {
            assert!(Layout::of(encoding).is_some(), "{encoding}");
        }
    }
}
