//! Salient regions as outlines that Foxglove draws over the image.

use crate::output::picture::{label_text, region_color};
use crate::perception::{Perception, Region, TrackState};
use crate::ros::message::builtin_interfaces::Time;
use crate::ros::message::foxglove_msgs::{
    Color, ImageAnnotations, Point2, PointsAnnotation, TextAnnotation,
};

/// Of the outline, in pixels; a prediction is drawn thinner.
const THICKNESS: f64 = 2.0;
const PREDICTED_THICKNESS: f64 = 1.0;
/// How much of the image the filling covers.
const FILLING: f64 = 0.2;
/// Height of the text in pixels, and how dark it is behind it.
const LETTERS: f64 = 14.0;
const SHADE: f64 = 0.6;

/// The contour of each region and a text over its box, for the image of the same
/// stamp: `left/image_rect`.
pub fn annotations(perception: &Perception) -> ImageAnnotations {
    let stamp: Time = perception.stamp.into();
    ImageAnnotations {
        circles: Vec::new(),
        points: perception.regions.iter().map(|region| outline(region, stamp)).collect(),
        texts: perception.regions.iter().map(|region| text(region, stamp)).collect(),
    }
}

fn outline(region: &Region, timestamp: Time) -> PointsAnnotation {
    let predicted = region.track_state == TrackState::Coasted;
    PointsAnnotation {
        timestamp,
        r#type: PointsAnnotation::LINE_LOOP,
        // The contour goes through the middle of pixels.
        points: region.contour.iter().map(|&[x, y]| point(x + 0.5, y + 0.5)).collect(),
        outline_color: color(region, 1.0),
        outline_colors: Vec::new(),
        fill_color: color(region, if predicted { 0.0 } else { FILLING }),
        thickness: if predicted { PREDICTED_THICKNESS } else { THICKNESS },
    }
}

fn text(region: &Region, timestamp: Time) -> TextAnnotation {
    TextAnnotation {
        timestamp,
        // Above the box; below its upper edge where there is no room.
        position: point(region.x as f32, (region.y as f32).max(LETTERS as f32)),
        text: label_text(region),
        font_size: LETTERS,
        text_color: Color { r: 1.0, g: 1.0, b: 1.0, a: 1.0 },
        background_color: Color { a: SHADE, ..Color::default() },
    }
}

fn point(x: f32, y: f32) -> Point2 {
    Point2 { x: f64::from(x), y: f64::from(y) }
}

fn color(region: &Region, opacity: f64) -> Color {
    let [r, g, b] = region_color(region).map(|c| f64::from(c) / 255.0);
    Color { r, g, b, a: opacity }
}

#[cfg(test)]
mod tests {
    use super::super::region::tests::perception;
    use super::*;

    #[test]
    fn each_region_is_outlined_through_the_middle_of_its_pixels_and_named() {
        let mut p = perception(2, 3);
        p.regions[0].contour = vec![[11.0, 20.0], [17.0, 20.0], [17.0, 26.0]];
        p.regions[0].median_depth = 12.0;
        p.regions[1].track_state = TrackState::Coasted;
        p.regions[1].y = 0;
        let all = annotations(&p);
        assert_eq!((all.circles.len(), all.points.len(), all.texts.len()), (0, 2, 2));
        let first = &all.points[0];
        assert_eq!(first.r#type, 2, "a closed line");
        assert_eq!(first.points[1], Point2 { x: 17.5, y: 20.5 });
        assert_eq!(first.timestamp, p.stamp.into());
        assert!(first.thickness > all.points[1].thickness);
        assert_eq!(all.points[1].fill_color.a, 0.0, "nothing was seen there");
        assert!(all.texts[0].text.contains("12"), "{}", all.texts[0].text);
        assert!(all.texts[1].position.y >= all.texts[1].font_size, "inside the image");
    }
}
