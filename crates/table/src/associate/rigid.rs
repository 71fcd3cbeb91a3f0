//! The board's pose that brings cavities onto tips (Arun, Huang, Blostein 1987; Kabsch 1976), also where
//! the cavities do not span the space.

use armcal_core::Pose;
use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};

/// Cavities whose spread across their main direction is below this share of it count as one line.
const LINE: f64 = 0.02;

/// A cavity, the tip in it, and the weight.
pub(super) type Match = (Vector3<f64>, Vector3<f64>, f64);

/// `world_from_board` with the smallest weighted squares of `world_from_board * cavity - tip`. Cavities on a
/// line leave the turn about it as it is in `near`; cavities in one place leave all of the rotation.
pub(super) fn fit_rigid(matches: &[Match], near: &Pose) -> Pose {
    let total: f64 = matches.iter().map(|m| m.2).sum();
    if total <= 0.0 || !total.is_finite() {
        return *near;
    }
    let cavity_mean = matches.iter().map(|m| m.0 * m.2).sum::<Vector3<f64>>() / total;
    let tip_mean = matches.iter().map(|m| m.1 * m.2).sum::<Vector3<f64>>() / total;
    let mut spread = Matrix3::zeros();
    let mut cross = Matrix3::zeros();
    for (cavity, tip, weight) in matches {
        let c = cavity - cavity_mean;
        spread += c * c.transpose() * *weight;
        cross += (tip - tip_mean) * c.transpose() * *weight;
    }
    let rotation = match main_direction(&spread) {
        Span::Point => near.rotation,
        Span::Line(direction) => {
            let seen = cross * direction;
            let turn = UnitQuaternion::rotation_between(&(near.rotation * direction), &seen);
            turn.unwrap_or_else(UnitQuaternion::identity) * near.rotation
        }
        Span::Plane => kabsch(&cross).unwrap_or(near.rotation),
    };
    Pose::from_parts(Translation3::from(tip_mean - rotation * cavity_mean), rotation)
}

/// Whether weighted points lie on one line (or in one place).
pub(super) fn on_a_line(points: impl Iterator<Item = (Vector3<f64>, f64)> + Clone) -> bool {
    let total: f64 = points.clone().map(|p| p.1).sum();
    if total <= 0.0 || !total.is_finite() {
        return true;
    }
    let mean = points.clone().map(|(p, w)| p * w).sum::<Vector3<f64>>() / total;
    let spread: Matrix3<f64> = points.map(|(p, w)| (p - mean) * (p - mean).transpose() * w).sum();
    !matches!(main_direction(&spread), Span::Plane)
}

enum Span {
    Point,
    Line(Vector3<f64>),
    Plane,
}

fn main_direction(spread: &Matrix3<f64>) -> Span {
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let (first, second) = (eigen.eigenvalues[order[0]], eigen.eigenvalues[order[1]]);
    if first < 1e-12 {
        Span::Point
    } else if second < LINE * LINE * first {
        Span::Line(eigen.eigenvectors.column(order[0]).into_owned())
    } else {
        Span::Plane
    }
}

/// The proper rotation closest to `cross = sum tip cavity^T`.
fn kabsch(cross: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let svd = cross.try_svd(true, true, f64::EPSILON, 100)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let smallest = svd.singular_values.imin();
    let mut signs = Vector3::repeat(1.0);
    signs[smallest] = (u * v_t).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(rotation);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planted_poses_come_back_even_from_a_plane_and_a_line() {
        let pose = Pose::new(Vector3::new(0.4, -0.1, 0.2), Vector3::new(0.3, -0.2, 1.1));
        let at = |c: [f64; 3]| {
            let c = Vector3::from(c);
            (c, pose.transform_point(&c.into()).coords, 1.0)
        };
        let plane = [at([0.1, 0.0, 0.0]), at([0.0, 0.1, 0.0]), at([-0.1, 0.05, 0.0]), at([0.0; 3])];
        let found = fit_rigid(&plane, &Pose::identity());
        assert!((found.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-12);
        // On a line only the turn about it stays free: tips and cavities still meet.
        let line = [at([-0.1, 0.0, 0.0]), at([0.05, 0.0, 0.0]), at([0.1, 0.0, 0.0])];
        let found = fit_rigid(&line, &Pose::identity());
        for (cavity, tip, _) in line {
            assert!((found.transform_point(&cavity.into()).coords - tip).norm() < 1e-12);
        }
        assert_eq!(fit_rigid(&[], &pose), pose);
    }
}
