//! Bags, written and read.

use salient_stereo::output::bag::{BagWriter, Packing};
use salient_stereo::ros::message::sensor_msgs::{CameraInfo, Image};
use salient_stereo::stamp::Stamp;

#[test]
fn the_same_messages_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = ["a.mcap", "b.mcap"].map(|name| {
        let path = folder.path().join(name);
        let mut bag = BagWriter::create_packed(&path, Packing::Zstd).unwrap();
        let images = bag.topic::<Image>("/left/image_rect").unwrap();
        let infos = bag.topic::<CameraInfo>("/left/camera_info").unwrap();
        for i in 0..5 {
            let image = Image { width: 4, data: vec![i; 4], ..Image::default() };
            bag.write(images, Stamp(i64::from(i)), &image).unwrap();
            bag.write(infos, Stamp(i64::from(i)), &CameraInfo::default()).unwrap();
            bag.flush().unwrap();
        }
        bag.finish().unwrap();
        std::fs::read(path).unwrap()
    });
    assert!(bytes[0] == bytes[1]);
}
