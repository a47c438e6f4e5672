//! Salient regions as things that viewers draw into the scene.

use std::time::Duration;

use super::detection::{extent, is_placed, pose};
use super::header;
use crate::output::picture::{label_text, region_color};
use crate::perception::{Perception, Region};
use crate::ros::message::geometry_msgs::Vector3;
use crate::ros::message::std_msgs::{ColorRGBA, Header};
use crate::ros::message::visualization_msgs::{Marker, MarkerArray};

/// How long a marker is shown when no newer one comes: as long as a track lives
/// on unseen by default.
const LIFETIME: Duration = Duration::from_millis(500);

/// A side that was not measured, or is thinner, is drawn this long, in metres:
/// viewers refuse boxes without thickness.
const THINNEST_M: f64 = 0.05;

/// Height of the letters in metres.
const LETTERS_M: f64 = 0.3;

/// A box and a text above it for each region that has a place in space. The id
/// is that of the track, or the label without tracking, so that a viewer moves
/// what it has drawn before.
pub fn markers(perception: &Perception) -> MarkerArray {
    let header = header(perception);
    let placed = perception.regions.iter().filter(|region| is_placed(region));
    let markers = placed.flat_map(|region| [solid(region, &header), text(region, &header)]);
    MarkerArray { markers: markers.collect() }
}

fn solid(region: &Region, header: &Header) -> Marker {
    let [x, y, z] = extent(region).map(|side| side.max(THINNEST_M));
    Marker {
        ns: "boxes".into(),
        r#type: Marker::CUBE,
        pose: pose(region),
        scale: Vector3 { x, y, z },
        color: color(region, 0.5),
        ..common(region, header)
    }
}

fn text(region: &Region, header: &Header) -> Marker {
    let mut place = pose(region);
    // In the optical frame up is -y.
    place.position.y -= extent(region)[1].max(THINNEST_M) / 2.0 + LETTERS_M;
    Marker {
        ns: "texts".into(),
        r#type: Marker::TEXT_VIEW_FACING,
        pose: place,
        scale: Vector3 { x: 0.0, y: 0.0, z: LETTERS_M },
        color: color(region, 1.0),
        text: label_text(region),
        ..common(region, header)
    }
}

fn common(region: &Region, header: &Header) -> Marker {
    let id = if region.track_id == 0 { u32::from(region.label) } else { region.track_id };
    Marker {
        header: header.clone(),
        // Track numbers count up from 1: the bits are kept, should they pass 2^31.
        id: id.cast_signed(),
        action: Marker::ADD,
        lifetime: LIFETIME.into(),
        ..Marker::default()
    }
}

fn color(region: &Region, opacity: f32) -> ColorRGBA {
    let [r, g, b] = region_color(region).map(|c| f32::from(c) / 255.0);
    ColorRGBA { r, g, b, a: opacity }
}

#[cfg(test)]
mod tests {
    use super::super::region::tests::perception;
    use super::*;

    #[test]
    fn a_region_is_a_box_and_a_text_that_vanish_by_themselves() {
        let mut p = perception(3, 3);
        for (i, region) in p.regions.iter_mut().enumerate() {
            region.position = [1.0, 2.0, 10.0 + i as f64];
            region.extent = [0.8, 1.6, f64::NAN];
            region.median_depth = 12.0;
        }
        p.regions[0].track_id = 77;
        p.regions[2].position[1] = f64::NAN;
        let array = markers(&p);
        assert_eq!(array.markers.len(), 4, "the third region has no place");
        let [solid, text, second, ..] = &array.markers[..] else { panic!() };
        assert_eq!((solid.ns.as_str(), solid.id, solid.r#type), ("boxes", 77, Marker::CUBE));
        assert_eq!(
            (text.ns.as_str(), text.id, text.r#type),
            ("texts", 77, Marker::TEXT_VIEW_FACING)
        );
        assert_eq!(second.id, 2, "the label, without a track");
        for marker in &array.markers {
            assert_eq!(marker.header.frame_id, "left_optical");
            assert_eq!(marker.action, Marker::ADD);
            assert_eq!((marker.lifetime.sec, marker.lifetime.nanosec), (0, 500_000_000));
            assert_eq!(marker.pose.orientation.w, 1.0);
        }
        assert_eq!(solid.scale, Vector3 { x: 0.8, y: 1.6, z: THINNEST_M });
        assert_eq!(solid.color.a, 0.5);
        assert!(text.pose.position.y < 2.0 - 0.8, "above the box: {:?}", text.pose);
        assert!(text.text.starts_with("#77 12.0 m"), "{}", text.text);
    }
}
