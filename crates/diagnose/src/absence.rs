//! Each of several names by its absence: what the refitted model does as well without is taken back.
//!
//! A search that goes forward accepts what explains the most, then what explains the most of what is left. The later a name
//! comes the less is left for it, and the more of that is chance: refitted together with all others, each must lower the
//! errors of held-out points by itself, as in a backward elimination.

use crate::compare::compare_heldout;
use crate::conclude::{ShownBy, shown_by};
use crate::config::DiagnosisConfig;
use crate::diagnosis::{Diagnosis, Refitted};
use crate::observed::Calibrated;
use armcal_calibrate::Calibration;
use armcal_core::{Severity, Stage, Warning};

impl Diagnosis {
    /// The calibration with those of the names without each of which it errs more; the others are taken back, the one with
    /// the least evidence first.
    pub(crate) fn each_by_its_absence(
        &mut self,
        calibrated: &Calibrated<'_>,
        found: Refitted,
        config: &DiagnosisConfig,
    ) -> Refitted {
        let mut found = found;
        while found.effects.len() > 1 {
            let mut weakest: Option<(usize, Refitted)> = None;
            for (k, effect) in self.effects.iter().enumerate() {
                let own = |spec: &String| *spec == effect.name;
                let others = found.effects.iter().filter(|e| !own(&e.to_string())).cloned().collect();
                let weaker = |k: usize| {
                    effect.log_evidence < self.effects.get(k).map_or(f64::INFINITY, |e| e.log_evidence)
                };
                let Some(without) = calibrated.with(others) else { continue };
                let needed = needed(&without.calibration, &found.calibration, calibrated, config);
                if !needed && weakest.as_ref().is_none_or(|(k, _)| weaker(*k)) {
                    weakest = Some((k, without));
                }
            }
            let Some((k, without)) = weakest else { break };
            self.take_back_one(k, (&without.calibration, &found.calibration), calibrated, config);
            found = without;
        }
        found
    }

    fn take_back_one(
        &mut self,
        k: usize,
        (without, with): (&Calibration, &Calibration),
        calibrated: &Calibrated<'_>,
        config: &DiagnosisConfig,
    ) {
        let name = self.effects.remove(k).name;
        self.name_again();
        let held = compare_heldout(without, with, calibrated.observations, config);
        let change = held.map_or_else(String::new, |h| format!(": it {}, p = {:.3}", h.change_text(), h.p));
        let message = format!(
            "{name} is not named: refitted beside what is named, it does not lower the errors of held-out points by more than \
             chance{change}"
        );
        self.warnings.push(Warning::new(Severity::Notice, Stage::Diagnose, "name-not-needed", name, message));
    }
}

/// Whether the model errs more without an effect: as a name alone must show it, and on held-out points that see it so clearly
/// as is asked of the best of many.
fn needed(
    without: &Calibration,
    with: &Calibration,
    calibrated: &Calibrated<'_>,
    config: &DiagnosisConfig,
) -> bool {
    match shown_by(without, with, calibrated.observations, config) {
        ShownBy::Nothing => false,
        ShownBy::Fitted => true,
        ShownBy::Judged => compare_heldout(without, with, calibrated.observations, config)
            .is_none_or(|held| held.p <= config.max_p_adjusted),
    }
}

#[cfg(test)]
#[path = "tests/absence.rs"]
mod tests;
