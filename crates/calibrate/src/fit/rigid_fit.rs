//! The rigid motion that carries one set of points onto another, robustly.

use armcal_core::Pose;
use armcal_core::robust::median;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Rounds of reweighting, and the motion [m, rad] below which they end.
const ROUNDS: usize = 20;
const SETTLED: f64 = 1e-5;
/// Share by which the current rotation is preferred where the points leave it open.
const PREFERENCE: f64 = 1e-9;

/// The same point in two frames [m].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub from: Vector3<f64>,
    pub to: Vector3<f64>,
}

/// The pose that minimises the sum of Huber losses of `|to - pose from|`, scale by the median (Kabsch 1976 within
/// reweighting). Where the points leave the rotation open (fewer than three, or on a line), the one nearest `current`.
/// Without pairs, `current`; without `rotate`, only the translation moves.
pub(crate) fn rigid_fit(pairs: &[Pair], current: &Pose, rotate: bool) -> Pose {
    let mut pose = *current;
    let mut weights = vec![1.0; pairs.len()];
    for _ in 0..ROUNDS {
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            return pose;
        }
        let mean = |point: fn(&Pair) -> Vector3<f64>| -> Vector3<f64> {
            pairs.iter().zip(&weights).map(|(pair, w)| point(pair) * *w).sum::<Vector3<f64>>() / total
        };
        let (from, to) = (mean(|pair| pair.from), mean(|pair| pair.to));
        let mut rotation = pose.rotation;
        if rotate {
            let cross: Matrix3<f64> = pairs
                .iter()
                .zip(&weights)
                .map(|(pair, w)| (pair.to - to) * (pair.from - from).transpose() * *w)
                .sum();
            rotation = nearest_rotation(&cross, &current.rotation);
        }
        let next = Pose::from_parts(Translation3::from(to - rotation * from), rotation);
        let moved = (next.translation.vector - pose.translation.vector).norm()
            + next.rotation.angle_to(&pose.rotation);
        pose = next;
        let errors: Vec<Vector3<f64>> = pairs
            .iter()
            .map(|pair| pair.to - (pose.rotation * pair.from + pose.translation.vector))
            .collect();
        weights = weights_of(&errors);
        if moved < SETTLED {
            break;
        }
    }
    pose
}

/// Huber weights of error vectors: 1 within the median norm, its share beyond.
pub(crate) fn weights_of(errors: &[Vector3<f64>]) -> Vec<f64> {
    let norms: Vec<f64> = errors.iter().map(|e| e.norm()).collect();
    let scale = median(&norms);
    norms.iter().map(|&n| if n > scale && n > 0.0 { scale / n } else { 1.0 }).collect()
}

/// The rotation R with the largest `tr(R' M)`, preferring `current` where M leaves it open.
pub(crate) fn nearest_rotation(m: &Matrix3<f64>, current: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let size = m.norm();
    let preferred = current.to_rotation_matrix().into_inner() * (PREFERENCE * size.max(f64::MIN_POSITIVE));
    let svd = (m + preferred).svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return *current;
    };
    let handed = (u * v_t).determinant().signum();
    let fix = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handed));
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * fix * v_t))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth() -> Pose {
        Pose::new(Vector3::new(3.0, -2.0, 0.7), Vector3::new(0.4, 2.4, -1.1))
    }

    fn pairs(points: &[[f64; 3]]) -> Vec<Pair> {
        points
            .iter()
            .map(|&p| {
                let from = Vector3::from(p);
                Pair { from, to: truth().rotation * from + truth().translation.vector }
            })
            .collect()
    }

    #[test]
    fn recovers_a_pose_half_a_turn_away_despite_outliers() {
        let points: Vec<[f64; 3]> =
            (0..20).map(|i| [(i as f64).sin(), (1.7 * i as f64).cos(), (0.6 * i as f64).sin()]).collect();
        let mut all = pairs(&points);
        all[3].to += Vector3::new(0.5, 0.0, 0.0);
        let found = rigid_fit(&all, &Pose::identity(), true);
        assert!((found.translation.vector - truth().translation.vector).norm() < 1e-3, "{found}");
        assert!(found.rotation.angle_to(&truth().rotation) < 1e-3);
    }

    #[test]
    fn two_points_leave_the_turn_about_their_line_at_the_current_pose() {
        let all = pairs(&[[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]]);
        let turned = truth() * Pose::rotation(Vector3::new(0.3, 0.0, 0.0));
        let found = rigid_fit(&all, &turned, true);
        assert!(
            found.rotation.angle_to(&turned.rotation) < 1e-6,
            "{}",
            found.rotation.angle_to(&turned.rotation)
        );
        let from = |v: Vector3<f64>| found.rotation * v + found.translation.vector;
        assert!((from(all[1].from) - all[1].to).norm() < 1e-9);
    }

    #[test]
    fn planar_points_do_not_become_a_mirror_image() {
        let all = pairs(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
        let found = rigid_fit(&all, &Pose::identity(), true);
        assert!(found.rotation.angle_to(&truth().rotation) < 1e-6);
    }
}
