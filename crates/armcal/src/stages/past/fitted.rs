//! Frames of the new recordings that nobody could know without them.

use super::Placed;
use crate::error::Error;
use crate::pipeline::Pipeline;
use armcal_calibrate::fit_frames_from;
use armcal_core::{Observation, Parameter, Role, Severity, Stage, Warning};
use armcal_model::Model;
use armcal_report::TipMount;

impl Placed {
    /// Fits the frames that nobody could know without these observations (a board or a base whose pose is estimated; an
    /// estimated tip that was mounted anew) to them, for both arms, which are left alone; says which.
    pub fn fit_frames(
        &mut self,
        pipeline: &Pipeline,
        observations: &[Observation],
    ) -> Result<Vec<Warning>, Error> {
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

fn notice(code: &'static str, subject: String, message: &str) -> Warning {
    Warning::new(Severity::Notice, Stage::Calibrate, code, subject, message.to_owned())
}

fn frames_fitted(frames: &[String]) -> Warning {
    let message = "nobody knows this beforehand: fitted to the dwells that are judged, for the nominal and the calibrated \
                   arm alike; the arms themselves are left alone";
    notice("frame-fitted-on-verification", frames.join(", "), message)
}

fn tip_kept() -> Warning {
    let message = "as the calibration recordings gave it, to the nominal and to the calibrated arm; if tool or target were \
                   mounted anew since, set tip = \"remounted\" in [verify]";
    notice("tip-kept", "tip".to_owned(), message)
}
