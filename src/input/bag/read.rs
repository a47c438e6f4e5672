//! The messages of a bag in the order of their log times.
//!
//! A bag is a list of units (see [`Unit`]) of one or several files, ordered by
//! the log time of their first message. Units are opened when their time comes
//! and merged message by message, so overlapping chunks and files, as of a bag
//! split over several writers, come out in order; equal times keep the order of
//! the files. Memory holds the open units only: one, unless they overlap.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use super::error::BagError;
use super::index::{self, Index, Recovered};
use super::record::MAGIC;
use super::unit::{self, Limits, Span, Unit};

/// Open units beyond this many bytes are drained before another one is opened:
/// a bag made to overlap everywhere then loses its order, not the memory.
const OPEN_BYTES: usize = 1 << 30;

/// One topic of a bag.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicInfo {
    /// As `sensor_msgs/msg/Image`.
    pub type_name: String,
    /// As `cdr`.
    pub message_encoding: String,
    /// Messages in all files.
    pub messages: u64,
}

/// One message.
pub struct BagMessage {
    /// What [`Reader::select`] was given for its topic.
    pub topic: usize,
    /// When the recorder took it, nanoseconds.
    pub log_time: u64,
    /// Its bytes.
    pub data: Vec<u8>,
}

/// Reads the messages of selected topics.
pub struct Reader {
    files: Vec<BagFile>,
    units: Vec<Unit>,
    next_unit: usize,
    open: Vec<Open>,
    spare: Vec<Open>,
    limits: Limits,
    bytes: u64,
    bytes_read: u64,
    messages: u64,
    messages_met: u64,
    damage: BTreeMap<String, u64>,
}

struct BagFile {
    path: PathBuf,
    source: BufReader<File>,
    index: Index,
    selected: BTreeMap<u16, usize>,
}

/// A unit in memory.
struct Open {
    unit: usize,
    file: usize,
    records: Vec<u8>,
    spans: Vec<Span>,
    next: usize,
}

impl Reader {
    /// Opens the files of one bag and finds out what they hold.
    ///
    /// # Errors
    /// When a file cannot be read or is no MCAP file.
    pub fn open(paths: &[PathBuf], limits: Limits) -> Result<Self, BagError> {
        let mut files = Vec::with_capacity(paths.len());
        let mut units = Vec::new();
        for (number, path) in paths.iter().enumerate() {
            let file = BagFile::open(path, number, limits)?;
            units.extend_from_slice(&file.index.units);
            files.push(file);
        }
        // Stable: units of equal time stay in the order of files and offsets.
        units.sort_by_key(|unit| unit.start_time);
        Ok(Self {
            bytes: units.iter().map(|unit| unit.len).sum(),
            messages: files.iter().map(|file| file.index.messages).sum(),
            files,
            units,
            next_unit: 0,
            open: Vec::new(),
            spare: Vec::new(),
            limits,
            bytes_read: 0,
            messages_met: 0,
            damage: BTreeMap::new(),
        })
    }

    /// All topics by name.
    pub fn topics(&self) -> BTreeMap<String, TopicInfo> {
        let mut topics: BTreeMap<String, TopicInfo> = BTreeMap::new();
        for index in self.files.iter().map(|file| &file.index) {
            for (id, channel) in &index.channels {
                let info = topics.entry(channel.topic.clone()).or_default();
                info.messages += index.counts.get(id).copied().unwrap_or(0);
                info.type_name.clone_from(&channel.type_name);
                info.message_encoding.clone_from(&channel.message_encoding);
            }
        }
        topics
    }

    /// Number of messages, of all topics, by the account of the files.
    pub const fn message_count(&self) -> u64 {
        self.messages
    }

    /// Files that had no index, with how they ended and the messages found.
    pub fn recovered(&self) -> impl Iterator<Item = (&Path, u64, &Recovered)> {
        self.files.iter().filter_map(|file| {
            let recovered = file.index.recovered.as_ref()?;
            Some((file.path.as_path(), file.index.messages, recovered))
        })
    }

    /// Delivers the messages of `topic` with the number `as_number`.
    pub fn select(&mut self, topic: &str, as_number: usize) {
        for file in &mut self.files {
            let ids = file.index.channels.iter().filter(|(_, channel)| channel.topic == topic);
            file.selected.extend(ids.map(|(id, _)| (*id, as_number)));
        }
    }

    /// Share of the bytes that has been read, 0..=1.
    pub fn progress(&self) -> f64 {
        if self.bytes == 0 { 1.0 } else { self.bytes_read as f64 / self.bytes as f64 }
    }

    /// Pieces of the files that could not be used, by reason.
    pub const fn damage(&self) -> &BTreeMap<String, u64> {
        &self.damage
    }

    /// Messages that the files promise and did not give; right at the end only.
    pub const fn messages_missing(&self) -> u64 {
        self.messages.saturating_sub(self.messages_met)
    }

    /// The next message of a selected topic.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn next_message(&mut self) -> Result<Option<BagMessage>, BagError> {
        loop {
            let earliest = self
                .open
                .iter()
                .enumerate()
                .filter_map(|(at, open)| Some((open.spans.get(open.next)?.log_time, open.unit, at)))
                .min();
            if let Some(unit) = self.units.get(self.next_unit)
                && earliest.is_none_or(|(time, ..)| unit.start_time <= time)
                && (earliest.is_none() || self.open_bytes() < OPEN_BYTES)
            {
                self.open_next()?;
                continue;
            }
            let Some((_, _, at)) = earliest else { return Ok(None) };
            let open = &mut self.open[at];
            let span = open.spans[open.next];
            open.next += 1;
            let topic = self.files[open.file].selected.get(&span.channel).copied();
            let message = topic.map(|topic| BagMessage {
                topic,
                log_time: span.log_time,
                data: open.records[span.start..span.end].to_vec(),
            });
            if open.next == open.spans.len() {
                let drained = self.open.swap_remove(at);
                self.spare.push(drained);
            }
            if message.is_some() {
                return Ok(message);
            }
        }
    }

    fn open_bytes(&self) -> usize {
        self.open.iter().map(|open| open.records.len()).sum()
    }

    fn open_next(&mut self) -> Result<(), BagError> {
        let number = self.next_unit;
        let unit = self.units[number];
        self.next_unit += 1;
        let file = &mut self.files[unit.file];
        let mut open = self.spare.pop().unwrap_or_else(|| Open {
            unit: 0,
            file: 0,
            records: Vec::new(),
            spans: Vec::new(),
            next: 0,
        });
        (open.unit, open.file, open.next) = (number, unit.file, 0);
        let mut damage = unit::load(&mut file.source, &unit, self.limits, &mut open.records)
            .map_err(|source| BagError::Io { path: file.path.clone(), source })?;
        let whole = unit::messages(&open.records, &mut open.spans);
        if !whole && damage.is_none() {
            damage = Some(unit::Damage::Broken);
        }
        if let Some(damage) = damage {
            *self.damage.entry(damage.reason()).or_default() += 1;
        }
        self.bytes_read += unit.len;
        self.messages_met += open.spans.len() as u64;
        if open.spans.is_empty() {
            self.spare.push(open);
        } else {
            self.open.push(open);
        }
        Ok(())
    }
}

impl BagFile {
    fn open(path: &Path, number: usize, limits: Limits) -> Result<Self, BagError> {
        let unreadable = |source| BagError::Io { path: path.to_owned(), source };
        let file = File::open(path).map_err(unreadable)?;
        let len = file.metadata().map_err(unreadable)?.len();
        let mut source = BufReader::with_capacity(1 << 16, file);
        let mut start = Vec::new();
        source.by_ref().take(MAGIC.len() as u64).read_to_end(&mut start).map_err(unreadable)?;
        if start != MAGIC {
            return Err(not_mcap(path, &start));
        }
        let index = index::index(&mut source, number, len, limits).map_err(unreadable)?;
        Ok(Self { path: path.to_owned(), source, index, selected: BTreeMap::new() })
    }
}

fn not_mcap(path: &Path, start: &[u8]) -> BagError {
    if start.starts_with(b"SQLite f") {
        return BagError::Sqlite { path: path.to_owned() };
    }
    let hint = if start.starts_with(b"#ROSBAG") {
        " (a ROS 1 bag): convert it to ROS 2 with `rosbags-convert`"
    } else if start.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        " (a zstd file): decompress it with `zstd -d`"
    } else {
        ""
    };
    let start = if start.is_empty() {
        "nothing, the file is empty".to_owned()
    } else {
        format!("\"{}\"", start.escape_ascii())
    };
    BagError::NotMcap { path: path.to_owned(), start, hint }
}
