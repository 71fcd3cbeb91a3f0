//! What the pipeline knows before it calibrates: the drawing of the arm, the measured frames.

use crate::config::LabConfig;
use crate::mechanism::Body;
use crate::trace::Trace;
use armcal_core::Pose;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// The model before calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Nominal {
    /// The arm's DH file.
    pub dh_toml: String,
    /// The base, as its markers have it in the mean of all recordings.
    pub world_from_base: Pose,
    /// How well the markers represent the base, per axis, 1 sigma [m].
    pub base_sigma_m: f64,
    /// The same for rotation [rad].
    pub base_sigma_rad: f64,
    /// The calibrated point on the last link.
    pub link_from_tip: Pose,
    /// The board in each recording, as its markers have it; taken as exact.
    pub boards: Vec<NominalBoard>,
}

/// The board in one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct NominalBoard {
    /// Name of the recording.
    pub recording: String,
    /// Where the markers have it.
    pub world_from_board: Pose,
}

impl Nominal {
    /// `frames`: mean of base and table in each recording.
    pub(super) fn new(config: &LabConfig, frames: &[[Pose; 2]]) -> Nominal {
        let bases: Vec<Pose> = frames.iter().map(|[base, _]| *base).collect();
        let boards = config.recordings.iter().zip(frames).map(|(recording, [_, board])| NominalBoard {
            recording: recording.name.clone(),
            world_from_board: *board,
        });
        Nominal {
            dh_toml: Nominal::dh_toml(config),
            world_from_base: coordinatewise_mean(&bases, |values| {
                values.iter().sum::<f64>() / values.len() as f64
            }),
            base_sigma_m: config.vicon.base_mount_sigma_mm * 1e-3,
            base_sigma_rad: config.vicon.base_mount_sigma_deg.to_radians(),
            link_from_tip: Pose::translation(0.0, 0.0, 0.0)
                * Translation3::from(Vector3::from(config.vicon.tip_offset_mm) * 1e-3),
            boards: boards.collect(),
        }
    }

    /// The drawing of the arm in the format of the product's DH files.
    pub fn dh_toml(config: &LabConfig) -> String {
        let deviation = &config.arm.deviation;
        let mut text = format!(
            "name = \"arm\"\nconvention = \"standard\"\n\n[deviation]\nbound_mm = {:?}\nbound_deg = {:?}\n\
             prior_sigma_mm = {:?}\nprior_sigma_deg = {:?}\n",
            deviation.length_mm,
            deviation.angle_deg,
            0.8 * deviation.length_mm,
            0.8 * deviation.angle_deg,
        );
        for row in &config.arm.rows {
            let fixed = if row.joint { "" } else { "joint = \"fixed\"\n" };
            text += &format!(
                "\n[[rows]]\nname = \"{}\"\n{fixed}theta_deg = {:?}\nd_mm = {:?}\na_mm = {:?}\nalpha_deg = {:?}\n",
                row.name,
                row.theta_deg,
                1e3 * row.d_m,
                1e3 * row.a_m,
                row.alpha_deg,
            );
        }
        text
    }
}

/// Robust mean of a body that stands still, or nearly: medians over time.
pub(super) fn mean_pose(trace: &Trace, body: Body) -> Pose {
    let seen = trace.seen(body);
    // Positions lie apart by unequal times; once a second is close enough to equal.
    let (mut even, mut next_s) = (Vec::new(), 0.0);
    for (pose, time_s) in seen.iter().zip(&trace.time_s) {
        while *time_s >= next_s {
            even.push(*pose);
            next_s += 1.0;
        }
    }
    coordinatewise_mean(&even, |values| {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]) / 2.0
    })
}

/// A mean, coordinate by coordinate, rotations in the tangent space of the first.
fn coordinatewise_mean(poses: &[Pose], mean: impl Fn(&[f64]) -> f64) -> Pose {
    let Some(first) = poses.first() else { return Pose::identity() };
    let vector = |of: &dyn Fn(&Pose) -> Vector3<f64>| {
        Vector3::from_fn(|k, _| mean(&poses.iter().map(|pose| of(pose)[k]).collect::<Vec<_>>()))
    };
    let position = vector(&|pose| pose.translation.vector);
    let turn = vector(&|pose| (first.rotation.inverse() * pose.rotation).scaled_axis());
    Isometry3::from_parts(
        Translation3::from(position),
        first.rotation * UnitQuaternion::from_scaled_axis(turn),
    )
}
