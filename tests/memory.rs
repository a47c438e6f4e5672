//! A length on the wire takes no memory before it is checked. A crate of its own
//! because it measures the whole process, where other tests would disturb it.

#![cfg(all(feature = "tool", target_os = "linux"))]

use salient_stereo::ros::cdr;
use salient_stereo::ros::message::{geometry_msgs, rcl_interfaces, sensor_msgs, std_msgs};

/// Peak of the address space in KiB: an allocation counts also when nobody
/// writes to it.
fn peak_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmPeak:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn twelve_bytes_that_claim_gigabytes_take_nothing() {
    let claim = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 2, 3, 4];
    let text = [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0x7f, 1, 2, 3, 4];
    let before = peak_kib();
    assert!(cdr::decode::<rcl_interfaces::GetParameterTypesResponse>(&claim).is_err(), "bytes");
    assert!(cdr::decode::<geometry_msgs::Polygon>(&claim).is_err(), "structures");
    assert!(cdr::decode::<rcl_interfaces::GetParametersRequest>(&claim).is_err(), "strings");
    assert!(cdr::decode::<std_msgs::Header>(&text).is_err(), "text");
    let mut image = cdr::encode(&sensor_msgs::Image::default());
    let len = image.len();
    image[len - 4..].fill(0xff);
    assert!(cdr::decode::<sensor_msgs::Image>(&image).is_err(), "image");
    let taken = peak_kib() - before;
    assert!(taken < 256 << 10, "{taken} KiB were taken");
}
