//! The calibrated model, in the form the nominal one had: `calibrated.toml` (DH) or `calibrated.urdf`.

use crate::{ReportError, Run};
use armcal_core::Warning;
use armcal_model::Model;
use std::path::Path;

/// By this the file is known for armcal's own.
const MARK: &str = "armcal.calibrated-model/1";
/// Names of the file, by the form of the nominal model.
pub(crate) const DH: &str = "calibrated.toml";
pub(crate) const URDF: &str = "calibrated.urdf";

/// A model file with its name in the output folder.
pub(crate) struct ModelFile {
    pub name: &'static str,
    pub media_type: &'static str,
    pub text: String,
    /// What the form cannot express.
    pub warnings: Vec<Warning>,
}

/// The calibrated model of a run, as it was in its last recording.
pub(crate) fn model_file(run: &Run) -> Result<ModelFile, ReportError> {
    let p = run.calibration.fit.values();
    let (model, p) = run.model.in_recording(run.recordings.len().saturating_sub(1), &p);
    calibrated(model, &run.model_text, &p)
}

/// A model with the parameters `p`, in the form of the text that its nominal one was read from.
pub(crate) fn calibrated(model: &Model, nominal_text: &str, p: &[f64]) -> Result<ModelFile, ReportError> {
    if model.chain().is_urdf() {
        let (text, warnings) = model.to_urdf(nominal_text, Path::new("model_text of the run"), p)?;
        let text = marked_xml(text);
        return Ok(ModelFile { name: URDF, media_type: "application/xml", text, warnings });
    }
    let text = format!("# {MARK}\n\n{}", model.chain().to_dh_toml(p)?);
    Ok(ModelFile { name: DH, media_type: "application/toml", text, warnings: Vec::new() })
}

/// The text with the mark as a comment behind the XML declaration, where it has none yet: the nominal model may itself be a
/// calibrated one.
fn marked_xml(text: String) -> String {
    let comment = format!("<!-- {MARK} -->");
    if text.contains(&comment) {
        return text;
    }
    let declared = text.starts_with("<?xml").then(|| text.find("?>")).flatten().map_or(0, |at| at + 2);
    let (declaration, rest) = text.split_at(declared);
    let between = if declared == 0 { "" } else { "\n" };
    format!("{declaration}{between}{comment}\n{}", rest.strip_prefix('\n').unwrap_or(rest))
}
