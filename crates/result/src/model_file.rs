//! The calibrated model, in the form the nominal one had: `calibrated.toml` (DH) or `calibrated.urdf`; of several arms one
//! file each, by their names.

use crate::{ResultError, Run};
use armcal_core::Warning;
use armcal_model::{Arm, Model};
use armcal_recording::seal_text;
use std::path::Path;

/// By this the file is known for armcal's own.
const MARK: &str = "armcal.calibrated-model/1";
/// Names of the file, by the form of the nominal model.
const DH: &str = "calibrated.toml";
const URDF: &str = "calibrated.urdf";

/// A model file with its name in the output folder.
pub struct ModelFile {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: &'static str,
    /// Its content.
    pub text: String,
    /// What the form cannot express.
    pub warnings: Vec<Warning>,
}

/// The calibrated model of a run, as it was in its last recording; of several arms one each.
pub fn model_files(run: &Run) -> Result<Vec<ModelFile>, ResultError> {
    let all = run.calibration.fit.values();
    let (model, values) = run.model.in_recording(run.recordings.len().saturating_sub(1), &all);
    let arms = model.chain().arms();
    if arms.is_empty() {
        let text = run.model_texts.first().map_or("", String::as_str);
        return Ok(vec![arm_model_file((model, 0), text, &values)?]);
    }
    let of_arm = |(at, (arm, text)): (usize, (&Arm, &String))| {
        let file = arm_model_file((model, at), text, &values)?;
        Ok(ModelFile { name: model_file_name(Some(&arm.name), file.name == URDF), ..file })
    };
    arms.iter().zip(&run.model_texts).enumerate().map(of_arm).collect()
}

/// Name of the file of an arm, of several by its own.
pub fn model_file_name(arm: Option<&str>, urdf: bool) -> String {
    let form = if urdf { "urdf" } else { "toml" };
    format!("{}.{form}", arm.unwrap_or("calibrated"))
}

/// An arm of a model with the parameters `p`, in the form of the text that its nominal one was read from.
fn arm_model_file(
    (model, arm): (&Model, usize),
    nominal_text: &str,
    p: &[f64],
) -> Result<ModelFile, ResultError> {
    let (chain, own) = model.chain().arm(arm);
    if chain.is_urdf() {
        let (text, warnings) = model.to_urdf(arm, nominal_text, Path::new("model_text of the run"), p)?;
        let text = seal_text(&marked_xml(text)).into_owned();
        return Ok(ModelFile { name: URDF.into(), media_type: "application/xml", text, warnings });
    }
    let text = seal_text(&format!("# {MARK}\n\n{}", chain.to_dh_toml(&p[own])?)).into_owned();
    Ok(ModelFile { name: DH.into(), media_type: "application/toml", text, warnings: Vec::new() })
}

/// The text with the mark as a comment behind the XML declaration, where it has none yet: the nominal model may itself be a
/// calibrated one.
pub fn marked_xml(text: String) -> String {
    let comment = format!("<!-- {MARK} -->");
    if text.contains(&comment) {
        return text;
    }
    let declared = text.starts_with("<?xml").then(|| text.find("?>")).flatten().map_or(0, |at| at + 2);
    let (declaration, rest) = text.split_at(declared);
    let between = if declared == 0 { "" } else { "\n" };
    format!("{declaration}{between}{comment}\n{}", rest.strip_prefix('\n').unwrap_or(rest))
}
