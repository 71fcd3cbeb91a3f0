//! `parameters.toml`: what the calibration says about every parameter and frame, for programs and people.

use crate::ReportError;
use armcal_recording::seal_text;
use armcal_result::summary::{FrameEntry, ParameterSummary};
use armcal_result::{Run, VERSION};
use serde::Serialize;

const HEADER: &str = "\
# armcal.parameters/1
# Parameters of the calibrated arm. value, nominal, sigma and ci95 (the 95 % interval) are in `unit`.
# determined = false: the data say nothing about it and the prior keeps it near nominal.
# at_bound = true: it wants to go further than its bounds allow.
# Frames: where `frame` lies in `parent`; roll, pitch, yaw about the fixed x, y, z of the parent.

";

/// Begins otherwise, so that a pool takes the place of no run's own parameters.
const POOLED: &str = "\
# armcal.pooled-parameters/1
# Parameters of an arm calibrated on many recordings at once. value, nominal, sigma and ci95 (the 95 % interval) are in `unit`.
# <recording>.<parameter> and board.<recording>.* are that recording's own; everything else is shared.
# determined = false: the data say nothing about it and the prior keeps it near nominal.
# Frames: where `frame` lies in `parent`; roll, pitch, yaw about the fixed x, y, z of the parent.

";

#[derive(Serialize)]
struct File<'a> {
    pipeline: &'a str,
    version: &'static str,
    conclusion: String,
    undetermined: Vec<&'a str>,
    parameters: Vec<ParameterSummary<'a>>,
    frames: Vec<FrameEntry>,
}

/// The text of the file.
pub(crate) fn parameters_toml(run: &Run) -> Result<String, ReportError> {
    let fit = &run.calibration.fit;
    let file = File {
        pipeline: &run.pipeline_name,
        version: VERSION,
        conclusion: armcal_wording::conclusion(&run.calibration),
        undetermined: fit.undetermined.iter().map(|u| u.text.as_str()).collect(),
        parameters: fit.estimates.iter().map(ParameterSummary::from).collect(),
        frames: FrameEntry::all(run),
    };
    let header = if run.is_pool() { POOLED } else { HEADER };
    Ok(seal_text(&format!("{header}{}", toml::to_string(&file)?)).into_owned())
}
