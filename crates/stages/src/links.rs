//! On which link is a body? Of each link: where on it the body would have to be, and how far off it then is.
//!
//! A body at `o` of a link is seen at `B (R_k o + t_k)` in pose `k` of the arm, with `R_k, t_k` of the nominal arm and `B` the
//! base in the world. `o` given, `B` is the rigid motion between two sets of points (Kabsch 1976); `B` given, `o` is linear:
//! in turns.

use armcal_core::Pose;
use armcal_core::robust::median;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Turns at most, and the change of the place on the link at which they end [m].
const TURNS: usize = 300;
const SETTLED_M: f64 = 1e-6;
/// Poses this many times as far off as half of them are not believed in a second fit.
const FAR: f64 = 4.0;
/// Fewer poses than this say nothing about nine unknowns.
const FEWEST: usize = 6;

/// A body on a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// world_from_base.
    pub base: Pose,
    /// Where it is on the link [m].
    pub at_m: Vector3<f64>,
    /// Median distance between where it was seen and where it should have been [m].
    pub off_m: f64,
}

/// Places a body that was seen at `seen_m` on the link that was at `link` then.
pub fn place_on_link(link: &[Pose], seen_m: &[Vector3<f64>]) -> Option<Placed> {
    if link.len() < FEWEST {
        return None;
    }
    let first = fit_on_link(link, seen_m)?;
    let near = |i: &usize| first.off(&link[*i], &seen_m[*i]) <= FAR * first.off_m;
    let near: Vec<usize> = (0..link.len()).filter(near).collect();
    if near.len() < FEWEST || near.len() == link.len() {
        return Some(first);
    }
    let (some_link, some_m): (Vec<Pose>, Vec<Vector3<f64>>) =
        near.iter().map(|i| (link[*i], seen_m[*i])).unzip();
    fit_on_link(&some_link, &some_m).map(|again| again.judged(link, seen_m))
}

impl Placed {
    fn off(&self, link: &Pose, seen_m: &Vector3<f64>) -> f64 {
        (self.base.transform_point(&link.transform_point(&self.at_m.into())).coords - seen_m).norm()
    }

    fn judged(self, link: &[Pose], seen_m: &[Vector3<f64>]) -> Placed {
        let off: Vec<f64> = link.iter().zip(seen_m).map(|(link, seen_m)| self.off(link, seen_m)).collect();
        Placed { off_m: median(&off), ..self }
    }
}

fn fit_on_link(link: &[Pose], seen_m: &[Vector3<f64>]) -> Option<Placed> {
    let mut placed = Placed { base: Pose::identity(), at_m: Vector3::zeros(), off_m: 0.0 };
    for _ in 0..TURNS {
        let points: Vec<Vector3<f64>> =
            link.iter().map(|l| l.transform_point(&placed.at_m.into()).coords).collect();
        placed.base = fit_rigid_motion(&points, seen_m)?;
        let turned = placed.base.rotation;
        // One shift of all that is seen goes with the place: both are fitted, and the next turn moves the base.
        let rows = 3 * link.len();
        let mut matrix = DMatrix::zeros(rows, 6);
        let mut right = DVector::zeros(rows);
        for (i, (link, seen)) in link.iter().zip(seen_m).enumerate() {
            let rotation = (turned * link.rotation).to_rotation_matrix();
            matrix.fixed_view_mut::<3, 3>(3 * i, 0).copy_from(rotation.matrix());
            matrix.fixed_view_mut::<3, 3>(3 * i, 3).copy_from(&Matrix3::identity());
            right.fixed_rows_mut::<3>(3 * i).copy_from(&(seen - turned * link.translation.vector));
        }
        let solved = matrix.svd(true, true).solve(&right, 1e-6).ok()?;
        let next_m = Vector3::new(solved[0], solved[1], solved[2]);
        let moved_m = (next_m - placed.at_m).norm();
        placed.at_m = next_m;
        if moved_m < SETTLED_M {
            break;
        }
    }
    Some(placed.judged(link, seen_m))
}

/// The rigid motion that carries points onto others.
pub fn fit_rigid_motion(from_m: &[Vector3<f64>], to_m: &[Vector3<f64>]) -> Option<Pose> {
    let count = from_m.len().max(1) as f64;
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / count;
    let (from, to) = (mean(from_m), mean(to_m));
    let cross: Matrix3<f64> = from_m.iter().zip(to_m).map(|(a, b)| (b - to) * (a - from).transpose()).sum();
    let svd = cross.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * sign * v_t));
    Some(Pose::from_parts(Translation3::from(to - rotation * from), rotation))
}

/// Median difference of the angles by which a link and a body turned from pose to pose [rad].
pub fn turned_apart(link: &[Pose], seen: &[UnitQuaternion<f64>]) -> f64 {
    let of_link = link.windows(2).map(|w| w[0].rotation.angle_to(&w[1].rotation));
    let of_body = seen.windows(2).map(|w| w[0].angle_to(&w[1]));
    median(&of_link.zip(of_body).map(|(a, b)| (a - b).abs()).collect::<Vec<_>>())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    #[test]
    fn a_planted_body_is_found_on_its_link_and_nowhere_else() {
        let base = Pose::new(Vector3::new(1.2, -0.4, 0.7), Vector3::new(0.1, -0.2, 0.9));
        let at_m = Vector3::new(0.03, -0.05, 0.12);
        let link = |i: f64, speed: f64| {
            let turn = Vector3::new((0.7 * i).sin(), (speed * i).cos(), (0.4 * i).sin());
            Pose::new(Vector3::new(0.4 * (0.5 * i).cos(), 0.3 * (0.8 * i).sin(), 0.2 * (0.3 * i).cos()), turn)
        };
        let own: Vec<Pose> = (0..40).map(|i| link(f64::from(i), 1.1)).collect();
        let mut seen: Vec<Vector3<f64>> =
            own.iter().map(|l| base * (l * nalgebra::Point3::from(at_m))).map(|p| p.coords).collect();
        // One pose was seen wrong: it must not spoil the rest.
        seen[7] += Vector3::new(0.0, 0.3, 0.0);
        let placed = place_on_link(&own, &seen).unwrap();
        assert!((placed.at_m - at_m).norm() < 1e-4 && placed.off_m < 1e-4, "{placed:?}");
        assert!((placed.base.translation.vector - base.translation.vector).norm() < 1e-3, "{placed:?}");
        assert!(placed.base.rotation.angle_to(&base.rotation) < 1e-3);
        let other: Vec<Pose> = (0..40).map(|i| link(1.3 * f64::from(i), 0.6)).collect();
        assert!(place_on_link(&other, &seen).unwrap().off_m > 0.05);
        assert!(place_on_link(&own[..5], &seen[..5]).is_none());
        let turns: Vec<UnitQuaternion<f64>> =
            own.iter().map(|l| base.rotation * l.rotation * base.rotation).collect();
        assert!(turned_apart(&own, &turns) < 1e-9 && turned_apart(&other, &turns) > 0.1);
    }
}
