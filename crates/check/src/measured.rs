//! One limit, held or broken.

use serde::Serialize;

/// One limit and what was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// The key in `[check]`, with the recording or severity it is about: `dwells.normal`.
    pub name: String,
    /// What was measured.
    pub measured: Measured,
    /// What is allowed.
    pub limit: Measured,
    /// `mm`, `deg`; empty for pure numbers, counts and words.
    pub unit: &'static str,
    /// Whether it holds.
    pub holds: bool,
    /// What was measured, in a sentence.
    pub said: String,
    /// Where it is broken: what the run shows about the cause, gravest first, and what to look at.
    pub why: Vec<String>,
}

/// A value of a check.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Measured {
    /// A count.
    Count(usize),
    /// A number in the check's unit.
    Number(f64),
    /// Words.
    Words(String),
    /// There was nothing to measure: `null`.
    Nothing,
}

impl Measured {
    /// For people, without the unit.
    pub fn text(&self) -> String {
        match self {
            Measured::Count(n) => n.to_string(),
            Measured::Number(v) if *v != 0.0 && v.abs() < 0.001 => format!("{v:.1e}"),
            Measured::Number(v) => format!("{v:.3}"),
            Measured::Words(words) => words.clone(),
            Measured::Nothing => "-".to_owned(),
        }
    }
}

impl Check {
    /// A number that must not be larger than `limit`; what is not a number breaks it.
    pub fn at_most(name: &str, measured: Option<f64>, limit: f64, unit: &'static str) -> Check {
        let measured = measured.filter(|value| value.is_finite());
        Check {
            name: name.to_owned(),
            holds: measured.is_some_and(|value| value <= limit),
            measured: measured.map_or(Measured::Nothing, Measured::Number),
            limit: Measured::Number(limit),
            unit,
            said: String::new(),
            why: Vec::new(),
        }
    }

    /// A count, held or not.
    pub fn count(name: String, measured: usize, limit: usize, holds: bool) -> Check {
        let (measured, limit) = (Measured::Count(measured), Measured::Count(limit));
        Check { name, measured, limit, unit: "", holds, said: String::new(), why: Vec::new() }
    }

    /// The same with its sentence, and the causes where it is broken.
    pub fn saying(self, said: String, why: impl FnOnce() -> Vec<String>) -> Check {
        let why = if self.holds { Vec::new() } else { why() };
        Check { said, why, ..self }
    }

    /// What was measured, with its unit.
    pub fn measured_text(&self) -> String {
        with_unit(&self.measured, self.unit)
    }

    /// What is allowed, with its unit.
    pub fn limit_text(&self) -> String {
        with_unit(&self.limit, self.unit)
    }
}

fn with_unit(value: &Measured, unit: &str) -> String {
    format!("{} {unit}", value.text()).trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_breaks_its_limit() {
        assert!(Check::at_most("a", Some(0.2), 0.2, "mm").holds);
        for measured in [None, Some(f64::NAN), Some(f64::INFINITY), Some(0.200_001)] {
            assert!(!Check::at_most("a", measured, 0.2, "mm").holds, "{measured:?}");
        }
        assert_eq!(Check::at_most("a", None, 0.2, "mm").measured_text(), "- mm");
    }
}
