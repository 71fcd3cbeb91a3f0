//! The verdict in the end: what the judge named, how much of the error that is, and what remains.
//!
//! Names are the judge's ([`crate::search::settle`]); calibrations with and without them give the figures beside. Whether *nothing* is
//! missing is the one question of the noise: the errors must be those that it gives.

use crate::config::DiagnosisConfig;
use crate::diagnosis::{BeforeAfter, Diagnosis, JudgedOn, Refitted, Tried, Unexplained, Verdict};
use crate::verdict::next::prepend_findings;
use armcal_calibrate::{
    Calibration, DwellError, compare_heldout, error_places, repeatability_m, single_dwells,
};
use armcal_core::{Code, Observation, Severity, Stage, Warning, list_names};

/// Standard deviation of the norm of an isotropic Gaussian error over its mean, `sqrt(3 pi / 8 - 1)` (Maxwell).
const SPREAD_OF_NORM: f64 = 0.422;
/// Standard errors by which a mean error of nothing but noise stays below its expectation with 99.5 %.
const CHANCE: f64 = 2.58;

/// What the verdict is settled with.
pub(crate) struct Evidence<'a> {
    /// The calibration that was diagnosed.
    pub before: &'a Calibration,
    /// Its observations, in the order of its residuals.
    pub observations: &'a [Observation],
    /// The calibration with what was found.
    pub refitted: Option<Refitted>,
    /// Names of the joints.
    pub joint_names: &'a [String],
}

impl Diagnosis {
    /// Settles the verdict.
    pub(crate) fn conclude(&mut self, evidence: Evidence<'_>, config: &DiagnosisConfig) {
        let Evidence { before, observations, refitted, joint_names } = evidence;
        let after = refitted.as_ref().map(|r| &r.calibration);
        let best = after.unwrap_or(before);
        self.judged = if before.held_out() { JudgedOn::HeldOut } else { JudgedOn::Fitted };
        self.holdout_mm = BeforeAfter { before: error_mm(before), after: error_mm(best) };
        self.floor_mm = before.noise_floor_m * 1e3;
        self.repeatability_mm = repeatability_m(best, observations).map(|m| m * 1e3);
        self.warnings.extend(refitted.iter().flat_map(|r| r.warnings.iter().cloned()));
        self.warnings.extend(refitted.as_ref().and_then(|r| errs_more(before, r, observations, config)));
        let noise_alone = noise_alone(before);
        let agrees =
            before.times_floor() <= config.floor_factor && before.fit.sigma_scale <= config.floor_factor;
        self.refitted = refitted.map(Box::new);
        self.settle(agrees, noise_alone);
        self.tell_unexplained(before, observations, joint_names, config);
        prepend_findings(self, observations, joint_names);
    }

    /// The verdict, of what was found, whether the errors agree with nothing missing, and whether they are no larger than noise
    /// alone gives: then what has no name is too small to be worth a claim. Nor is one what takes nothing from errors once it is
    /// fitted.
    fn settle(&mut self, agrees: bool, noise_alone: bool) {
        let in_vain = self.refitted.is_some() && self.holdout_mm.after >= self.holdout_mm.before;
        if self.verdict == Verdict::Unknown && (noise_alone || in_vain || self.unlisted.is_empty()) {
            self.unlisted.clear();
            self.unknown = None;
            self.tentative.clear();
            (self.refitted, self.holdout_mm.after) = (None, self.holdout_mm.before);
            self.verdict = Verdict::NothingMissing;
        }
        self.verdict = match self.verdict {
            Verdict::NothingMissing if agrees => Verdict::NothingMissing,
            Verdict::NothingMissing | Verdict::Unexplained => Verdict::Unexplained,
            named => named,
        };
        self.probability = match self.verdict {
            Verdict::NothingMissing => Some(self.p_nothing),
            Verdict::Unexplained => None,
            _ => self.probability,
        };
    }

    /// What is neither explained nor of the noise: how much, where, and what was tried.
    fn tell_unexplained(
        &mut self,
        before: &Calibration,
        observations: &[Observation],
        joint_names: &[String],
        config: &DiagnosisConfig,
    ) {
        let settled = self.refitted.as_ref().map_or(before, |r| &r.calibration);
        // Its floor may hold what no reading shows of a play.
        let times = settled.times_floor();
        let beside_names = self.verdict != Verdict::NothingMissing && times > config.floor_factor;
        if self.verdict != Verdict::Unexplained && !beside_names {
            return;
        }
        let errors: Vec<DwellError<'_>> = settled
            .judged_pairs(observations)
            .map(|(r, observation)| DwellError {
                observation,
                error_m: r.fitted_m.norm(),
                expected_m: r.expected_norm_m,
            })
            .collect();
        let single = single_dwells(&errors, config.floor_factor);
        // Where single dwells are all of it, what the others look like says nothing of it.
        let scatter = self.noise.alike().filter(|_| single.is_none());
        let unexplained = Unexplained {
            error_mm: error_mm(settled),
            floor_mm: settled.noise_floor_m * 1e3,
            repeatability_mm: self.repeatability_mm,
            times_floor: times,
            explained_share: self.explained_share(),
            places: single.map_or_else(|| error_places(&errors, joint_names), |single| vec![single]),
            scatter,
            tried: Tried { listed: self.candidates.len(), unlisted: self.tried_unlisted },
        };
        self.warnings.extend(unexplained.warning(self.verdict, config));
        self.unexplained = Some(unexplained);
    }

    /// Share of the squared error beyond the declared noise that what was found explains.
    fn explained_share(&self) -> f64 {
        let BeforeAfter { before, after } = self.holdout_mm;
        let beyond = before.powi(2) - self.floor_mm.powi(2);
        if beyond > 0.0 { ((before.powi(2) - after.powi(2)) / beyond).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// Mean error by which a calibration is judged [mm].
fn error_mm(calibration: &Calibration) -> f64 {
    calibration.judged().fitted.mean_m * 1e3
}

/// Whether the mean of the judged errors is no larger than the declared noise, and what a fit to such noise does not learn, may
/// give by chance.
fn noise_alone(calibration: &Calibration) -> bool {
    let share = calibration.times_floor().min(calibration.fit.sigma_scale).min(1.0);
    let (mut excess_m, mut variance_m2) = (0.0, 0.0);
    for r in calibration.judged_residuals() {
        let expected_m = share * calibration.prediction_factor * r.expected_norm_m;
        excess_m += r.fitted_m.norm() - expected_m;
        variance_m2 += (SPREAD_OF_NORM * expected_m).powi(2);
    }
    excess_m <= CHANCE * variance_m2.sqrt()
}

/// That the points of the hold-out err more with what was named, though dwells in general do not: as where each turn leaves out what
/// an effect acts in, or asks for more than the effect reaches.
fn errs_more(
    before: &Calibration,
    refitted: &Refitted,
    observations: &[Observation],
    config: &DiagnosisConfig,
) -> Option<Warning> {
    let held = compare_heldout(before, &refitted.calibration, observations, config.flips())?;
    let names: Vec<String> = refitted.effects.iter().map(ToString::to_string).collect();
    let message = format!(
        "{} predicts dwells that were left out place by place, but on this hold-out it {}: what it predicts does not reach \
         there, or a turn leaves out what it acts in; another hold-out (`[holdout]`) may tell",
        list_names(&names),
        held.change_text()
    );
    let subject = names.join(" + ");
    held.harms()
        .then(|| Warning::new(Severity::Notice, Stage::Diagnose, Code::HoldoutErrsMore, subject, message))
}

#[cfg(test)]
#[path = "../tests/conclude.rs"]
pub(crate) mod tests;
