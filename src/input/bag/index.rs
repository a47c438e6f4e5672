//! What a file holds and where: from its summary when there is a whole one,
//! else by walking through the file, as for one whose recorder crashed.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

use super::record::{
    Bytes, Channel, Channels, ChunkIndex, HEAD_LEN, MAGIC, MessageHead, Records, Statistics, op,
};
use super::unit::{self, Limits, Unit};

/// Bytes of the last record with its head, and of the magic after it.
const FOOTER_LEN: u64 = 9 + 20;
const TAIL_LEN: u64 = FOOTER_LEN + 8;

/// Records outside chunks are read in runs of about this many bytes.
const RUN_BYTES: u64 = 4 << 20;

/// Most runs and chunks of one file: at 1 MiB each, 4 TiB.
const MAX_UNITS: usize = 1 << 22;

/// Largest summary that is read; a larger one is treated as none.
const MAX_SUMMARY_BYTES: u64 = 256 << 20;

/// What one file holds.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// Its topics by channel id.
    pub channels: BTreeMap<u16, Channel>,
    /// Messages per channel.
    pub counts: BTreeMap<u16, u64>,
    /// Its pieces in file order.
    pub units: Vec<Unit>,
    /// All messages.
    pub messages: u64,
    /// Set when the file had to be walked through although it should have an index.
    pub recovered: Option<Recovered>,
}

/// How a file without index ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// Where the walk stopped, bytes.
    pub at: u64,
    /// Bytes behind it that could not be used.
    pub lost: u64,
}

/// The index of an open file that starts with the magic.
///
/// # Errors
/// When the file cannot be read.
pub fn index(
    file: &mut BufReader<File>,
    number: usize,
    len: u64,
    limits: Limits,
) -> io::Result<Index> {
    match from_summary(file, number, len)? {
        Some(index) => Ok(index),
        None => walk(file, number, len, limits),
    }
}

/// The index from the summary; `None` when there is none, or not a whole one.
fn from_summary(file: &mut BufReader<File>, number: usize, len: u64) -> io::Result<Option<Index>> {
    let Some(footer_at) = len.checked_sub(TAIL_LEN) else { return Ok(None) };
    let mut tail = [0; TAIL_LEN as usize];
    file.seek(SeekFrom::Start(footer_at))?;
    file.read_exact(&mut tail)?;
    let Some((start, crc)) = footer(&tail) else { return Ok(None) };
    if start < MAGIC.len() as u64 || start >= footer_at || footer_at - start > MAX_SUMMARY_BYTES {
        return Ok(None);
    }
    let mut summary = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(footer_at - start).read_to_end(&mut summary)?;
    if crc != 0 {
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&summary);
        // All of the footer before the checksum itself belongs to it.
        hasher.update(&tail[..HEAD_LEN + 16]);
        if hasher.finalize() != crc {
            return Ok(None);
        }
    }
    let mut channels = Channels::default();
    let mut statistics = None;
    let mut index = Index::default();
    for (code, _, content) in Records::new(&summary) {
        match code {
            op::STATISTICS => statistics = Statistics::parse(content),
            op::CHUNK_INDEX => {
                let Some(chunk) = ChunkIndex::parse(content) else { return Ok(None) };
                if chunk.offset.checked_add(chunk.len).is_none_or(|end| end > start) {
                    return Ok(None);
                }
                index.units.push(Unit {
                    file: number,
                    offset: chunk.offset,
                    len: chunk.len,
                    start_time: chunk.start_time,
                    cut: false,
                });
            }
            _ => channels.note(code, content),
        }
    }
    // Each byte belongs to one chunk at most: else a small file could make the
    // reader decompress the same chunk without end.
    index.units.sort_by_key(|unit| unit.offset);
    if index.units.windows(2).any(|two| two[0].offset + two[0].len > two[1].offset) {
        return Ok(None);
    }
    index.channels = channels.resolve();
    let Some(statistics) = statistics else { return Ok(None) };
    index.counts = statistics.per_channel;
    index.messages = statistics.messages;
    // Unchunked messages have no index, and a summary may leave things out.
    let whole = index.units.len() == statistics.chunks as usize
        && (index.messages == 0 || !index.units.is_empty())
        && index.counts.keys().all(|id| index.channels.contains_key(id));
    Ok(whole.then_some(index))
}

/// Start of the summary and its checksum; `None` when the file does not end as
/// it should or has no summary.
fn footer(tail: &[u8]) -> Option<(u64, u32)> {
    let mut bytes = Bytes(tail);
    let (code, len) = (bytes.u8()?, bytes.u64()?);
    let (start, _offsets, crc) = (bytes.u64()?, bytes.u64()?, bytes.u32()?);
    (code == op::FOOTER && len == FOOTER_LEN - 9 && bytes.0 == MAGIC && start != 0)
        .then_some((start, crc))
}

/// The index from the file itself, record by record.
fn walk(file: &mut BufReader<File>, number: usize, len: u64, limits: Limits) -> io::Result<Index> {
    let mut walk = Walk {
        index: Index::default(),
        channels: Channels::default(),
        run: None,
        records: Vec::new(),
        spans: Vec::new(),
        number,
    };
    let mut at = MAGIC.len() as u64;
    let mut ended = false;
    file.seek(SeekFrom::Start(at))?;
    while at < len && walk.index.units.len() < MAX_UNITS {
        let mut head = [0; HEAD_LEN];
        if unit::read_up_to(file, &mut head)? < HEAD_LEN {
            break;
        }
        let Some((code, record_len)) = unit::record_head(&head) else { break };
        if code == op::DATA_END || code == op::FOOTER {
            ended = true;
            break;
        }
        let room = len - at - HEAD_LEN as u64;
        let cut = record_len > room;
        if code == 0 || (cut && code != op::CHUNK) {
            break;
        }
        let unit_len = HEAD_LEN as u64 + record_len.min(room);
        match code {
            op::CHUNK => {
                walk.close_run();
                walk.chunk(
                    file,
                    Unit { file: number, offset: at, len: unit_len, start_time: 0, cut },
                    limits,
                )?;
                file.seek(SeekFrom::Start(at + unit_len))?;
            }
            op::MESSAGE if record_len > limits.message as u64 => break,
            op::MESSAGE => {
                let mut head = [0; MessageHead::LEN];
                let got = unit::read_up_to(
                    file,
                    &mut head[..record_len.min(MessageHead::LEN as u64) as usize],
                )?;
                if let Some(head) = MessageHead::parse(&head[..got]) {
                    walk.message(at, unit_len, head);
                }
                file.seek_relative((record_len - got as u64) as i64)?;
            }
            op::SCHEMA | op::CHANNEL => {
                walk.records.clear();
                file.take(record_len).read_to_end(&mut walk.records)?;
                walk.channels.note(code, &walk.records);
            }
            _ => {
                file.seek_relative(record_len as i64)?;
            }
        }
        at += unit_len;
        if cut {
            break;
        }
    }
    walk.close_run();
    let Walk { mut index, channels, .. } = walk;
    index.channels = channels.resolve();
    if !ended {
        index.recovered = Some(Recovered { at, lost: len - at.min(len) });
    }
    Ok(index)
}

struct Walk {
    index: Index,
    channels: Channels,
    run: Option<Unit>,
    records: Vec<u8>,
    spans: Vec<unit::Span>,
    number: usize,
}

impl Walk {
    fn chunk(
        &mut self,
        file: &mut BufReader<File>,
        mut chunk: Unit,
        limits: Limits,
    ) -> io::Result<()> {
        unit::load(file, &chunk, limits, &mut self.records)?;
        for (code, _, content) in Records::new(&self.records) {
            self.channels.note(code, content);
        }
        unit::messages(&self.records, &mut self.spans);
        for span in &self.spans {
            *self.index.counts.entry(span.channel).or_default() += 1;
        }
        self.index.messages += self.spans.len() as u64;
        // A chunk that gave nothing is kept, so that reading it counts the damage.
        chunk.start_time = self.spans.first().map_or(0, |span| span.log_time);
        self.index.units.push(chunk);
        Ok(())
    }

    fn message(&mut self, offset: u64, len: u64, head: MessageHead) {
        *self.index.counts.entry(head.channel).or_default() += 1;
        self.index.messages += 1;
        // Records between two messages belong to the run: it stays contiguous.
        match &mut self.run {
            Some(run) if offset + len - run.offset <= RUN_BYTES => {
                run.len = offset + len - run.offset;
                run.start_time = run.start_time.min(head.log_time);
            }
            _ => {
                self.close_run();
                self.run = Some(Unit {
                    file: self.number,
                    offset,
                    len,
                    start_time: head.log_time,
                    cut: false,
                });
            }
        }
    }

    fn close_run(&mut self) {
        self.index.units.extend(self.run.take());
    }
}
