//! Pictures of perceptions: colours, overlays, bytes.

use std::sync::Arc;

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::image::{Image, Size};
use salient_stereo::output::picture::{self, Colormap, INVALID, Scale};
use salient_stereo::perception::{Perception, Region};

fn perception(width: usize, height: usize) -> Perception {
    let size = Size::new(width, height);
    let camera = |tx| Camera::pinhole(size, 300.0, width as f64 / 2.0, height as f64 / 2.0, tx);
    let rig = StereoRig::new(camera(0.0), camera(-60.0), 0.0).unwrap();
    let mut out = Perception::new(size, Arc::new(rig));
    out.max_disparity = 64.0;
    out
}

fn add_region(out: &mut Perception, [x, y, width, height]: [u32; 4]) {
    let region = out.regions.push_empty();
    *region = Region {
        label: 1,
        track_id: 3,
        x,
        y,
        width,
        height,
        mask: vec![255; (width * height) as usize],
        contour: vec![
            [x as f32, y as f32],
            [(x + width) as f32, y as f32],
            [(x + width) as f32, (y + height) as f32],
            [x as f32, (y + height) as f32],
        ],
        median_depth: 12.34,
        confidence: 0.93,
        ..Region::default()
    };
}

#[test]
fn colour_maps_meet_their_published_ends() {
    // Anchors of the original tables, which the polynomials approximate.
    let within = |tolerance: i32, a: [u8; 3], b: [i32; 3]| {
        let near = a.iter().zip(b).all(|(a, b)| (i32::from(*a) - b).abs() <= tolerance);
        assert!(near, "{a:?} is not {b:?}");
    };
    let viridis = Colormap::Viridis.table();
    within(6, viridis[0], [68, 1, 84]);
    within(6, viridis[128], [33, 145, 140]);
    within(6, viridis[255], [253, 231, 37]);
    let inferno = Colormap::Inferno.table();
    within(6, inferno[0], [0, 0, 4]);
    within(6, inferno[128], [188, 55, 84]);
    within(6, inferno[255], [252, 255, 164]);
    // Turbo's fit is the coarser one, at its ends above all.
    let turbo = Colormap::Turbo.table();
    within(32, turbo[0], [48, 18, 59]);
    within(20, turbo[64], [40, 187, 235]);
    within(20, turbo[128], [164, 252, 60]);
    within(20, turbo[192], [251, 128, 34]);
    within(32, turbo[255], [122, 4, 3]);
}

#[test]
fn no_colour_map_contains_the_colour_of_invalid_pixels() {
    for map in [Colormap::Turbo, Colormap::Viridis, Colormap::Inferno] {
        let nearest = map
            .table()
            .iter()
            .map(|c| c.iter().zip(INVALID).map(|(a, b)| a.abs_diff(b)).max().unwrap())
            .min()
            .unwrap();
        assert!(nearest > 20, "{map:?}: {nearest}");
    }
}

#[test]
fn a_scale_finds_its_values_again() {
    for scale in [Scale::linear(-3.0, 64.0), Scale::logarithmic(0.5, 80.0)] {
        for i in 0..=255 {
            assert_eq!(scale.index(scale.value(i as f32 / 255.0)), i);
        }
        assert_eq!((scale.index(-1e9), scale.index(1e9)), (0, 255));
        assert_eq!((scale.index(f32::NEG_INFINITY), scale.index(f32::INFINITY)), (0, 255));
    }
    // Ranges without extent do not divide by zero.
    assert!(Scale::linear(5.0, 5.0).position(5.0).is_finite());
    assert!(Scale::logarithmic(f32::NAN, f32::NAN).position(5.0).is_finite());
}

#[test]
fn disparity_and_depth_show_holes_and_the_ends_of_the_range() {
    let mut seen = perception(3, 1);
    seen.disparity = Image::from_vec(Size::new(3, 1), vec![f32::NAN, 0.0, 64.0]).unwrap();
    seen.depth =
        Image::from_vec(Size::new(3, 1), vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]).unwrap();
    let mut out = Image::default();
    picture::disparity(&seen, &Scale::of_disparity(&seen), &mut out);
    let turbo = Colormap::Turbo.table();
    assert_eq!(out.pixels(), [INVALID, turbo[0], turbo[255]]);
    picture::depth(&seen, &Scale::logarithmic(0.1, 80.0), &mut out);
    let viridis = Colormap::Viridis.table();
    assert_eq!(out.pixels(), [INVALID, viridis[0], viridis[255]]);
}

#[test]
fn salient_border_and_rest_of_the_roi_differ() {
    let mut seen = perception(3, 1);
    seen.left.rgb.fill([128; 3]);
    seen.roi.salient = Image::from_vec(Size::new(3, 1), vec![255, 0, 0]).unwrap();
    seen.roi.matched = Image::from_vec(Size::new(3, 1), vec![255, 255, 0]).unwrap();
    let mut out = Image::default();
    picture::roi(&seen, &mut out);
    let [salient, border, rest] = [out.get(0, 0), out.get(1, 0), out.get(2, 0)];
    assert!(salient[0] > salient[2], "salient is warm: {salient:?}");
    assert!(border[2] > border[0], "the border is cool: {border:?}");
    assert!(rest.iter().all(|c| *c < 80), "the rest is dim: {rest:?}");
}

type Draw = fn(&Perception, &mut Image<[u8; 3]>);

#[test]
fn every_picture_works_at_any_size_and_with_boxes_over_the_edge() {
    for (width, height) in [(1, 1), (2, 3), (17, 5), (5, 17), (333, 97), (1243, 376)] {
        let mut seen = perception(width, height);
        seen.left.rgb = Image::from_fn(Size::new(width, height), |x, y| [x as u8, y as u8, 90]);
        seen.attention.fill(f32::NAN);
        add_region(&mut seen, [0, 0, width as u32, height as u32]);
        add_region(&mut seen, [width as u32 - 1, height as u32 - 1, 40, 30]);
        add_region(&mut seen, [u32::MAX, u32::MAX, 0, 0]);
        add_region(&mut seen, [0, 0, 3, 3]);
        seen.regions[3].contour = vec![[f32::NAN, 0.0], [f32::INFINITY, 1e9]];
        seen.regions[3].mask.truncate(4); // shorter than the box says
        let draw: [Draw; 5] = [
            picture::regions,
            picture::roi,
            picture::saliency,
            |p, out| picture::disparity(p, &Scale::of_disparity(p), out),
            |p, out| picture::depth(p, &Scale::logarithmic(0.1, 80.0), out),
        ];
        let mut out = Image::default();
        for draw in draw {
            draw(&seen, &mut out);
            assert_eq!(out.size(), Size::new(width, height));
        }
    }
}

#[test]
fn a_label_says_id_distance_and_confidence_and_leaves_out_what_is_unknown() {
    let mut region = Region { label: 2, track_id: 7, ..Region::default() };
    (region.median_depth, region.confidence) = (12.34, 0.934);
    assert_eq!(picture::label_text(&region), "#7 12.3 m 93%");
    region.median_depth = 1.234;
    assert_eq!(picture::label_text(&region), "#7 1.23 m 93%");
    (region.median_depth, region.confidence) = (f32::NAN, f32::NAN);
    assert_eq!(picture::label_text(&region), "#7");
    region.track_id = 0;
    assert_eq!(picture::label_text(&region), "#2");
}

#[test]
fn labels_of_neighbours_do_not_cover_each_other() {
    let mut seen = perception(400, 200);
    add_region(&mut seen, [50, 80, 30, 40]);
    // Without contours: the plates alone have the colour of their track.
    seen.regions[0].contour.clear();
    let mut one = Image::default();
    picture::regions(&seen, &mut one);
    seen.regions[0].track_id = 4;
    add_region(&mut seen, [90, 80, 30, 40]);
    seen.regions[1].contour.clear();
    let mut two = Image::default();
    picture::regions(&seen, &mut two);
    let count = |image: &Image<[u8; 3]>, id| {
        let color = picture::track_color(id);
        image.pixels().iter().filter(|p| **p == color).count()
    };
    assert_eq!(count(&one, 3), count(&two, 3), "the one is whole");
    assert!(count(&two, 4) * 10 > count(&two, 3) * 8, "and so is the other");
}

#[test]
fn encoded_pictures_decode_to_what_was_drawn() {
    let size = Size::new(31, 17);
    let drawn = Image::from_fn(size, |x, y| [(x * 8) as u8, (y * 15) as u8, 60]);
    let png = image::load_from_memory(&picture::png(&drawn).unwrap()).unwrap().to_rgb8();
    assert_eq!(png.as_raw().as_slice(), drawn.pixels().as_flattened());
    let jpeg = image::load_from_memory(&picture::jpeg(&drawn, 90).unwrap()).unwrap().to_rgb8();
    assert_eq!(jpeg.dimensions(), (31, 17));
    let gray = picture::jpeg_gray(&Image::filled(size, 100), 90).unwrap();
    assert_eq!(image::load_from_memory(&gray).unwrap().to_luma8().get_pixel(3, 3).0, [100]);
    assert!(picture::jpeg(&Image::new(Size::new(70_000, 1)), 90).is_err(), "too wide for JPEG");
}
