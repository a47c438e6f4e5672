//! The records of an MCAP file, parsed from bytes that nobody has vouched for.
//!
//! Format: <https://mcap.dev/spec>. Every length is checked against the bytes
//! that are there, so nothing is allocated for what a length only claims.

use std::collections::BTreeMap;

/// First and last bytes of every MCAP file.
pub const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// Bytes of a record before its content: operation code and length.
pub const HEAD_LEN: usize = 9;

/// Operation codes of the records that are read.
pub mod op {
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const STATISTICS: u8 = 0x0B;
    pub const DATA_END: u8 = 0x0F;
}

/// Reads little-endian values from the front of a slice.
#[derive(Clone, Copy)]
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    pub fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(head)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[b]| b)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn string(&mut self) -> Option<String> {
        let len = self.u32()?;
        let bytes = self.take(usize::try_from(len).ok()?)?;
        // A name that is not UTF-8 is still worth showing.
        Some(String::from_utf8_lossy(bytes).into_owned())
    }
}

/// The records in a slice, one after the other, as operation code, content and
/// the position of the content; ends before the first that is not complete.
pub struct Records<'a> {
    rest: Bytes<'a>,
    len: usize,
}

impl<'a> Records<'a> {
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { rest: Bytes(bytes), len: bytes.len() }
    }

    /// Bytes after the last complete record so far.
    pub const fn left_over(&self) -> usize {
        self.rest.0.len()
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = (u8, usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let mut rest = self.rest;
        let code = rest.u8()?;
        let len = usize::try_from(rest.u64()?).ok()?;
        let at = self.len - rest.0.len();
        let content = rest.take(len)?;
        self.rest = rest;
        Some((code, at, content))
    }
}

/// A topic of one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    pub topic: String,
    /// Name of the message type; empty without schema.
    pub type_name: String,
    pub message_encoding: String,
}

/// Schemas and channels met so far.
#[derive(Clone, Debug, Default)]
pub struct Channels {
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, (u16, Channel)>,
}

impl Channels {
    /// Takes note of a schema or channel; other records are ignored.
    pub fn note(&mut self, code: u8, content: &[u8]) {
        let mut bytes = Bytes(content);
        match code {
            op::SCHEMA => {
                if let (Some(id), Some(name)) = (bytes.u16(), bytes.string()) {
                    self.schemas.insert(id, name);
                }
            }
            op::CHANNEL => {
                let (Some(id), Some(schema_id)) = (bytes.u16(), bytes.u16()) else { return };
                let (Some(topic), Some(message_encoding)) = (bytes.string(), bytes.string()) else {
                    return;
                };
                let channel = Channel { topic, type_name: String::new(), message_encoding };
                self.channels.insert(id, (schema_id, channel));
            }
            _ => {}
        }
    }

    /// All channels by id, with the names of their types.
    pub fn resolve(self) -> BTreeMap<u16, Channel> {
        let Self { schemas, channels } = self;
        let named = |(id, (schema_id, mut channel)): (u16, (u16, Channel))| {
            channel.type_name = schemas.get(&schema_id).cloned().unwrap_or_default();
            (id, channel)
        };
        channels.into_iter().map(named).collect()
    }
}

/// What stands before the bytes of a message.
#[derive(Clone, Copy, Debug)]
pub struct MessageHead {
    pub channel: u16,
    pub log_time: u64,
}

impl MessageHead {
    /// Length in a message record: channel, sequence, log and publish time.
    pub const LEN: usize = 22;

    pub fn parse(content: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(content);
        let channel = bytes.u16()?;
        let _sequence = bytes.u32()?;
        let log_time = bytes.u64()?;
        let _publish_time = bytes.u64()?;
        Some(Self { channel, log_time })
    }
}

/// What stands before the records of a chunk.
#[derive(Clone, Debug)]
pub struct ChunkHead {
    pub uncompressed_size: u64,
    /// CRC-32 of the uncompressed records; 0 when it was not computed.
    pub crc: u32,
    pub compression: String,
    pub compressed_size: u64,
    /// Bytes that this head takes.
    pub len: usize,
}

impl ChunkHead {
    /// More than any head takes: the names of compressions have a few letters.
    pub const MAX_LEN: usize = 256;

    pub fn parse(content: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(content);
        let _start_time = bytes.u64()?;
        let _end_time = bytes.u64()?;
        let uncompressed_size = bytes.u64()?;
        let crc = bytes.u32()?;
        let compression = bytes.string()?;
        let compressed_size = bytes.u64()?;
        let len = content.len() - bytes.0.len();
        Some(Self { uncompressed_size, crc, compression, compressed_size, len })
    }
}

/// Where a chunk stands and which times it covers.
#[derive(Clone, Copy, Debug)]
pub struct ChunkIndex {
    pub start_time: u64,
    pub offset: u64,
    pub len: u64,
}

impl ChunkIndex {
    pub fn parse(content: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(content);
        let start_time = bytes.u64()?;
        let _end_time = bytes.u64()?;
        Some(Self { start_time, offset: bytes.u64()?, len: bytes.u64()? })
    }
}

/// How much a file holds, by its own account.
#[derive(Clone, Debug)]
pub struct Statistics {
    pub messages: u64,
    pub chunks: u32,
    pub per_channel: BTreeMap<u16, u64>,
}

impl Statistics {
    pub fn parse(content: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(content);
        let messages = bytes.u64()?;
        let (_schemas, _channels) = (bytes.u16()?, bytes.u32()?);
        let (_attachments, _metadata) = (bytes.u32()?, bytes.u32()?);
        let chunks = bytes.u32()?;
        let (_start, _end) = (bytes.u64()?, bytes.u64()?);
        let len = usize::try_from(bytes.u32()?).ok()?;
        let mut counts = Bytes(bytes.take(len)?);
        let mut per_channel = BTreeMap::new();
        while let (Some(id), Some(count)) = (counts.u16(), counts.u64()) {
            per_channel.insert(id, count);
        }
        Some(Self { messages, chunks, per_channel })
    }
}
