//! What is asked for of a finished run: its model, as in which recording, in which frame.

use crate::{Arm, CompensateError, Compensator, Conditions, Limits, Target};
use armcal_core::FeatureId;
use armcal_model::Model;
use armcal_model_file::{StoredArms, StoredModel};
use nalgebra::{Point3, UnitQuaternion, Vector3};

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

impl TargetFrame {
    /// A position [m] and, where one is wanted, an orientation in this frame, as the model takes them.
    ///
    /// # Errors
    /// An orientation on a board.
    pub fn target(
        self,
        arms: &StoredArms,
        feature: FeatureId,
        name: &str,
        (at_m, turned): (Vector3<f64>, Option<UnitQuaternion<f64>>),
    ) -> Result<Target, CompensateError> {
        match (self, turned) {
            (TargetFrame::World, turned) => Ok(Target::in_world(name, at_m, turned)),
            (TargetFrame::Base, turned) => {
                let base = arms.model.arm_base_in_world(&arms.values, arms.model.arm_of(feature));
                let turned = turned.map(|q| base.rotation * q);
                Ok(Target::in_world(name, (base * Point3::from(at_m)).coords, turned))
            }
            (TargetFrame::Board(_), None) => Ok(Target::on_board(name, at_m)),
            (TargetFrame::Board(_), Some(_)) => {
                let problem = "orientations are taken in world or base, not on a board; leave qx..qw out";
                Err(CompensateError::BadTarget { target: name.to_owned(), problem: problem.into() })
            }
        }
    }
}

/// Joints that stay where they are while the tip is brought to a target: those off the way to it, and those that move another
/// branch too, unless a range is given for them.
pub fn held_joints(model: &Model, tip: FeatureId, drive: &Drive) -> Vec<usize> {
    let (own, shared) = (model.joints_to(tip), model.joints_shared_by(tip));
    let moves = |joint: &usize| {
        own.contains(joint) && (!shared.contains(joint) || drive.ranges.iter().any(|(j, _)| j == joint))
    };
    (0..model.joint_count()).filter(|joint| !moves(joint)).collect()
}

impl<'a> Compensator<'a> {
    /// Everything but the targets, of a finished run.
    pub fn of_result(
        past: &StoredModel,
        arms: &'a StoredArms,
        (feature, frame): (FeatureId, TargetFrame),
        drive: &Drive,
    ) -> Compensator<'a> {
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
        Compensator {
            nominal: Arm { model: &arms.geometry, values: nominal_values },
            calibrated: Arm { model: &arms.model, values: arms.values.clone() },
            conditions,
            limits,
            postures_rad: past.postures_rad.clone(),
            recorded_rad: past.range_rad.clone(),
            approach_rad: drive.approach_deg.to_radians(),
            crossing_s: drive.crossing_s,
        }
    }
}
