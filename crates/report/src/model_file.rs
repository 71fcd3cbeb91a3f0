//! The calibrated model, in the form the nominal one had: `calibrated.toml` (DH) or `calibrated.urdf`.

use crate::{ReportError, Run};
use armcal_core::Warning;
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
    let p = run.calibration.fit.values();
    if run.model.chain().is_urdf() {
        let (text, warnings) = run.model.to_urdf(&run.model_text, Path::new("model_text of the run"), &p)?;
        return Ok(ModelFile { name: "calibrated.urdf", media_type: "application/xml", text, warnings });
    }
    let text = run.model.chain().to_dh_toml(&p)?;
    Ok(ModelFile { name: "calibrated.toml", media_type: "application/toml", text, warnings: Vec::new() })
}
