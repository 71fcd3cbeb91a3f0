//! What the user should know of an alignment.

use armcal_core::{Code, Severity, Stage, Warning};

use super::coarse::Coarse;
use super::jump::Jump;
use super::{Drift, Estimate, Streams};
use crate::ClockAlignment;

/// A drift beyond the limit by fewer standard errors is one on the limit.
const BEYOND_SIGMAS: f64 = 3.0;

pub(super) fn clock_warning(severity: Severity, code: Code, message: String) -> Warning {
    Warning::new(severity, Stage::Dwell, code, "clock", message)
}

impl Streams<'_> {
    pub(super) fn warnings(
        &self,
        found: &ClockAlignment,
        estimate: &Estimate,
        coarse: &Coarse,
        jump: Option<&Jump>,
    ) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if !(0.8..=1.25).contains(&found.displacement_ratio) {
            let message = format!(
                "the tip moves {:.3} times as far as the nominal model predicts; check units, link lengths and \
                 which point of the arm the sensor sees",
                found.displacement_ratio
            );
            let far = !(0.5..=2.0).contains(&found.displacement_ratio);
            let severity = if far { Severity::Inadequate } else { Severity::Notice };
            warnings.push(clock_warning(severity, Code::ClockDisplacementRatio, message));
        }
        if let Some(rival_s) = coarse.rival_s {
            let message = format!(
                "the motion repeats itself: an offset of {:+.2} s fits nearly as well as {:+.2} s; set \
                 clock.initial_offset_s and a small clock.max_offset_s if it is known",
                self.config.initial_offset_s + rival_s,
                found.offset_s
            );
            warnings.push(clock_warning(Severity::Inadequate, Code::ClockAmbiguous, message));
        }
        warnings.extend(self.drift_warning(estimate.drift));
        if found.offset_sigma_s > 0.02 {
            let message = format!(
                "the offset is known to {:.0} ms only; record more and faster moves",
                found.offset_sigma_s * 1e3
            );
            warnings.push(clock_warning(Severity::Notice, Code::ClockUncertain, message));
        }
        if let Some(jump) = jump {
            warnings.push(clock_warning(
                Severity::Inadequate,
                Code::ClockNotLinear,
                self.jump_in_words(jump),
            ));
        }
        warnings
    }

    fn drift_warning(&self, drift: Drift) -> Option<Warning> {
        let most_ppm = self.config.max_drift_ppm;
        match drift {
            Drift::Estimated => None,
            Drift::Unknown => {
                let message = format!(
                    "the recording is too short to tell the drift better than clock.max_drift_ppm = {most_ppm}; taken as \
                     zero with that standard error"
                );
                Some(clock_warning(Severity::Notice, Code::ClockDriftUnknown, message))
            }
            Drift::Limited { wanted, sigma } => {
                let message = format!(
                    "the motion wants a drift of {:+.0} ± {:.0} ppm; taken as the largest allowed, clock.max_drift_ppm = \
                     {most_ppm}; raise it if the clocks can be so far apart",
                    wanted * 1e6,
                    sigma * 1e6
                );
                let beyond = wanted.abs() - self.max_drift() > BEYOND_SIGMAS * sigma;
                let severity = if beyond { Severity::Inadequate } else { Severity::Notice };
                Some(clock_warning(severity, Code::ClockDriftLimited, message))
            }
        }
    }
}
