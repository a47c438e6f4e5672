//! Small bags to order.

use std::io::Cursor;
use std::path::Path;

use salient_stereo::camera::Camera;
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::input::bag::{BagOptions, BagSource};
use salient_stereo::input::{FrameSource, Observation, Tally};
use salient_stereo::output::bag::{BagWriter, Packing};
use salient_stereo::ros::convert;
use salient_stereo::ros::message::sensor_msgs::{self, CameraInfo, CompressedImage};
use salient_stereo::ros::message::std_msgs::Header;
use salient_stereo::stamp::Stamp;

pub type Spoil = fn(usize, &mut sensor_msgs::Image);
pub type Miscalibrate = fn(&mut CameraInfo, &mut CameraInfo);

#[derive(Clone)]
#[allow(clippy::struct_excessive_bools, reason = "one switch per oddity of a bag")]
pub struct Recipe {
    pub frames: usize,
    pub first: usize,
    pub packing: Packing,
    pub flush: bool,
    pub compressed: bool,
    pub namespace: &'static str,
    pub image: &'static str,
    pub left: bool,
    pub right: bool,
    pub infos: bool,
    pub side_by_side: bool,
    /// True disparity and ids, of 16 bits or 8.
    pub truth: Option<bool>,
    pub right_later_ns: i64,
    pub backwards: bool,
    pub size: Size,
    /// Changes the left image of each frame.
    pub spoil: Spoil,
    /// Changes the camera infos.
    pub miscalibrate: Miscalibrate,
    /// Stamp of each frame, nanoseconds.
    pub clock: fn(usize) -> i64,
    /// When each frame was recorded, if not at its stamp, nanoseconds.
    pub recorded: Option<fn(usize) -> i64>,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            frames: 6,
            first: 0,
            packing: Packing::Zstd,
            flush: true,
            compressed: false,
            namespace: "",
            image: "image_rect",
            left: true,
            right: true,
            infos: true,
            side_by_side: false,
            truth: None,
            right_later_ns: 0,
            backwards: false,
            size: Size::new(16, 6),
            spoil: |_, _| {},
            miscalibrate: |_, _| {},
            clock: |i| 1_700_000_000_000_000_000 + 100_000_000 * i as i64,
            recorded: None,
        }
    }
}

impl Recipe {
    pub fn stamp(&self, i: usize) -> Stamp {
        Stamp((self.clock)(i))
    }

    fn recorded(&self, i: usize) -> Stamp {
        Stamp(self.recorded.unwrap_or(self.clock)(i))
    }

    pub fn picture(&self, i: usize, right: bool) -> Image<[u8; 3]> {
        Image::from_fn(self.size, |x, y| {
            let v = (x * 7 + y * 13 + i * 31 + usize::from(right) * 101) as u8;
            [v, v.wrapping_mul(3), v.wrapping_add(50)]
        })
    }

    pub fn write(&self, path: &Path) {
        self.write_unfinished(path).finish().unwrap();
    }

    pub fn write_unfinished(&self, path: &Path) -> BagWriter {
        let mut bag = BagWriter::create_packed(path, self.packing).unwrap();
        let mut frames: Vec<usize> = (self.first..self.first + self.frames).collect();
        if self.backwards {
            frames.reverse();
        }
        for i in frames {
            if self.side_by_side {
                self.write_both(&mut bag, i);
            }
            for (right, wanted) in [(false, self.left), (true, self.right)] {
                if wanted {
                    self.write_side(&mut bag, i, right);
                }
            }
            if let Some(wide) = self.truth {
                self.write_truth(&mut bag, i, wide);
            }
            if self.flush {
                bag.flush().unwrap();
            }
        }
        bag
    }

    fn write_side(&self, bag: &mut BagWriter, i: usize, right: bool) {
        let side = if right { "right" } else { "left" };
        let stamp = Stamp(self.stamp(i).0 + if right { self.right_later_ns } else { 0 });
        let log = Stamp(self.recorded(i).0 + stamp.0 - self.stamp(i).0);
        let frame_id = format!("{side}_optical");
        let header = Header { stamp: stamp.into(), frame_id };
        let namespace = format!("{}/{side}", self.namespace);
        if !self.side_by_side {
            let mut message = convert::rgb_image(&self.picture(i, right), header.clone());
            if !right {
                (self.spoil)(i, &mut message);
            }
            put_image(bag, &format!("{namespace}/{}", self.image), log, &message, self.compressed);
        }
        if self.infos {
            let tx = if right { -200.0 } else { 0.0 };
            let camera = Camera::pinhole(self.size, 400.0, 8.0, 3.0, tx);
            let mut info = convert::camera_info(&camera, header);
            let mut other = CameraInfo::default();
            if right {
                (self.miscalibrate)(&mut other, &mut info);
            } else {
                (self.miscalibrate)(&mut info, &mut other);
            }
            put(bag, &format!("{namespace}/camera_info"), log, &info);
        }
    }

    fn write_both(&self, bag: &mut BagWriter, i: usize) {
        let [left, right] = [false, true].map(|right| self.picture(i, right));
        let (w, h) = (self.size.width, self.size.height);
        let both = Image::from_fn(Size::new(2 * w, h), |x, y| {
            if x < w { left.get(x, y) } else { right.get(x - w, y) }
        });
        let header = Header { stamp: self.stamp(i).into(), frame_id: "left_optical".into() };
        put(bag, "/image_raw", self.recorded(i), &convert::rgb_image(&both, header));
    }

    fn write_truth(&self, bag: &mut BagWriter, i: usize, wide: bool) {
        let size = (self.size.width as u32, self.size.height as u32);
        let disparity =
            image::ImageBuffer::<image::Luma<u16>, _>::from_fn(size.0, size.1, |x, _| {
                image::Luma([if x == 0 { 0 } else { 256 + i as u16 }])
            });
        let objects: image::DynamicImage = if wide {
            image::ImageBuffer::<image::Luma<u16>, _>::from_fn(size.0, size.1, |x, y| {
                image::Luma([if (x, y) == (2, 1) { 300 } else { 0 }])
            })
            .into()
        } else {
            image::ImageBuffer::<image::Luma<u8>, _>::from_fn(size.0, size.1, |x, y| {
                image::Luma([if (x, y) == (2, 1) { 3 } else { 0 }])
            })
            .into()
        };
        for (topic, picture) in [("disparity", disparity.into()), ("objects", objects)] {
            let message = CompressedImage {
                header: Header { stamp: self.stamp(i).into(), frame_id: "left_optical".into() },
                format: "png".into(),
                data: png(&picture),
            };
            let topic = format!("{}/truth/{topic}/compressed", self.namespace);
            put(bag, &topic, self.recorded(i), &message);
        }
    }
}

fn put_image(
    bag: &mut BagWriter,
    topic: &str,
    stamp: Stamp,
    message: &sensor_msgs::Image,
    compressed: bool,
) {
    if !compressed {
        return put(bag, topic, stamp, message);
    }
    let (w, h) = (message.width, message.height);
    let picture = image::RgbImage::from_raw(w, h, message.data.clone()).unwrap();
    let message = CompressedImage {
        header: message.header.clone(),
        format: "rgb8; png compressed bgr8".into(),
        data: png(&picture.into()),
    };
    put(bag, &format!("{topic}/compressed"), stamp, &message);
}

/// Adds the topic again each time: the writer knows it already.
fn put<T: salient_stereo::ros::message::Message>(
    bag: &mut BagWriter,
    topic: &str,
    stamp: Stamp,
    message: &T,
) {
    let topic = bag.topic::<T>(topic).unwrap();
    bag.write(topic, stamp, message).unwrap();
}

fn png(picture: &image::DynamicImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// All frames of a bag that can be opened and read.
pub fn observe(path: &Path, config: &Config) -> (Vec<Observation>, Tally) {
    let mut source = BagSource::open(path, config, BagOptions::default()).unwrap();
    let mut observed = Vec::new();
    while let Some(observation) = source.next_observation().unwrap() {
        observed.push(observation);
    }
    (observed, source.tally().clone())
}

pub fn pairs(path: &Path) -> usize {
    observe(path, &Config::default()).0.len()
}

pub fn stamps(path: &Path) -> Vec<Stamp> {
    observe(path, &Config::default()).0.iter().map(|o| o.frame.stamp).collect()
}

/// What opening or reading to the end says when it fails.
pub fn failure(path: &Path, config: &Config) -> String {
    let mut source = match BagSource::open(path, config, BagOptions::default()) {
        Ok(source) => source,
        Err(e) => return e.to_string(),
    };
    loop {
        match source.next_observation() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("no failure: {:?}", source.tally()),
            Err(e) => return e.to_string(),
        }
    }
}
