//! Writes ROS 2 messages into an MCAP bag that rosbag2 and Foxglove read.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapError, WriteOptions, Writer};
use thiserror::Error;

use super::metadata::{self, Summary, TopicSummary};
use crate::ros::cdr;
use crate::ros::message::Message;
use crate::ros::schema;
use crate::stamp::Stamp;

/// What can go wrong while a bag is written.
#[derive(Debug, Error)]
pub enum BagWriteError {
    /// File or folder cannot be made.
    #[error("cannot create the bag {path}: {source}")]
    Create {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The path ends in nothing that can name a bag.
    #[error("'{path}' names no bag: give a file that ends in .mcap, or a folder")]
    NoName {
        /// As given.
        path: PathBuf,
    },
    /// A message, index or the end of the file could not be written.
    #[error("cannot write the bag {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What was met: the disk is full, most often.
        source: McapError,
    },
    /// A type without a definition text.
    #[error("{type_name} has no message definition and cannot be written into a bag")]
    NoDefinition {
        /// The type.
        type_name: &'static str,
    },
    /// A message after the end.
    #[error("the bag {path} is finished already")]
    Finished {
        /// The file.
        path: PathBuf,
    },
}

/// How the messages are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// Chunks compressed by zstd.
    Zstd,
    /// Chunks compressed by LZ4.
    Lz4,
    /// Chunks without compression.
    Plain,
    /// No chunks, hence no index: as small recorders write.
    Unchunked,
}

/// A topic of a bag under construction, for messages `T`.
#[derive(Debug)]
pub struct Topic<T> {
    index: usize,
    message: PhantomData<fn(&T)>,
}

impl<T> Clone for Topic<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Topic<T> {}

/// A bag under construction: one `.mcap` file, alone or in a bag folder with
/// `metadata.yaml`.
///
/// It is written in place: whatever [`BagWriter::flush`] has passed on survives
/// when the process is killed, and is found again by a linear scan. The same
/// messages give the same bytes.
pub struct BagWriter {
    file: PathBuf,
    folder: Option<PathBuf>,
    writer: Option<Writer<BufWriter<File>>>,
    topics: Vec<TopicSummary>,
    channels: Vec<u16>,
    bounds: Option<(u64, u64)>,
    encoded: Vec<u8>,
}

impl BagWriter {
    /// A bag at `path`: a single file when it ends in `.mcap`, else a folder.
    /// What stood there under the same name is overwritten.
    ///
    /// # Errors
    /// When file or folder cannot be made.
    pub fn create(path: &Path) -> Result<Self, BagWriteError> {
        Self::create_packed(path, Packing::Zstd)
    }

    /// As [`BagWriter::create`], with another packing.
    ///
    /// # Errors
    /// As [`BagWriter::create`].
    pub fn create_packed(path: &Path, packing: Packing) -> Result<Self, BagWriteError> {
        let (file, folder) = place(path)?;
        let failed = |source| BagWriteError::Create { path: path.to_owned(), source };
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent).map_err(failed)?;
        }
        if let Some(folder) = &folder {
            // Old metadata would describe another bag until this one is finished.
            match fs::remove_file(folder.join(metadata::FILE_NAME)) {
                Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(failed(e)),
                _ => {}
            }
        }
        let sink = BufWriter::new(File::create(&file).map_err(failed)?);
        let mut options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("salient_stereo ", env!("CARGO_PKG_VERSION")))
            .compression(match packing {
                Packing::Zstd => Some(Compression::Zstd),
                Packing::Lz4 => Some(Compression::Lz4),
                Packing::Plain | Packing::Unchunked => None,
            })
            .use_chunks(packing != Packing::Unchunked)
            .chunk_size(Some(CHUNK_BYTES))
            // A chunk then reaches the file whole, so that a killed process
            // leaves no half-written one.
            .disable_seeking(true);
        // With worker threads the bytes would depend on the machine.
        options = options.compression_threads(0);
        let writer = options
            .create(sink)
            .map_err(|source| BagWriteError::Write { path: file.clone(), source })?;
        Ok(Self {
            file,
            folder,
            writer: Some(writer),
            topics: Vec::new(),
            channels: Vec::new(),
            bounds: None,
            encoded: Vec::new(),
        })
    }

    /// The `.mcap` file.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Adds a topic for messages of one type.
    ///
    /// # Errors
    /// When the type has no definition, or on a failed write.
    pub fn topic<T: Message>(&mut self, name: &str) -> Result<Topic<T>, BagWriteError> {
        let type_name = T::TYPE_NAME;
        let no_definition = BagWriteError::NoDefinition { type_name };
        let (Some(text), Some(type_hash)) =
            (schema::definition(type_name), schema::type_hash(type_name))
        else {
            return Err(no_definition);
        };
        let channel = [
            ("offered_qos_profiles".to_owned(), metadata::OFFERED_QOS.to_owned()),
            ("topic_type_hash".to_owned(), type_hash.clone()),
        ]
        .into();
        let id = self.try_write(|writer| {
            let schema = writer.add_schema(type_name, "ros2msg", text.as_bytes())?;
            writer.add_channel(schema, name, "cdr", &channel)
        })?;
        self.topics.push(TopicSummary {
            name: name.to_owned(),
            type_name: type_name.to_owned(),
            type_hash,
            messages: 0,
        });
        self.channels.push(id);
        Ok(Topic { index: self.topics.len() - 1, message: PhantomData })
    }

    /// Writes a message; `stamp` becomes its log and publish time.
    ///
    /// # Errors
    /// On a failed write.
    pub fn write<T: Message>(
        &mut self,
        topic: Topic<T>,
        stamp: Stamp,
        message: &T,
    ) -> Result<(), BagWriteError> {
        let mut encoded = std::mem::take(&mut self.encoded);
        cdr::encode_into(message, &mut encoded);
        let written = self.write_encoded(topic, stamp, &encoded);
        self.encoded = encoded;
        written
    }

    /// Writes a message that is encoded already (CDR with its header).
    ///
    /// # Errors
    /// On a failed write.
    pub fn write_encoded<T: Message>(
        &mut self,
        topic: Topic<T>,
        stamp: Stamp,
        encoded: &[u8],
    ) -> Result<(), BagWriteError> {
        let time = u64::try_from(stamp.0).unwrap_or(0);
        let header = MessageHeader {
            channel_id: self.channels[topic.index],
            sequence: self.topics[topic.index].messages as u32,
            log_time: time,
            publish_time: time,
        };
        self.try_write(|writer| writer.write_to_known_channel(&header, encoded))?;
        self.topics[topic.index].messages += 1;
        let (start, end) = self.bounds.unwrap_or((time, time));
        self.bounds = Some((start.min(time), end.max(time)));
        Ok(())
    }

    /// Passes everything on to the system: it survives the death of the process.
    ///
    /// # Errors
    /// On a failed write.
    pub fn flush(&mut self) -> Result<(), BagWriteError> {
        self.try_write(Writer::flush)
    }

    /// Writes index, summary and metadata. Nothing can be written afterwards;
    /// a second call does nothing.
    ///
    /// # Errors
    /// On a failed write.
    pub fn finish(&mut self) -> Result<(), BagWriteError> {
        if self.writer.is_none() {
            return Ok(());
        }
        let file_name = self.file.file_name().map(|name| name.to_string_lossy().into_owned());
        let mut summary = Summary {
            file_name: None,
            topics: &self.topics,
            bounds: self.bounds.unwrap_or((0, 0)),
        };
        let record = Metadata {
            name: "rosbag2".to_owned(),
            metadata: [("serialized_metadata".to_owned(), summary.fields(""))].into(),
        };
        summary.file_name = file_name;
        let yaml = summary.file();
        self.try_write(|writer| {
            writer.write_metadata(&record)?;
            writer.finish()?;
            Ok(())
        })?;
        let failed = |source| BagWriteError::Write { path: self.file.clone(), source };
        if let Some(writer) = self.writer.take() {
            let sink = writer.into_inner();
            sink.into_inner().map_err(|e| failed(McapError::Io(e.into_error())))?;
        }
        if let Some(folder) = &self.folder {
            fs::write(folder.join(metadata::FILE_NAME), yaml)
                .map_err(|e| failed(McapError::Io(e)))?;
        }
        Ok(())
    }

    fn try_write<R>(
        &mut self,
        act: impl FnOnce(&mut Writer<BufWriter<File>>) -> Result<R, McapError>,
    ) -> Result<R, BagWriteError> {
        let Some(writer) = &mut self.writer else {
            return Err(BagWriteError::Finished { path: self.file.clone() });
        };
        act(writer).map_err(|source| BagWriteError::Write { path: self.file.clone(), source })
    }
}

/// Bytes of messages after which a chunk is closed, flushed or not.
const CHUNK_BYTES: u64 = 4 << 20;

/// Where the `.mcap` file goes, and the folder around it unless it stands alone.
fn place(path: &Path) -> Result<(PathBuf, Option<PathBuf>), BagWriteError> {
    let no_name = || BagWriteError::NoName { path: path.to_owned() };
    let name = path.file_name().ok_or_else(no_name)?;
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
        return Ok((path.to_owned(), None));
    }
    let file = path.join(format!("{}_0.mcap", name.to_string_lossy()));
    Ok((file, Some(path.to_owned())))
}
