//! YUV to RGB by ITU-R BT.601 with its limited range (16..=235, 16..=240), as
//! OpenCV does.

/// Four bytes for two pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packed {
    /// U Y V Y
    Uyvy,
    /// Y U Y V
    Yuyv,
}

/// A plane of Y and a plane of interleaved chroma.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SemiPlanar {
    /// One U V for 2x2 pixels.
    Nv12,
    /// One V U for 2x2 pixels.
    Nv21,
    /// One U V for every pixel.
    Nv24,
}

impl SemiPlanar {
    /// Bytes of both planes when luma rows are `step` bytes apart.
    pub const fn payload_len(self, step: usize, height: usize) -> usize {
        match self {
            Self::Nv12 | Self::Nv21 => step * height + step * (height / 2),
            Self::Nv24 => 3 * step * height,
        }
    }

    /// The chroma of luma row `y`.
    pub fn chroma_row(self, plane: &[u8], step: usize, y: usize) -> &[u8] {
        match self {
            Self::Nv12 | Self::Nv21 => &plane[(y / 2) * step..][..step],
            Self::Nv24 => &plane[y * 2 * step..][..2 * step],
        }
    }
}

/// One row of packed YUV, two bytes per pixel; `out` has an even length.
pub fn packed_row(row: &[u8], order: Packed, out: &mut [[u8; 3]]) {
    for (pair, &[a, b, c, d]) in out.as_chunks_mut::<2>().0.iter_mut().zip(row.as_chunks::<4>().0) {
        let (u, v, first, second) = match order {
            Packed::Uyvy => (a, c, b, d),
            Packed::Yuyv => (b, d, a, c),
        };
        let chroma = Chroma::new(u, v);
        *pair = [chroma.rgb(first), chroma.rgb(second)];
    }
}

/// One row of luma with its chroma.
pub fn semi_planar_row(luma: &[u8], chroma: &[u8], order: SemiPlanar, out: &mut [[u8; 3]]) {
    let chroma = chroma.as_chunks::<2>().0;
    if order == SemiPlanar::Nv24 {
        for ((pixel, &y), &[u, v]) in out.iter_mut().zip(luma).zip(chroma) {
            *pixel = Chroma::new(u, v).rgb(y);
        }
        return;
    }
    let pairs = out.as_chunks_mut::<2>().0.iter_mut().zip(luma.as_chunks::<2>().0);
    for ((pair, &[first, second]), &[a, b]) in pairs.zip(chroma) {
        let (u, v) = if order == SemiPlanar::Nv12 { (a, b) } else { (b, a) };
        let chroma = Chroma::new(u, v);
        *pair = [chroma.rgb(first), chroma.rgb(second)];
    }
}

/// What chroma adds to red, green and blue, times 256.
struct Chroma([i32; 3]);

impl Chroma {
    fn new(u: u8, v: u8) -> Self {
        let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
        // 1.596 V; -0.392 U - 0.813 V; 2.017 U; and a half for rounding.
        Self([409 * v + 128, -100 * u - 208 * v + 128, 516 * u + 128])
    }

    fn rgb(&self, y: u8) -> [u8; 3] {
        // 1.164 = 255 / 219
        let luma = 298 * (i32::from(y) - 16);
        self.0.map(|chroma| ((luma + chroma) >> 8).clamp(0, 255) as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// BT.601 in floating point.
    fn reference(y: u8, u: u8, v: u8) -> [f64; 3] {
        let (y, u, v) = (
            255.0 / 219.0 * (f64::from(y) - 16.0),
            255.0 / 112.0 * (f64::from(u) - 128.0),
            255.0 / 112.0 * (f64::from(v) - 128.0),
        );
        [y + 0.701 * v, y - 0.886 * 0.114 / 0.587 * u - 0.701 * 0.299 / 0.587 * v, y + 0.886 * u]
            .map(|c| c.clamp(0.0, 255.0))
    }

    #[test]
    fn integers_stay_within_two_grey_levels_of_the_equations() {
        for y in (0..=255).step_by(5) {
            for u in (0..=255).step_by(5) {
                for v in (0..=255).step_by(5) {
                    let ours = Chroma::new(u, v).rgb(y);
                    for (ours, exact) in ours.iter().zip(reference(y, u, v)) {
                        assert!(
                            (f64::from(*ours) - exact).abs() < 2.0,
                            "{y} {u} {v}: {ours} {exact}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn black_and_white_are_exact() {
        assert_eq!(Chroma::new(128, 128).rgb(16), [0; 3]);
        assert_eq!(Chroma::new(128, 128).rgb(235), [255; 3]);
    }

    #[test]
    fn each_pair_of_pixels_has_its_own_chroma() {
        let mut out = [[0; 3]; 4];
        semi_planar_row(&[81, 81, 41, 41], &[90, 240, 240, 110], SemiPlanar::Nv12, &mut out);
        assert!(out[1][0] > 250 && out[1][2] < 5, "{out:?}");
        assert!(out[2][0] < 5 && out[2][2] > 250, "{out:?}");
    }
}
