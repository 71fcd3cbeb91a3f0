//! Clause 7.3: distance accuracy AD and distance repeatability RD, between two poses that are visited in turn.

use crate::IsoError;
use crate::pose::three_deviations;
use crate::stats::{mean, standard_deviation};
use crate::tip_pose::{TipPose, check_poses};
use nalgebra::Vector3;

/// A distance between two poses, or what the standard makes of several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Between the positions: `D`, `AD_P` or `RD_P` [m].
    pub position_m: f64,
    /// Along x, y, z: `D_x = |x_1 - x_2|`, `AD_x` or `RD_x` ... [m].
    pub axes_m: Vector3<f64>,
    /// About x, y, z: `D_a = |a_1 - a_2|`, `AD_a` or `RD_a` ... [rad].
    pub angles_rad: Option<Vector3<f64>>,
}

fn distance_between(pair: &[TipPose; 2]) -> Distance {
    let step_m = pair[1].position_m - pair[0].position_m;
    Distance {
        position_m: step_m.norm(),
        axes_m: step_m.abs(),
        angles_rad: pair[1].turn_from_rad(&pair[0]).map(|turn| turn.abs()),
    }
}

fn check_pairs(what: &'static str, pairs: &[[TipPose; 2]], least: usize) -> Result<(), IsoError> {
    (0..2)
        .try_for_each(|end| check_poses(what, &pairs.iter().map(|pair| pair[end]).collect::<Vec<_>>(), least))
}

/// Distance accuracy: mean attained minus commanded distance, `AD_P = D_mean - D_c`, signed; likewise along and
/// about x, y, z (ISO 9283:1998, 7.3.2). `attained[j]` are the two poses of cycle j.
///
/// Fails without a cycle, or where a pose is not finite.
pub fn distance_accuracy(commanded: &[TipPose; 2], attained: &[[TipPose; 2]]) -> Result<Distance, IsoError> {
    check_pairs("distance accuracy", attained, 1)?;
    check_pairs("distance accuracy", std::slice::from_ref(commanded), 1)?;
    let (asked, got): (Distance, Vec<Distance>) =
        (distance_between(commanded), attained.iter().map(distance_between).collect());
    let n = got.len() as f64;
    let angles_rad = got.iter().map(|d| d.angles_rad).collect::<Option<Vec<_>>>();
    Ok(Distance {
        position_m: mean(&got.iter().map(|d| d.position_m).collect::<Vec<_>>()) - asked.position_m,
        axes_m: got.iter().map(|d| d.axes_m).sum::<Vector3<f64>>() / n - asked.axes_m,
        angles_rad: angles_rad
            .zip(asked.angles_rad)
            .map(|(turns, asked)| turns.iter().sum::<Vector3<f64>>() / n - asked),
    })
}

/// Distance repeatability `RD = +-3 sqrt(sum_j (D_j - D_mean)^2 / (n - 1))`, the positive side; likewise along and
/// about x, y, z (ISO 9283:1998, 7.3.3).
///
/// Fails with fewer than two cycles, or where a pose is not finite.
pub fn distance_repeatability(attained: &[[TipPose; 2]]) -> Result<Distance, IsoError> {
    check_pairs("distance repeatability", attained, 2)?;
    let got: Vec<Distance> = attained.iter().map(distance_between).collect();
    let angles_rad = got.iter().map(|d| d.angles_rad).collect::<Option<Vec<_>>>();
    Ok(Distance {
        position_m: 3.0 * standard_deviation(&got.iter().map(|d| d.position_m).collect::<Vec<_>>()),
        axes_m: three_deviations(&got.iter().map(|d| d.axes_m).collect::<Vec<_>>()),
        angles_rad: angles_rad.map(|turns| three_deviations(&turns)),
    })
}
