//! The verdict after the refit: a search in the linearised model proposes, calibrations with and without what it found
//! decide.
//!
//! * *nothing missing* is said only of errors at the floor, of noise about as declared, and of a model that is not
//!   improbable, or that nothing unlisted could improve: errors no larger than what the noise alone may give;
//! * a name stays only where the refitted model errs less, by an amount worth a name and clear of chance;
//! * what is neither explained nor at the floor is `unexplained`, and says how much, where, and what was tried.

use crate::compare::compare_heldout;
use crate::config::DiagnosisConfig;
use crate::diagnosis::{BeforeAfter, Diagnosis, JudgedOn, Refitted, Tried, Unexplained, Verdict};
use crate::error_places::{DwellError, error_places, single_dwells};
use crate::explain::explanations;
use crate::next::lead;
use armcal_calibrate::Calibration;
use armcal_core::{Observation, Severity, Stage, Warning, listed};

/// A refit that leaves more than this share of the error that was fitted shows nothing by that.
const CONFIRMED_SHARE: f64 = 0.95;
/// Mean errors that fall by less than this share of the floor are not worth a name.
const WORTH_NAMING: f64 = 0.02;
/// Held-out points are no worse for an effect where the 95 % interval of the change of their mean error ends below this share
/// of the floor (a test of non-inferiority).
const NO_WORSE: f64 = 0.1;
/// A turn of the hold-out that is this many times less certain of a parameter than the whole fit has not learnt it.
const LEARNT: f64 = 3.0;

/// Standard deviation of the norm of an isotropic Gaussian error over its mean, `sqrt(3 pi / 8 - 1)` (Maxwell).
const SPREAD_OF_NORM: f64 = 0.422;
/// Standard errors by which a mean error of nothing but noise stays below its expectation with 99.5 %.
const CHANCE: f64 = 2.58;

/// Where more than this many times the floor remains, a name stays only if it explains at least this share of what lay above
/// the floor: what leaves the most unexplained has only leaned on another cause.
pub(crate) const LARGE_REST: f64 = armcal_calibrate::INADEQUATE;
const LEAST_EXPLAINED: f64 = 0.5;

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
        self.judged = if before.held_out() { JudgedOn::HeldOut } else { JudgedOn::Fitted };
        self.holdout_mm = BeforeAfter { before: error_mm(before), after: error_mm(after.unwrap_or(before)) };
        self.floor_mm = before.noise_floor_m * 1e3;

        let least = after.map_or(f64::INFINITY, Calibration::times_floor).min(self.noise.sigma_ratio);
        let noise_alone = noise_alone(before, least.min(1.0));
        let shown = after.map(|after| shown_by(before, after, observations, config));
        let withheld = (self.verdict == Verdict::Unknown && noise_alone)
            || after.is_some_and(|after| shown == Some(ShownBy::Nothing) || leans(before, after, config));
        let mut refuted = Vec::new();
        if withheld {
            refuted.extend(refitted.map(|r| (together(&r), self.holdout_mm)));
            self.take_back();
        } else {
            self.warnings.extend(refitted.as_ref().filter(|_| shown == Some(ShownBy::Fitted)).map(by_fitted));
            self.warnings.extend(refitted.iter().flat_map(|r| r.warnings.iter().cloned()));
            self.refitted = refitted.map(Box::new);
        }
        let improbable = self.p_nothing < config.max_probability_nothing;
        let agrees = at_floor(before, config) && (noise_alone || !improbable);
        self.settle(withheld, agrees, improbable);
        self.tell_unexplained(before, observations, joint_names, refuted, config);
        lead(self, observations, joint_names);
        self.explanations = explanations(self, config);
    }

    /// Takes back everything that was found: the refit does not confirm it.
    fn take_back(&mut self) {
        self.holdout_mm.after = self.holdout_mm.before;
        self.effects.clear();
        self.unlisted.clear();
        self.unknown = None;
        self.tentative.clear();
    }

    /// The verdict, of what was found in the linearised model, whether that is `withheld`, whether the data agree with
    /// nothing missing, and whether that is improbable.
    fn settle(&mut self, withheld: bool, agrees: bool, improbable: bool) {
        self.verdict = match self.verdict {
            Verdict::NothingMissing if agrees => Verdict::NothingMissing,
            Verdict::NothingMissing | Verdict::Unexplained => Verdict::Unexplained,
            _ if withheld && agrees => Verdict::NothingMissing,
            _ if withheld => Verdict::Unexplained,
            Verdict::Unknown if self.unlisted.is_empty() => Verdict::Unexplained,
            named => named,
        };
        if matches!(self.verdict, Verdict::NothingMissing | Verdict::Unexplained) {
            self.names.clear();
        }
        self.probability = match self.verdict {
            Verdict::NothingMissing => (!improbable).then_some(self.p_nothing),
            Verdict::Unexplained => None,
            _ => self.probability,
        };
    }

    /// What is neither explained nor at the floor: how much, where, and what was tried, `refuted` names among it.
    fn tell_unexplained(
        &mut self,
        before: &Calibration,
        observations: &[Observation],
        joint_names: &[String],
        refuted: Vec<(String, BeforeAfter)>,
        config: &DiagnosisConfig,
    ) {
        let settled = self.refitted.as_ref().map_or(before, |r| &r.calibration);
        let times_floor = settled.left_over();
        let beside_names = self.verdict != Verdict::NothingMissing && times_floor > config.floor_factor;
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
        let scatter = self.noise.correlated().filter(|_| single.is_none());
        let unexplained = Unexplained {
            error_mm: error_mm(settled),
            floor_mm: settled.noise_floor_m * 1e3,
            times_floor: settled.times_floor(),
            places: single.map_or_else(|| error_places(&errors, joint_names), |single| vec![single]),
            scatter: scatter.map(|(kind, _)| kind.to_owned()),
            tried: Tried { listed: self.candidates.len(), unlisted: self.tried_unlisted, refitted: refuted },
        };
        self.warnings.extend(unexplained.warning(self.verdict, times_floor, config));
        self.unexplained = Some(unexplained);
    }
}

/// Mean error by which a calibration is judged [mm].
fn error_mm(calibration: &Calibration) -> f64 {
    calibration.judged().fitted.mean_m * 1e3
}

/// Names of what was refitted together.
fn together(refitted: &Refitted) -> String {
    let names: Vec<String> = refitted.effects.iter().map(ToString::to_string).collect();
    names.join(" + ")
}

/// Whether what a refit with more effects leaves is so much that they have only leaned on another cause.
fn leans(before: &Calibration, after: &Calibration, config: &DiagnosisConfig) -> bool {
    let left = after.left_over();
    left > config.unexplained_factor || (left > LARGE_REST && explained(before, after) < LEAST_EXPLAINED)
}

/// Whether the calibrated errors are at the floor and scatter about as declared.
fn at_floor(calibration: &Calibration, config: &DiagnosisConfig) -> bool {
    calibration.times_floor() <= config.floor_factor && calibration.fit.sigma_scale <= config.floor_factor
}

/// Whether the mean of the judged errors is no larger than noise of this share of what is declared, and what a fit to such
/// noise does not learn, may give by chance: whatever looks like structure in them is too small to be worth a claim without
/// a name.
fn noise_alone(calibration: &Calibration, share: f64) -> bool {
    let (mut excess_m, mut variance_m2) = (0.0, 0.0);
    for r in calibration.judged_residuals() {
        let expected_m = share * calibration.prediction_factor * r.expected_norm_m;
        excess_m += r.fitted_m.norm() - expected_m;
        variance_m2 += (SPREAD_OF_NORM * expected_m).powi(2);
    }
    excess_m <= CHANCE * variance_m2.sqrt()
}

/// By which points a model with more effects errs less.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ShownBy {
    /// By those that are judged: held out, or all where nothing is.
    Judged,
    /// By those that were fitted, the held-out ones being no worse.
    Fitted,
    /// By none.
    Nothing,
}

/// Whether a mean error falls by an amount worth a name [mm].
pub(crate) fn is_worth_naming(before_mm: f64, after_mm: f64, floor_mm: f64) -> bool {
    before_mm - after_mm > WORTH_NAMING * floor_mm
}

/// Whether a model with more effects errs less by an amount worth a name: on held-out points, with an interval clear of zero;
/// or clearly less on those that were fitted, where few held-out ones show an effect, so that their mean falls not clear of
/// chance, or is certainly no worse, or where a turn leaves out what it acts in and cannot learn it. Held-out points that a
/// turn has learnt to predict and that may be worse refute what the fitted ones show.
pub(crate) fn shown_by(
    before: &Calibration,
    after: &Calibration,
    observations: &[Observation],
    config: &DiagnosisConfig,
) -> ShownBy {
    let floor_mm = before.noise_floor_m * 1e3;
    let worth = is_worth_naming(error_mm(before), error_mm(after), floor_mm);
    let fitted = after.train.fitted.mean_m < CONFIRMED_SHARE * before.train.fitted.mean_m;
    match compare_heldout(before, after, observations, config) {
        Some(held) if worth && held.helps() => ShownBy::Judged,
        Some(held) if fitted && !held.harms() => {
            let no_worse = worth || held.change_ci95[1] < NO_WORSE * floor_mm;
            if no_worse || !learnt(before, after) { ShownBy::Fitted } else { ShownBy::Nothing }
        }
        None if worth => ShownBy::Judged,
        _ => ShownBy::Nothing,
    }
}

/// Whether every turn of the hold-out knows the parameters that only the model with more effects has.
pub(crate) fn learnt(before: &Calibration, after: &Calibration) -> bool {
    let old = |name: &str| before.fit.estimates.iter().any(|e| e.parameter.name == name);
    let new =
        after.fit.estimates.iter().zip(&after.turn_sigma_ratio).filter(|(e, _)| !old(&e.parameter.name));
    new.into_iter().all(|(_, ratio)| *ratio <= LEARNT)
}

/// What was named by the fit alone, in words.
fn by_fitted(refitted: &Refitted) -> Warning {
    let names: Vec<String> = refitted.effects.iter().map(ToString::to_string).collect();
    let message = format!(
        "{}: the held-out points gain nothing clear of chance, as where an effect acts only in what each turn leaves out; the \
         fitted points decided, and another hold-out (`[holdout]`) may show more",
        listed(&names)
    );
    Warning::new(Severity::Notice, Stage::Diagnose, "judged-by-fit", together(refitted), message)
}

/// Share of the squared error above the floor that a refit with more effects explains, on the side of the hold-out that shows
/// more of it.
fn explained(before: &Calibration, after: &Calibration) -> f64 {
    let floor = |c: &Calibration| c.noise_floor_m.powi(2);
    let share = |b: f64, a: f64| (b.powi(2) - a.powi(2)) / (b.powi(2) - floor(before)).max(f64::MIN_POSITIVE);
    let judged = share(before.judged().fitted.mean_m, after.judged().fitted.mean_m);
    let fitted = share(before.train.fitted.mean_m, after.train.fitted.mean_m);
    judged.max(fitted)
}

#[cfg(test)]
#[path = "tests/conclude.rs"]
mod tests;
