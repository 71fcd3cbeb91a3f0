//! The calibrated model, in the form the nominal one had: `calibrated.toml` (DH) or `calibrated.urdf`.

use crate::{ReportError, Run};
use armcal_core::Warning;
use armcal_model::Model;
use std::path::Path;

/// A model file with its name in the output folder.
pub(crate) struct ModelFile {
    pub name: &'static str,
    pub media_type: &'static str,
    pub text: String,
    /// What the form cannot express.
    pub warnings: Vec<Warning>,
}

/// The calibrated model of a run.
pub(crate) fn model_file(run: &Run) -> Result<ModelFile, ReportError> {
    calibrated(&run.model, &run.model_text, &run.calibration.fit.values())
}

/// A model with the parameters `p`, in the form of the text that its nominal one was read from.
pub(crate) fn calibrated(model: &Model, nominal_text: &str, p: &[f64]) -> Result<ModelFile, ReportError> {
    if model.chain().is_urdf() {
        let (text, warnings) = model.to_urdf(nominal_text, Path::new("model_text of the run"), p)?;
        return Ok(ModelFile { name: "calibrated.urdf", media_type: "application/xml", text, warnings });
    }
    let text = model.chain().to_dh_toml(p)?;
    Ok(ModelFile { name: "calibrated.toml", media_type: "application/toml", text, warnings: Vec::new() })
}
