//! The model adapter: a calibrated model and its observations are diagnosed, and what was found is refitted.

pub(crate) mod channels;
pub(crate) mod group;
pub(crate) mod knowledge;
pub(crate) mod model_refit;
pub(crate) mod nested;
pub(crate) mod rests;
pub(crate) mod scans;
pub(crate) mod stretches;
pub(crate) mod suggestion;
pub(crate) mod view;

use crate::diagnosis::Refitted;
use crate::problem::places::{places_of_poses, thin_observations};
use crate::robot::knowledge::Knowledge;
use crate::robot::model_refit::{ModelRefit, Seen};
use crate::verdict::conclude::Evidence;
use crate::verdict::{diagnose_beyond, propose_candidates};
use crate::{DiagnoseError, Diagnosis, DiagnosisConfig};
use armcal_calibrate::{Calibration, FitConfig, HoldoutConfig, calibrate_beside};
use armcal_core::Observation;
use armcal_model::{EffectSpec, Model, Session};
use std::collections::BTreeSet;

/// A fit to so many observations begins with one to a few poses, and a search through them with one through these: a few more
/// than are weighed in every detail.
const MANY: usize = 1600;
const FEW: usize = 480;
/// Fewest of these to each recording.
const OF_EACH: usize = 20;

/// A calibrated model, and what it was calibrated with.
#[derive(Debug, Clone, Copy)]
pub struct Calibrated<'a> {
    /// The model.
    pub model: &'a Model,
    /// Its calibration on `observations`.
    pub calibration: &'a Calibration,
    /// What the fit saw, and the dwells held out of it.
    pub observations: &'a [Observation],
    /// What the effects need to know about all of them.
    pub session: &'a Session,
    /// How it was fitted.
    pub fit: &'a FitConfig,
    /// What was held out.
    pub holdout: &'a HoldoutConfig,
}

impl Calibrated<'_> {
    /// The model with more effects, on the same observations and hold-out; none where this leaves no way to fit it.
    pub(crate) fn with(&self, effects: Vec<EffectSpec>) -> Option<Refitted> {
        let model = self.model.with_effects(&effects, self.session).ok()?;
        let beside = Some(self.calibration);
        let calibration =
            { calibrate_beside(beside, &model, self.observations, self.fit, self.holdout) }.ok()?;
        Some(Refitted { effects, model, calibration, warnings: Vec::new() })
    }
}

/// Diagnoses a calibrated model: which effect do its observations ask for?
pub fn diagnose(calibrated: &Calibrated<'_>, config: &DiagnosisConfig) -> Result<Diagnosis, DiagnoseError> {
    let Calibrated { calibration, observations, session, fit, .. } = *calibrated;
    config.check()?;
    let model = &as_fitted(calibrated)?;
    let joint_names = model.chain().joint_names();
    let values = calibration.fit.values();
    let weighed: Vec<Observation> = thin_observations(observations, config).into_iter().cloned().collect();
    let few = initial_subset(observations, config);
    let places = places_of_poses(&weighed);
    let seen = Seen { observations, weighed: &weighed, few: &few, places: &places };
    let knowledge = || Knowledge::of(config, joint_names);
    let mut refit = ModelRefit::new((model, values.clone()), seen, session, fit, knowledge()?);
    let mut proposed = Vec::new();
    if few.len() < weighed.len() && !few.is_empty() {
        let few: Vec<Observation> = few.iter().copied().cloned().collect();
        let places = places_of_poses(&few);
        let seen = Seen { observations: &few, weighed: &few, few: &[], places: &places };
        let mut scout = ModelRefit::new((model, values), seen, session, fit, knowledge()?);
        // Where few cannot be fitted, or weighed, all of them may be.
        proposed = propose_candidates(&mut scout, config).unwrap_or_default();
        refit.take_sizes(scout);
    }
    let mut diagnosis = diagnose_beyond(&mut refit, &proposed, config)?;
    diagnosis.warnings.extend(refit.knowledge.warning(&model.declared_held()));
    let refitted =
        refit_suggested(calibrated, &diagnosis).map(|found| diagnosis.with_rests(calibrated, found));
    diagnosis.conclude(Evidence { before: calibration, observations, refitted, joint_names }, config);
    Ok(diagnosis)
}

/// Of very many observations a few that tell nearly where a fit to all of them ends; none where recordings, which may have
/// parameters of their own, would have few of these each.
fn initial_subset<'o>(observations: &'o [Observation], config: &DiagnosisConfig) -> Vec<&'o Observation> {
    let recordings: BTreeSet<usize> = observations.iter().map(|o| o.dwell.recording).collect();
    if observations.len() < MANY || recordings.len() * OF_EACH > FEW {
        return Vec::new();
    }
    thin_observations(observations, &DiagnosisConfig { max_weighed: FEW, ..config.clone() })
}

/// The model with the priors that its fit learnt and the bounds that it took, which hold for all that is tried beside it.
fn as_fitted(calibrated: &Calibrated<'_>) -> Result<Model, DiagnoseError> {
    let mut model = calibrated.model.clone();
    let learnt = calibrated.calibration.fit.estimates.iter().map(|e| &e.parameter);
    for parameter in learnt.filter(|p| p.assumed.is_some()) {
        model.set_parameter(&parameter.name, |p| {
            (p.prior_sigma, p.assumed) = (parameter.prior_sigma, None);
            (p.lower, p.upper) = (parameter.lower, parameter.upper);
        })?;
    }
    Ok(model)
}

impl Diagnosis {
    /// Fits what was found again, where it was read back from the results of a run.
    pub fn refit(&mut self, calibrated: &Calibrated<'_>) {
        self.refitted = refit_suggested(calibrated, self).map(Box::new);
    }
}

/// The model with everything that was found, on the same observations and hold-out. None where nothing was found, or
/// where this hold-out leaves no way to fit it.
fn refit_suggested(calibrated: &Calibrated<'_>, diagnosis: &Diagnosis) -> Option<Refitted> {
    let effects = diagnosis.suggested(calibrated.model.chain().joint_names()).ok()?;
    if effects.is_empty() { None } else { calibrated.with(effects) }
}
