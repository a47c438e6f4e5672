//! `replay`: a bag through the pipeline to an output bag and a report.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use serde_json::{Value, json};

use crate::command::print::{put, say};
use crate::command::settings::{Settings, bag_options};
use crate::command::summary;
use crate::command::watch::{make_parent, progress_bar, stop_on_signal, write_json};
use crate::command::{CommandError, Outcome};
use crate::config::Config;
use crate::drive::{Ending, Engine, drive};
use crate::input::bag::{BagSource, BagTopics};
use crate::input::{FrameSource, Tally};
use crate::metric::StageStats;
use crate::output::AnySink;
use crate::output::bag::{BagSink, BagTopicsOut};
use crate::output::report::{ReportSink, RunFacts};
use crate::output::score::{ScoreSink, ScoreSummary};
use crate::perception::{Perception, Rejections};

/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// Arguments of `replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// Bag: an .mcap file or a bag folder
    input: PathBuf,
    /// Output bag: a single file when it ends in .mcap, else a bag folder
    #[arg(short, long, value_name = "BAG")]
    output: Option<PathBuf>,
    /// HTML report
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write counts, regions and times as JSON (`-`: to stdout, instead of the text)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    topics: TopicArgs,
    #[command(flatten)]
    settings: Settings,
}

/// Topics other than the ones that are found by themselves.
#[derive(Clone, Debug, Default, Args)]
pub struct TopicArgs {
    /// Topic of the left image (found by itself when it ends in `left/image_rect` or the like)
    #[arg(long, value_name = "TOPIC")]
    left_image: Option<String>,
    /// Topic of the right image
    #[arg(long, value_name = "TOPIC")]
    right_image: Option<String>,
    /// Topic of the left camera info
    #[arg(long, value_name = "TOPIC")]
    left_info: Option<String>,
    /// Topic of the right camera info
    #[arg(long, value_name = "TOPIC")]
    right_info: Option<String>,
}

impl TopicArgs {
    /// The topics named on the command line.
    pub fn topics(&self) -> BagTopics {
        BagTopics {
            left: self.left_image.clone(),
            right: self.right_image.clone(),
            left_info: self.left_info.clone(),
            right_info: self.right_info.clone(),
            ..BagTopics::default()
        }
    }
}

/// What a run through a bag amounts to.
#[derive(Debug, Default)]
pub struct RunTotals {
    /// Regions of all frames.
    pub regions: u64,
    /// Refused candidates of all frames.
    pub rejections: Rejections,
    /// Stage times.
    pub stats: StageStats,
    /// Mean share of the image that was matched, times the number of frames.
    matched: f64,
}

impl RunTotals {
    /// Takes one more frame.
    pub fn add(&mut self, perception: &Perception) {
        self.regions += perception.regions.len() as u64;
        self.rejections += perception.rejections;
        self.stats.add(&perception.times);
        self.matched += f64::from(perception.roi.fraction);
    }

    /// The totals beside what the source counted, for `--json`.
    pub fn to_json(&self, tally: &Tally, score: Option<&ScoreSummary>) -> Value {
        let r = &self.rejections;
        let mut document = json!({
            "pairs": tally.pairs,
            "unpaired": { "left": tally.unpaired_left, "right": tally.unpaired_right },
            "skipped": tally.skipped,
            "regions": self.regions,
            "rejected": {
                "small_area": r.small_area,
                "low_confidence": r.low_confidence,
                "inconsistent_depth": r.inconsistent_depth,
                "unstable": r.unstable,
                "over_count": r.over_count,
            },
            "matched_fraction": self.matched / (self.stats.frames().max(1) as f64),
            "score": score,
        });
        if let Some(summary) = self.stats.summary() {
            document["frames"] = json!(summary.frames);
            document["matching_ms"] = json!(summary.matching_ms);
            document["total_ms"] = json!(summary.total_ms);
            let value = serde_json::to_value(summary).unwrap_or_default();
            document["stages"] = value["stages"].clone();
        }
        document
    }
}

/// Runs the command.
///
/// # Errors
/// Unusable parameters, a bag without a usable pair, or an output that cannot be written.
pub fn run(args: &ReplayArgs) -> Result<Outcome, CommandError> {
    let config = args.settings.config(Config::default())?;
    let options = bag_options(&config, args.topics.topics())?;
    let mut source =
        BagSource::open(&args.input, &config, options).map_err(CommandError::failed)?;
    for note in source.notes() {
        eprintln!("note: {note}");
    }

    let mut bag = match &args.output {
        Some(path) => {
            if source.reads(path) {
                return Err(CommandError::Usage(format!(
                    "the output would overwrite the input: {}",
                    path.display()
                )));
            }
            make_parent(path)?;
            Some(
                BagSink::create(path, &config, BagTopicsOut::default())
                    .map_err(CommandError::failed)?,
            )
        }
        None => None,
    };
    let mut report = match &args.report {
        Some(path) => {
            let facts = RunFacts {
                command: "replay".into(),
                source: args.input.display().to_string(),
                config: config.clone(),
            };
            Some(ReportSink::create(path, facts).map_err(CommandError::failed)?)
        }
        None => None,
    };
    let mut score = ScoreSink::new(config.regions.min_area as u32);

    let mut totals = RunTotals::default();
    let bar = progress_bar(STEPS);
    let stop = stop_on_signal()?;
    let mut engine = Engine::new(config);
    let ending = {
        let mut sinks: Vec<&mut (dyn AnySink + Send)> = vec![&mut score];
        sinks.extend(bag.as_mut().map(|b| b as &mut (dyn AnySink + Send)));
        sinks.extend(report.as_mut().map(|r| r as &mut (dyn AnySink + Send)));
        drive(&mut source, &mut engine, &mut sinks, &stop, |_, perception, source| {
            totals.add(perception);
            bar.set_position((source.progress().unwrap_or(0.0) * STEPS as f64) as u64);
        })
    }
    .map_err(CommandError::failed)?;
    bar.finish_and_clear();

    let tally = source.tally();
    if tally.pairs == 0 && ending == Ending::Complete {
        return Err(CommandError::failed(nothing_paired(tally, source.explain())));
    }
    conclude(args, &totals, tally, score.summary().as_ref(), engine.jumps_back())?;
    if stop.load(Ordering::Relaxed) {
        eprintln!("interrupted: the output holds the {} pairs up to then", tally.pairs);
    }
    Ok(if tally.has_losses() { Outcome::DoneWithLosses } else { Outcome::Done })
}

fn conclude(
    args: &ReplayArgs,
    totals: &RunTotals,
    tally: &Tally,
    score: Option<&ScoreSummary>,
    jumps_back: u64,
) -> Result<(), CommandError> {
    let json = args.json.as_deref();
    if let Some(path) = json {
        let mut document = totals.to_json(tally, score);
        document["jumps_back"] = json!(jumps_back);
        write_json(path, &document)?;
    }
    if json.is_none_or(|path| path.as_os_str() != "-") {
        say(format_args!("{} pairs, {} regions", tally.pairs, totals.regions));
        if let Some(times) = totals.stats.summary() {
            put(format_args!("{}", summary::times(&times)));
        }
        if let Some(score) = score {
            put(format_args!("{}", summary::scores(score)));
        }
    }
    for line in losses(tally) {
        eprintln!("{line}");
    }
    Ok(())
}

/// What was lost, a line each.
pub fn losses(tally: &Tally) -> Vec<String> {
    let mut lines = Vec::new();
    if tally.unpaired_left + tally.unpaired_right > 0 {
        lines.push(format!(
            "without a partner: {} left and {} right images",
            tally.unpaired_left, tally.unpaired_right
        ));
    }
    lines.extend(tally.skipped.iter().map(|(reason, n)| format!("skipped {n} times: {reason}")));
    lines
}

fn nothing_paired(tally: &Tally, why: Option<String>) -> String {
    let mut lines = vec!["the bag has no usable stereo pair".to_owned()];
    lines.extend(losses(tally));
    lines.extend(why);
    lines.join("\n  ")
}
