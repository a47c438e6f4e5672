//! Plots as inline SVG without text: the words lie over it as HTML, so that
//! they keep their size on every screen.

use super::text::escape;

/// Side of the plot's own coordinates.
const SIDE: f64 = 1000.0;

/// A plot over frame numbers.
#[derive(Debug)]
pub struct Plot {
    x_max: f64,
    y_max: f64,
    unit: &'static str,
    class: &'static str,
    paths: String,
    labels: String,
}

impl Plot {
    /// A plot for `frames` frames and values from 0 to `y_max` (made round)
    /// in `unit`.
    pub fn new(frames: u64, y_max: f64, unit: &'static str) -> Self {
        let y_max = if y_max.is_finite() && y_max > 0.0 { y_max } else { 1.0 };
        let step = round_step(y_max, 4.0);
        Self {
            x_max: frames.saturating_sub(1).max(1) as f64,
            y_max: (y_max / step - 1e-9).ceil() * step,
            unit,
            class: "",
            paths: String::new(),
            labels: String::new(),
        }
    }

    /// The same plot with one more CSS class.
    #[must_use]
    pub fn with_class(mut self, class: &'static str) -> Self {
        self.class = class;
        self
    }

    fn x(&self, x: f64) -> f64 {
        x / self.x_max * SIDE
    }

    fn y(&self, y: f64) -> f64 {
        SIDE - y.clamp(0.0, self.y_max) / self.y_max * SIDE
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

    /// The plot as HTML, with a cursor that the viewer moves.
    pub fn html(&self) -> String {
        let mut grid = String::new();
        let mut ticks = String::new();
        let step = round_step(self.y_max, 4.0);
        let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
        for i in 0..=(self.y_max / step + 0.5) as usize {
            let value = i as f64 * step;
            let y = self.y(value);
            grid.push_str(&format!("M0 {y:.1}H{SIDE}"));
            let bottom = 100.0 - y / SIDE * 100.0;
            let last = (i + 1) as f64 * step > self.y_max + step * 0.5;
            let unit = if last { self.unit } else { "" };
            ticks.push_str(&format!(
                "<span class=\"yt\" style=\"bottom:{bottom:.2}%\">{value:.decimals$}{unit}</span>"
            ));
        }
        let step = round_step(self.x_max, 6.0).max(1.0);
        for i in 0..=(self.x_max / step) as usize {
            let frame = i as f64 * step;
            let left = frame / self.x_max * 100.0;
            ticks.push_str(&format!(
                "<span class=\"xt\" style=\"left:{left:.2}%\">{:.0}</span>",
                frame + 1.0
            ));
        }
        format!(
            "<div class=\"plot seek {}\"><svg viewBox=\"0 0 {SIDE} {SIDE}\" preserveAspectRatio=\"none\" aria-hidden=\"true\"><path class=\"grid\" d=\"{grid}\"/>{}</svg>{ticks}{}<div class=\"now\"></div></div>",
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
        let mut plot = Plot::new(11, 10.0, "m");
        plot.line(&[(0.0, 1.0), (1.0, 2.0), (5.0, 3.0), (9.0, 4.0), (10.0, 5.0)], 2.0, "red");
        assert_eq!(plot.paths.matches('M').count(), 3);
        assert_eq!(plot.paths.matches("h0").count(), 1);
    }

    #[test]
    fn no_value_and_no_frame_still_make_a_plot() {
        let plot = Plot::new(0, f64::NAN, "");
        assert!(!plot.html().contains("NaN") && !plot.html().contains("inf"));
    }
}
