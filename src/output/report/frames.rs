//! The frames as data for the viewer.

use std::io::{self, Write};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use serde_json::{Value, json};

use super::layer::{BEYOND_COLOR, NEAR_COLOR, ValueLayer};
use super::{Kept, ReportSink};
use crate::output::html::plot::round_step;
use crate::output::html::text::{hex, script_safe};
use crate::output::picture::{BORDER, Colormap, INVALID, SALIENT, Scale};

/// The colour scales of the whole run.
struct Scales {
    disparity: Scale,
    depth: Scale,
}

impl Scales {
    fn of(kept: &[Kept]) -> Self {
        let range = |map: fn(&Kept) -> &ValueLayer| {
            let scales = kept.iter().filter_map(move |frame| map(frame).scale);
            scales.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), scale| {
                (low.min(scale.low()), high.max(scale.high()))
            })
        };
        let (disparity_low, disparity_high) = range(|frame| &frame.disparity);
        let (depth_low, depth_high) = range(|frame| &frame.depth);
        Self {
            disparity: Scale::linear(disparity_low, disparity_high),
            depth: Scale::logarithmic(depth_low, depth_high),
        }
    }
}

fn linear_ticks(scale: &Scale) -> Vec<Value> {
    let (low, high) = (f64::from(scale.low()), f64::from(scale.high()));
    let step = round_step(high - low, 5.0);
    let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    let first = (low / step - 1e-6).ceil() as i64;
    (first..first + 8)
        .map(|i| i as f64 * step)
        .take_while(|v| *v <= high + step * 1e-6)
        .map(|v| json!([scale.position(v as f32), format!("{v:.decimals$}")]))
        .collect()
}

fn logarithmic_ticks(scale: &Scale) -> Vec<Value> {
    let (low, high) = (f64::from(scale.low()), f64::from(scale.high()));
    let decades = (low.log10().floor() as i32)..=(high.log10().ceil() as i32);
    let wide = high / low > 30.0;
    let factors: &[f64] = match high / low {
        ratio if ratio > 300.0 => &[1.0],
        _ if wide => &[1.0, 2.0, 5.0],
        ratio if ratio > 4.0 => &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0],
        _ => return linear_ticks(scale),
    };
    decades
        .flat_map(|power| factors.iter().map(move |factor| factor * 10_f64.powi(power)))
        .filter(|v| (low..=high).contains(v))
        .map(|v| json!([scale.position(v as f32), format!("{v}")]))
        .collect()
}

fn color_table(map: Colormap) -> String {
    map.table().iter().map(|color| hex(*color)[1..].to_owned()).collect()
}

/// Writes the run's scales and every kept frame, each in a script of its own
/// that the viewer reads when the frame is shown.
pub fn write(report: &ReportSink, out: &mut impl Write) -> io::Result<()> {
    let scales = &Scales::of(report.kept.items());
    let unit_ticks: Vec<Value> =
        [0.0, 0.5, 1.0].iter().map(|v| json!([v, v.to_string()])).collect();
    let with_unit = |mut ticks: Vec<Value>, unit: &str| {
        if let Some(text) = ticks.last_mut().and_then(|tick| tick.get_mut(1)) {
            *text = json!(format!("{} {unit}", text.as_str().unwrap_or_default()));
        }
        ticks
    };
    let describe = |scale: &Scale, colors: &str, unit: &str, log: bool, reversed: bool| {
        let ticks = if log { logarithmic_ticks(scale) } else { linear_ticks(scale) };
        json!({
            "low": scale.low(), "high": scale.high(), "log": log, "colors": colors,
            "reversed": reversed, "unit": unit, "ticks": with_unit(ticks, unit),
        })
    };
    let shown: Vec<u64> = report.kept.items().iter().map(|frame| frame.index).collect();
    let run = json!({
        "frames": report.totals.frames,
        "shown": shown,
        "pace": pace(report),
        "scales": {
            "saliency": {
                "low": 0, "high": 1, "log": false, "colors": "inferno", "reversed": false,
                "unit": "", "ticks": unit_ticks,
            },
            "disparity": describe(&scales.disparity, "turbo", "px", false, false),
            "depth": describe(&scales.depth, "viridis", "m", true, true),
        },
        "colors": {
            "turbo": color_table(Colormap::Turbo),
            "viridis": color_table(Colormap::Viridis),
            "inferno": color_table(Colormap::Inferno),
        },
        "invalid": hex(INVALID),
        "beyond": hex(BEYOND_COLOR),
        "near": hex(NEAR_COLOR),
        "salient": hex(SALIENT),
        "border": hex(BORDER),
    });
    writeln!(
        out,
        "<script type=\"application/json\" id=\"run\">{}</script>",
        script_safe(&run.to_string())
    )?;
    for frame in report.kept.items() {
        write_frame(frame, scales, out)?;
    }
    Ok(())
}

fn write_frame(frame: &Kept, scales: &Scales, out: &mut impl Write) -> io::Result<()> {
    let png = |bytes: &[u8]| format!("data:image/png;base64,{}", BASE64.encode(bytes));
    let painted = |map: &ValueLayer, scale: &Scale, colors: Colormap, reversed: bool| {
        let mut map = map.clone();
        map.paint(scale, colors, reversed);
        png(map.layer.bytes())
    };
    let data = json!({
        "index": frame.index,
        "time": frame.time,
        "width": frame.size.width,
        "height": frame.size.height,
        "left": format!("data:image/jpeg;base64,{}", BASE64.encode(&frame.left)),
        "layers": {
            "saliency": png(frame.saliency.bytes()),
            "roi": png(frame.roi.bytes()),
            "disparity": painted(&frame.disparity, &scales.disparity, Colormap::Turbo, false),
            "depth": painted(&frame.depth, &scales.depth, Colormap::Viridis, true),
        },
        "regions": frame.regions,
        "rejected": frame.rejected,
    });
    writeln!(
        out,
        "<script type=\"application/json\" class=\"frame\">{}</script>",
        script_safe(&data.to_string())
    )
}

/// Milliseconds per shown frame while playing: real time where that can be seen.
fn pace(report: &ReportSink) -> f64 {
    let totals = &report.totals;
    let seconds = totals.last.seconds_since(totals.first);
    let per_frame = 1000.0 * seconds / totals.frames.saturating_sub(1).max(1) as f64;
    let pace = per_frame * report.kept.stride() as f64;
    if pace.is_finite() && pace > 0.0 { pace.clamp(100.0, 700.0).round() } else { 300.0 }
}
