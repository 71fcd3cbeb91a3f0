//! What is neither explained nor at the floor, in words.

use crate::conclude::LARGE_REST;
use crate::config::DiagnosisConfig;
use crate::diagnosis::{Unexplained, Verdict};
use armcal_core::{Severity, Stage, Warning};

/// Code of the warning about what is neither explained nor at the floor.
pub const UNEXPLAINED: &str = "unexplained";

impl Unexplained {
    /// The warning, of the verdict and of the times that the floor is exceeded on either side of a hold-out: errors far above
    /// the floor make a result inadequate, whatever was named beside them. None where what is left beside names is small.
    pub(crate) fn warning(
        &self,
        verdict: Verdict,
        times_floor: f64,
        config: &DiagnosisConfig,
    ) -> Option<Warning> {
        let alone = verdict == Verdict::Unexplained;
        let inadequate = match alone {
            true => self.times_floor > config.floor_factor,
            false => times_floor > LARGE_REST,
        };
        if !alone && !inadequate {
            return None;
        }
        let severity = if inadequate { Severity::Inadequate } else { Severity::Notice };
        let beside = if alone { "" } else { "beside what is named, " };
        let message = format!("{beside}{}", self.sentence());
        Some(Warning::new(severity, Stage::Diagnose, UNEXPLAINED, "diagnosis", message))
    }

    /// How much, where, and what was tried, in one sentence without its capital.
    pub fn sentence(&self) -> String {
        let much = match self.times_floor.is_finite() {
            true => format!(
                "the mean error of {:.3} mm is {:.1} times the noise floor of {:.3} mm",
                self.error_mm, self.times_floor, self.floor_mm
            ),
            false => format!("the mean error is {:.3} mm, and no noise is declared", self.error_mm),
        };
        let places: Vec<String> = self
            .places
            .iter()
            .map(|p| {
                let plural = if p.dwells == 1 { "" } else { "s" };
                format!(
                    "{} ({} dwell{plural}, {:.3} mm, {:.1} times; elsewhere {:.3} mm, {:.1} times)",
                    p.place, p.dwells, p.error_mm, p.times_noise, p.elsewhere_mm, p.elsewhere_times_noise
                )
            })
            .collect();
        let places = match places.is_empty() {
            true => "about alike in all recordings, joint ranges and directions".to_owned(),
            false => format!("largest against their noise in {}", places.join(" and in ")),
        };
        let refitted: Vec<String> = self
            .tried
            .refitted
            .iter()
            .map(|(names, e)| format!("; {names} would leave {:.3} mm", e.after))
            .collect();
        let scatter = self.scatter.as_ref().map_or(String::new(), |kind| format!("; the scatter is {kind}"));
        format!(
            "{much}, {places}{scatter}; {} listed effects and {} unlisted shapes were tried and do not explain it{}",
            self.tried.listed,
            self.tried.unlisted,
            refitted.concat()
        )
    }
}
