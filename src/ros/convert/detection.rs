//! Salient regions as detections, for tools that speak `vision_msgs`.

use super::header;
use crate::perception::{Perception, Region};
use crate::ros::message::geometry_msgs::{Pose, PoseWithCovariance};
use crate::ros::message::std_msgs::Header;
use crate::ros::message::vision_msgs::{
    BoundingBox2D, BoundingBox3D, Detection2D, Detection2DArray, Detection3D, Detection3DArray,
    ObjectHypothesis, ObjectHypothesisWithPose, Point2D, Pose2D,
};

/// The one class there is: what stands out is found, not what it is called.
pub const CLASS_ID: &str = "salient_region";

/// The boxes of all regions in the image, in their order. A pixel covers
/// `x..x + 1`, so a box of one pixel at 0 has its centre at 0.5.
pub fn detections_2d(perception: &Perception) -> Detection2DArray {
    let header = header(perception);
    let detections = perception.regions.iter().map(|region| Detection2D {
        header: header.clone(),
        results: vec![hypothesis(region)],
        bbox: BoundingBox2D {
            center: Pose2D {
                position: Point2D {
                    x: f64::from(region.x) + f64::from(region.width) / 2.0,
                    y: f64::from(region.y) + f64::from(region.height) / 2.0,
                },
                theta: 0.0,
            },
            size_x: f64::from(region.width),
            size_y: f64::from(region.height),
        },
        id: id(region),
    });
    Detection2DArray { detections: detections.collect(), header }
}

/// The boxes in space, in metres along the axes of the left optical frame, of
/// the regions that have a place there.
pub fn detections_3d(perception: &Perception) -> Detection3DArray {
    let header = header(perception);
    let placed = perception.regions.iter().filter(|region| is_placed(region));
    let detections = placed.map(|region| detection_3d(region, &header));
    Detection3DArray { detections: detections.collect(), header }
}

fn detection_3d(region: &Region, header: &Header) -> Detection3D {
    Detection3D {
        header: header.clone(),
        results: vec![hypothesis(region)],
        bbox: BoundingBox3D { center: pose(region), size: extent(region).into() },
        id: id(region),
    }
}

/// True when the region's position was measured.
pub(super) fn is_placed(region: &Region) -> bool {
    region.position.iter().all(|v| v.is_finite())
}

/// Where the region is; axes parallel to the camera's.
pub(super) fn pose(region: &Region) -> Pose {
    Pose { position: region.position.into(), ..Pose::default() }
}

/// Size along x, y and z in metres; 0 where it was not measured.
pub(super) fn extent(region: &Region) -> [f64; 3] {
    region.extent.map(|v| if v.is_finite() { v } else { 0.0 })
}

fn hypothesis(region: &Region) -> ObjectHypothesisWithPose {
    // 6x6 over (x, y, z, rotations): the rotation is not measured.
    let mut covariance = [0.0; 36];
    for (row, values) in region.position_covariance.as_chunks::<3>().0.iter().enumerate() {
        covariance[6 * row..6 * row + 3].copy_from_slice(values);
    }
    ObjectHypothesisWithPose {
        hypothesis: ObjectHypothesis {
            class_id: CLASS_ID.to_owned(),
            score: f64::from(region.confidence),
        },
        pose: PoseWithCovariance { pose: pose(region), covariance },
    }
}

/// The track's number; empty without tracking, as the message wants it.
fn id(region: &Region) -> String {
    if region.track_id == 0 { String::new() } else { region.track_id.to_string() }
}

#[cfg(test)]
mod tests {
    use super::super::region::tests::perception;
    use super::*;
    use crate::ros::message::geometry_msgs::{Point, Vector3};

    fn measured() -> Perception {
        let mut p = perception(2, 3);
        let r = &mut p.regions[0];
        (r.track_id, r.confidence) = (77, 0.875);
        r.position = [1.0, 2.0, 30.0];
        r.position_covariance = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
        r.extent = [4.0, 5.0, f64::NAN];
        p.regions[1].position = [f64::NAN; 3];
        p
    }

    #[test]
    fn every_region_has_its_box_in_the_image() {
        let array = detections_2d(&measured());
        assert_eq!(array.header.frame_id, "left_optical");
        assert_eq!(array.detections.len(), 2);
        let first = &array.detections[0];
        assert_eq!(first.header, array.header);
        // Columns 11 to 17, rows 20 to 26.
        assert_eq!(first.bbox.center.position, Point2D { x: 14.5, y: 23.5 });
        assert_eq!((first.bbox.size_x, first.bbox.size_y), (7.0, 7.0));
        assert_eq!((first.id.as_str(), array.detections[1].id.as_str()), ("77", ""));
        let result = &first.results[0];
        assert_eq!(
            (result.hypothesis.class_id.as_str(), result.hypothesis.score),
            (CLASS_ID, 0.875)
        );
    }

    #[test]
    fn only_regions_with_a_place_are_detected_in_space() {
        let array = detections_3d(&measured());
        assert_eq!(array.detections.len(), 1);
        let first = &array.detections[0];
        assert_eq!(first.bbox.center.position, Point { x: 1.0, y: 2.0, z: 30.0 });
        assert_eq!(first.bbox.center.orientation.w, 1.0);
        assert_eq!(first.bbox.size, Vector3 { x: 4.0, y: 5.0, z: 0.0 });
        assert_eq!(first.results[0].pose.pose.position, first.bbox.center.position);
        let covariance = &first.results[0].pose.covariance;
        assert_eq!(covariance[..3], [0.1, 0.2, 0.3]);
        assert_eq!(covariance[6..9], [0.4, 0.5, 0.6]);
        assert_eq!(covariance[12..15], [0.7, 0.8, 0.9]);
        assert_eq!(covariance.iter().filter(|v| **v == 0.0).count(), 27);
    }
}
