//! Set-points from a finished run: its model read back, targets from a file, everything to CSV, MCAP and the terminal.
//!
//! [`targets`] reads what is asked for, `armcal_compensate` computes, [`table`] and [`recording`] write what
//! comes of it.

pub mod recording;
pub mod table;
pub mod targets;

use crate::error::DeployError;
use armcal_compensate::{Target, TargetFrame};
use armcal_core::{FeatureId, Unit};
use armcal_result::{StoredArms, StoredModel};
use nalgebra::{Point3, Vector3};
use targets::Wanted;

/// The frame of that name: `world`, `base`, or `board.<recording>`; what there is, otherwise.
pub fn target_frame(past: &StoredModel, name: &str) -> Result<TargetFrame, String> {
    match name {
        "world" => Ok(TargetFrame::World),
        "base" => Ok(TargetFrame::Base),
        _ => {
            let recording = name
                .strip_prefix("board.")
                .ok_or("the frames are world, base, and board.RECORDING for the board of a recording")?;
            recording_index(past, recording).map(TargetFrame::Board)
        }
    }
}

/// A recording of the run by its name; what there is, otherwise.
pub fn recording_index(past: &StoredModel, name: &str) -> Result<usize, String> {
    past.recordings.iter().position(|r| r.name == name).ok_or_else(|| {
        let names: Vec<&str> = past.recordings.iter().map(|r| r.name.as_str()).collect();
        format!("the run has no recording `{name}`; it has {}", names.join(", "))
    })
}

/// Targets as the model takes them.
pub fn place_targets(
    arms: &StoredArms,
    (feature, frame): (FeatureId, TargetFrame),
    wanted: &[Wanted],
) -> Result<Vec<Target>, DeployError> {
    let place = |w: &Wanted| {
        let target = frame.target(arms, feature, &w.name, (Vector3::from(w.xyz_m), w.orientation()))?;
        Ok(Target { time_s: w.t_s, ..target })
    };
    wanted.iter().map(place).collect()
}

/// Where the targets are in the world as calibrated [m].
pub fn in_world_m(arms: &StoredArms, frame: TargetFrame, target: &Target) -> Vector3<f64> {
    let board = match frame {
        TargetFrame::Board(recording) => arms.model.board_in_world(&arms.values, recording),
        TargetFrame::World | TargetFrame::Base => None,
    };
    board.map_or(target.position_m(), |board| (board * Point3::from(target.position_m())).coords)
}

/// The suffix of a joint's columns: SI and display.
pub(crate) fn unit_suffixes(unit: Unit) -> [&'static str; 2] {
    if unit == Unit::Metre { ["m", "mm"] } else { ["rad", "deg"] }
}
