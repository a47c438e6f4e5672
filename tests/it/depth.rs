//! Depth from disparity: eq. 2 and the special values of REP 117.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::stage::depth::Depth;

const F: f64 = 700.0;
const BASELINE: f64 = 0.5;

fn depth_of(disparities: &[f32]) -> Vec<f32> {
    let size = Size::new(disparities.len(), 1);
    let rig = StereoRig::new(
        Camera::pinhole(size, F, 5.0, 0.0, 0.0),
        Camera::pinhole(size, F, 5.0, 0.0, -F * BASELINE),
        0.0,
    )
    .unwrap();
    let disparity = Image::from_vec(size, disparities.to_vec()).unwrap();
    let mut depth = Image::default();
    Depth::new(&Config::default()).run(&disparity, &rig, &mut depth);
    depth.into_vec()
}

#[test]
fn depth_is_focal_length_times_baseline_over_disparity() {
    for (d, z) in [5.0_f32, 7.0, 35.03125, 350.0].iter().zip(depth_of(&[5.0, 7.0, 35.03125, 350.0]))
    {
        let plain = F * BASELINE / f64::from(*d);
        assert!((f64::from(z) - plain).abs() < 1e-5 * plain, "{d}: {z} instead of {plain}");
    }
}

#[test]
fn limits_and_holes_are_told_apart() {
    // fB = 350: 80 m is 4.375 px, 0.1 m is 3500 px.
    let z = depth_of(&[f32::NAN, 4.3, 0.0, -0.0, -1.0, 3600.0, 4.4, 3499.0]);
    assert!(z[0].is_nan());
    assert_eq!(z[1..5], [f32::INFINITY; 4]);
    assert_eq!(z[5], f32::NEG_INFINITY);
    assert!(z[6].is_finite() && z[7].is_finite());
}

#[test]
fn pixels_in_a_vector_and_behind_it_have_the_same_depth() {
    let values = [f32::NAN, 4.3, 0.0, -1.0, 3600.0, 4.4, 3499.0, 17.25, 350.0];
    // One and a half vectors of each, and a row that no vector fits into.
    for value in values {
        let many = depth_of(&[value; 24]);
        let one = depth_of(&[value])[0];
        assert!(
            many.iter().all(|z| *z == one || (z.is_nan() && one.is_nan())),
            "{value}: {many:?}"
        );
    }
}

#[test]
fn the_bits_of_finite_depths_are_those_whose_depth_is_finite() {
    let limits = |low: f64, high: f64| {
        let mut config = Config::default();
        (config.depth.min, config.depth.max) = (low, high);
        Depth::new(&config)
    };
    for (low, high) in [(0.1, 80.0), (0.0, 80.0), (2.0, 2.5), (0.3, 1e30)] {
        let depth = limits(low, high);
        for scale in [1e-3, 35.0, 387.5, 1e6] {
            let range = depth.finite_bits(scale);
            // All exponents and signs, infinity and NaN, and what is next to the ends.
            let steps = (0..=u16::MAX).map(|upper| u32::from(upper) << 16 | 0x0123);
            let ends = [range.start, range.end].into_iter().flat_map(|end| end - 1..=end + 1);
            for bits in steps.chain(ends).chain([0, f32::INFINITY.to_bits(), 0x8000_0000]) {
                let z = depth.of(f32::from_bits(bits), scale);
                assert_eq!(range.contains(&bits), z.is_finite(), "{bits:#x}: {z}, {low}, {high}");
            }
        }
    }
}
