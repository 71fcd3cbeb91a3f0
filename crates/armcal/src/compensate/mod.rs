//! Set-points from a finished run: its model read back, targets from a file, everything to CSV, MCAP and the terminal.
//!
//! [`targets`] reads what is asked for, [`prepare`] puts model and conditions together for `armcal_compensate`, [`table`]
//! and [`recording`] write what comes of it.

pub mod recording;
pub mod table;
pub mod targets;

use crate::error::Error;
use armcal_compensate::{Arm, Compensator, Conditions, Limits, Target};
use armcal_core::{FeatureId, Unit};
use armcal_report::{PastArms, PastModel};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use targets::Wanted;

/// What the targets' coordinates mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TargetFrame {
    /// The sensor's frame.
    World,
    /// The base of the arm whose tip it is, as calibrated.
    Base,
    /// The board of this recording, as calibrated.
    Board(usize),
}

/// What the user may say about the drive.
#[derive(Debug, Clone, Default)]
pub struct Drive {
    /// Recording as in which the arm is; the last when absent.
    pub recording: Option<usize>,
    /// Load at the tip [kg]; that of the recording when absent.
    pub load_kg: Option<f64>,
    /// Temperature [degC]; that of the recording when absent.
    pub temperature_c: Option<f64>,
    /// Ranges of single joints, in the joint's display unit.
    pub ranges: Vec<(usize, [f64; 2])>,
    /// Size of an approach before every target [deg]; 0 for none.
    pub approach_deg: f64,
    /// Time in which a joint crosses its gap on a path [s].
    pub crossing_s: f64,
}

/// The frame of that name: `world`, `base`, or `board.<recording>`.
pub fn target_frame(past: &PastModel, name: &str) -> Result<TargetFrame, Error> {
    let bad = |problem: String| Error::BadOption { option: "--frame", value: name.to_owned(), problem };
    match name {
        "world" => Ok(TargetFrame::World),
        "base" => Ok(TargetFrame::Base),
        _ => {
            let recording = name.strip_prefix("board.").ok_or_else(|| {
                bad("the frames are world, base, and board.RECORDING for the board of a recording".into())
            })?;
            recording_index(past, recording).map(TargetFrame::Board).map_err(bad)
        }
    }
}

/// A recording of the run by its name; what there is, otherwise.
pub fn recording_index(past: &PastModel, name: &str) -> Result<usize, String> {
    past.recordings.iter().position(|r| r.name == name).ok_or_else(|| {
        let names: Vec<&str> = past.recordings.iter().map(|r| r.name.as_str()).collect();
        format!("the run has no recording `{name}`; it has {}", names.join(", "))
    })
}

/// Everything but the targets.
pub fn prepare<'a>(
    past: &PastModel,
    arms: &'a PastArms,
    (feature, frame): (FeatureId, TargetFrame),
    drive: &Drive,
) -> Result<Compensator<'a>, Error> {
    let last = past.recordings.len().saturating_sub(1);
    let on_board = if let TargetFrame::Board(recording) = frame { Some(recording) } else { None };
    let recording = on_board.or(drive.recording).unwrap_or(last);
    let facts = past.recordings.get(recording);
    let conditions = Conditions {
        feature,
        recording,
        dwell: facts.map_or(0, |f| f.last_dwell),
        time_ns: facts.map_or(0, |f| f.last_ns),
        load_kg: drive.load_kg.or(facts.map(|f| f.load_kg)).unwrap_or(0.0),
        more_loads: facts.map_or_else(Vec::new, |f| f.more_loads.clone()),
        temperature_c: drive.temperature_c.or(facts.and_then(|f| f.temperature_c)),
    };
    let chain = arms.geometry.chain();
    let mut limits = Limits::none(arms.geometry.joint_count());
    for (joint, (limit, recorded)) in limits.0.iter_mut().zip(&past.range_rad).enumerate() {
        *limit = chain.joint_limits(joint, *recorded);
    }
    for (joint, range) in &drive.ranges {
        limits.0[*joint] = range.map(|v| chain.joint_unit(*joint).from_display(v));
    }
    let mut nominal_values = arms.nominal_values.clone();
    if frame == TargetFrame::Base {
        // The controller's own base is where it is: only the arm beyond it is nominal.
        for index in arms.geometry.base_parameters(arms.geometry.arm_of(feature)) {
            nominal_values[index] = arms.values[index];
        }
    }
    Ok(Compensator {
        nominal: Arm { model: &arms.geometry, values: nominal_values },
        calibrated: Arm { model: &arms.model, values: arms.values.clone() },
        conditions,
        limits,
        postures_rad: past.postures_rad.clone(),
        recorded_rad: past.range_rad.clone(),
        approach_rad: drive.approach_deg.to_radians(),
        crossing_s: drive.crossing_s,
    })
}

/// Targets as the model takes them.
pub fn placed(
    arms: &PastArms,
    (feature, frame): (FeatureId, TargetFrame),
    wanted: &[Wanted],
) -> Result<Vec<Target>, Error> {
    let base = arms.model.arm_base_in_world(&arms.values, arms.model.arm_of(feature));
    let place = |w: &Wanted| {
        let at_m = Vector3::from(w.xyz_m);
        let target = match (frame, w.orientation()) {
            (TargetFrame::World, turned) => Target::in_world(&w.name, at_m, turned),
            (TargetFrame::Base, turned) => {
                let turned: Option<UnitQuaternion<f64>> = turned.map(|q| base.rotation * q);
                Target::in_world(&w.name, (base * Point3::from(at_m)).coords, turned)
            }
            (TargetFrame::Board(_), None) => Target::on_board(&w.name, at_m),
            (TargetFrame::Board(_), Some(_)) => {
                let problem =
                    "orientations are taken in world or base, not on a board; leave qx..qw out".into();
                return Err(Error::BadOption { option: "--frame", value: "board".into(), problem });
            }
        };
        Ok(Target { time_s: w.t_s, ..target })
    };
    wanted.iter().map(place).collect()
}

/// Where the targets are in the world as calibrated [m].
pub fn in_world_m(arms: &PastArms, frame: TargetFrame, target: &Target) -> Vector3<f64> {
    let board = match frame {
        TargetFrame::Board(recording) => arms.model.board_in_world(&arms.values, recording),
        TargetFrame::World | TargetFrame::Base => None,
    };
    board.map_or(target.position_m(), |board| (board * Point3::from(target.position_m())).coords)
}

/// The suffix of a joint's columns: SI and display.
pub(crate) fn suffixes(unit: Unit) -> [&'static str; 2] {
    if unit == Unit::Metre { ["m", "mm"] } else { ["rad", "deg"] }
}
