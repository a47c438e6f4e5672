//! What is installed into the package's share folder, by its name there.

macro_rules! shared {
    ($($name:literal = $source:literal),+ $(,)?) => {
        /// Names below `share/salient_stereo`, and texts.
        pub const SHARED: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../../", $source)))),+];
    };
}

shared! {
    "package.xml" = "package.xml",
    "launch/salient_stereo.launch.py" = "config/launch/salient_stereo.launch.py",
    "launch/salient_stereo.launch.xml" = "config/launch/salient_stereo.launch.xml",
    "launch/salient_stereo.launch.yaml" = "config/launch/salient_stereo.launch.yaml",
    "config/salient_stereo.yaml" = "config/salient_stereo.yaml",
    "config/road.yaml" = "config/road.yaml",
    "config/indoor.yaml" = "config/indoor.yaml",
    "config/low_power.yaml" = "config/low_power.yaml",
    "config/dds/60-salient-stereo.conf" = "config/dds/60-salient-stereo.conf",
    "config/dds/cyclonedds.xml" = "config/dds/cyclonedds.xml",
    "config/dds/fastdds.xml" = "config/dds/fastdds.xml",
    "rviz/salient_stereo.rviz" = "config/rviz/salient_stereo.rviz",
    "foxglove/salient_stereo.json" = "config/foxglove/salient_stereo.json",
    "examples/print_regions.py" = "examples/rclpy/print_regions.py",
    "examples/nearest_region.py" = "examples/rclpy/nearest_region.py",
}
