//! The arm as it is built: joint axes as lines in space and the tip as a point, at zero joint angles.
//!
//! Moving it is the product of exponentials (Brockett 1984): the tip turns about the last axis, then
//! about the one before it, down to the first; axes are never re-expressed in link frames. The table
//! of Denavit-Hartenberg numbers only says how to lay the lines out: along an axis by `d`, along the
//! common normal by `a`, the next axis twisted about that normal by `alpha`.

use crate::screw::{Line, pose_from_axes, rotate_vector};
use armcal_core::Pose;
use nalgebra::{Matrix3, Matrix3xX, Vector3};
use serde::{Deserialize, Serialize};

/// One row of the table: turn by `theta` about z, go `d` along it, `a` along the new x, twist by `alpha`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DhRow {
    /// Name of the joint, or of the fixed row.
    pub name: String,
    /// Whether a joint angle is added to `theta`.
    pub joint: bool,
    /// Angle at joint zero [deg].
    pub theta_deg: f64,
    /// Offset along the axis [m].
    pub d_m: f64,
    /// Length of the common normal [m].
    pub a_m: f64,
    /// Twist [deg].
    pub alpha_deg: f64,
}

/// An arm at rest in its zero position, in its base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisArm {
    /// Joint axes, from base to tip.
    pub axes: Vec<Line>,
    /// The tip [m].
    pub tip_m: Vector3<f64>,
    /// The tip frame's x, y and z directions.
    pub tip_axes: [Vector3<f64>; 3],
    /// Centre of mass of each joint's link: the middle between its axis and what follows [m].
    pub mass_centres_m: Vec<Vector3<f64>>,
}

/// Why inverse kinematics gave up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfReach {
    /// How far the tip stays away from the target [m].
    pub short_by_m: f64,
}

impl DhRow {
    /// `theta` [rad].
    pub fn theta_rad(&self) -> f64 {
        self.theta_deg.to_radians()
    }

    /// `alpha` [rad].
    pub fn alpha_rad(&self) -> f64 {
        self.alpha_deg.to_radians()
    }
}

impl AxisArm {
    /// Lays out the axes that a DH table describes, walking along axes and common normals.
    pub fn from_rows(rows: &[DhRow]) -> AxisArm {
        let (mut point, mut x, mut z) = (Vector3::zeros(), Vector3::x(), Vector3::z());
        let (mut axes, mut ends) = (Vec::new(), Vec::new());
        for row in rows {
            if row.joint {
                axes.push(Line { point_m: point, direction: z });
                ends.push(point);
            }
            x = rotate_vector(&z, &x, row.theta_rad());
            point += z * row.d_m + x * row.a_m;
            z = rotate_vector(&x, &z, row.alpha_rad());
            if let Some(end) = ends.last_mut() {
                *end = point;
            }
        }
        let mass_centres_m = axes.iter().zip(&ends).map(|(a, end)| (a.point_m + end) / 2.0).collect();
        AxisArm { axes, tip_m: point, tip_axes: [x, z.cross(&x), z], mass_centres_m }
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.axes.len()
    }

    /// Where a point fixed to the link of joint `link` is [m, base frame].
    pub fn carried(&self, link: usize, point_m: &Vector3<f64>, joint_rad: &[f64]) -> Vector3<f64> {
        (0..=link).rev().fold(*point_m, |p, j| self.axes[j].turn_point(&p, joint_rad[j]))
    }

    /// Where the link of a joint ends in the zero position: at the next axis, or at the tip [m].
    pub fn link_end_m(&self, link: usize) -> Vector3<f64> {
        self.axes.get(link + 1).map_or(self.tip_m, |next| next.point_m)
    }

    /// A body fixed to the link of joint `link`, `at_m` from where that ends, along the axes of the base in the zero position,
    /// where it is [base frame].
    pub fn carried_pose(&self, link: usize, at_m: &Vector3<f64>, joint_rad: &[f64]) -> Pose {
        self.carried_frame(
            link,
            &(self.link_end_m(link) + at_m),
            [Vector3::x(), Vector3::y(), Vector3::z()],
            joint_rad,
        )
    }

    fn carried_frame(
        &self,
        link: usize,
        at_m: &Vector3<f64>,
        axes: [Vector3<f64>; 3],
        joint_rad: &[f64],
    ) -> Pose {
        let turned = |axis| {
            (0..=link).rev().fold(axis, |v, j| rotate_vector(&self.axes[j].direction, &v, joint_rad[j]))
        };
        pose_from_axes(self.carried(link, at_m, joint_rad), &axes.map(turned))
    }

    /// The tip [m, base frame].
    pub fn tip(&self, joint_rad: &[f64]) -> Vector3<f64> {
        self.carried(self.joint_count() - 1, &self.tip_m, joint_rad)
    }

    /// The tip frame in the base frame.
    pub fn tip_pose(&self, joint_rad: &[f64]) -> Pose {
        self.carried_frame(self.joint_count() - 1, &self.tip_m, self.tip_axes, joint_rad)
    }

    /// The joint axes where they are at these angles.
    pub fn axes_at(&self, joint_rad: &[f64]) -> Vec<Line> {
        (0..self.joint_count())
            .map(|j| (0..j).rev().fold(self.axes[j], |l, k| self.axes[k].turn_line(&l, joint_rad[k])))
            .collect()
    }

    /// Turns everything beyond the end of link `link` about `line`, all in the zero position. No angle, no change.
    pub fn turn_beyond(&mut self, link: usize, line: &Line, angle_rad: f64) {
        if angle_rad == 0.0 {
            return;
        }
        self.axes.iter_mut().skip(link + 1).for_each(|axis| *axis = line.turn_line(axis, angle_rad));
        let centres = self.mass_centres_m.iter_mut().skip(link + 1);
        centres.for_each(|centre| *centre = line.turn_point(centre, angle_rad));
        self.tip_m = line.turn_point(&self.tip_m, angle_rad);
        self.tip_axes = self.tip_axes.map(|axis| rotate_vector(&line.direction, &axis, angle_rad));
    }

    /// Shifts everything beyond the end of link `link` [m], all in the zero position.
    pub fn shift_beyond(&mut self, link: usize, by_m: &Vector3<f64>) {
        self.axes.iter_mut().skip(link + 1).for_each(|axis| axis.point_m += by_m);
        self.mass_centres_m.iter_mut().skip(link + 1).for_each(|centre| *centre += by_m);
        self.tip_m += by_m;
    }

    /// The link of joint `link` in the zero position: from its own axis to the next one, or to the tip [m].
    pub fn link_m(&self, link: usize) -> Vector3<f64> {
        self.link_end_m(link) - self.axes[link].point_m
    }

    /// Gravity's torque on each joint, `> 0` pushing towards `+q` [N m].
    ///
    /// `gravity_m_s2` is in the base frame; `masses_kg` one a link, `tip_kg` at the tip.
    pub fn gravity_torque(
        &self,
        joint_rad: &[f64],
        gravity_m_s2: &Vector3<f64>,
        masses_kg: &[f64],
        tip_kg: f64,
    ) -> Vec<f64> {
        let axes = self.axes_at(joint_rad);
        let mut torque = vec![0.0; axes.len()];
        let mut hang = |link: usize, point: Vector3<f64>, mass_kg: f64| {
            let force = gravity_m_s2 * mass_kg;
            for (t, axis) in torque.iter_mut().zip(&axes).take(link + 1) {
                *t += axis.velocity(&point).dot(&force);
            }
        };
        for (link, (centre, mass)) in self.mass_centres_m.iter().zip(masses_kg).enumerate() {
            hang(link, self.carried(link, centre, joint_rad), *mass);
        }
        hang(axes.len() - 1, self.tip(joint_rad), tip_kg);
        torque
    }

    /// Joint angles that put the tip on `target_m`, near `start_rad` (damped least squares, Wampler 1986).
    pub fn solve(&self, target_m: &Vector3<f64>, start_rad: &[f64]) -> Result<Vec<f64>, OutOfReach> {
        let mut q = start_rad.to_vec();
        let mut error = target_m - self.tip(&q);
        for _ in 0..200 {
            if error.norm() < 1e-11 {
                return Ok(q);
            }
            // Damping fades with the error: robust far away, quadratic convergence close by.
            let step = self.step_towards(&q, &error, 0.1 * error.norm().min(0.1));
            let largest = step.iter().fold(0.0f64, |a, s| a.max(s.abs()));
            let scale = (0.2 / largest.max(1e-12)).min(1.0);
            q.iter_mut().zip(&step).for_each(|(q, s)| *q += s * scale);
            error = target_m - self.tip(&q);
        }
        if error.norm() < 1e-9 { Ok(q) } else { Err(OutOfReach { short_by_m: error.norm() }) }
    }

    fn step_towards(&self, q: &[f64], error: &Vector3<f64>, damping: f64) -> Vec<f64> {
        let tip = self.tip(q);
        let axes = self.axes_at(q);
        let columns: Vec<Vector3<f64>> = axes.iter().map(|axis| axis.velocity(&tip)).collect();
        let jacobian = Matrix3xX::from_columns(&columns);
        let normal = &jacobian * jacobian.transpose() + Matrix3::identity() * (damping * damping + 1e-14);
        let weights = normal.try_inverse().unwrap_or_else(Matrix3::identity) * error;
        (jacobian.transpose() * weights).iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ArmConfig;
    use nalgebra::Matrix4;
    use proptest::prelude::*;

    /// Eq. 9-14 of the paper multiplied out: the independent check of the axis-line construction.
    fn dh_product(rows: &[DhRow], joint_rad: &[f64]) -> Matrix4<f64> {
        let mut joints = joint_rad.iter();
        rows.iter().fold(Matrix4::identity(), |t, row| {
            let q = if row.joint { *joints.next().unwrap() } else { 0.0 };
            let ((s, c), (sa, ca)) = ((row.theta_rad() + q).sin_cos(), row.alpha_rad().sin_cos());
            t * Matrix4::new(
                c,
                -s * ca,
                s * sa,
                row.a_m * c,
                s,
                c * ca,
                -c * sa,
                row.a_m * s,
                0.0,
                sa,
                ca,
                row.d_m,
                0.0,
                0.0,
                0.0,
                1.0,
            )
        })
    }

    #[test]
    fn nominal_tip_at_zero_is_the_papers() {
        let arm = AxisArm::from_rows(&ArmConfig::default().rows);
        assert!((arm.tip(&[0.0; 3]) - Vector3::new(0.3543, 0.012, 0.476)).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn axis_lines_agree_with_the_papers_matrices(
            q in prop::array::uniform3(-3.0..3.0f64), dev in prop::collection::vec(-1.0..1.0f64, 16),
        ) {
            let mut rows = ArmConfig::default().rows;
            for (row, d) in rows.iter_mut().zip(dev.chunks(4)) {
                row.theta_deg += 2.0 * d[0];
                row.d_m += 0.005 * d[1];
                row.a_m += 0.005 * d[2];
                row.alpha_deg += 2.0 * d[3];
            }
            let pose = AxisArm::from_rows(&rows).tip_pose(&q).to_homogeneous();
            prop_assert!((pose - dh_product(&rows, &q)).norm() < 1e-12);
        }

        #[test]
        fn inverse_kinematics_returns_to_the_tip(q in prop::array::uniform3(-0.5..0.5f64)) {
            let arm = AxisArm::from_rows(&ArmConfig::default().rows);
            let start = [q[0] * 0.5, q[1] - 0.4, q[2] - 0.4];
            let target = arm.tip(&[q[0], q[1] - 0.6, q[2] - 0.3]);
            let solved = arm.solve(&target, &start).unwrap();
            prop_assert!((arm.tip(&solved) - target).norm() < 1e-9);
        }

        #[test]
        fn gravity_torque_is_the_slope_of_the_potential(q in prop::array::uniform3(-1.0..1.0f64)) {
            let arm = AxisArm::from_rows(&ArmConfig::default().rows);
            let (g, masses, tip_kg) = (Vector3::new(0.3, -0.2, -9.8), [1.0, 1.2, 0.6], 0.3);
            let potential = |q: &[f64]| {
                let links: f64 = (0..3).map(|l| masses[l] * arm.carried(l, &arm.mass_centres_m[l], q).dot(&g)).sum();
                -links - tip_kg * arm.tip(q).dot(&g)
            };
            let torque = arm.gravity_torque(&q, &g, &masses, tip_kg);
            for j in 0..3 {
                let (mut above, mut below) = (q, q);
                above[j] += 1e-5;
                below[j] -= 1e-5;
                prop_assert!((torque[j] + (potential(&above) - potential(&below)) / 2e-5).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn a_target_beyond_the_arm_is_out_of_reach_by_the_right_amount() {
        let arm = AxisArm::from_rows(&ArmConfig::default().rows);
        let error = arm.solve(&Vector3::new(1.5, 0.0, 0.076), &[0.0, -1.0, -0.2]).unwrap_err();
        // Stretched out: 0.4 + 0.3543 along x, and 12 mm to the side of the shoulder.
        let reach = (0.7543f64.powi(2) + 0.012f64.powi(2)).sqrt();
        assert!((error.short_by_m - (1.5 - reach)).abs() < 0.01, "{}", error.short_by_m);
    }
}
