//! Clause 7.2: pose accuracy AP, pose repeatability RP, multi-directional pose accuracy variation vAP.

use crate::IsoError;
use crate::error::at_least;
use crate::stats::{largest, mean, standard_deviation};
use crate::tip_pose::{TipPose, barycentre, check_poses};
use nalgebra::Vector3;

/// A deviation of the position, and about x, y, z where every orientation was tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Of the position [m].
    pub position_m: f64,
    /// Of the angles about x, y, z [rad].
    pub angles_rad: Option<Vector3<f64>>,
}

impl Deviation {
    /// The largest of each part.
    pub(crate) fn largest(all: &[Deviation]) -> Deviation {
        let turns_rad: Option<Vec<Vector3<f64>>> = all.iter().map(|d| d.angles_rad).collect();
        Deviation {
            position_m: largest(all.iter().map(|d| d.position_m)),
            angles_rad: turns_rad
                .map(|turns| Vector3::from_fn(|axis, _| largest(turns.iter().map(|t| t[axis].abs())))),
        }
    }
}

/// 7.2.1: where the barycentre of the attained poses lies, seen from the commanded pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseAccuracy {
    /// `AP_P = sqrt((x_mean - x_c)^2 + (y_mean - y_c)^2 + (z_mean - z_c)^2)` [m].
    pub position_m: f64,
    /// `AP_x, AP_y, AP_z` = mean minus commanded [m].
    pub axes_m: Vector3<f64>,
    /// `AP_a, AP_b, AP_c` = mean minus commanded angle about x, y, z [rad].
    pub angles_rad: Option<Vector3<f64>>,
}

impl PoseAccuracy {
    /// Without the axes.
    pub(crate) fn deviation(&self) -> Deviation {
        Deviation { position_m: self.position_m, angles_rad: self.angles_rad }
    }
}

/// Pose accuracy of `attained`, all approached from one direction (ISO 9283:1998, 7.2.1).
///
/// Fails without a pose, or where one is not finite.
pub fn pose_accuracy(commanded: &TipPose, attained: &[TipPose]) -> Result<PoseAccuracy, IsoError> {
    check_poses("pose accuracy", attained, 1)?;
    check_poses("pose accuracy", std::slice::from_ref(commanded), 1)?;
    let centre = barycentre(attained);
    let axes_m = centre.position_m - commanded.position_m;
    Ok(PoseAccuracy { position_m: axes_m.norm(), axes_m, angles_rad: centre.turn_from_rad(commanded) })
}

/// 7.2.2: how closely the attained poses of one command lie together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRepeatability {
    /// `RP_l = l_mean + 3 S_l`, the radius of a sphere about the barycentre [m].
    pub radius_m: f64,
    /// `l_mean`, the mean distance from the barycentre [m].
    pub mean_m: f64,
    /// `S_l`, the standard deviation of that distance [m].
    pub deviation_m: f64,
    /// `RP_a, RP_b, RP_c = +-3 S_a, +-3 S_b, +-3 S_c`, the positive side [rad].
    pub angles_rad: Option<Vector3<f64>>,
}

impl PoseRepeatability {
    /// Radius and angles.
    pub(crate) fn deviation(&self) -> Deviation {
        Deviation { position_m: self.radius_m, angles_rad: self.angles_rad }
    }
}

/// Pose repeatability of `attained`, all approached from one direction (ISO 9283:1998, 7.2.2).
///
/// Fails with fewer than two poses, or where one is not finite.
pub fn pose_repeatability(attained: &[TipPose]) -> Result<PoseRepeatability, IsoError> {
    check_poses("pose repeatability", attained, 2)?;
    let centre = barycentre(attained);
    let distances_m: Vec<f64> = attained.iter().map(|p| (p.position_m - centre.position_m).norm()).collect();
    let (mean_m, deviation_m) = (mean(&distances_m), standard_deviation(&distances_m));
    let turns_rad: Option<Vec<Vector3<f64>>> = attained.iter().map(|p| p.turn_from_rad(&centre)).collect();
    Ok(PoseRepeatability {
        radius_m: mean_m + 3.0 * deviation_m,
        mean_m,
        deviation_m,
        angles_rad: turns_rad.map(|turns| three_deviations(&turns)),
    })
}

/// Three standard deviations of each component.
pub(crate) fn three_deviations(rows: &[Vector3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        3.0 * standard_deviation(&rows.iter().map(|row| row[axis]).collect::<Vec<_>>())
    })
}

/// Multi-directional pose accuracy variation vAP, the largest distance and the largest angle between the barycentres of two
/// directions: `directions[h]` are the poses attained from direction h, three perpendicular ones in the standard (ISO
/// 9283:1998, 7.2.3).
///
/// Fails with fewer than two directions, with a direction without poses, or where a pose is not finite.
pub fn accuracy_variation(directions: &[Vec<TipPose>]) -> Result<Deviation, IsoError> {
    const WHAT: &str = "multi-directional pose accuracy variation";
    at_least(2, "directions of approach", directions.len(), WHAT)?;
    directions.iter().try_for_each(|poses| check_poses(WHAT, poses, 1))?;
    let centres: Vec<TipPose> = directions.iter().map(|poses| barycentre(poses)).collect();
    let pairs = centres.iter().enumerate().flat_map(|(h, a)| centres[..h].iter().map(move |b| (a, b)));
    let between = |(a, b): (&TipPose, &TipPose)| Deviation {
        position_m: (a.position_m - b.position_m).norm(),
        angles_rad: a.turn_from_rad(b),
    };
    Ok(Deviation::largest(&pairs.map(between).collect::<Vec<_>>()))
}
