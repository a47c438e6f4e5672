//! Frames from a bag.
//!
//! A bag is an MCAP file or a bag folder. Nothing of it is trusted: lengths are
//! checked before they are used, damaged chunks and unusable images are counted
//! and left out, and memory is bounded by the chunk, not by the file.
//!
//! Messages are taken in the order of their log times (see `read`), over all
//! files of the bag; images are paired by the stamps in their headers.

mod error;
mod folder;
mod index;
mod read;
mod record;
mod topics;
mod truth;
mod unit;

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use error::BagError;
pub use read::{BagMessage, Reader, TopicInfo};
pub use topics::{BagTopics, ImageTopic, Selection};
pub use unit::Limits;

use self::topics::Finder;
use self::truth::TruthQueue;
use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::Picture;
use crate::input::{FrameSource, Observation, Tally};
use crate::perception::StereoFrame;
use crate::ros::cdr;
use crate::ros::convert;
use crate::ros::message::sensor_msgs::{CameraInfo, CompressedImage, Image};
use crate::stamp::Stamp;
use crate::sync::{Pair, Settings, Side, Synchronizer};

/// What to read of a bag, besides what the parameters say.
#[derive(Clone, Debug, Default)]
pub struct BagOptions {
    /// Topics by name.
    pub topics: BagTopics,
    /// Calibrations, left and right, that replace the bag's own.
    pub camera_infos: [Option<CameraInfo>; 2],
    /// Bounds on what the file may ask for.
    pub limits: Limits,
}

/// Distinct reasons in a tally; all others are counted together.
const MAX_REASONS: usize = 64;

/// Numbers of the selected topics.
const LEFT: usize = 0;
const RIGHT: usize = 1;
const LEFT_INFO: usize = 2;
const RIGHT_INFO: usize = 3;
const DISPARITY: usize = 4;
const OBJECTS: usize = 5;

type RawPair = Pair<Vec<u8>, Arc<CameraInfo>>;

/// Stereo frames of a bag.
pub struct BagSource {
    path: PathBuf,
    files: Vec<PathBuf>,
    reader: Reader,
    selection: Selection,
    sync: Synchronizer<Vec<u8>, Arc<CameraInfo>>,
    ready: VecDeque<RawPair>,
    truth: TruthQueue,
    baseline_override: f64,
    calibrated: Option<Calibrated>,
    ended: bool,
    /// Skips that are not in `sync` or `reader`.
    own: Tally,
    tally: Tally,
    notes: Vec<String>,
}

/// The rig of the last pair and what it was made of.
struct Calibrated {
    infos: [Arc<CameraInfo>; 2],
    rig: Arc<StereoRig>,
}

impl BagSource {
    /// Opens the bag at `path`, a `.mcap` file or a bag folder, and finds its
    /// stereo pair.
    ///
    /// # Errors
    /// When there is no readable bag or no usable pair of topics in it.
    pub fn open(path: &Path, config: &Config, options: BagOptions) -> Result<Self, BagError> {
        let (files, mut notes) = folder::files(path)?;
        let mut reader = Reader::open(&files, options.limits)?;
        for (file, messages, recovered) in reader.recovered() {
            let lost = match recovered.lost {
                0 => String::new(),
                lost => format!(", the last {lost} bytes are unusable"),
            };
            notes.push(format!(
                "{} has no index (its recorder did not finish): {messages} messages found by a scan of {} bytes{lost}",
                file.display(),
                recovered.at
            ));
        }
        if reader.message_count() == 0 {
            let note = match notes.as_slice() {
                [] => String::new(),
                notes => format!(": {}", notes.join("; ")),
            };
            return Err(BagError::Empty { path: path.to_owned(), note });
        }
        let topics = reader.topics();
        let selection = Finder { path, topics: &topics, config }.choose(&options.topics)?;
        let mut sync = Synchronizer::new(Settings::new(config));
        for (i, (side, info)) in
            [Side::Left, Side::Right].into_iter().zip(options.camera_infos).enumerate()
        {
            match info {
                Some(info) => sync.fix_info(side, Arc::new(info)),
                None if selection.infos[i].is_none() => {
                    return Err(BagError::NoCameraInfoTopic {
                        path: path.to_owned(),
                        topic: selection.info_names[i].clone(),
                        topics: topics::listed(&topics),
                    });
                }
                None => {}
            }
        }
        let names = [
            (Some(&selection.left.name), LEFT),
            (selection.right.as_ref().map(|right| &right.name), RIGHT),
            (selection.infos[0].as_ref(), LEFT_INFO),
            (selection.infos[1].as_ref(), RIGHT_INFO),
            (selection.true_disparity.as_ref(), DISPARITY),
            (selection.true_objects.as_ref(), OBJECTS),
        ];
        for (name, number) in names {
            if let Some(name) = name {
                reader.select(name, number);
            }
        }
        let truth =
            TruthQueue::new(selection.true_disparity.is_some(), selection.true_objects.is_some());
        let mut own = Tally::default();
        let lost: u64 = reader.recovered().map(|(_, _, recovered)| recovered.lost).sum();
        if lost > 0 {
            own.skipped.insert("bytes behind the break of a cut bag".to_owned(), lost);
        }
        Ok(Self {
            path: path.to_owned(),
            files,
            reader,
            selection,
            sync,
            ready: VecDeque::new(),
            truth,
            baseline_override: config.calibration.baseline_override,
            calibrated: None,
            ended: false,
            tally: own.clone(),
            own,
            notes,
        })
    }

    /// What a user should know about the bag: no index, no metadata.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The topics that are read.
    pub const fn selection(&self) -> &Selection {
        &self.selection
    }

    /// True when `path` is one of the files that are read: it must not be written.
    pub fn reads(&self, path: &Path) -> bool {
        let real = |path: &Path| path.canonicalize().ok();
        let wanted = real(path);
        wanted.is_some()
            && (wanted == real(&self.path) || self.files.iter().any(|file| real(file) == wanted))
    }

    /// Why images found no partner, or pairs no calibration.
    pub fn explain(&self) -> Option<String> {
        let has_info = [Side::Left, Side::Right].map(|side| self.sync.has_info(side));
        self.sync.counts().explain(self.sync.settings(), has_info)
    }

    /// How often stamps jumped back in time.
    pub const fn jumps(&self) -> u64 {
        self.sync.counts().jumps
    }

    /// Reads on until a pair is complete with its truth, or the bag ends.
    fn next_pair(&mut self) -> Result<Option<RawPair>, BagError> {
        loop {
            if let Some(pair) = self.ready.front()
                && (self.ended || self.truth.is_complete(pair.stamp, self.ready.len()))
            {
                return Ok(self.ready.pop_front());
            }
            if self.ended {
                return Ok(None);
            }
            if let Some(message) = self.reader.next_message()? {
                self.take(message);
            } else {
                self.ended = true;
                self.sync.finish();
            }
            while let Some(pair) = self.sync.pop() {
                self.ready.push_back(pair);
            }
            if self.ended {
                self.sync.close();
            }
        }
    }

    fn take(&mut self, message: BagMessage) {
        let data = message.data;
        let Some(stamp) = stamp_of(&data) else {
            self.skip("message without a header".to_owned());
            return;
        };
        match message.topic {
            LEFT => self.sync.push(Side::Left, stamp, data),
            RIGHT => self.sync.push(Side::Right, stamp, data),
            LEFT_INFO => self.take_info(Side::Left, stamp, &data),
            RIGHT_INFO => self.take_info(Side::Right, stamp, &data),
            DISPARITY => self.truth.push_disparity(stamp, data),
            _ => self.truth.push_objects(stamp, data),
        }
    }

    fn take_info(&mut self, side: Side, stamp: Stamp, data: &[u8]) {
        match cdr::decode::<CameraInfo>(data) {
            Ok(info) => self.sync.push_info(side, stamp, Arc::new(info)),
            Err(e) => self.skip(format!("{} camera info: {e}", side.name())),
        }
    }

    /// The frame of a pair; its reason when it cannot be used.
    fn observe(&mut self, pair: &RawPair) -> Result<Observation, String> {
        let left_topic = &self.selection.left;
        let (left, right) = match (&pair.right, &self.selection.right) {
            // Decoding JPEG or PNG takes as long as a stage: both at once.
            (Some(right), Some(topic)) => rayon::join(
                || decode(&pair.left, left_topic.compressed),
                || decode(right, topic.compressed).map(Some),
            ),
            _ => (decode(&pair.left, left_topic.compressed), Ok(None)),
        };
        let (left, frame_id) = left.map_err(|e| format!("left image: {e}"))?;
        let (left, right) = match right.map_err(|e| format!("right image: {e}"))? {
            Some((right, _)) => (left, right),
            None => convert::split_side_by_side(&left).map_err(|e| e.to_string())?,
        };
        let size = convert::common_size(&left, &right).map_err(|e| e.to_string())?;
        let rig = self.rig(pair, size).map_err(|e| e.to_string())?;
        let (truth, fault) = self.truth.take(pair.stamp, size);
        if let Some(fault) = fault {
            self.skip(fault);
        }
        let frame = StereoFrame {
            stamp: pair.stamp,
            right_stamp: pair.right_stamp,
            frame_id,
            left,
            right,
            rig,
        };
        Ok(Observation { frame, truth })
    }

    /// The calibration of a pair, made anew only when it differs from the last one.
    fn rig(
        &mut self,
        pair: &RawPair,
        size: crate::image::Size,
    ) -> Result<Arc<StereoRig>, crate::error::CalibrationError> {
        if let Some(Calibrated { infos: [left, right], rig }) = &self.calibrated
            && rig.left.size == size
            && same_calibration(left, &pair.left_info)
            && same_calibration(right, &pair.right_info)
        {
            return Ok(Arc::clone(rig));
        }
        let rig = convert::rig(&pair.left_info, &pair.right_info, size, self.baseline_override)?;
        let rig = Arc::new(rig);
        let infos = [Arc::clone(&pair.left_info), Arc::clone(&pair.right_info)];
        self.calibrated = Some(Calibrated { infos, rig: Arc::clone(&rig) });
        Ok(rig)
    }

    fn skip(&mut self, reason: String) {
        let skipped = &self.own.skipped;
        if skipped.len() < MAX_REASONS || skipped.contains_key(&reason) {
            self.own.skip(reason);
        } else {
            self.own.skip("other reasons");
        }
    }

    /// Brings the tally up to date with pairing and reading.
    fn sum_up(&mut self) {
        let counts = self.sync.counts();
        let mut tally = self.own.clone();
        let unpaired = |side: Side| {
            let side = counts.side(side);
            side.unpaired + side.overflow + side.cleared
        };
        tally.unpaired_left = unpaired(Side::Left);
        tally.unpaired_right = unpaired(Side::Right);
        let mut add = |reason: &str, count: u64| {
            if count > 0 {
                *tally.skipped.entry(reason.to_owned()).or_default() += count;
            }
        };
        add("left image with the stamp of the one before", counts.left.duplicate);
        add("right image with the stamp of the one before", counts.right.duplicate);
        add("pair without camera info", counts.without_info);
        for (reason, count) in self.reader.damage() {
            add(reason, *count);
        }
        if self.ended {
            add("message lost in a damaged chunk", self.reader.messages_missing());
        }
        self.tally = tally;
    }
}

impl FrameSource for BagSource {
    type Error = BagError;

    fn next_observation(&mut self) -> Result<Option<Observation>, BagError> {
        loop {
            let pair = self.next_pair()?;
            let Some(pair) = pair else {
                self.sum_up();
                let missing = [Side::Left, Side::Right].map(|side| !self.sync.has_info(side));
                let frames = self.sync.counts().without_info;
                if frames > 0 && missing.contains(&true) {
                    let names = self.selection.info_names.iter().zip(missing);
                    let names: Vec<&str> = names
                        .filter(|(_, missing)| *missing)
                        .map(|(name, _)| name.as_str())
                        .collect();
                    return Err(BagError::NoCameraInfo {
                        path: self.path.clone(),
                        frames,
                        missing: names.join(" and "),
                    });
                }
                return Ok(None);
            };
            let observed = self.observe(&pair);
            match observed {
                Ok(observation) => {
                    self.own.pairs += 1;
                    self.sum_up();
                    return Ok(Some(observation));
                }
                Err(reason) => {
                    self.skip(reason);
                    self.sum_up();
                }
            }
        }
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }

    fn progress(&self) -> Option<f64> {
        Some(self.reader.progress())
    }
}

/// Picture and frame of an encoded image message.
fn decode(data: &[u8], compressed: bool) -> Result<(Picture, Arc<str>), String> {
    if compressed {
        let message: CompressedImage = cdr::decode(data).map_err(|e| e.to_string())?;
        let picture = convert::compressed_picture(&message).map_err(|e| e.to_string())?;
        Ok((picture, message.header.frame_id.into()))
    } else {
        let message: Image = cdr::decode(data).map_err(|e| e.to_string())?;
        let picture = convert::picture(&message).map_err(|e| e.to_string())?;
        Ok((picture, message.header.frame_id.into()))
    }
}

/// The stamp of a message that begins with a header, without decoding it.
fn stamp_of(data: &[u8]) -> Option<Stamp> {
    let (&[_, order, _, _], body) = data.split_first_chunk::<4>()?;
    let (sec, body) = body.split_first_chunk::<4>()?;
    let (nanosec, _) = body.split_first_chunk::<4>()?;
    Some(if order & 1 == 1 {
        Stamp::from_parts(i32::from_le_bytes(*sec), u32::from_le_bytes(*nanosec))
    } else {
        Stamp::from_parts(i32::from_be_bytes(*sec), u32::from_be_bytes(*nanosec))
    })
}

/// Everything but the header is equal.
fn same_calibration(a: &CameraInfo, b: &CameraInfo) -> bool {
    (a.height, a.width, a.binning_x, a.binning_y, a.roi)
        == (b.height, b.width, b.binning_x, b.binning_y, b.roi)
        && a.distortion_model == b.distortion_model
        && (&a.d, a.k, a.r, a.p) == (&b.d, b.k, b.r, b.p)
}
