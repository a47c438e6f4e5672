//! Masks over time, by hand.

use salient_stereo::image::{Image, Size};
use salient_stereo::metric::{VideoStats, boundary_f};

/// A square of 10x10 pixels, `left` columns from the border.
fn square(left: usize) -> Image<u8> {
    Image::from_fn(Size::new(60, 40), |x, y| {
        u8::from((left..left + 10).contains(&x) && (10..20).contains(&y))
    })
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-12, "{a} is not {b}");
}

#[test]
fn outlines_by_hand() {
    let empty = Image::new(Size::new(60, 40));
    assert_eq!(boundary_f(&square(5), &square(5)), 1.0);
    // One pixel of shift is within reach of a diagonal of 72 pixels.
    assert_eq!(boundary_f(&square(5), &square(6)), 1.0);
    assert_eq!(boundary_f(&square(5), &square(40)), 0.0);
    assert_eq!(boundary_f(&square(5), &empty), 0.0);
    assert_eq!(boundary_f(&empty, &square(5)), 0.0);
    assert_eq!(boundary_f(&empty, &empty), 1.0);
    assert_eq!(boundary_f(&square(5), &Image::new(Size::new(4, 4))), 0.0);
    assert_eq!(boundary_f(&Image::default(), &Image::default()), 1.0);
    // The outline lies on the near side of each edge: 11 columns by 11 rows,
    // 40 pixels. Shifted by four, of the upper and of the lower row seven meet
    // and one lies beside, and of one side the two pixels next to the rows.
    near(boundary_f(&square(5), &square(9)), 18.0 / 40.0);
}

#[test]
fn videos_by_hand() {
    let mut stats = VideoStats::default();
    assert_eq!(stats.total(), None);
    stats.begin_video();
    assert_eq!(stats.total(), None);
    // The first and the last frame do not count.
    for left in [40, 5, 5, 10, 40, 5] {
        stats.add_frame(&square(left), &square(5));
    }
    let mut other = VideoStats::default();
    // Nothing there and nothing found is right.
    other.add_frame(&Image::new(Size::new(9, 9)), &Image::new(Size::new(9, 9)));
    stats.merge(&other);
    let score = stats.total().unwrap();
    // J 1, 1, 1/3, 0 and 1: means 7/12 and 1; shares above 1/2: 1/2 and 1.
    near(score.j_mean, 19.0 / 24.0);
    near(score.j_recall, 0.75);
    near(score.j_decay, (1.0 - 1.0 / 6.0) / 2.0);
    assert!(score.f_mean < 1.0 && score.f_recall == 0.75 && score.f_decay > 0.3);
    assert_eq!((score.warped_iou, score.true_warped_iou), (None, None));

    stats.add_stability(&square(5), &square(10), |_, _| Some((-5.0, 0.0)));
    stats.add_stability(&square(5), &square(10), |_, _| Some((0.0, 0.0)));
    stats.add_true_stability(&square(5), &square(5), |_, _| Some((0.0, 0.0)));
    let score = stats.total().unwrap();
    assert_eq!((score.warped_iou, score.true_warped_iou), (Some(2.0 / 3.0), Some(1.0)));
}
