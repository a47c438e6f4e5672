//! Disparity without holes.

use crate::image::Image;
use crate::stage::coarse::fill_row;

/// Gives every hole (what is not finite) the smaller one of the two nearest
/// disparities in its row, or the only one: what is hidden from one view lies
/// behind. Rows without any disparity become 0.
///
/// So methods that leave holes are compared with those that do not.
pub fn fill(disparity: &mut Image<f32>) {
    for y in 0..disparity.height() {
        let row = disparity.row_mut(y);
        for value in row.iter_mut().filter(|value| !value.is_finite()) {
            *value = f32::NAN;
        }
        if !fill_row(row) {
            row.fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    #[test]
    fn holes_take_the_farther_neighbour() {
        let hole = f32::NAN;
        let rows = [
            [hole, 7.0, hole, f32::INFINITY, 3.0, 4.0],
            [hole; 6],
            [2.0, hole, 6.0, hole, 1.0, hole],
        ];
        let mut disparity = Image::from_vec(Size::new(6, 3), rows.concat()).unwrap();
        fill(&mut disparity);
        assert_eq!(disparity.row(0), [7.0, 7.0, 3.0, 3.0, 3.0, 4.0]);
        assert_eq!(disparity.row(1), [0.0; 6]);
        assert_eq!(disparity.row(2), [2.0, 2.0, 6.0, 1.0, 1.0, 1.0]);
        fill(&mut Image::default());
    }
}
