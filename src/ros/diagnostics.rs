//! The health of the node: counters that its threads write, and the
//! `/diagnostics` message made of them once a second.

mod draft;
mod echo;
mod report;
mod section;

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub use report::{Reporter, Surroundings};

use echo::Echo;

use crate::metric::Epipolar;
use crate::perception::{Rejections, StageTimes};
use crate::stage::ground::Footing;
use crate::sync::{Counts, Settings};

/// Most drop reasons that are told apart: their texts hold numbers of untrusted
/// messages.
const MAX_REASONS: usize = 32;

/// Measurements of the alignment that are kept: one of them may be wrong.
const ALIGNMENTS: usize = 5;

/// What the input thread knows.
#[derive(Clone, Debug)]
pub struct InputState {
    /// What became of the images.
    pub counts: Counts,
    /// Pairs that wait for camera infos.
    pub waiting_for_info: usize,
    /// Whether a left and a right camera info has ever come.
    pub has_info: [bool; 2],
    /// The settings under which `counts` are to be explained.
    pub explanation_settings: Settings,
    /// When this was written.
    pub since: Instant,
}

/// Counters of a running node, shared by its threads.
#[derive(Debug)]
pub struct NodeStatus {
    started: Instant,
    /// Nanoseconds from `started` to the last image and to the last pair, plus 1; 0: none yet.
    last_arrival: AtomicU64,
    last_pair: AtomicU64,
    paired: AtomicU64,
    displaced: AtomicU64,
    processed: AtomicU64,
    regions: AtomicU64,
    output_displaced: AtomicU64,
    would_block: AtomicU64,
    publish_errors: AtomicU64,
    oversized: AtomicU64,
    largest_regions_bytes: AtomicU64,
    input: Mutex<Option<InputState>>,
    dropped: Mutex<BTreeMap<String, u64>>,
    calibration: Mutex<Option<Result<String, String>>>,
    alignment: Mutex<VecDeque<Epipolar>>,
    ground: Mutex<Option<Footing>>,
    latency: Mutex<Latency>,
    work: Mutex<Work>,
    published: Mutex<BTreeMap<String, u64>>,
    echo: Mutex<Echo>,
}

/// Where the time went since the last report.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Frames in the sums.
    pub frames: u32,
    /// Sum of the stage times, by [`crate::perception::Stage::ALL`].
    pub stage_ms: [f64; 9],
    /// Longest total of a frame.
    pub longest_ms: f64,
    /// Sum of the shares of the image that were matched.
    pub roi_fraction: f64,
    /// Candidates refused, summed.
    pub rejections: [u64; Rejections::KINDS],
}

/// How long results took since the last report, from the complete pair to the
/// published regions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Latency {
    /// Results in the sums.
    pub results: u32,
    /// Sum, milliseconds.
    pub sum_ms: f64,
    /// Longest one.
    pub longest_ms: f64,
    /// Longest share that was not spent in the stages: waiting, decoding, converting.
    pub longest_beyond_ms: f64,
}

/// Totals since the start.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Pairs made of the images.
    pub paired: u64,
    /// Pairs replaced by a newer one before they were processed.
    pub displaced: u64,
    /// Frames processed.
    pub processed: u64,
    /// Regions found in them.
    pub regions: u64,
    /// Results replaced by a newer one before they were published.
    pub output_displaced: u64,
    /// Messages not published because a subscriber was too slow.
    pub would_block: u64,
    /// Messages not published for another reason.
    pub publish_errors: u64,
    /// `regions` messages above the size that arrives with any buffer.
    pub oversized: u64,
    /// Largest `regions` message in bytes.
    pub largest_regions_bytes: u64,
    /// Frames dropped, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Messages published, by topic.
    pub published: BTreeMap<String, u64>,
}

impl Default for NodeStatus {
    fn default() -> Self {
        Self {
            started: Instant::now(),
            last_arrival: AtomicU64::new(0),
            last_pair: AtomicU64::new(0),
            paired: AtomicU64::new(0),
            displaced: AtomicU64::new(0),
            processed: AtomicU64::new(0),
            regions: AtomicU64::new(0),
            output_displaced: AtomicU64::new(0),
            would_block: AtomicU64::new(0),
            publish_errors: AtomicU64::new(0),
            oversized: AtomicU64::new(0),
            largest_regions_bytes: AtomicU64::new(0),
            input: Mutex::default(),
            dropped: Mutex::default(),
            calibration: Mutex::default(),
            alignment: Mutex::default(),
            ground: Mutex::default(),
            latency: Mutex::default(),
            work: Mutex::default(),
            published: Mutex::default(),
            echo: Mutex::default(),
        }
    }
}

impl NodeStatus {
    /// An image came.
    pub fn note_arrival(&self) {
        self.last_arrival.store(self.now(), Ordering::Relaxed);
    }

    /// A pair was made.
    pub fn note_pair(&self) {
        self.paired.fetch_add(1, Ordering::Relaxed);
        self.last_pair.store(self.now(), Ordering::Relaxed);
    }

    /// A pair was replaced by a newer one.
    pub fn count_displaced(&self) {
        self.displaced.fetch_add(1, Ordering::Relaxed);
    }

    /// A result was replaced by a newer one.
    pub fn count_output_displaced(&self) {
        self.output_displaced.fetch_add(1, Ordering::Relaxed);
    }

    /// A message was not published because the send window is full.
    pub fn count_would_block(&self) {
        self.would_block.fetch_add(1, Ordering::Relaxed);
    }

    /// A message was not published.
    pub fn count_publish_error(&self) {
        self.publish_errors.fetch_add(1, Ordering::Relaxed);
    }

    /// A message was published.
    pub fn count_published(&self, topic: &str) {
        let mut published = lock(&self.published);
        match published.get_mut(topic) {
            Some(count) => *count += 1,
            None => drop(published.insert(topic.to_owned(), 1)),
        }
    }

    /// Size of a `regions` message, and whether it is above the limit.
    pub fn note_regions_size(&self, bytes: usize, limit: usize) {
        self.largest_regions_bytes.fetch_max(bytes as u64, Ordering::Relaxed);
        if bytes > limit {
            self.oversized.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// A frame was dropped.
    pub fn drop_frame(&self, reason: String) {
        let mut dropped = lock(&self.dropped);
        let key = if dropped.len() < MAX_REASONS || dropped.contains_key(&reason) {
            reason
        } else {
            "other reasons".to_owned()
        };
        *dropped.entry(key).or_default() += 1;
    }

    /// A frame was processed.
    pub fn note_processed(
        &self,
        times: &StageTimes,
        roi_fraction: f32,
        regions: usize,
        rejections: &Rejections,
    ) {
        self.processed.fetch_add(1, Ordering::Relaxed);
        self.regions.fetch_add(regions as u64, Ordering::Relaxed);
        let mut work = lock(&self.work);
        work.frames += 1;
        for (sum, stage) in work.stage_ms.iter_mut().zip(crate::perception::Stage::ALL) {
            *sum += times.get(stage);
        }
        work.longest_ms = work.longest_ms.max(times.total());
        work.roi_fraction += f64::from(roi_fraction);
        for (sum, count) in work.rejections.iter_mut().zip(rejections.counts()) {
            *sum += u64::from(count);
        }
    }

    /// The ground in the last frame; `None` when nobody looks for it.
    pub fn note_ground(&self, seen: Option<Footing>) {
        *lock(&self.ground) = seen;
    }

    /// A result was published this long after its pair was complete, of which
    /// the stages took `stages_ms`.
    pub fn note_latency(&self, latency_ms: f64, stages_ms: f64) {
        let mut latency = lock(&self.latency);
        latency.results += 1;
        latency.sum_ms += latency_ms;
        latency.longest_ms = latency.longest_ms.max(latency_ms);
        latency.longest_beyond_ms = latency.longest_beyond_ms.max(latency_ms - stages_ms);
    }

    /// What the input thread knows.
    pub fn set_input(&self, state: InputState) {
        *lock(&self.input) = Some(state);
    }

    /// Left and right images received so far; `None` before the first.
    pub fn received(&self) -> Option<[u64; 2]> {
        let input = lock(&self.input);
        input.as_ref().map(|state| [state.counts.left.received, state.counts.right.received])
    }

    /// Why images were not paired; `None` when all were.
    pub fn explain_pairing(&self) -> Option<String> {
        let input = lock(&self.input);
        let state = input.as_ref()?;
        state.counts.explain(&state.explanation_settings, state.has_info)
    }

    /// The calibration in use, or why there is none. True when this is news.
    pub fn set_calibration(&self, calibration: Result<String, String>) -> bool {
        let mut current = lock(&self.calibration);
        let news = current.as_ref() != Some(&calibration);
        *current = Some(calibration);
        news
    }

    /// The rows of a pair were compared.
    pub fn note_alignment(&self, found: Epipolar) {
        let mut latest = lock(&self.alignment);
        if latest.len() == ALIGNMENTS {
            latest.pop_front();
        }
        latest.push_back(found);
    }

    /// The measurement with the middle error of the latest ones.
    pub fn alignment(&self) -> Option<Epipolar> {
        let mut latest: Vec<Epipolar> = lock(&self.alignment).iter().copied().collect();
        latest.sort_by(|a, b| a.error_px.total_cmp(&b.error_px));
        latest.get(latest.len() / 2).copied()
    }

    /// The node is about to call itself: the number to call with, `None` when
    /// it need not.
    pub fn call_echo(&self) -> Option<i32> {
        lock(&self.echo).call(Instant::now())
    }

    /// The call of this number came back.
    pub fn hear_echo(&self, number: i32) {
        lock(&self.echo).hear(number, Instant::now());
    }

    /// Time since the last pair, or since the start when there was none.
    pub fn since_last_pair(&self) -> Duration {
        self.since(&self.last_pair)
    }

    /// Totals since the start.
    pub fn totals(&self) -> Totals {
        let get = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Totals {
            paired: get(&self.paired),
            displaced: get(&self.displaced),
            processed: get(&self.processed),
            regions: get(&self.regions),
            output_displaced: get(&self.output_displaced),
            would_block: get(&self.would_block),
            publish_errors: get(&self.publish_errors),
            oversized: get(&self.oversized),
            largest_regions_bytes: get(&self.largest_regions_bytes),
            dropped: lock(&self.dropped).clone(),
            published: lock(&self.published).clone(),
        }
    }

    fn now(&self) -> u64 {
        self.started.elapsed().as_nanos() as u64 + 1
    }

    fn since(&self, mark: &AtomicU64) -> Duration {
        let mark = mark.load(Ordering::Relaxed);
        Duration::from_nanos(self.now().saturating_sub(mark.max(1)))
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Counters stay usable whatever happened to another thread.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
