//! What the method's paper says, from simulation.

/// One figure of the paper. It is not of the data it is shown beside.
#[derive(Clone, Copy, Debug)]
pub struct Simulated {
    /// Key of the measure that it is shown beside.
    key: &'static str,
    /// Its value, in the unit of the measure: shares are 0..=1.
    pub value: f64,
    /// What the paper says.
    pub text: &'static str,
}

const FIGURES: [Simulated; 3] = [
    Simulated { key: "f1", value: 0.93, text: "F1 of 0.93" },
    Simulated { key: "region_f1_50", value: 0.93, text: "F1 of 0.93" },
    Simulated {
        key: "saved_total",
        value: 0.324,
        text: "32.4 % less time per frame than full-frame matching",
    },
];

impl Simulated {
    /// The figure in a sentence.
    pub fn note(&self) -> String {
        format!("The method's paper gives {}: simulated, not measured on these data.", self.text)
    }
}

/// The paper's figure for the measure of this key.
pub fn simulated(key: &str) -> Option<&'static Simulated> {
    FIGURES.iter().find(|figure| figure.key == key)
}
