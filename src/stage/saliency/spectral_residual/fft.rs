//! A Fourier transform of 64x64 values.

use std::f64::consts::PI;

/// Width and height.
pub const SIDE: usize = 64;

/// One real plane.
pub type Plane = [[f32; SIDE]; SIDE];

/// A complex image that is transformed in place, and a plane of scratch.
pub struct Spectrum {
    /// Real part.
    pub re: Box<Plane>,
    /// Imaginary part.
    pub im: Box<Plane>,
    /// Free for use between transforms.
    pub scratch: Box<Plane>,
    /// exp(-2πik/64) for k < 32.
    twiddles: [(f32, f32); SIDE / 2],
}

impl Default for Spectrum {
    fn default() -> Self {
        let plane = || Box::new([[0.0; SIDE]; SIDE]);
        let twiddles = std::array::from_fn(|k| {
            let angle = -2.0 * PI * k as f64 / SIDE as f64;
            (angle.cos() as f32, angle.sin() as f32)
        });
        Self { re: plane(), im: plane(), scratch: plane(), twiddles }
    }
}

impl Spectrum {
    /// From an image to its spectrum, with rows and columns exchanged.
    pub fn forward(&mut self) {
        self.columns(1.0);
        self.transpose();
        self.columns(1.0);
    }

    /// From the spectrum of [`Spectrum::forward`] back to the image.
    pub fn inverse(&mut self) {
        self.columns(-1.0);
        self.transpose();
        self.columns(-1.0);
        let scale = 1.0 / (SIDE * SIDE) as f32;
        for value in self.re.iter_mut().chain(self.im.iter_mut()).flatten() {
            *value *= scale;
        }
    }

    fn transpose(&mut self) {
        for plane in [&mut self.re, &mut self.im] {
            for y in 1..SIDE {
                for x in 0..y {
                    let (upper, lower) = plane.split_at_mut(y);
                    std::mem::swap(&mut upper[x][y], &mut lower[0][x]);
                }
            }
        }
    }

    /// Radix-2 transform of all columns at once (Cooley and Tukey 1965): each
    /// butterfly works on two whole rows, which vectorises.
    fn columns(&mut self, direction: f32) {
        for i in 0..SIDE {
            let j = i.reverse_bits() >> (usize::BITS - SIDE.trailing_zeros());
            if i < j {
                self.re.swap(i, j);
                self.im.swap(i, j);
            }
        }
        let mut half = 1;
        while half < SIDE {
            for start in (0..SIDE).step_by(2 * half) {
                for k in 0..half {
                    let (c, s) = self.twiddles[k * (SIDE / 2) / half];
                    let (i, j) = (start + k, start + k + half);
                    butterfly(&mut self.re, &mut self.im, (i, j), (c, direction * s));
                }
            }
            half *= 2;
        }
    }
}

/// (a, b) becomes (a + t b, a - t b) for the rows a and b.
fn butterfly(re: &mut Plane, im: &mut Plane, rows: (usize, usize), twiddle: (f32, f32)) {
    let ((i, j), (c, s)) = (rows, twiddle);
    let (re_a, re_b) = re.split_at_mut(j);
    let (im_a, im_b) = im.split_at_mut(j);
    let (re_a, re_b, im_a, im_b) = (&mut re_a[i], &mut re_b[0], &mut im_a[i], &mut im_b[0]);
    for x in 0..SIDE {
        let (br, bi) = (re_b[x] * c - im_b[x] * s, re_b[x] * s + im_b[x] * c);
        let (ar, ai) = (re_a[x], im_a[x]);
        (re_a[x], im_a[x]) = (ar + br, ai + bi);
        (re_b[x], im_b[x]) = (ar - br, ai - bi);
    }
}
