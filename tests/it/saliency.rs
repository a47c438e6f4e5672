//! The attention map against plain references, on odd sizes.

use rayon::ThreadPoolBuilder;
use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::{Config, SaliencyMode, ThresholdMode};
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::View;
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::preprocess::gradient::gradient;
use salient_stereo::stage::preprocess::luma::luma;
use salient_stereo::stage::saliency::color::{Color, Lab};
use salient_stereo::stage::saliency::depth::Depth;
use salient_stereo::stage::saliency::flow::Flow;
use salient_stereo::stage::saliency::integral::{Integral, MAX_RADIUS, MAX_VALUE};
use salient_stereo::stage::saliency::intensity::Intensity;
use salient_stereo::stage::saliency::motion::Motion;
use salient_stereo::stage::saliency::normalize::normalize;
use salient_stereo::stage::saliency::orientation::Orientation;
use salient_stereo::stage::saliency::paper::{LEAST, Paper};
use salient_stereo::stage::saliency::persistence::Persistence;
use salient_stereo::stage::saliency::spectral_residual::{SIDE, Spectrum};
use salient_stereo::stage::saliency::{
    AttentionScene, Cue, Previous, PreviousFrame, Saliency, Scene, shrink_view, upsample,
};
use salient_stereo::stamp::Stamp;

use super::reference::preprocess as plain_view;
use super::reference::saliency as plain;
use super::reference::{Noise, ODD_SIZES};

fn view(rgb: Image<[u8; 3]>) -> View {
    let mut view = View { rgb, ..View::default() };
    luma(simd::detect(), &view.rgb, &mut view.gray);
    gradient(simd::detect(), &view.gray, &mut view.gradient);
    view
}

fn rig(size: Size) -> StereoRig {
    StereoRig::new(
        Camera::pinhole(size, 100.0, 60.0, 40.0, 0.0),
        Camera::pinhole(size, 100.0, 58.0, 40.0, -50.0),
        0.0,
    )
    .unwrap()
}

fn coarse(filled: Image<f32>) -> CoarseDisparity {
    CoarseDisparity { checked: filled.clone(), filled }
}

/// Everything a cue reads, for one frame.
struct World {
    left: View,
    cells: View,
    coarse: CoarseDisparity,
    rig: StereoRig,
    previous: Option<PreviousFrame>,
}

impl World {
    fn new(rgb: Image<[u8; 3]>) -> Self {
        let left = view(rgb);
        let mut cells = View::default();
        shrink_view(simd::detect(), &left, &mut cells);
        let size = left.gray.size();
        let filled = Image::from_fn(size.divided_by(4), |x, y| {
            3.0 + y as f32 * 0.7 + if (4..9).contains(&x) { 17.25 } else { 0.0 }
        });
        Self { left, cells, coarse: coarse(filled), rig: rig(size), previous: None }
    }

    fn noise(size: Size, seed: u64) -> Self {
        // Blocks of colour under noise: contrast at every scale.
        let mut noise = Noise(seed);
        let blocks = noise.rgb(size.divided_by(12));
        Self::new(Image::from_fn(size, |x, y| {
            blocks.get(x / 12, y / 12).map(|value| value / 4 * 3 + noise.next() as u8 / 4)
        }))
    }

    fn scene(&self) -> AttentionScene<'_> {
        AttentionScene {
            stamp: Stamp::default(),
            left: &self.left,
            cells: &self.cells,
            coarse: &self.coarse,
            rig: &self.rig,
            previous: self.previous.as_ref(),
            flow: None,
        }
    }

    fn after(mut self, gray: Image<u8>) -> Self {
        let attention = Image::new(gray.size());
        self.previous = Some(PreviousFrame { gray, attention, ..PreviousFrame::default() });
        self
    }
}

fn map_of(cue: &mut dyn Cue, world: &World) -> Image<f32> {
    let mut out = Image::default();
    cue.conspicuity(&world.scene(), &mut out);
    assert_eq!(out.size(), world.cells.gray.size());
    assert!(out.pixels().iter().all(|v| (0.0..=1.0).contains(v)), "outside 0..=1");
    out
}

fn assert_near(found: &Image<f32>, expected: &Image<f64>, tolerance: f64, what: &str) {
    assert_eq!(found.size(), expected.size(), "{what}");
    for (i, (&a, &b)) in found.pixels().iter().zip(expected.pixels()).enumerate() {
        let (x, y) = (i % found.width(), i / found.width());
        assert!((f64::from(a) - b).abs() <= tolerance, "{what} at ({x}, {y}): {a}, not {b}");
    }
}

const MODES: [SaliencyMode; 4] = [
    SaliencyMode::Paper,
    SaliencyMode::FrequencyTuned,
    SaliencyMode::SpectralResidual,
    SaliencyMode::FullFrame,
];

fn config(mode: SaliencyMode) -> Config {
    let mut config = Config::default();
    config.saliency.mode = mode;
    config
}

/// One frame through a stage: attention per cell, saliency per pixel.
fn run(
    stage: &mut Saliency,
    previous: &mut Previous,
    left: &View,
    coarse: &CoarseDisparity,
) -> (Image<f32>, Image<f32>) {
    let (mut attention, mut saliency) = (Image::default(), Image::default());
    let rig = rig(left.gray.size());
    let scene = Scene { stamp: Stamp::default(), left, coarse, rig: &rig };
    stage.run(&scene, previous, &mut attention);
    upsample(simd::detect(), &attention, left.gray.size(), &mut saliency);
    (attention, saliency)
}

fn first(config: &Config, left: &View, coarse: &CoarseDisparity) -> (Image<f32>, Image<f32>) {
    let mut stage = Saliency::new(config, left.gray.size(), simd::detect());
    run(&mut stage, &mut Previous::default(), left, coarse)
}

#[test]
fn integral_means_equal_means() {
    for size in ODD_SIZES {
        let mut noise = Noise(1);
        let image = Image::from_fn(size, |_, _| noise.next() as u16 % (MAX_VALUE + 1));
        let mut integral = Integral::default();
        integral.take(&image);
        let values = plain::real(&image);
        for radius in [0, 1, 2, 5, 16, MAX_RADIUS, 1000] {
            let mut means = vec![0.0; size.width];
            for y in 0..size.height {
                integral.means(y, radius, &mut means);
                for (x, &mean) in means.iter().enumerate() {
                    let exact = plain::mean(&values, x, y, radius.min(MAX_RADIUS));
                    let close = (f64::from(mean) - exact).abs() <= 1e-6 * exact;
                    assert!(close, "{size}, radius {radius}, ({x}, {y}): {mean}, not {exact}");
                }
            }
        }
    }
}

#[test]
fn a_wrapped_integral_still_gives_exact_sums() {
    let size = Size::new(600, 300);
    let mut integral = Integral::default();
    integral.take(&Image::filled(size, MAX_VALUE));
    let mut means = vec![0.0; size.width];
    integral.means(299, MAX_RADIUS, &mut means);
    assert!(means.iter().all(|&mean| mean == f32::from(MAX_VALUE)), "{means:?}");
}

#[test]
fn the_quarter_size_view_holds_means() {
    for size in ODD_SIZES {
        let left = view(Noise(2).rgb(size));
        let mut cells = View::default();
        shrink_view(simd::detect(), &left, &mut cells);
        let small = size.divided_by(4);
        assert_eq!(cells.gray, plain_view::box_mean(&left.gray, 4, small), "{size}");
        for c in 0..3 {
            let expected = plain_view::box_mean(&plain_view::channel(&left.rgb, c), 4, small);
            assert_eq!(plain_view::channel(&cells.rgb, c), expected, "{size}");
        }
    }
}

#[test]
fn upsampling_interpolates_between_cell_centres() {
    // Rows of fewer cells than a vector has, of as many, and of more.
    let sizes = [1, 2, 61, 64, 67, 72, 131, 331].map(|width| Size::new(width, 23));
    for size in ODD_SIZES.into_iter().chain(sizes) {
        let cells = Noise(3).map(size.divided_by(4));
        let expected = plain::upsample(&cells, size);
        let mut maps = simd::available().into_iter().map(|level| {
            let mut out = Image::default();
            upsample(level, &cells, size, &mut out);
            assert_near(&out, &expected, 1e-6, &format!("upsampling, {size}, {level:?}"));
            out
        });
        let first = maps.next();
        assert!(maps.all(|map| Some(map) == first), "the levels differ, {size}");
    }
}

#[test]
fn lab_by_table_equals_lab_by_formula() {
    let lab = Lab::default();
    for step in 0..32_768 {
        let rgb = [step % 32 * 8 + step / 4681, step / 32 % 32 * 8 + 3, step / 1024 * 8 + 7];
        let rgb = rgb.map(|value| value as u8);
        for (a, b) in lab.of(rgb).into_iter().zip(plain::lab(rgb)) {
            assert!((f64::from(a) - b).abs() < 0.05, "{rgb:?}: {a}, not {b}");
        }
    }
}

#[test]
fn intensity_contrast_is_equation_3() {
    for size in ODD_SIZES {
        let world = World::noise(size, 4);
        let expected = plain::intensity(&world.cells.gray);
        assert_near(&map_of(&mut Intensity::default(), &world), &expected, 1e-5, "C_I");
    }
}

#[test]
fn color_contrast_is_the_distance_from_the_mean_color() {
    for size in ODD_SIZES {
        let world = World::noise(size, 5);
        let expected = plain::color(&world.cells.rgb);
        assert_near(&map_of(&mut Color::new(simd::detect()), &world), &expected, 1e-3, "C_C");
    }
}

#[test]
fn orientation_contrast_is_the_contrast_of_steered_energy() {
    for size in ODD_SIZES {
        let world = World::noise(size, 6);
        let expected = plain::orientation(&world.cells.gray);
        // Energies are whole eighths of a gray level.
        assert_near(&map_of(&mut Orientation::default(), &world), &expected, 2e-3, "C_O");
    }
}

#[test]
fn depth_contrast_is_relative_to_the_nearer_surface() {
    for size in ODD_SIZES {
        let world = World::noise(size, 7);
        let expected = plain::depth(&world.coarse.filled, 2.0);
        // Disparities are in 1/16 px.
        assert_near(&map_of(&mut Depth::default(), &world), &expected, 8e-3, "C_D");
    }
}

#[test]
fn a_moved_patch_raises_motion_there_only() {
    let size = Size::new(160, 96);
    let background = |x: usize, y: usize| (90 + (x / 8 * 5 + y / 8 * 9) % 60) as u8;
    let patch = |at: usize, x: usize, y: usize| (at..at + 24).contains(&x) && (40..64).contains(&y);
    let before =
        Image::from_fn(size, |x, y| [if patch(40, x, y) { 230 } else { background(x, y) }; 3]);
    // The whole picture gets darker as well: that is light, not motion.
    let after = Image::from_fn(size, |x, y| {
        let value = if patch(88, x, y) { 230 } else { background(x, y) };
        [(f32::from(value) * 0.8 + 3.0) as u8; 3]
    });
    let world = World::new(after).after(World::new(before).cells.gray);
    let map = map_of(&mut Motion, &world);
    for y in 0..map.height() {
        for x in 0..map.width() {
            let moved = patch(40, 4 * x, 4 * y) || patch(88, 4 * x, 4 * y);
            let c = map.get(x, y);
            assert!(if moved { c > 0.5 } else { c == 0.0 }, "({x}, {y}): {c}");
        }
    }
}

#[test]
fn there_is_no_motion_without_a_previous_frame_or_in_a_still_scene() {
    let size = Size::new(67, 66);
    let world = World::noise(size, 8);
    assert!(map_of(&mut Motion, &world).pixels().iter().all(|&c| c == 0.0));
    let gray = world.cells.gray.clone();
    let world = World::noise(size, 8).after(gray);
    assert!(map_of(&mut Motion, &world).pixels().iter().all(|&c| c == 0.0));
    // Dark, flat, all black: nothing to fit a gain to.
    let world = World::new(Image::filled(size, [40; 3])).after(Image::new(size.divided_by(4)));
    assert!(map_of(&mut Motion, &world).pixels().iter().all(|&c| c == 0.0));
}

#[test]
fn the_paper_mode_is_equation_4_cue_by_cue() {
    for size in ODD_SIZES {
        let gray = World::noise(size, 10).cells.gray;
        let world = World::noise(size, 9).after(gray);
        let cues: [&mut dyn Cue; 5] = [
            &mut Intensity::default(),
            &mut Color::new(simd::detect()),
            &mut Orientation::default(),
            &mut Depth::default(),
            &mut Motion,
        ];
        let mut sum = Image::filled(world.cells.gray.size(), 0.0);
        for (cue, weight) in cues.into_iter().zip([0.25, 0.20, 0.15, 0.30, 0.10]) {
            let map = map_of(cue, &world);
            for (sum, &c) in sum.pixels_mut().iter_mut().zip(map.pixels()) {
                *sum += weight * f64::from(c);
            }
        }
        let mut out = Image::default();
        Paper::new(&Config::default().saliency.paper, simd::detect()).run(&world.scene(), &mut out);
        let expected = plain::normalize(&sum, f64::from(LEAST));
        assert_near(&out, &expected, 1e-5, "S");
    }
}

#[test]
fn weights_count_relative_to_their_sum_and_zero_switches_a_cue_off() {
    let world = World::noise(Size::new(131, 45), 11);
    let mut weights = Config::default().saliency.paper;
    (weights.color, weights.orientation, weights.depth, weights.motion) = (0.0, 0.0, 0.0, 0.0);
    let (mut one, mut other) = (Image::default(), Image::default());
    weights.intensity = 0.25;
    Paper::new(&weights, simd::detect()).run(&world.scene(), &mut one);
    weights.intensity = 1.0;
    Paper::new(&weights, simd::detect()).run(&world.scene(), &mut other);
    assert_eq!(one, other);
    let mut expected = map_of(&mut Intensity::default(), &world);
    normalize(&mut expected, LEAST);
    assert_eq!(one, expected);
}

#[test]
fn a_map_of_little_range_is_not_stretched() {
    let mut map = Image::from_fn(Size::new(4, 1), |x, _| 0.3 + 0.01 * x as f32);
    normalize(&mut map, 0.1);
    assert!(map.pixels().iter().zip([0.0, 0.1, 0.2, 0.3]).all(|(a, b)| (a - b).abs() < 1e-5));
    let mut map = Image::from_fn(Size::new(3, 1), |x, _| 0.2 + 0.3 * x as f32);
    normalize(&mut map, 0.1);
    assert!(map.pixels().iter().zip([0.0, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 1e-5));
}

#[test]
fn a_constant_image_is_nowhere_salient() {
    for size in ODD_SIZES {
        let flat = coarse(Image::filled(size.divided_by(4), 9.0));
        for value in [0, 100, 255] {
            let left = view(Image::filled(size, [value; 3]));
            for mode in MODES {
                let wanted = if mode == SaliencyMode::FullFrame { 1.0 } else { 0.0 };
                let (attention, saliency) = first(&config(mode), &left, &flat);
                assert_eq!(attention.size(), size.divided_by(4));
                assert_eq!(saliency, Image::filled(size, wanted), "{mode:?}, {size}");
                assert!(attention.pixels().iter().all(|&s| s == wanted), "{mode:?}, {size}");
            }
        }
    }
}

#[test]
fn faint_noise_is_nowhere_salient() {
    let size = Size::new(320, 200);
    let mut noise = Noise(12);
    let left = view(Image::from_fn(size, |_, _| [120 + (noise.next() % 7) as u8; 3]));
    let flat = coarse(Image::filled(size.divided_by(4), 9.0));
    for mode in [SaliencyMode::Paper, SaliencyMode::FrequencyTuned, SaliencyMode::SpectralResidual]
    {
        let (_, saliency) = first(&config(mode), &left, &flat);
        let most = saliency.pixels().iter().copied().fold(0.0, f32::max);
        assert!(most < 0.3, "{mode:?}: {most}");
    }
}

#[test]
fn a_salient_patch_gets_the_maximum() {
    let size = Size::new(320, 200);
    let inside = |x: usize, y: usize| (200..240).contains(&x) && (60..100).contains(&y);
    let mut noise = Noise(13);
    let left = view(Image::from_fn(size, |x, y| {
        let texture = (noise.next() % 16) as u8;
        if inside(x, y) { [240, 190 + texture, 40] } else { [90 + texture, 100 + texture, 95] }
    }));
    let depth =
        coarse(Image::from_fn(
            size.divided_by(4),
            |x, y| {
                if inside(4 * x, 4 * y) { 30.0 } else { 10.0 }
            },
        ));
    for mode in [SaliencyMode::Paper, SaliencyMode::FrequencyTuned, SaliencyMode::SpectralResidual]
    {
        let (_, saliency) = first(&config(mode), &left, &depth);
        let (best, _) =
            saliency.pixels().iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        assert!(inside(best % 320, best / 320), "{mode:?}: {} {}", best % 320, best / 320);
    }
}

#[test]
fn the_fourier_transform_equals_its_sum() {
    let mut noise = Noise(14);
    let mut spectrum = Spectrum::default();
    let values: Vec<Vec<plain::Complex>> =
        (0..SIDE).map(|_| (0..SIDE).map(|_| (f64::from(noise.unit()), 0.0)).collect()).collect();
    for (row, values) in spectrum.re.iter_mut().zip(&values) {
        for (re, &(value, _)) in row.iter_mut().zip(values) {
            *re = value as f32;
        }
    }
    spectrum.forward();
    let expected = plain::fourier(&values, -1.0);
    for (v, row) in expected.iter().enumerate() {
        for (u, &(a, b)) in row.iter().enumerate() {
            // Rows and columns are exchanged.
            let (re, im) = (f64::from(spectrum.re[u][v]), f64::from(spectrum.im[u][v]));
            assert!((re - a).abs() < 2e-3 && (im - b).abs() < 2e-3, "({u}, {v}): {re}+{im}i");
        }
    }
    spectrum.inverse();
    for (row, values) in spectrum.re.iter().zip(&values) {
        for (&re, &(value, _)) in row.iter().zip(values) {
            assert!((f64::from(re) - value).abs() < 1e-5, "{re}, not {value}");
        }
    }
    assert!(spectrum.im.iter().flatten().all(|im| im.abs() < 1e-5));
}

/// Smooth random texture, moved by whole pixels.
fn texture(size: Size, dx: f64, dy: f64) -> Image<u8> {
    let lattice = plain::real(&Noise(20).gray(Size::new(90, 70)));
    Image::from_fn(size, |x, y| {
        let (u, v) = ((x as f64 - dx) / 7.0 + 5.0, (y as f64 - dy) / 7.0 + 5.0);
        plain::bilinear(&lattice, u, v) as u8
    })
}

#[test]
fn flow_points_to_where_things_were() {
    let size = Size::new(200, 140);
    for (dx, dy) in [(0, 0), (3, -2), (-7, 4), (12, 5)] {
        let mut flow = Flow::new(simd::detect());
        flow.run(&texture(size, 0.0, 0.0), &texture(size, f64::from(dx), f64::from(dy)));
        // Away from the edge: the coarsest blocks are 32 pixels wide, and what
        // came into view was not seen before.
        for y in 50..90 {
            for x in 60..140 {
                let found = (flow.dx.get(x, y), flow.dy.get(x, y));
                assert_eq!(found, (-dx as f32, -dy as f32), "({x}, {y})");
                assert!(flow.trust.get(x, y) > 0.9, "({x}, {y})");
            }
        }
    }
}

#[test]
fn what_was_not_seen_before_is_not_trusted() {
    let size = Size::new(120, 72);
    let before = texture(size, 0.0, 0.0);
    let inside = |x: usize, y: usize| (40..72).contains(&x) && (24..48).contains(&y);
    let now = Image::from_fn(size, |x, y| {
        if inside(x, y) { (x / 3 + y / 2) as u8 % 2 * 250 } else { before.get(x, y) }
    });
    let mut flow = Flow::new(simd::detect());
    flow.run(&before, &now);
    assert!(flow.trust.get(56, 36) < 0.1, "{}", flow.trust.get(56, 36));
    assert_eq!((flow.dx.get(12, 60), flow.trust.get(12, 60)), (0.0, 1.0));
}

#[test]
fn flow_of_a_few_pixels_is_none() {
    for size in ODD_SIZES {
        let gray = Noise(19).gray(size);
        let mut flow = Flow::new(simd::detect());
        flow.run(&gray, &gray);
        let still = |map: &Image<f32>| map.pixels().iter().all(|&v| v == 0.0);
        assert!(still(&flow.dx) && still(&flow.dy), "{size}");
        assert_eq!(flow.trust, Image::filled(size, 1.0), "{size}");
    }
}

/// All of it where a cell differs little from what it was, half where much.
fn worth_of_the_past(now: f64, past: f64) -> f64 {
    match (past - now).abs() {
        little if little <= 0.1 => 1.0,
        much if much >= 0.4 => 0.5,
        change => 1.0 - (change - 0.1) / 0.6,
    }
}

#[test]
fn smoothing_blends_with_the_past_along_the_flow_and_a_reset_forgets_it() {
    let size = Size::new(331, 245);
    let mut config = config(SaliencyMode::FrequencyTuned);
    config.saliency.temporal_smoothing = 0.25;
    let world = |at: usize| {
        let gray = texture(size, at as f64, 0.0);
        World::new(Image::from_fn(size, |x, y| [gray.get(x, y), 90, gray.get(x, y) / 2]))
    };
    let (one, two) = (world(0), world(12));
    let (alone, _) = first(&config, &one.left, &one.coarse);
    let (other, _) = first(&config, &two.left, &two.coarse);
    let mut stage = Saliency::new(&config, size, simd::detect());
    let mut previous = Previous::default();
    let (start, _) = run(&mut stage, &mut previous, &one.left, &one.coarse);
    assert_eq!(start, alone);
    let (blend, pixels) = run(&mut stage, &mut previous, &two.left, &two.coarse);
    let mut flow = Flow::new(simd::detect());
    flow.run(&one.cells.gray, &two.cells.gray);
    let before = plain::real(&alone);
    let expected = Image::from_fn(blend.size(), |x, y| {
        let (u, v) = (x as f32 + flow.dx.get(x, y), y as f32 + flow.dy.get(x, y));
        let now = f64::from(other.get(x, y));
        let trust = f64::from(flow.trust.get(x, y));
        let past = plain::bilinear(&before, u.into(), v.into());
        now + 0.25 * trust * worth_of_the_past(now, past) * (past - now)
    });
    assert_near(&blend, &expected, 1e-5, "blend");
    assert_near(&pixels, &plain::upsample(&blend, size), 1e-6, "full-size blend");
    assert!(blend != other, "the past must count");
    previous.clear();
    let (again, _) = run(&mut stage, &mut previous, &two.left, &two.coarse);
    assert_eq!(again, other, "a reset must forget the frame before");
}

#[test]
fn what_was_attended_to_stays_a_little_and_marks_itself() {
    let size = Size::new(37, 23);
    let value = |x: usize, y: usize, k: usize| ((x * 31 + y * 17 + k * 7) % 97) as f32 / 97.0;
    let map = |k: usize| Image::from_fn(size, |x, y| value(x, y, k));
    let attended = Image::from_fn(size, |x, y| f32::from(u8::from(value(x, y, 3) > 0.6)));
    let before =
        PreviousFrame { attention: map(1), attended: attended.clone(), ..PreviousFrame::default() };
    let config = Config::default();
    let share = config.saliency.temporal_smoothing;
    for level in simd::available() {
        let mut flow = Flow::new(level);
        flow.dx = Image::from_fn(size, |x, y| 6.0 * value(x, y, 5) - 3.0);
        flow.dy = Image::from_fn(size, |x, y| 6.0 * value(x, y, 9) - 3.0);
        flow.trust = map(11);
        let mut persistence = Persistence::new(&config, level);
        let (mut out, mut marks) = (map(2), Image::default());
        persistence.smooth(&mut out, &before, &flow);
        let (old, past) = (plain::real(&before.attention), plain::real(&attended));
        let place = |x: usize, y: usize| {
            let at = (x as f32 + flow.dx.get(x, y), y as f32 + flow.dy.get(x, y));
            (f64::from(at.0), f64::from(at.1), f64::from(flow.trust.get(x, y)))
        };
        let smooth = Image::from_fn(size, |x, y| {
            let ((u, v, trust), now) = (place(x, y), f64::from(value(x, y, 2)));
            let past = plain::bilinear(&old, u, v);
            now + share * trust * worth_of_the_past(now, past) * (past - now)
        });
        assert_near(&out, &smooth, 1e-5, "smoothed");
        persistence.stay(&mut out, &mut marks);
        let stayed = Image::from_fn(size, |x, y| {
            let (u, v, trust) = place(x, y);
            let was = plain::bilinear(&past, u, v);
            (smooth.get(x, y) + trust * (0.08 * was - 0.03 * (1.0 - was))).clamp(0.0, 1.0)
        });
        assert_near(&out, &stayed, 1e-5, "stayed");
        let expected = out.pixels().iter().map(|s| f32::from(u8::from(*s >= 0.55)));
        assert!(marks.pixels().iter().copied().eq(expected));
        // A map that has no frame before it is only marked.
        let mut first = map(2);
        persistence.stay(&mut first, &mut marks);
        assert_eq!(first, map(2));
        assert!(marks.pixels().contains(&1.0) && marks.pixels().contains(&0.0));
    }
    // Nothing is marked where the threshold is not known beforehand, or for the paper's maps.
    let mut otsu = Config::default();
    otsu.saliency.threshold_mode = ThresholdMode::Otsu;
    for config in [otsu, self::config(SaliencyMode::Paper)] {
        let mut marks = Image::default();
        Persistence::new(&config, simd::detect()).stay(&mut map(2), &mut marks);
        assert!(marks.pixels().is_empty());
    }
}

#[test]
fn after_a_reset_mode_scene_knows_nothing_of_what_moved() {
    let size = Size::new(331, 245);
    let world = |at: f64| {
        let (rest, moved) = (texture(size, 0.0, 0.0), texture(size, at, 0.0));
        World::new(Image::from_fn(size, |x, y| {
            let inside = (100..200).contains(&x) && (60..180).contains(&y);
            [if inside { &moved } else { &rest }.get(x, y); 3]
        }))
    };
    let (before, after, later) = (world(0.0), world(9.0), world(1.0));
    let config = config(SaliencyMode::Scene);
    let mut used = Saliency::new(&config, size, simd::detect());
    let mut previous = Previous::default();
    run(&mut used, &mut previous, &before.left, &before.coarse);
    let (moving, _) = run(&mut used, &mut previous, &after.left, &after.coarse);
    previous.clear();
    let mut new = Saliency::new(&config, size, simd::detect());
    let mut empty = Previous::default();
    for world in [&after, &after, &later] {
        let found = run(&mut used, &mut previous, &world.left, &world.coarse);
        assert_eq!(found, run(&mut new, &mut empty, &world.left, &world.coarse));
        assert_ne!(found.0, moving);
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let size = Size::new(501, 203);
    let (one, two) = (World::noise(size, 17), World::noise(size, 18));
    for mode in MODES {
        let with = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut stage = Saliency::new(&config(mode), size, simd::detect());
                let mut previous = Previous::default();
                run(&mut stage, &mut previous, &one.left, &one.coarse);
                let (attention, saliency) = run(&mut stage, &mut previous, &two.left, &two.coarse);
                let bits = |map: &Image<f32>| -> Vec<u32> {
                    map.pixels().iter().map(|value| value.to_bits()).collect()
                };
                (bits(&attention), bits(&saliency))
            })
        };
        assert_eq!(with(1), with(2), "{mode:?}");
    }
}
