//! Before against after on points that no fit saw, and what their interval says.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What an effect does to errors on groups the fit did not see.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldOut {
    /// Mean error without it [mm].
    pub before: f64,
    /// Mean error with it [mm].
    pub after: f64,
    /// 95 % interval of the mean change (after - before) over groups [mm].
    pub change_ci95: [f64; 2],
    /// Relative fall of the squared whitened error, 0 to 1; below 0 it grew.
    pub gain: f64,
    /// Sign-flip p-value that the fall is chance.
    pub p: f64,
    /// Number of groups.
    pub groups: usize,
}

impl HeldOut {
    /// Whether the error falls by more than chance.
    pub fn helps(&self) -> bool {
        self.change_ci95[1] < 0.0
    }

    /// Whether the error grows by more than chance.
    pub fn harms(&self) -> bool {
        self.change_ci95[0] > 0.0
    }

    /// What the interval says.
    pub fn verdict(&self) -> &'static str {
        match (self.helps(), self.harms()) {
            (true, _) => "it helps there",
            (_, true) => "it does harm there",
            _ => "no more than chance",
        }
    }

    /// What "it changes" with its interval.
    pub fn change_text(&self) -> String {
        let [low, high] = self.change_ci95;
        format!(
            "changes the mean error there from {:.3} to {:.3} mm (95 % {low:+.3} to {high:+.3})",
            self.before, self.after
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_interval_clear_of_zero_says_anything() {
        let of = |low: f64, high: f64| HeldOut {
            before: 1.0,
            after: 0.9,
            change_ci95: [low, high],
            gain: 0.1,
            p: 0.5,
            groups: 12,
        };
        for (low, high, helps, harms, words) in [
            (-0.3, -0.1, true, false, "it helps there"),
            (-0.3, 0.0, false, false, "no more than chance"),
            (-0.3, 0.1, false, false, "no more than chance"),
            (0.0, 0.2, false, false, "no more than chance"),
            (0.1, 0.2, false, true, "it does harm there"),
        ] {
            let held_out = of(low, high);
            assert_eq!((held_out.helps(), held_out.harms(), held_out.verdict()), (helps, harms, words));
        }
        assert_eq!(
            of(-0.3, 0.1).change_text(),
            "changes the mean error there from 1.000 to 0.900 mm (95 % -0.300 to +0.100)"
        );
    }
}
