//! What stands on the ground of a street.

use salient_stereo::image::Image;
use salient_stereo::simd;
use salient_stereo::stage::ground::Ground;
use salient_stereo::stage::standing::{self, Standing, Things};

use super::scene::{BASELINE, F, HEIGHT, HORIZON, SIZE, rig, street, view};

/// An upright street as the former of regions sees it.
fn upright(boxes: &[[f64; 5]]) -> Image<f32> {
    view(0.0, boxes, standing::cells(SIZE), standing::centre)
}

/// What stands on the street.
fn things(disparity: &Image<f32>) -> Things {
    let rig = rig();
    let mut ground = Ground::default();
    ground.run(&street(0.0, &[]), &rig);
    let plane = *ground.plane().expect("a street has a ground");
    let mut things = Things::default();
    Standing::new(simd::detect()).run(disparity, &plane, &rig, 4, &mut things);
    things
}

#[test]
fn what_is_seen_between_two_things_parts_them() {
    // Two people, 0.3 m between them.
    let people = [[-0.65, -0.15, 0.0, 1.7, 10.0], [0.15, 0.65, 0.0, 1.7, 10.0]];
    let seen = upright(&people);
    assert_eq!(things(&seen).list.len(), 2);
    // What was not measured there may be a part of one thing.
    let people = Image::from_fn(seen.size(), |x, y| {
        let (u, _) = standing::centre(x, y);
        if (u - 320.0).abs() < 0.15 / 10.0 * F as f32 { f32::NAN } else { seen.get(x, y) }
    });
    assert_eq!(things(&people).list.len(), 1);
}

#[test]
fn what_is_seen_on_both_sides_of_something_nearer_is_one() {
    let person = [-0.3, 0.3, 0.0, 1.8, 8.0];
    let left = [-2.0, 0.0, 0.0, 1.5, 10.0];
    let right = |distance| [0.0, 2.0, 0.0, 1.5, distance];
    assert_eq!(things(&upright(&[left, right(10.0), person])).list.len(), 2);
    // Not what is farther away there, or wider apart than a person.
    assert_eq!(things(&upright(&[left, right(10.3), person])).list.len(), 3);
    let van = [-0.8, 0.8, 0.0, 1.8, 8.0];
    assert_eq!(things(&upright(&[left, right(10.0), van])).list.len(), 3);
}

#[test]
fn the_side_of_a_car_that_recedes_is_a_part_of_it() {
    // Seen from behind: its rear at 8 m, its side beside the axis up to 14 m.
    let (side, rear, front) = (1.9, 8.0, 14.0);
    let street = upright(&[[side, 3.5, 0.0, 1.5, rear]]);
    let car = Image::from_fn(street.size(), |x, y| {
        let (u, v) = standing::centre(x, y);
        let z = F * side / (f64::from(u) - 320.0);
        let height = HEIGHT - (f64::from(v) - HORIZON) * z / F;
        if !(rear..front).contains(&z) || !(0.0..1.5).contains(&height) {
            return street.get(x, y);
        }
        // Disparity falls in steps: by too much here, by too little there.
        let wrong = if x % 4 < 2 { 0.13 } else { -0.13 };
        (F * BASELINE / z) as f32 + wrong
    });
    let things = things(&car);
    assert_eq!(things.list.len(), 1, "{:?}", things.list);
    let [near, far] = things.list[0].depth_m;
    assert!(near < rear as f32 + 0.2 && far > front as f32 - 0.7, "{near} {far}");
}

/// A street with surfaces of this height at the right, of which `depth` tells how far
/// away they are in each direction from the axis (lateral metres per metre).
fn receding(height: f64, depth: impl Fn(f64) -> Option<f64>) -> Image<f32> {
    let street = upright(&[]);
    Image::from_fn(street.size(), |x, y| {
        let (u, v) = standing::centre(x, y);
        let z = depth((f64::from(u) - 320.0) / F);
        z.filter(|z| (0.0..height).contains(&(HEIGHT - (f64::from(v) - HORIZON) * z / F)))
            .map_or(street.get(x, y), |z| (F * BASELINE / z) as f32)
    })
}

/// Rear and side of a vehicle whose side is 3.5 m beside the camera, in one direction.
fn vehicle(rear: f64, length: f64, slope: f64) -> Option<f64> {
    let side = 3.5 / slope;
    let seen = slope > 0.0 && slope <= 5.2 / rear && side < rear + length;
    seen.then_some(side.max(rear))
}

#[test]
fn cars_nose_to_tail_are_two_and_a_bus_is_one() {
    // Cars are 4.5 m long, and 0.5 m apart.
    let car = |rear: f64, slope: f64| vehicle(rear, 4.5, slope);
    let one = things(&receding(1.5, |slope| car(20.0, slope))).list;
    assert_eq!(one.len(), 1, "{one:?}");
    let two = things(&receding(1.5, |slope| car(20.0, slope).or_else(|| car(25.0, slope)))).list;
    assert_eq!(two.len(), 2, "{two:?}");
    let far = |i: usize| two[i].depth_m[1];
    assert!(far(0).min(far(1)) < 25.0 && far(0).max(far(1)) > 28.0, "{two:?}");
    // The side of a bus is as deep as two cars, with its rear in view or not.
    for rear in [12.0, 18.0, 25.0] {
        let bus = things(&receding(3.0, |slope| vehicle(rear, 12.0, slope))).list;
        assert_eq!(bus.len(), 1, "{bus:?}");
    }
    let fence = |slope: f64| Some(3.5 / slope).filter(|z| (18.0..30.0).contains(z));
    let fence = things(&receding(1.5, fence)).list;
    assert_eq!(fence.len(), 1, "{fence:?}");
}

#[test]
fn nothing_beside_a_thing_speaks_for_it_far_away_only() {
    for (distance, found) in [(10.0, 0), (30.0, 1)] {
        let seen = upright(&[[-0.9, 0.9, 0.0, 1.5, distance]]);
        let half = 0.9 / distance * F;
        let alone = Image::from_fn(seen.size(), |x, y| {
            let (u, _) = standing::centre(x, y);
            if f64::from(u - 320.0).abs() < half { seen.get(x, y) } else { f32::NAN }
        });
        assert_eq!(things(&alone).list.len(), found, "{distance}");
        assert_eq!(things(&seen).list.len(), 1, "{distance}");
    }
}

#[test]
fn on_the_axis_a_car_is_not_one_with_what_is_far_behind_it() {
    // There what recedes could be at any depth in the next column.
    let cars = [[-1.5, 0.075, 0.0, 1.5, 20.0], [0.0375, 1.6, 0.0, 1.5, 10.0]];
    let list = things(&upright(&cars)).list;
    assert_eq!(list.len(), 2, "{list:?}");
}

#[test]
fn what_stands_is_found_and_what_floats_is_counted() {
    // A car, a pole, and a sign board that nothing carries, far apart.
    let boxes =
        [[-3.5, -1.5, 0.0, 1.5, 9.0], [1.4, 1.7, 0.0, 2.2, 7.0], [4.0, 6.0, 1.4, 2.4, 12.0]];
    let things = things(&upright(&boxes));

    let at = |[left, right, bottom, top, distance]: [f64; 5]| {
        let (x, h) = (left.midpoint(right), bottom.midpoint(top));
        let u = 320.0 + F * x / distance;
        let v = HORIZON + F * (HEIGHT - h) / distance;
        things.ids.get(u as usize / standing::WIDE, v as usize / standing::HIGH)
    };
    let (car, pole) = (at(boxes[0]), at(boxes[1]));
    assert!(car != 0 && pole != 0 && car != pole);
    assert_eq!((at(boxes[2]), things.floating), (0, 1));
    let car = things.list[car as usize - 1];
    assert!((car.lateral_m[0] + 3.5).abs() < 0.2 && (car.lateral_m[1] + 1.5).abs() < 0.2);
    assert!((car.top_m - 1.5).abs() < 0.15 && (car.depth_m[0] - 9.0).abs() < 0.2);
    // The ground itself is none of them.
    assert_eq!(things.ids.get(320 / standing::WIDE, 232 / standing::HIGH), 0);
}

#[test]
fn two_cells_are_a_thing_far_away_and_an_edge_nearby() {
    // A car 44 m away, before what is much farther than the wall.
    let street = upright(&[]);
    let (wall, far) = ((F * BASELINE / 40.0) as f32, 1.5);
    let car = Image::from_fn(street.size(), |x, y| {
        let (u, v) = standing::centre(x, y);
        let height = HEIGHT - (f64::from(v) - HORIZON) * 44.0 / F;
        let inside = (f64::from(u) - 320.0).abs() < 0.9 * F / 44.0 && (0.0..1.3).contains(&height);
        let behind = if street.get(x, y) > wall { street.get(x, y) } else { far };
        if inside { (F * BASELINE / 44.0) as f32 } else { behind }
    });
    let found = things(&car).list;
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0].depth_m[0] - 44.0).abs() < 0.5, "{found:?}");
    // As many cells of a kerb.
    assert!(things(&upright(&[[-0.9, 0.9, 0.0, 0.4, 10.0]])).list.is_empty());
}

#[test]
fn a_sign_on_a_post_that_is_not_seen_is_a_thing_up_to_its_top() {
    let at = |things: &Things, x: f64, height: f64| {
        let (u, v) = (320.0 + F * x / 10.0, HORIZON + F * (HEIGHT - height) / 10.0);
        things.ids.get(u as usize / standing::WIDE, v as usize / standing::HIGH)
    };
    let sign = [1.7, 2.3, 2.0, 2.9, 10.0];
    let found = things(&upright(&[sign]));
    assert_eq!((found.list.len(), found.floating), (1, 0));
    assert_eq!((at(&found, 2.0, 2.1), at(&found, 2.0, 2.8)), (1, 1));
    assert_eq!((at(&found, 2.0, 1.6), at(&found, 1.5, 2.4)), (0, 0));
    // Of one above a van only the lower edge is as low as what is looked for.
    let (high, van) = ([1.7, 2.3, 2.4, 3.2, 10.0], [0.5, 1.5, 0.0, 2.0, 5.0]);
    let found = things(&upright(&[high, van]));
    assert_eq!(found.list.len(), 2, "{:?}", found.list);
    assert_ne!(at(&found, 2.0, 2.5), 0);
    // A far one, of which a row or two of cells are as low as that.
    let far = [1.7, 2.3, 2.35, 2.95, 20.0];
    let found = things(&upright(&[far]));
    assert_eq!((found.list.len(), found.floating), (1, 0));
    // One on a wall just behind it is none, and one that something nearer covers at a side.
    let wall = [-3.0, 6.0, 1.5, 3.5, 10.3];
    assert_eq!(at(&things(&upright(&[sign, wall])), 2.0, 2.3), 0);
    let nearer = [1.2, 1.55, 0.0, 6.0, 8.0];
    assert_eq!(at(&things(&upright(&[sign, nearer])), 2.1, 2.3), 0);
}

#[test]
fn parked_cars_are_two_and_the_house_behind_them_is_none() {
    // Two cars one behind the other, and a house front that goes up out of the picture.
    let boxes =
        [[1.6, 3.4, 0.0, 1.5, 6.0], [1.6, 3.4, 0.0, 1.5, 12.0], [-9.0, 9.0, 0.0, 9.0, 20.0]];
    let things = things(&upright(&boxes));
    let nearest: Vec<_> = things.list.iter().map(|t| t.depth_m[0].round()).collect();
    assert_eq!(nearest, [12.0, 6.0]);
}

#[test]
fn what_goes_on_upward_is_a_trunk_or_a_part_of_a_building() {
    let tall = |wide: f64| things(&upright(&[[-wide / 2.0, wide / 2.0, 0.0, 6.0, 10.0]])).list;
    assert_eq!(tall(1.5).len(), 1);
    assert_eq!(tall(1.9).len(), 0);
}
