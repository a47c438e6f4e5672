//! Detections in two and three dimensions.

#![allow(missing_docs, reason = "the .msg texts document the fields")]

use serde::{Deserialize, Serialize};

use super::geometry_msgs::{Pose, PoseWithCovariance, Vector3};
use super::std_msgs::Header;

/// A class and its score.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectHypothesis {
    pub class_id: String,
    pub score: f64,
}

/// A class, its score, and where the object is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectHypothesisWithPose {
    pub hypothesis: ObjectHypothesis,
    pub pose: PoseWithCovariance,
}

/// A point in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point2D {
    pub x: f64,
    pub y: f64,
}

/// A point in pixels and an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose2D {
    pub position: Point2D,
    pub theta: f64,
}

/// A box in the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoundingBox2D {
    pub center: Pose2D,
    pub size_x: f64,
    pub size_y: f64,
}

/// A box in space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoundingBox3D {
    pub center: Pose,
    pub size: Vector3,
}

/// One detection in the image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection2D {
    pub header: Header,
    pub results: Vec<ObjectHypothesisWithPose>,
    pub bbox: BoundingBox2D,
    pub id: String,
}

/// The detections of one image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection2DArray {
    pub header: Header,
    pub detections: Vec<Detection2D>,
}

/// One detection in space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection3D {
    pub header: Header,
    pub results: Vec<ObjectHypothesisWithPose>,
    pub bbox: BoundingBox3D,
    pub id: String,
}

/// The detections of one instant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection3DArray {
    pub header: Header,
    pub detections: Vec<Detection3D>,
}

message! {
    ObjectHypothesis = "vision_msgs/msg/ObjectHypothesis",
    ObjectHypothesisWithPose = "vision_msgs/msg/ObjectHypothesisWithPose",
    Point2D = "vision_msgs/msg/Point2D",
    Pose2D = "vision_msgs/msg/Pose2D",
    BoundingBox2D = "vision_msgs/msg/BoundingBox2D",
    BoundingBox3D = "vision_msgs/msg/BoundingBox3D",
    Detection2D = "vision_msgs/msg/Detection2D",
    Detection2DArray = "vision_msgs/msg/Detection2DArray",
    Detection3D = "vision_msgs/msg/Detection3D",
    Detection3DArray = "vision_msgs/msg/Detection3DArray",
}
