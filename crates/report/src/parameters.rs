//! `parameters.toml`: what the calibration says about every parameter and frame, for programs and people.

use crate::ReportError;
use armcal_calibrate::Estimate;
use armcal_core::{FeatureId, Pose, RollPitchYaw};
use armcal_recording::sealed;
use armcal_result::{Run, VERSION, role_word};
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
    parameters: Vec<Entry<'a>>,
    frames: Vec<FrameEntry>,
}

/// One parameter in a file for programs.
#[derive(Serialize)]
pub(crate) struct Entry<'a> {
    name: &'a str,
    unit: &'static str,
    nominal: f64,
    value: f64,
    sigma: f64,
    ci95: [f64; 2],
    free: bool,
    determined: bool,
    at_bound: bool,
    role: &'static str,
    meaning: &'a str,
}

/// Where a frame lies in its parent.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct FrameEntry {
    frame: String,
    parent: String,
    xyz_m: [f64; 3],
    rpy_deg: [f64; 3],
}

/// The text of the file.
pub(crate) fn parameters_toml(run: &Run) -> Result<String, ReportError> {
    let fit = &run.calibration.fit;
    let file = File {
        pipeline: &run.pipeline_name,
        version: VERSION,
        conclusion: armcal_wording::conclusion(&run.calibration),
        undetermined: fit.undetermined.iter().map(|u| u.text.as_str()).collect(),
        parameters: fit.estimates.iter().map(entry).collect(),
        frames: frames(run),
    };
    let header = if run.is_pool() { POOLED } else { HEADER };
    Ok(sealed(&format!("{header}{}", toml::to_string(&file)?)).into_owned())
}

/// One parameter as it is written.
pub(crate) fn entry(e: &Estimate) -> Entry<'_> {
    Entry {
        name: &e.parameter.name,
        unit: e.parameter.unit.symbol(),
        nominal: e.parameter.nominal,
        value: e.value,
        sigma: e.sigma,
        ci95: e.ci95,
        free: e.parameter.free,
        determined: e.determined,
        at_bound: e.at_bound,
        role: role_word(e.parameter.role),
        meaning: &e.parameter.meaning,
    }
}

/// Base and tip, those of the last recording where each has its own, and the board of every recording that has one, as
/// calibrated.
pub(crate) fn frames(run: &Run) -> Vec<FrameEntry> {
    let p = run.calibration.fit.values();
    let (last, last_p) = run.model.in_recording(run.recordings.len().saturating_sub(1), &p);
    let arms: Vec<String> = run.model.chain().arms().iter().map(|arm| format!("{}.", arm.name)).collect();
    let one = [String::new()];
    let mut frames = Vec::new();
    for (arm, prefix) in if arms.is_empty() { &one[..] } else { &arms[..] }.iter().enumerate() {
        let (base, tip) =
            (last.arm_base_in_world(&last_p, arm), last.feature_in_link(&last_p, FeatureId(arm)));
        frames.push(frame_entry(format!("{prefix}base"), "world", &base));
        frames.push(frame_entry(format!("{prefix}tip"), "last link", &tip));
    }
    for (index, recording) in run.recordings.iter().enumerate() {
        if let Some(board) = run.model.board_in_world(&p, index) {
            frames.push(frame_entry(format!("board.{}", recording.name), "world", &board));
        }
    }
    frames
}

/// A frame as it is written.
pub(crate) fn frame_entry(frame: String, parent: &str, pose: &Pose) -> FrameEntry {
    let RollPitchYaw { xyz_m, rpy_deg } = pose.into();
    FrameEntry { frame, parent: parent.into(), xyz_m, rpy_deg }
}
