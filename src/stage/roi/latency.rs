//! The time budget: how much of the image there is time to match.

/// Least share of the image that is matched, however late it is: with nothing
/// matched, nothing would be learnt about its cost.
const LEAST_FRACTION: f64 = 0.01;
/// Share of the last frame in the running cost.
const RENEWAL: f64 = 0.5;

/// Keeps a frame's time by limiting what is matched.
///
/// What follows the region of interest takes k times its share of the image, k
/// being learnt from the frames before. With a part that does not depend on the
/// share, t = c + m·share, the limit still approaches the right one: from any
/// share above 0 the step share' = (left / t)·share has its fixed point at
/// t = left, and nears it by the factor c / left < 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Latency {
    /// Milliseconds per frame; 0 is no budget.
    budget_ms: f64,
    /// Milliseconds that the whole image would take, once known.
    cost_ms: Option<f64>,
}

impl Latency {
    /// The budget of `max_latency` seconds per frame; 0 switches it off.
    pub fn new(max_latency: f64) -> Self {
        Self { budget_ms: 1e3 * max_latency, cost_ms: None }
    }

    /// Share of the image that may be matched in a frame that has taken
    /// `spent_ms` so far. 1 before the first frame has told the cost.
    pub fn allowance(&self, spent_ms: f64) -> f64 {
        match self.cost_ms {
            Some(cost_ms) if self.budget_ms > 0.0 => {
                ((self.budget_ms - spent_ms) / cost_ms).clamp(LEAST_FRACTION, 1.0)
            }
            _ => 1.0,
        }
    }

    /// Learns that matching this share of the image, and all that follows, took
    /// `taken_ms`. Nothing is learnt without a clock, which says 0.
    pub fn learn(&mut self, taken_ms: f64, fraction: f64) {
        if taken_ms > 0.0 && fraction > 0.0 {
            let now = taken_ms / fraction.max(LEAST_FRACTION);
            let before = self.cost_ms.unwrap_or(now);
            self.cost_ms = Some(before + RENEWAL * (now - before));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share that is settled on when matching takes 4 ms and 40 ms times the share.
    fn settled(budget_ms: f64, wanted: f64) -> f64 {
        let mut latency = Latency::new(budget_ms / 1e3);
        let mut fraction = wanted;
        for _ in 0..60 {
            fraction = latency.allowance(6.0).min(wanted);
            latency.learn(4.0 + 40.0 * fraction, fraction);
        }
        fraction
    }

    #[test]
    fn the_share_settles_where_the_budget_is_met() {
        for wanted in [0.3, 1.0] {
            assert!((settled(20.0, wanted) - 0.25).abs() < 1e-3, "{}", settled(20.0, wanted));
        }
        // Enough time for all, too little for anything, and no budget.
        assert_eq!(settled(60.0, 0.3), 0.3);
        assert_eq!(settled(8.0, 0.3), LEAST_FRACTION);
        assert_eq!(settled(0.0, 0.3), 0.3);
    }

    #[test]
    fn without_a_clock_there_is_no_limit() {
        let mut latency = Latency::new(0.001);
        latency.learn(0.0, 0.5);
        assert_eq!(latency.allowance(0.0), 1.0);
    }
}
