//! Plots as inline SVG without text: the words lie over it as HTML, so that
//! they keep their size on every screen.

use super::text::escape;

/// Side of the plot's own coordinates.
const SIDE: f64 = 1000.0;

/// One axis of a plot, from 0.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    max: f64,
    unit: &'static str,
    /// What is written where the value is 0.
    first: f64,
    /// Least distance of two ticks.
    least_step: f64,
    /// Most distances of ticks.
    parts: f64,
}

impl Axis {
    /// Numbers of frames, counted from 1 for people.
    pub fn frames(frames: u64) -> Self {
        let max = frames.saturating_sub(1).max(1) as f64;
        Self { max, unit: "", first: 1.0, least_step: 1.0, parts: 6.0 }
    }

    /// Values from 0 to `max` in `unit`.
    pub const fn exactly(max: f64, unit: &'static str) -> Self {
        let max = if max.is_finite() && max > 0.0 { max } else { 1.0 };
        Self { max, unit, first: 0.0, least_step: 0.0, parts: 5.0 }
    }

    /// Values from 0 to `max` (made round) in `unit`.
    pub fn up_to(max: f64, unit: &'static str) -> Self {
        let exact = Self::exactly(max, unit);
        let parts = 4.0;
        let step = round_step(exact.max, parts);
        Self { max: (exact.max / step - 1e-9).ceil() * step, parts, ..exact }
    }

    /// Round values with what is written there; the unit stands at the last one.
    fn ticks(&self) -> Vec<(f64, String)> {
        let step = round_step(self.max, self.parts).max(self.least_step);
        let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
        let last = (self.max / step + 1e-6) as usize;
        let text = |value: f64| format!("{:.decimals$}", value + self.first);
        (0..=last)
            .map(|i| (i as f64 * step, if i == last { self.unit } else { "" }))
            .map(|(value, unit)| (value, text(value) + unit))
            .collect()
    }
}

/// A plot of curves over a common axis.
#[derive(Debug)]
pub struct Plot {
    x: Axis,
    y: Axis,
    /// Over frames: has a cursor that the viewer moves.
    seek: bool,
    class: &'static str,
    paths: String,
    labels: String,
}

impl Plot {
    /// An empty plot.
    pub const fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, seek: false, class: "", paths: String::new(), labels: String::new() }
    }

    /// A plot for `frames` frames and values from 0 to `y_max` (made round)
    /// in `unit`, with a cursor that the viewer moves.
    pub fn over_frames(frames: u64, y_max: f64, unit: &'static str) -> Self {
        Self { seek: true, ..Self::new(Axis::frames(frames), Axis::up_to(y_max, unit)) }
    }

    /// The same plot with one more CSS class.
    #[must_use]
    pub fn with_class(mut self, class: &'static str) -> Self {
        self.class = class;
        self
    }

    fn x(&self, x: f64) -> f64 {
        x.clamp(0.0, self.x.max) / self.x.max * SIDE
    }

    fn y(&self, y: f64) -> f64 {
        SIDE - y.clamp(0.0, self.y.max) / self.y.max * SIDE
    }

    /// A line through all of `points`.
    pub fn curve(&mut self, points: &[(f64, f64)], color: &str) {
        self.line(points, f64::INFINITY, color);
    }

    /// The same, dashed.
    pub fn dashed_curve(&mut self, points: &[(f64, f64)], color: &str) {
        let path = self.run(points);
        self.paths.push_str(&format!(
            "<path class=\"line dashed\" style=\"stroke:{color}\" d=\"{path}\"/>"
        ));
    }

    /// A line through `points`, broken where the distance in x is more than
    /// `gap`; a point alone is drawn as a dot.
    pub fn line(&mut self, points: &[(f64, f64)], gap: f64, color: &str) {
        let (mut lines, mut dots) = (String::new(), String::new());
        let mut rest = points;
        while !rest.is_empty() {
            let end = rest
                .windows(2)
                .position(|pair| pair[1].0 - pair[0].0 > gap || pair[1].0 < pair[0].0)
                .map_or(rest.len(), |at| at + 1);
            let (run, after) = rest.split_at(end);
            match run {
                [(x, y)] => dots.push_str(&format!("M{:.1} {:.1}h0", self.x(*x), self.y(*y))),
                _ => lines.push_str(&self.run(run)),
            }
            rest = after;
        }
        for (class, path) in [("line", lines), ("dots", dots)] {
            if !path.is_empty() {
                self.paths.push_str(&format!(
                    "<path class=\"{class}\" style=\"stroke:{color}\" d=\"{path}\"/>"
                ));
            }
        }
    }

    /// The area between two curves over the same x.
    pub fn area(&mut self, x: &[f64], low: &[f64], high: &[f64], color: &str) {
        let upper: Vec<_> = x.iter().copied().zip(high.iter().copied()).collect();
        let lower: Vec<_> = x.iter().copied().zip(low.iter().copied()).rev().collect();
        if upper.len() < 2 {
            // One frame is shown as a column over the whole width.
            if let (Some((_, high)), Some((_, low))) = (upper.first(), lower.first()) {
                let (top, bottom) = (self.y(*high), self.y(*low));
                self.paths.push_str(&format!(
                    "<path class=\"fill\" style=\"fill:{color}\" d=\"M0 {top:.1}H{SIDE}V{bottom:.1}H0Z\"/>"
                ));
            }
            return;
        }
        let back = self.run(&lower).replacen('M', "L", 1);
        let path = self.run(&upper) + &back;
        self.paths
            .push_str(&format!("<path class=\"fill\" style=\"fill:{color}\" d=\"{path}Z\"/>"));
    }

    /// A dashed horizontal line.
    pub fn reference(&mut self, y: f64) {
        self.paths.push_str(&format!("<path class=\"ref\" d=\"M0 {:.1}H{SIDE}\"/>", self.y(y)));
    }

    /// A word beside a point.
    pub fn label(&mut self, x: f64, y: f64, text: &str, color: &str) {
        let (left, bottom) = (self.x(x) / SIDE * 100.0, 100.0 - self.y(y) / SIDE * 100.0);
        let text = escape(text);
        self.labels.push_str(&format!(
            "<span class=\"tag\" style=\"left:{left:.2}%;bottom:{bottom:.2}%;color:{color}\">{text}</span>"
        ));
    }

    fn run(&self, points: &[(f64, f64)]) -> String {
        let coordinates: Vec<String> =
            points.iter().map(|(x, y)| format!("{:.1} {:.1}", self.x(*x), self.y(*y))).collect();
        format!("M{}", coordinates.join("L"))
    }

    /// The plot as HTML.
    pub fn html(&self) -> String {
        let mut grid = String::new();
        let mut ticks = String::new();
        for (value, text) in self.y.ticks() {
            let y = self.y(value);
            grid.push_str(&format!("M0 {y:.1}H{SIDE}"));
            let bottom = 100.0 - y / SIDE * 100.0;
            ticks.push_str(&format!(
                "<span class=\"yt\" style=\"bottom:{bottom:.2}%\">{text}</span>"
            ));
        }
        for (value, text) in self.x.ticks() {
            let left = self.x(value) / SIDE * 100.0;
            ticks.push_str(&format!("<span class=\"xt\" style=\"left:{left:.2}%\">{text}</span>"));
        }
        let (seek, cursor) =
            if self.seek { ("seek ", "<div class=\"now\"></div>") } else { ("", "") };
        format!(
            "<div class=\"plot {seek}{}\"><svg viewBox=\"0 0 {SIDE} {SIDE}\" preserveAspectRatio=\"none\" aria-hidden=\"true\"><path class=\"grid\" d=\"{grid}\"/>{}</svg>{ticks}{}{cursor}</div>",
            self.class, self.paths, self.labels
        )
    }
}

/// The smallest of 1, 2, 5 times a power of ten that cuts `range` into at most
/// `parts` parts.
pub fn round_step(range: f64, parts: f64) -> f64 {
    let least = (range / parts).max(1e-9);
    let power = 10_f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    steps.into_iter().find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(power * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for (range, parts, expected) in [(10.0, 4.0, 5.0), (1.0, 4.0, 0.5), (59.0, 6.0, 10.0)] {
            assert!((round_step(range, parts) - expected).abs() < 1e-12);
        }
        for i in 1..2000 {
            let range = f64::from(i) * 0.037;
            let step = round_step(range, 4.0);
            assert!(range / step <= 4.000_001 && range / step > 1.5, "{range} {step}");
        }
    }

    #[test]
    fn lines_break_at_gaps_and_lone_points_are_dots() {
        let mut plot = Plot::over_frames(11, 10.0, "m");
        plot.line(&[(0.0, 1.0), (1.0, 2.0), (5.0, 3.0), (9.0, 4.0), (10.0, 5.0)], 2.0, "red");
        assert_eq!(plot.paths.matches('M').count(), 3);
        assert_eq!(plot.paths.matches("h0").count(), 1);
    }

    #[test]
    fn ticks_are_round_and_the_last_one_has_the_unit() {
        let texts = |axis: Axis| -> Vec<String> {
            axis.ticks().into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(texts(Axis::up_to(0.9, " px")), ["0.0", "0.5", "1.0 px"]);
        assert_eq!(texts(Axis::exactly(0.9, "")), ["0.0", "0.2", "0.4", "0.6", "0.8"]);
        assert_eq!(texts(Axis::frames(3)), ["1", "2", "3"]);
        assert_eq!(Axis::exactly(192.0, "").ticks().last().unwrap().0, 150.0);
    }

    #[test]
    fn curves_that_go_back_are_not_broken_when_dashed() {
        let mut plot = Plot::new(Axis::exactly(1.0, ""), Axis::exactly(1.0, ""));
        plot.dashed_curve(&[(0.0, 1.0), (0.5, 2.0), (0.2, 0.0)], "red");
        assert_eq!(plot.paths.matches('M').count(), 1);
        assert!(!plot.html().contains("seek") && !plot.html().contains("now"));
    }

    #[test]
    fn no_value_and_no_frame_still_make_a_plot() {
        let plot = Plot::over_frames(0, f64::NAN, "");
        assert!(!plot.html().contains("NaN") && !plot.html().contains("inf"));
    }
}
