//! What the demo plays, and what it keeps of the results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::MessageStream;

use crate::command::CommandError;
use crate::command::replay::RunTotals;
use crate::command::settings::bag_options;
use crate::command::summary;
use crate::config::Config;
use crate::input::bag::{BagSource, BagTopics};
use crate::input::{FrameSource, Observation, Truth};
use crate::output::Sink;
use crate::output::bag::{BagSink, BagTopicsOut};
use crate::output::report::{ReportSink, RunFacts};
use crate::output::score::ScoreSink;
use crate::perception::Perception;
use crate::ros::cdr;
use crate::ros::message::sensor_msgs::{CameraInfo, CompressedImage, Image};
use crate::ros::play::{ImagePair, StereoMessages};
use crate::stamp::Stamp;

/// Largest bag that is held in memory to be played.
const MOST_BYTES: u64 = 512 << 20;

/// A bag, ready to be published.
pub struct Recording {
    /// The pairs in their order.
    pub messages: Vec<StereoMessages>,
    /// True when the images are `CompressedImage`s.
    pub compressed: bool,
    /// Whether the left and the right camera info are played.
    pub infos: [bool; 2],
    /// What is true at each stamp.
    pub truth: BTreeMap<Stamp, Truth>,
}

impl Recording {
    /// Reads the bag: its usable pairs as they were recorded, and their truth.
    pub fn read(path: &Path, config: &Config) -> Result<Self, CommandError> {
        let failed = |text: String| CommandError::failed(format!("{}: {text}", path.display()));
        if path.is_dir() {
            return Err(failed("is a folder; the demo plays a single .mcap file".into()));
        }
        let bytes = std::fs::metadata(path).map_err(|e| failed(e.to_string()))?.len();
        if bytes > MOST_BYTES {
            return Err(failed(format!(
                "is {bytes} bytes; the demo plays bags of up to {MOST_BYTES} bytes (use `ros2 bag play` and `salient_stereo node`)"
            )));
        }
        // The source checks every pair, so that only usable ones are played.
        let options = bag_options(config, BagTopics::default())?;
        let fixed = options.camera_infos.each_ref().map(Option::is_some);
        let mut source = BagSource::open(path, config, options).map_err(CommandError::failed)?;
        let mut truth = BTreeMap::new();
        while let Some(observation) = source.next_observation().map_err(CommandError::failed)? {
            truth.insert(observation.frame.stamp, observation.truth.unwrap_or_default());
        }
        let selection = source.selection();
        let Some(right) = &selection.right else {
            return Err(failed("has no two image topics".into()));
        };
        let compressed = selection.left.compressed;
        // The node takes from a file what is fixed; the bag's own is not played.
        let [left_info, right_info] =
            [0, 1].map(|i| selection.infos[i].as_ref().filter(|_| !fixed[i]));
        let names = [Some(&selection.left.name), Some(&right.name), left_info, right_info];
        let bytes = std::fs::read(path).map_err(|e| failed(e.to_string()))?;
        let messages = messages(&bytes, names, compressed, &truth).map_err(failed)?;
        if messages.is_empty() {
            return Err(failed("has no stereo pair with equal stamps".into()));
        }
        Ok(Self { messages, compressed, infos: fixed.map(|fixed| !fixed), truth })
    }
}

#[derive(Default)]
struct Partial {
    images: [Option<Sent>; 2],
    infos: [Option<CameraInfo>; 2],
}

enum Sent {
    Raw(Image),
    Compressed(CompressedImage),
}

fn messages(
    bytes: &[u8],
    names: [Option<&String>; 4],
    compressed: bool,
    usable: &BTreeMap<Stamp, Truth>,
) -> Result<Vec<StereoMessages>, String> {
    let mut by_stamp = BTreeMap::<Stamp, Partial>::new();
    for message in MessageStream::new(bytes).map_err(|e| e.to_string())? {
        let message = message.map_err(|e| e.to_string())?;
        let Some(slot) =
            names.iter().position(|name| name.is_some_and(|name| *name == message.channel.topic))
        else {
            continue;
        };
        let text = |e: cdr::CdrError| format!("{}: {e}", message.channel.topic);
        if slot >= 2 {
            let info: CameraInfo = cdr::decode(&message.data).map_err(text)?;
            let stamp = info.header.stamp.into();
            by_stamp.entry(stamp).or_default().infos[slot - 2] = Some(info);
        } else {
            let (stamp, image) = if compressed {
                let image: CompressedImage = cdr::decode(&message.data).map_err(text)?;
                (image.header.stamp, Sent::Compressed(image))
            } else {
                let image: Image = cdr::decode(&message.data).map_err(text)?;
                (image.header.stamp, Sent::Raw(image))
            };
            by_stamp.entry(stamp.into()).or_default().images[slot] = Some(image);
        }
    }
    let complete = by_stamp.into_iter().filter(|(stamp, _)| usable.contains_key(stamp));
    Ok(complete
        .filter_map(|(_, Partial { images, infos: [left_info, right_info] })| {
            let images = match images {
                [Some(Sent::Raw(left)), Some(Sent::Raw(right))] => ImagePair::Raw(left, right),
                [Some(Sent::Compressed(left)), Some(Sent::Compressed(right))] => {
                    ImagePair::Compressed(left, right)
                }
                _ => return None,
            };
            let info = |info: Option<CameraInfo>, wanted: bool| {
                if wanted { info } else { Some(CameraInfo::default()) }
            };
            Some(StereoMessages {
                images,
                left_info: info(left_info, names[2].is_some())?,
                right_info: info(right_info, names[3].is_some())?,
            })
        })
        .collect())
}

/// Keeps what the node made: bag, report and scores.
pub struct Recorder {
    bag: BagSink,
    report: ReportSink,
    score: ScoreSink,
    totals: RunTotals,
    truth: BTreeMap<Stamp, Truth>,
    paths: [PathBuf; 2],
    failure: Option<String>,
}

impl Recorder {
    /// Outputs in the folder `out`.
    pub fn create(
        out: &Path,
        source: &Path,
        config: &Config,
        truth: BTreeMap<Stamp, Truth>,
    ) -> Result<Self, CommandError> {
        let paths = [out.join("demo.mcap"), out.join("demo.html")];
        let facts = RunFacts {
            command: "demo".into(),
            source: source.display().to_string(),
            config: config.clone(),
        };
        Ok(Self {
            bag: BagSink::create(&paths[0], config, BagTopicsOut::default())
                .map_err(CommandError::failed)?,
            report: ReportSink::create(&paths[1], facts).map_err(CommandError::failed)?,
            score: ScoreSink::new(config.regions.min_area as u32),
            totals: RunTotals::default(),
            truth,
            paths,
            failure: None,
        })
    }

    /// Takes one result of the node, with the truth of its stamp.
    pub fn take(&mut self, observation: &Observation, perception: &Perception) {
        let truth = self.truth.remove(&observation.frame.stamp);
        let observation = Observation { frame: observation.frame.clone(), truth };
        self.totals.add(perception);
        let written = (self.bag.write(&observation, perception).map_err(|e| e.to_string()))
            .and_then(|()| self.report.write(&observation, perception).map_err(|e| e.to_string()));
        if let Err(error) = written {
            self.failure.get_or_insert(error);
        }
        let Ok(()) = self.score.write(&observation, perception);
    }

    /// Completes the outputs and gives the summary for people.
    pub fn finish(&mut self) -> Result<String, CommandError> {
        let bag = self.bag.finish().map_err(CommandError::failed);
        let report = self.report.finish().map_err(CommandError::failed);
        if let Some(failure) = self.failure.take() {
            return Err(CommandError::failed(failure));
        }
        bag.and(report)?;
        let times = self.totals.stats.summary().map(|t| summary::times(&t)).unwrap_or_default();
        let scores = self.score.summary().map(|s| summary::scores(&s)).unwrap_or_default();
        Ok(times + &scores)
    }

    /// The output bag.
    pub fn bag_path(&self) -> &Path {
        &self.paths[0]
    }

    /// The report.
    pub fn report_path(&self) -> &Path {
        &self.paths[1]
    }
}
