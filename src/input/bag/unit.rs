//! A unit: a piece of a file that is read at once, a chunk or a run of records
//! outside chunks, and the messages in it.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use super::record::{Bytes, ChunkHead, HEAD_LEN, MessageHead, Records, op};

/// Bounds on what a file may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest message, bytes.
    pub message: usize,
    /// Largest chunk after decompression, bytes.
    pub chunk: usize,
}

impl Default for Limits {
    /// A message of 256 MiB (an 8K image of 16-bit colours takes 200) and a
    /// chunk of 512 MiB (recorders close theirs after 1 to 4).
    fn default() -> Self {
        Self { message: 256 << 20, chunk: 512 << 20 }
    }
}

/// Where a unit stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Number of the file in the bag.
    pub file: usize,
    /// First byte.
    pub offset: u64,
    /// Length in bytes, heads included.
    pub len: u64,
    /// Log time of the earliest message.
    pub start_time: u64,
    /// The file ends inside.
    pub cut: bool,
}

/// Why a unit gave fewer messages than it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The file ends inside.
    Cut,
    /// Cannot be decompressed or parsed.
    Broken,
    /// Decompressed, but not to what was recorded.
    Checksum,
    /// Compressed by something else than zstd or LZ4.
    Compression(String),
    /// Larger than the limit.
    TooLarge(u64),
}

impl Damage {
    /// The reason, for counting.
    pub fn reason(&self) -> String {
        match self {
            Self::Cut => "chunk cut off by the end of the file".to_owned(),
            Self::Broken => "chunk broken".to_owned(),
            Self::Checksum => "chunk with a wrong checksum".to_owned(),
            Self::Compression(name) => {
                format!("chunk compressed by '{}' (zstd and lz4 are known)", name.escape_default())
            }
            Self::TooLarge(limit) => format!("chunk larger than {} MiB", limit >> 20),
        }
    }
}

/// Reads the records of `unit` into `records` (without the chunk around them).
///
/// The buffer grows with what is really there, up to the limit.
///
/// # Errors
/// When the file cannot be read.
pub fn load(
    file: &mut BufReader<File>,
    unit: &Unit,
    limits: Limits,
    records: &mut Vec<u8>,
) -> io::Result<Option<Damage>> {
    records.clear();
    file.seek(SeekFrom::Start(unit.offset))?;
    let mut source = file.take(unit.len);
    let mut head = [0; HEAD_LEN + ChunkHead::MAX_LEN];
    let got = read_up_to(&mut source, &mut head)?;
    let head = &head[..got];
    if head.first() != Some(&op::CHUNK) {
        // A run is no larger than its records, which were measured when it was found.
        records.extend_from_slice(head);
        source.read_to_end(records)?;
        return Ok(None);
    }
    let Some(chunk) = head.get(HEAD_LEN..).and_then(ChunkHead::parse) else {
        return Ok(Some(Damage::Broken));
    };
    let compressed = &head[HEAD_LEN + chunk.len..];
    let source = compressed.chain(source).take(chunk.compressed_size);
    let limit = (limits.chunk as u64).min(chunk.uncompressed_size);
    // One byte more than allowed shows that there is more.
    let read = match chunk.compression.as_str() {
        "" => source.take(limit + 1).read_to_end(records),
        "zstd" => zstd::stream::read::Decoder::new(source)
            .and_then(|decoder| decoder.take(limit + 1).read_to_end(records)),
        "lz4" => lz4::Decoder::new(source)
            .and_then(|decoder| decoder.take(limit + 1).read_to_end(records)),
        _ => return Ok(Some(Damage::Compression(chunk.compression))),
    };
    if unit.cut {
        return Ok(Some(Damage::Cut));
    }
    if records.len() as u64 > limit {
        records.clear();
        let too_large = chunk.uncompressed_size > limits.chunk as u64;
        return Ok(Some(if too_large { Damage::TooLarge(limit) } else { Damage::Broken }));
    }
    if read.is_err() || (records.len() as u64) < chunk.uncompressed_size {
        // What came before the fault cannot be told from what it made of it.
        records.clear();
        return Ok(Some(Damage::Broken));
    }
    if chunk.crc != 0 && chunk.crc != crc32fast::hash(records) {
        records.clear();
        return Ok(Some(Damage::Checksum));
    }
    Ok(None)
}

/// Where a message stands in the records of its unit.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    pub log_time: u64,
    pub channel: u16,
    pub start: usize,
    pub end: usize,
}

/// Finds the messages among `records` in the order of their log times, those
/// of equal time as they stand; false when the records break off.
pub fn messages(records: &[u8], spans: &mut Vec<Span>) -> bool {
    spans.clear();
    let mut all = Records::new(records);
    for (code, at, content) in &mut all {
        if code == op::MESSAGE
            && let Some(head) = MessageHead::parse(content)
        {
            spans.push(Span {
                log_time: head.log_time,
                channel: head.channel,
                start: at + MessageHead::LEN,
                end: at + content.len(),
            });
        }
    }
    // Stable, so that ties keep the order of the file.
    spans.sort_by_key(|span| span.log_time);
    all.left_over() == 0
}

/// Fills `buffer` as far as the source goes.
pub fn read_up_to(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match source.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

/// Operation code and length of the record at the front of `head`.
pub fn record_head(head: &[u8]) -> Option<(u8, u64)> {
    let mut bytes = Bytes(head);
    Some((bytes.u8()?, bytes.u64()?))
}
