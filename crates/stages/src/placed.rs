//! A calibrated model among the frames of other recordings, and what of these nobody could know without them.

use crate::RunError;
use armcal_calibrate::fit_frames_from;
use armcal_config::{Pipeline, TipMount};
use armcal_core::{Code, Observation, Parameter, Pose, Role, Severity, Stage, Warning};
use armcal_model::Model;
use nalgebra::Vector3;

/// The model of the past in new surroundings.
pub struct Placed {
    /// Its arm and effects between the frames of the new recordings.
    pub model: Model,
    /// Nominal arm without effects, base and boards as the new recordings know them.
    pub nominal: Vec<f64>,
    /// The arm and its effects as calibrated, the same frames.
    pub calibrated: Vec<f64>,
    /// What could not be carried over.
    pub warnings: Vec<Warning>,
}

impl Placed {
    /// The calibrated base's own frame: where nominal and calibrated arm are compared.
    pub fn base(&self) -> PlacedBase<'_> {
        PlacedBase { model: &self.model, base_in_world: self.model.base_in_world(&self.calibrated) }
    }
}

/// Positions in the calibrated base frame.
pub struct PlacedBase<'a> {
    model: &'a Model,
    base_in_world: Pose,
}

impl PlacedBase<'_> {
    /// A position of the sensor's frame [m] in the base frame [m].
    pub fn from_world_m(&self, in_world_m: &Vector3<f64>) -> Vector3<f64> {
        self.base_in_world.inverse_transform_point(&(*in_world_m).into()).coords
    }

    /// The tip as these parameters predict it, in the base frame [m].
    pub fn predicted_tip_m(&self, p: &[f64], o: &Observation) -> Vector3<f64> {
        self.from_world_m(&self.model.predicted_tip_in_world(p, o))
    }
}

impl Placed {
    /// Fits the frames that nobody could know without these observations (a board or a base whose pose is estimated; an
    /// estimated tip that was mounted anew) to them, for both arms, which are left alone; says which.
    pub fn fit_frames(
        &mut self,
        pipeline: &Pipeline,
        observations: &[Observation],
    ) -> Result<Vec<Warning>, RunError> {
        let (model, fit) = (&self.model, &pipeline.fit);
        let kept = pipeline.verify.tip == TipMount::Kept;
        let estimated = |p: &Parameter| p.free && p.role == Role::EstimatedFrame;
        let is_length = |name: &str| model.lengths().any(|(_, at)| model.parameters()[at].name == name);
        let of_tip = |name: &str| name.starts_with("tip.") || name.contains(".tip.") || is_length(name);
        let fitted = |p: &Parameter| estimated(p) && !(kept && of_tip(&p.name));
        let mut said = Vec::new();
        if model.parameters().iter().any(fitted) {
            self.nominal = fit_frames_from(model, observations, self.nominal.clone(), fit, &fitted)?;
            self.calibrated = fit_frames_from(model, observations, self.calibrated.clone(), fit, &fitted)?;
            said.push(frames_fitted(&frames_of(model, &fitted)));
        }
        if model.parameters().iter().any(|p| estimated(p) && !fitted(p) && !is_length(&p.name)) {
            said.push(tip_kept());
        }
        Ok(said)
    }
}

/// Names of the frames of which a parameter is chosen.
fn frames_of(model: &Model, chosen: &dyn Fn(&Parameter) -> bool) -> Vec<String> {
    let chosen = model.parameters().iter().filter(|p| chosen(p));
    let mut names: Vec<String> =
        chosen.filter_map(|p| p.name.rsplit_once('.').map(|(frame, _)| frame.to_owned())).collect();
    names.dedup();
    names
}

fn calibration_notice(code: Code, subject: String, message: &str) -> Warning {
    Warning::new(Severity::Notice, Stage::Calibrate, code, subject, message.to_owned())
}

fn frames_fitted(frames: &[String]) -> Warning {
    let message = "nobody knows this beforehand: fitted to the dwells that are judged, for the nominal and the calibrated \
                   arm alike; the arms themselves are left alone";
    calibration_notice(Code::FrameFittedOnVerification, frames.join(", "), message)
}

fn tip_kept() -> Warning {
    let message = "as the calibration recordings gave it, to the nominal and to the calibrated arm; if tool or target were \
                   mounted anew since, set tip = \"remounted\" in [verify]";
    calibration_notice(Code::TipKept, "tip".to_owned(), message)
}
