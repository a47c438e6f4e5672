//! The disparity image.

#![allow(missing_docs, reason = "the .msg texts document the fields")]

use serde::{Deserialize, Serialize};

use super::sensor_msgs::{Image, RegionOfInterest};
use super::std_msgs::Header;

/// Disparities of a stereo pair and what is needed to turn them into depth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DisparityImage {
    pub header: Header,
    pub image: Image,
    pub f: f32,
    pub t: f32,
    pub valid_window: RegionOfInterest,
    pub min_disparity: f32,
    pub max_disparity: f32,
    pub delta_d: f32,
}

message! { DisparityImage = "stereo_msgs/msg/DisparityImage" }
