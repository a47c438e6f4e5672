//! Our own messages: the texts are in `msgs/msg/`.

#![allow(missing_docs, reason = "the .msg texts document the fields")]

use serde::{Deserialize, Serialize};

use super::geometry_msgs::{Point, Polygon, Vector3};
use super::sensor_msgs::{CompressedImage, RegionOfInterest};
use super::std_msgs::Header;

/// One salient image region and its stereo range measurement.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SalientRegion {
    pub label: u16,
    pub track_id: u32,
    pub track_state: u8,
    pub track_age: f32,
    pub roi: RegionOfInterest,
    pub contour: Polygon,
    pub mask: CompressedImage,
    pub area: u32,
    pub mean_saliency: f32,
    pub max_saliency: f32,
    pub valid_fraction: f32,
    pub mean_disparity: f32,
    pub disparity_stddev: f32,
    pub mean_depth: f32,
    pub median_depth: f32,
    pub depth_stddev: f32,
    pub near_depth: f32,
    pub far_depth: f32,
    pub confidence: f32,
    pub position: Point,
    pub position_covariance: [f64; 9],
    pub size: Vector3,
    pub velocity: Vector3,
}

impl SalientRegion {
    pub const TRACK_NONE: u8 = 0;
    pub const TRACK_NEW: u8 = 1;
    pub const TRACK_ACTIVE: u8 = 2;
    pub const TRACK_COASTED: u8 = 3;
}

/// The salient regions of one stereo pair.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SalientRegionArray {
    pub header: Header,
    pub height: u32,
    pub width: u32,
    pub stereo_time_offset: f64,
    pub regions: Vec<SalientRegion>,
}

message! {
    SalientRegion = "salient_stereo_msgs/msg/SalientRegion",
    SalientRegionArray = "salient_stereo_msgs/msg/SalientRegionArray",
}
