//! What is neither explained nor of the noise, in words.

use crate::config::DiagnosisConfig;
use crate::diagnosis::{Tried, Unexplained, Verdict};
use armcal_core::{Code, Severity, Stage, Warning};

/// Of the squared error beyond the declared noise an adequate model explains at least this share.
const ADEQUATE_SHARE: f64 = 0.5;

impl Unexplained {
    /// The warning: a result is inadequate where the errors are beyond the noise and no explanation takes half of that. None
    /// where a name does.
    pub(crate) fn warning(&self, verdict: Verdict, config: &DiagnosisConfig) -> Option<Warning> {
        let alone = verdict == Verdict::Unexplained;
        let beyond = self.times_floor > config.floor_factor;
        let inadequate = beyond && (alone || self.explained_share < ADEQUATE_SHARE);
        if !alone && !inadequate {
            return None;
        }
        let severity = if inadequate { Severity::Inadequate } else { Severity::Notice };
        let beside = if alone { "" } else { "beside what is named, " };
        let message = format!("{beside}{}", self.sentence());
        Some(Warning::new(severity, Stage::Diagnose, Code::Unexplained, "diagnosis", message))
    }

    /// What the errors are compared with, and beside it how well poses repeat.
    pub fn measure(&self) -> String {
        let repeats = self.repeatability_mm.map_or(String::new(), |repeatability| {
            format!("; poses that were visited again the same way differ by {repeatability:.3} mm")
        });
        format!("what the declared noise gives ({:.3} mm{repeats})", self.floor_mm)
    }

    /// How much, where, and what was tried, in one sentence without its capital.
    pub fn sentence(&self) -> String {
        let much = match self.times_floor.is_finite() {
            true => format!(
                "the mean error of {:.3} mm is {:.1} times {}",
                self.error_mm,
                self.times_floor,
                self.measure()
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
        let scatter = self.scatter.as_ref().map_or(String::new(), |alike| format!("; {alike}"));
        let Tried { listed, unlisted } = self.tried;
        format!(
            "{much}, {places}{scatter}; {listed} listed effects and {unlisted} unlisted shapes were tried, and none predicts it clear \
             of chance"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a warning would be of errors so many times the noise, of which such a share is explained.
    fn severity(verdict: Verdict, times_floor: f64, explained_share: f64) -> Option<Severity> {
        let left = Unexplained {
            error_mm: 0.6,
            floor_mm: 0.2,
            repeatability_mm: None,
            times_floor,
            explained_share,
            places: Vec::new(),
            scatter: None,
            tried: Tried { listed: 3, unlisted: 4 },
        };
        left.warning(verdict, &DiagnosisConfig::default()).map(|w| w.severity)
    }

    #[test]
    fn a_result_is_inadequate_beyond_the_noise_and_where_less_than_half_is_explained() {
        let limit = DiagnosisConfig::default().floor_factor;
        let (alone, named) = (Verdict::Unexplained, Verdict::Identified);
        assert_eq!(severity(alone, limit, 0.0), Some(Severity::Notice), "no more than that is not beyond it");
        assert_eq!(severity(alone, 1.01 * limit, 1.0), Some(Severity::Inadequate));
        assert_eq!(severity(named, limit, 0.0), None);
        assert_eq!(severity(named, 1.01 * limit, 0.49), Some(Severity::Inadequate));
        assert_eq!(severity(named, 1.01 * limit, 0.5), None, "half is enough");
    }
}
