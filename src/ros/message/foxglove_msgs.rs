//! What Foxglove draws over an image, as in `foxglove_msgs` 3. In bags only,
//! where the definition travels along: robots need not have the package.

#![allow(missing_docs, reason = "the .msg texts document the fields")]

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Time;

/// A colour, each part 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Color {
    pub r: f64,
    pub g: f64,
    pub b: f64,
    pub a: f64,
}

/// Pixels from the image's upper left corner: the middle of the first pixel is at 0.5.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point2 {
    pub x: f64,
    pub y: f64,
}

/// A circle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CircleAnnotation {
    pub timestamp: Time,
    pub position: Point2,
    pub diameter: f64,
    pub thickness: f64,
    pub fill_color: Color,
    pub outline_color: Color,
}

/// Points, or lines between them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointsAnnotation {
    pub timestamp: Time,
    pub r#type: u8,
    pub points: Vec<Point2>,
    pub outline_color: Color,
    pub outline_colors: Vec<Color>,
    pub fill_color: Color,
    pub thickness: f64,
}

impl PointsAnnotation {
    pub const LINE_LOOP: u8 = 2;
}

/// A text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TextAnnotation {
    pub timestamp: Time,
    pub position: Point2,
    pub text: String,
    pub font_size: f64,
    pub text_color: Color,
    pub background_color: Color,
}

/// All of one image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageAnnotations {
    pub circles: Vec<CircleAnnotation>,
    pub points: Vec<PointsAnnotation>,
    pub texts: Vec<TextAnnotation>,
}

message! {
    Color = "foxglove_msgs/msg/Color",
    Point2 = "foxglove_msgs/msg/Point2",
    CircleAnnotation = "foxglove_msgs/msg/CircleAnnotation",
    PointsAnnotation = "foxglove_msgs/msg/PointsAnnotation",
    TextAnnotation = "foxglove_msgs/msg/TextAnnotation",
    ImageAnnotations = "foxglove_msgs/msg/ImageAnnotations",
}
