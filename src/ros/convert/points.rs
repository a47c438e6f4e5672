//! Depth and colours as a point cloud.

use super::header;
use crate::perception::Perception;
use crate::ros::message::sensor_msgs::{PointCloud2, PointField};

/// Bytes of a point: x, y, z, rgb, label.
const POINT_STEP: usize = 20;

/// One point per pixel of the left view, row by row (an organised cloud), in
/// metres of the left optical frame.
///
/// Fields: `x` `y` `z` (NaN where depth is unknown or out of range), `rgb` (the
/// bytes 0RGB of a little-endian number, in a float as PCL wants it) and
/// `label` (the pixel's region, 0 for none).
pub fn points(perception: &Perception) -> PointCloud2 {
    let size = perception.depth.size();
    let camera = &perception.rig.left.p;
    let (fx, fy) = (camera[(0, 0)] as f32, camera[(1, 1)] as f32);
    let (cx, cy) = (camera[(0, 2)] as f32, camera[(1, 2)] as f32);
    let mut data = vec![0; size.area() * POINT_STEP];
    let pixels = perception.depth.pixels().iter();
    let pixels = pixels.zip(perception.left.rgb.pixels()).zip(perception.labels.pixels());
    let points = data.as_chunks_mut::<POINT_STEP>().0.iter_mut();
    for (index, (point, ((&z, &[r, g, b]), &label))) in points.zip(pixels).enumerate() {
        let (u, v) = ((index % size.width) as f32, (index / size.width) as f32);
        let z = if z.is_finite() { z } else { f32::NAN };
        let place = [(u - cx) / fx * z, (v - cy) / fy * z, z];
        point[..12].as_chunks_mut().0.copy_from_slice(&place.map(f32::to_le_bytes));
        point[12..15].copy_from_slice(&[b, g, r]);
        point[16..].copy_from_slice(&u32::from(label).to_le_bytes());
    }
    PointCloud2 {
        header: header(perception),
        height: size.height as u32,
        width: size.width as u32,
        fields: vec![
            field("x", 0, PointField::FLOAT32),
            field("y", 4, PointField::FLOAT32),
            field("z", 8, PointField::FLOAT32),
            field("rgb", 12, PointField::FLOAT32),
            field("label", 16, PointField::UINT32),
        ],
        is_bigendian: false,
        point_step: POINT_STEP as u32,
        row_step: (POINT_STEP * size.width) as u32,
        data,
        is_dense: false,
    }
}

fn field(name: &str, offset: u32, datatype: u8) -> PointField {
    PointField { name: name.into(), offset, datatype, count: 1 }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::image::{Image, Size};

    #[test]
    fn each_pixel_is_a_point_and_holes_are_nan() {
        let size = Size::new(3, 2);
        let camera = |tx| Camera::pinhole(size, 2.0, 1.0, 0.5, tx);
        let rig = StereoRig::new(camera(0.0), camera(-1.0), 0.0).unwrap();
        let mut p = Perception::new(size, Arc::new(rig));
        p.frame_id = Arc::from("left_optical");
        p.depth = Image::filled(size, f32::NAN);
        p.depth.set(0, 0, 4.0);
        p.depth.set(1, 0, f32::INFINITY);
        p.depth.set(2, 1, 8.0);
        p.left.rgb.set(2, 1, [1, 2, 3]);
        p.labels.set(2, 1, 300);
        let cloud = points(&p);
        assert_eq!((cloud.width, cloud.height, cloud.point_step, cloud.row_step), (3, 2, 20, 60));
        assert_eq!((cloud.data.len(), cloud.is_dense, cloud.is_bigendian), (120, false, false));
        assert_eq!(cloud.header.frame_id, "left_optical");
        let offset = |name: &str| {
            cloud.fields.iter().find(|f| f.name == name).map(|f| f.offset as usize).unwrap()
        };
        let bytes = |index: usize, name| -> [u8; 4] {
            let at = index * 20 + offset(name);
            cloud.data[at..at + 4].try_into().unwrap()
        };
        let place = |index| ["x", "y", "z"].map(|name| f32::from_le_bytes(bytes(index, name)));
        assert_eq!(place(0), [-2.0, -1.0, 4.0]);
        assert_eq!(place(5), [4.0, 2.0, 8.0]);
        for hole in [1, 2, 3, 4] {
            assert!(place(hole).iter().all(|v| v.is_nan()), "{hole}");
        }
        assert_eq!(u32::from_le_bytes(bytes(5, "rgb")), 0x0001_0203);
        assert_eq!(u32::from_le_bytes(bytes(5, "label")), 300);
        assert_eq!(u32::from_le_bytes(bytes(0, "label")), 0);
    }
}
