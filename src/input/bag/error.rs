//! What can stop the reading of a bag.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// What can stop the reading of a bag. Damage that leaves something to use is
/// not an error: it is counted.
#[derive(Debug, Error)]
pub enum BagError {
    /// The system refuses.
    #[error("cannot read {path}: {source}")]
    Io {
        /// File or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Some other kind of file.
    #[error("{path} is not an MCAP file: it starts with {start}{hint}")]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// Its first bytes.
        start: String,
        /// What it may be instead, and what to do.
        hint: &'static str,
    },
    /// A bag of the other storage.
    #[error(
        "{path} is an sqlite3 bag, which is not read here: convert it with `ros2 bag convert -i {path} -o convert.yaml`, where convert.yaml says `output_bags: [{{uri: converted, storage_id: mcap, all_topics: true}}]`"
    )]
    Sqlite {
        /// File or folder.
        path: PathBuf,
    },
    /// Compression around the storage instead of inside it.
    #[error(
        "{path} uses {format} compression of whole {mode}s (rosbag2 --compression-mode {mode}), which is not read here: convert it with `ros2 bag convert` to an mcap bag without compression_mode (MCAP compresses inside: --storage-preset-profile zstd_fast)"
    )]
    Compressed {
        /// The folder.
        path: PathBuf,
        /// `zstd` most often.
        format: String,
        /// `file` or `message`.
        mode: String,
    },
    /// A folder that is no bag.
    #[error("{path} is no bag folder: it has neither metadata.yaml nor a file that ends in .mcap")]
    NoFiles {
        /// The folder.
        path: PathBuf,
    },
    /// `metadata.yaml` says something else than it should.
    #[error("{path}: {reason}")]
    Metadata {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// `metadata.yaml` points elsewhere.
    #[error(
        "{path} names '{named}', which is not inside the bag's folder: a bag may only consist of files of its own"
    )]
    Outside {
        /// The metadata file.
        path: PathBuf,
        /// The file it names.
        named: String,
    },
    /// No message at all.
    #[error("the bag {path} holds no message{note}")]
    Empty {
        /// File or folder.
        path: PathBuf,
        /// What else was noticed about it.
        note: String,
    },
    /// Nothing to pair.
    #[error("the bag {path} has no stereo images: {wanted}; its topics are {topics}{hint}")]
    NoImages {
        /// File or folder.
        path: PathBuf,
        /// Which topics were looked for.
        wanted: String,
        /// What is there.
        topics: String,
        /// What to try.
        hint: String,
    },
    /// Several stereo cameras.
    #[error(
        "the bag {path} has several stereo cameras ({namespaces}): name the topics of the one to use"
    )]
    Ambiguous {
        /// File or folder.
        path: PathBuf,
        /// Their namespaces.
        namespaces: String,
    },
    /// A topic that was asked for by name.
    #[error("the bag {path} has no topic {topic}; its topics are {topics}")]
    NoTopic {
        /// File or folder.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// What is there.
        topics: String,
    },
    /// A topic that carries something else.
    #[error("topic {topic} of the bag {path} carries {found}, not {wanted}")]
    TopicType {
        /// File or folder.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The type it has.
        found: String,
        /// The type it should have.
        wanted: String,
    },
    /// Messages in another form.
    #[error(
        "the messages of topic {topic} of the bag {path} are encoded as {encoding}; ROS 2 messages (cdr) are read here"
    )]
    Encoding {
        /// File or folder.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// `json`, `ros1`, `protobuf` …
        encoding: String,
    },
    /// Images without a topic for their calibration.
    #[error(
        "the bag {path} has no camera info topic {topic}: record it too, or give the calibration with camera_info.left_url and camera_info.right_url; its topics are {topics}"
    )]
    NoCameraInfoTopic {
        /// File or folder.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// What is there.
        topics: String,
    },
    /// Images without calibration.
    #[error(
        "{frames} pairs of images, but no camera info on {missing} in the bag {path}: record it too, or give the calibration with camera_info.left_url and camera_info.right_url"
    )]
    NoCameraInfo {
        /// File or folder.
        path: PathBuf,
        /// Pairs that had to be dropped.
        frames: u64,
        /// The topics without message.
        missing: String,
    },
}
