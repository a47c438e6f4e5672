//! Colour maps from their published formulas, and the scales they are read by.

use crate::perception::Perception;

/// A perceptually ordered colour map of 256 steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colormap {
    /// Turbo: dark blue, green, red. Polynomial of degree 5 by A. Mikhailov and
    /// R. Du, "Turbo, an improved rainbow colormap for visualization" (2019).
    Turbo,
    /// Viridis (S. van der Walt, N. Smith 2015): dark violet, green, yellow.
    /// Polynomial of degree 6 fitted by M. Zucker.
    Viridis,
    /// Inferno (S. van der Walt, N. Smith 2015): black, red, light yellow.
    /// Polynomial of degree 6 fitted by M. Zucker.
    Inferno,
}

type Polynomial<const N: usize> = [[f32; N]; 3];

/// Coefficients by channel, constant term first.
const TURBO: Polynomial<6> = [
    [0.135_721_38, 4.615_392_6, -42.660_32, 132.131_08, -152.942_4, 59.286_38],
    [0.091_402_61, 2.194_188_4, 4.842_966_6, -14.185_033, 4.277_298_6, 2.829_566],
    [0.106_673_3, 12.641_946, -60.582_05, 110.362_77, -89.903_11, 27.348_25],
];
const VIRIDIS: Polynomial<7> = [
    [0.277_727_33, 0.105_093_04, -0.330_861_83, -4.634_230_5, 6.228_27, 4.776_385, -5.435_456],
    [0.005_407_344, 1.404_613_5, 0.214_847_56, -5.799_101, 14.179_933, -13.745_145, 4.645_852_6],
    [0.334_099_8, 1.384_590_2, 0.095_095_16, -19.332_441, 56.690_55, -65.353_03, 26.312_435],
];
const INFERNO: Polynomial<7> = [
    [0.000_218_940_37, 0.106_513_42, 11.602_493, -41.703_995, 77.162_94, -71.319_43, 25.131_126],
    [0.001_651_004_6, 0.563_956_44, -3.972_854, 17.436_4, -33.402_36, 32.626_064, -12.242_669],
    [-0.019_480_899, 3.932_712_3, -15.942_394, 44.354_145, -81.807_31, 73.209_52, -23.070_325],
];

static TURBO_TABLE: [[u8; 3]; 256] = table(&TURBO);
static VIRIDIS_TABLE: [[u8; 3]; 256] = table(&VIRIDIS);
static INFERNO_TABLE: [[u8; 3]; 256] = table(&INFERNO);

const fn table<const N: usize>(polynomial: &Polynomial<N>) -> [[u8; 3]; 256] {
    let mut table = [[0; 3]; 256];
    let mut i = 0;
    while i < 256 {
        let t = i as f32 / 255.0;
        let mut channel = 0;
        while channel < 3 {
            let mut value = 0.0;
            let mut term = N;
            while term > 0 {
                term -= 1;
                value = value * t + polynomial[channel][term];
            }
            // The conversion saturates: the fits overshoot 0..=1 a little.
            table[i][channel] = (value * 255.0 + 0.5) as u8;
            channel += 1;
        }
        i += 1;
    }
    table
}

impl Colormap {
    /// The 256 colours, from low to high.
    pub const fn table(self) -> &'static [[u8; 3]; 256] {
        match self {
            Self::Turbo => &TURBO_TABLE,
            Self::Viridis => &VIRIDIS_TABLE,
            Self::Inferno => &INFERNO_TABLE,
        }
    }
}

/// Which value has which colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    low: f32,
    high: f32,
    logarithmic: bool,
}

impl Scale {
    /// A linear scale; an empty or not finite range is widened to `low..low + 1`.
    pub fn linear(low: f32, high: f32) -> Self {
        let low = if low.is_finite() { low } else { 0.0 };
        let high = if high.is_finite() && high > low { high } else { low + 1.0 };
        Self { low, high, logarithmic: false }
    }

    /// A logarithmic scale for positive values; an empty or not finite range is
    /// widened to a factor of ten.
    pub fn logarithmic(low: f32, high: f32) -> Self {
        let low = if low.is_finite() && low > 1e-6 { low } else { 1e-6 };
        let high = if high.is_finite() && high > low { high } else { low * 10.0 };
        Self { low, high, logarithmic: true }
    }

    /// The searched range of disparities in pixels.
    pub fn of_disparity(perception: &Perception) -> Self {
        Self::linear(perception.min_disparity, perception.max_disparity)
    }

    /// The lowest value.
    pub const fn low(&self) -> f32 {
        self.low
    }

    /// The highest value.
    pub const fn high(&self) -> f32 {
        self.high
    }

    /// Place of `value` on the scale, 0..=1; the ends take what lies beyond.
    pub fn position(&self, value: f32) -> f32 {
        let t = if self.logarithmic {
            (value.max(1e-12) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        super::unit(t)
    }

    /// Row of a colour table for `value`.
    pub fn index(&self, value: f32) -> usize {
        (self.position(value) * 255.0 + 0.5) as usize
    }

    /// The value at a place of the scale, 0..=1.
    pub fn value(&self, position: f32) -> f32 {
        if self.logarithmic {
            self.low * (self.high / self.low).powf(position)
        } else {
            self.low + (self.high - self.low) * position
        }
    }
}

/// A colour for a number: neighbours differ clearly, the same number always
/// has the same colour, and all are about equally light.
///
/// Hues in steps of the golden angle around Oklab (B. Ottosson 2020) at
/// lightness 0.78 and chroma 0.15.
pub fn track_color(id: u32) -> [u8; 3] {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let hue = f64::from(id % 4096) * GOLDEN_ANGLE + 0.35;
    oklab_to_srgb(0.78, 0.15 * hue.cos(), 0.15 * hue.sin())
}

fn oklab_to_srgb(lightness: f64, a: f64, b: f64) -> [u8; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548 * b).powi(3);
    let linear = [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ];
    linear.map(|c| {
        let c = c.clamp(0.0, 1.0);
        let encoded = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    })
}
