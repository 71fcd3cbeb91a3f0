//! What the tests of this crate share: seeded noise, an arm, recordings with planted dwells.

use crate::{NominalArm, PlacedArm};
use armcal_core::{JointSamples, PoseSamples};
use nalgebra::{Rotation3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Seeded noise.
pub(crate) struct Random(ChaCha8Rng);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    pub fn uniform(&mut self) -> f64 {
        self.0.random::<f64>()
    }

    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.uniform()
    }
}

/// A stationary AR(1) series of standard deviation `sigma`.
pub(crate) fn ar1(r: &mut Random, n: usize, rho: f64, sigma: f64) -> Vec<f64> {
    let mut x = r.normal();
    (0..n)
        .map(|_| {
            let now = x;
            x = rho * x + (1.0 - rho * rho).sqrt() * r.normal();
            now * sigma
        })
        .collect()
}

/// How wrong a nominal arm is: zeros of its three joints [rad], then the y and z of its upper and the x, y and z of its
/// fore arm [m].
pub(crate) type Wrong = [f64; 8];

/// Prior standard deviation of each.
pub(crate) const WRONG_SIGMA: Wrong = [0.04, 0.04, 0.04, 0.02, 0.02, 0.02, 0.02, 0.02];

/// Lengths off by up to 30 mm and zeros by some degrees.
pub(crate) const VERY_WRONG: Wrong = [0.03, -0.04, 0.05, 0.012, 0.02, -0.03, 0.01, 0.01];

/// A three-joint arm.
pub(crate) fn tip_of(q: &[f64], wrong: &Wrong) -> Vector3<f64> {
    let [w0, w1, w2, upper_y, upper_z, fore_x, fore_y, fore_z] = *wrong;
    let q = [q[0] + w0, q[1] + w1, q[2] + w2];
    let upper = Vector3::new(0.0, upper_y, 0.40 + upper_z);
    let fore = Vector3::new(0.3543 + fore_x, fore_y, fore_z);
    let z = Rotation3::from_axis_angle(&Vector3::z_axis(), q[0]);
    let a = Rotation3::from_axis_angle(&Vector3::y_axis(), q[1]);
    let b = Rotation3::from_axis_angle(&Vector3::y_axis(), q[2]);
    z * (a * (upper + b * fore)) + Vector3::new(0.0, 0.0, 0.076)
}

/// The same arm; `wrong` = 1 is [`VERY_WRONG`].
pub(crate) fn tip_m(q: &[f64], wrong: f64) -> Vector3<f64> {
    tip_of(q, &VERY_WRONG.map(|w| w * wrong))
}

/// The nominal arm, with its errors in their standard deviations.
pub(crate) fn nominal(q: &[f64], off: &[f64]) -> Vector3<f64> {
    tip_of(q, &std::array::from_fn(|k| WRONG_SIGMA[k] * off.get(k).copied().unwrap_or(0.0)))
}

/// An arm given by its tip over readings and errors in standard deviations; motions are central differences.
pub(crate) struct Formula<F> {
    pub tip_m: F,
    pub uncertain: usize,
}

impl<F: Fn(&[f64], &[f64]) -> Vector3<f64> + Sync> NominalArm for Formula<F> {
    fn uncertain(&self) -> usize {
        self.uncertain
    }

    fn with(&self, off: &[f64]) -> Box<dyn PlacedArm + '_> {
        Box::new(Placed { arm: self, off: off.to_vec() })
    }
}

struct Placed<'a, F> {
    arm: &'a Formula<F>,
    off: Vec<f64>,
}

impl<F: Fn(&[f64], &[f64]) -> Vector3<f64> + Sync> PlacedArm for Placed<'_, F> {
    fn tip_m(&self, joint_rad: &[f64]) -> Vector3<f64> {
        (self.arm.tip_m)(joint_rad, &self.off)
    }

    fn motions_m(&self, joint_rad: &[f64], moved_m: &mut [Vector3<f64>]) -> Vector3<f64> {
        let step = 1e-4;
        for (k, moved_m) in moved_m.iter_mut().enumerate() {
            let at = |by: f64| {
                let mut off = self.off.clone();
                off[k] += by;
                (self.arm.tip_m)(joint_rad, &off)
            };
            *moved_m = (at(step) - at(-step)) / (2.0 * step);
        }
        self.tip_m(joint_rad)
    }
}

/// A session: dwells joined by smooth moves, as functions of robot time [s].
pub(crate) struct Session {
    /// Start and end of each dwell [s].
    pub dwells_s: Vec<(f64, f64)>,
    /// Pose of each dwell [rad].
    pub poses_rad: Vec<Vec<f64>>,
}

impl Session {
    pub fn random(r: &mut Random, count: usize, dwell_s: (f64, f64), move_s: (f64, f64)) -> Session {
        let (mut t, mut dwells_s, mut poses_rad) = (0.0, Vec::new(), Vec::new());
        for _ in 0..count {
            let end = t + r.between(dwell_s.0, dwell_s.1);
            dwells_s.push((t, end));
            poses_rad.push(vec![r.between(-0.8, 0.8), r.between(-0.4, 0.6), r.between(-0.5, 0.5)]);
            t = end + r.between(move_s.0, move_s.1);
        }
        Session { dwells_s, poses_rad }
    }

    pub fn end_s(&self) -> f64 {
        self.dwells_s.last().map_or(0.0, |d| d.1)
    }

    /// Joint angles at a time: quintic between dwells (zero velocity and acceleration at both ends).
    pub fn joints_rad(&self, t_s: f64) -> Vec<f64> {
        let next = self.dwells_s.partition_point(|d| d.0 <= t_s);
        let (Some(at), to) = (next.checked_sub(1), next) else { return self.poses_rad[0].clone() };
        let leave = self.dwells_s[at].1;
        if t_s <= leave || to == self.dwells_s.len() {
            return self.poses_rad[at].clone();
        }
        let u = (t_s - leave) / (self.dwells_s[to].0 - leave);
        let s = u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u);
        let pair = self.poses_rad[at].iter().zip(&self.poses_rad[to]);
        pair.map(|(a, b)| a + s * (b - a)).collect()
    }

    /// Encoder stream; `step_rad` quantises when positive.
    pub fn encoders(&self, r: &mut Random, rate_hz: f64, noise_rad: f64, step_rad: f64) -> JointSamples {
        let n = (self.end_s() * rate_hz) as usize + 1;
        let mut joint_rad = vec![Vec::new(); 3];
        for i in 0..n {
            for (column, q) in joint_rad.iter_mut().zip(self.joints_rad(i as f64 / rate_hz)) {
                let noisy = q + noise_rad * r.normal();
                column.push(if step_rad > 0.0 { (noisy / step_rad).round() * step_rad } else { noisy });
            }
        }
        let time_ns = (0..n).map(|i| ns(i as f64 / rate_hz)).collect();
        JointSamples {
            time_ns,
            names: ["q1", "q2", "q3"].map(String::from).to_vec(),
            joint_rad,
            ..JointSamples::default()
        }
    }

    /// Tip stream of the true arm (`wrong` = 1) on a clock that is late and drifts.
    pub fn tip(&self, r: &mut Random, rate_hz: f64, noise_m: f64, offset_s: f64, drift: f64) -> PoseSamples {
        self.tip_of(r, &VERY_WRONG, rate_hz, noise_m, offset_s, drift)
    }

    /// The same of an arm that is wrong otherwise.
    pub fn tip_of(
        &self,
        r: &mut Random,
        wrong: &Wrong,
        rate_hz: f64,
        noise_m: f64,
        offset_s: f64,
        drift: f64,
    ) -> PoseSamples {
        let n = (self.end_s() * rate_hz) as usize + 1;
        let mid_s = 0.5 * self.end_s();
        let mut samples = PoseSamples::default();
        for i in 0..n {
            let robot_s = (i as f64 + 0.37) / rate_hz;
            let sensor_s = robot_s + offset_s + drift * (robot_s - mid_s);
            let noise = Vector3::from_fn(|_, _| noise_m * r.normal());
            samples.time_ns.push(ns(sensor_s));
            samples.position_m.push(tip_of(&self.joints_rad(robot_s), wrong) + noise);
        }
        samples
    }
}

/// Seconds -> nanoseconds after an epoch like that of a real recording.
pub(crate) fn ns(t_s: f64) -> i64 {
    1_600_000_000_000_000_000 + (t_s * 1e9).round() as i64
}
