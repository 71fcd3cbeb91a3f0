//! The mean pose of a body that should stand still: the table, the robot's base.

use armcal_core::robust::{MAD_TO_SIGMA, median};
use armcal_core::{Code, Pose, PoseSamples, Severity, Stage, Warning};
use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::DwellError;
use crate::series::{check_poses, seconds_between};
use crate::summary::pose_mean;

/// Time blocks in which motion of the body is looked for, and rows a block needs.
const MAX_BLOCKS: usize = 60;
const MIN_BLOCK_ROWS: usize = 10;

/// A change must exceed this many standard errors ...
const SIGNIFICANT_SIGMAS: f64 = 6.0;
/// ... and this distance [m] or angle [rad] to be warned about.
const MOTION_FLOOR_M: f64 = 0.2e-3;
const TURN_FLOOR_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;

/// Standard errors below which a mean is not believed: calibration of the sensor limits it, not noise.
const SIGMA_FLOOR_M: f64 = 0.01e-3;
const SIGMA_FLOOR_RAD: f64 = 1e-3 * std::f64::consts::PI / 180.0;

/// Where a static body stands in the frame of its sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanPose {
    /// Mean pose, `sensor_from_body`. Its rotation is the identity when the stream has no orientation.
    pub pose: Pose,
    /// Covariance of the mean position [m^2], autocorrelation taken into account.
    pub covariance_m2: Matrix3<f64>,
    /// Whether the stream had an orientation.
    pub has_orientation: bool,
    /// Standard error of the mean orientation per axis [rad]; infinite without orientation.
    pub orientation_sigma_rad: f64,
    /// Frames used.
    pub samples: usize,
    /// Independent frames these are worth.
    pub effective_samples: f64,
}

/// Robust mean pose of a static body over the whole recording.
///
/// Warns (`body-moved`, inadequate) when it drifted, jumped or was away for a while by more than its noise
/// and 0.2 mm or 0.05 deg, with when and how far: then there is no one pose to speak of.
///
/// # Errors
/// Fewer than three frames, columns of different length, stamps that do not increase.
pub fn mean_pose(samples: &PoseSamples) -> Result<(MeanPose, Vec<Warning>), DwellError> {
    let doing = "averaging the pose of a static body";
    check_poses(samples, doing, "pose")?;
    let mean = pose_mean(samples, 0..samples.len(), SIGMA_FLOOR_M, SIGMA_FLOOR_RAD)
        .ok_or(DwellError::NoSamples { doing, stream: "pose" })?;
    let rotation = mean.orientation.unwrap_or_else(UnitQuaternion::identity);
    let pose = Pose::from_parts(Translation3::from(mean.position_m), rotation);

    let subject = if samples.body.is_empty() { "static body" } else { samples.body.as_str() };
    let mut warnings = Vec::new();
    let mut say = |message| {
        warnings.push(Warning::new(Severity::Inadequate, Stage::Dwell, Code::BodyMoved, subject, message));
    };
    if let Some(change) = Change::of(&samples.time_ns, &samples.position_m, MOTION_FLOOR_M) {
        say(change.in_words(&|m| format!("{:.2} mm", m * 1e3)));
    }
    if let Some(orientations) = samples.orientation.as_ref().filter(|_| mean.orientation.is_some()) {
        let turns: Vec<Vector3<f64>> =
            orientations.iter().map(|q| (rotation.inverse() * q).scaled_axis()).collect();
        if let Some(change) = Change::of(&samples.time_ns, &turns, TURN_FLOOR_RAD) {
            say(change.in_words(&|rad| format!("{:.3} deg", rad.to_degrees())));
        }
    }
    let mean_pose = MeanPose {
        pose,
        covariance_m2: mean.covariance_m2,
        has_orientation: mean.orientation.is_some(),
        orientation_sigma_rad: mean.orientation_sigma_rad,
        samples: mean.samples,
        effective_samples: mean.effective_samples,
    };
    Ok((mean_pose, warnings))
}

/// How a body that should stand still moved.
#[derive(Debug, Clone, PartialEq)]
enum Change {
    /// From one place to another at a time [s after the start].
    Step { at_s: f64, by: f64 },
    /// Steadily over the recording.
    Drift { over_s: f64, by: f64 },
    /// Away for a while, and back.
    Excursion { from_s: f64, to_s: f64, by: f64 },
}

impl Change {
    /// Looks for the change that explains most of the block medians of a point over time.
    fn of(time_ns: &[i64], points: &[Vector3<f64>], floor: f64) -> Option<Change> {
        let blocks = Blocks::of(time_ns, points);
        if blocks.median.len() < 4 {
            return None;
        }
        let step = blocks.step();
        let drift = blocks.drift();
        let worse = if drift.1 > step.1 { (drift.0, drift.1) } else { (step.0, step.1) };
        if worse.1 > SIGNIFICANT_SIGMAS && worse.0.by() > floor {
            return Some(worse.0);
        }
        blocks.excursion(floor)
    }

    fn by(&self) -> f64 {
        match self {
            Change::Step { by, .. } | Change::Drift { by, .. } | Change::Excursion { by, .. } => *by,
        }
    }

    fn in_words(&self, amount: &dyn Fn(f64) -> String) -> String {
        let what = match self {
            Change::Step { at_s, by } => {
                format!("it jumped by {} about {at_s:.1} s after the start", amount(*by))
            }
            Change::Drift { over_s, by } => format!("it drifted by {} over {over_s:.1} s", amount(*by)),
            Change::Excursion { from_s, to_s, by } => {
                format!("it was {} away between {from_s:.1} s and {to_s:.1} s after the start", amount(*by))
            }
        };
        format!(
            "a body that should stand still moved: {what}; one mean pose does not describe it, split the recording there"
        )
    }
}

/// Medians of a point over blocks of time, with their noise.
struct Blocks {
    start_s: Vec<f64>,
    end_s: Vec<f64>,
    median: Vec<Vector3<f64>>,
    /// Standard deviation of one median per axis.
    sigma: f64,
}

impl Blocks {
    fn of(time_ns: &[i64], points: &[Vector3<f64>]) -> Blocks {
        let rows = points.len().div_ceil(MAX_BLOCKS).max(MIN_BLOCK_ROWS);
        let since = |i: usize| seconds_between(time_ns[0], time_ns[i]);
        let starts: Vec<usize> =
            (0..points.len()).step_by(rows).filter(|s| s + MIN_BLOCK_ROWS / 2 <= points.len()).collect();
        let end = |s: usize| (s + rows).min(points.len());
        let median_of = |s: usize| {
            Vector3::from_fn(|k, _| median(&points[s..end(s)].iter().map(|p| p[k]).collect::<Vec<_>>()))
        };
        let medians: Vec<Vector3<f64>> = starts.iter().map(|&s| median_of(s)).collect();
        // Successive differences: one step or a slow drift does not enter.
        let differences: Vec<f64> = medians
            .windows(2)
            .flat_map(|w| (w[1] - w[0]).iter().map(|d| d.abs()).collect::<Vec<_>>())
            .collect();
        Blocks {
            start_s: starts.iter().map(|&s| since(s)).collect(),
            end_s: starts.iter().map(|&s| since(end(s) - 1)).collect(),
            median: medians,
            sigma: (MAD_TO_SIGMA * median(&differences) / 2f64.sqrt()).max(1e-9),
        }
    }

    /// The best split in two, and its significance in sigmas.
    fn step(&self) -> (Change, f64) {
        let n = self.median.len();
        let total: Vector3<f64> = self.median.iter().sum();
        let mut before = Vector3::zeros();
        let mut best = (Change::Step { at_s: 0.0, by: 0.0 }, 0.0);
        for k in 1..n {
            before += self.median[k - 1];
            let by = (before / k as f64 - (total - before) / (n - k) as f64).norm();
            let significance = by / (self.sigma * (1.0 / k as f64 + 1.0 / (n - k) as f64).sqrt());
            if significance > best.1 && k >= 2 && n - k >= 2 {
                best = (Change::Step { at_s: self.start_s[k], by }, significance);
            }
        }
        best
    }

    /// The straight line in time, and its significance in sigmas.
    fn drift(&self) -> (Change, f64) {
        let n = self.median.len() as f64;
        let mid: Vec<f64> = self.start_s.iter().zip(&self.end_s).map(|(a, b)| 0.5 * (a + b)).collect();
        let centre = mid.iter().sum::<f64>() / n;
        let square: f64 = mid.iter().map(|t| (t - centre).powi(2)).sum();
        let slope =
            mid.iter().zip(&self.median).map(|(t, p)| p * (t - centre)).sum::<Vector3<f64>>() / square;
        let over_s = self.end_s.last().copied().unwrap_or(0.0);
        let drift = Change::Drift { over_s, by: slope.norm() * over_s };
        (drift, slope.norm() * square.sqrt() / self.sigma)
    }

    /// The longest row of neighbouring blocks away from the middle.
    fn excursion(&self, floor: f64) -> Option<Change> {
        let middle = Vector3::from_fn(|k, _| median(&self.median.iter().map(|p| p[k]).collect::<Vec<_>>()));
        let away: Vec<f64> = self.median.iter().map(|p| (p - middle).norm()).collect();
        let limit = floor.max(SIGNIFICANT_SIGMAS * 3f64.sqrt() * self.sigma);
        let runs = crate::stillness::hysteresis(
            &away.iter().map(|a| -a).collect::<Vec<_>>(),
            0..away.len(),
            -limit,
            -limit,
        );
        let longest = runs.into_iter().max_by_key(|r| r.len())?;
        let by = away[longest.clone()].iter().copied().fold(0.0, f64::max);
        Some(Change::Excursion { from_s: self.start_s[longest.start], to_s: self.end_s[longest.end - 1], by })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Random, ar1, ns};

    fn body(seed: u64, n: usize, rho: f64, shift: impl Fn(f64) -> f64) -> PoseSamples {
        let mut r = Random::new(seed);
        let [x, y, z] = [(); 3].map(|()| ar1(&mut r, n, rho, 1e-4));
        let turn = UnitQuaternion::from_euler_angles(0.2, -0.4, 2.9);
        let mut s = PoseSamples { body: "table".into(), ..PoseSamples::default() };
        let mut orientation = Vec::new();
        for (i, ((x, y), z)) in x.iter().zip(&y).zip(&z).enumerate() {
            let t_s = i as f64 * 0.01;
            s.time_ns.push(ns(t_s));
            s.position_m.push(Vector3::new(0.4 + shift(t_s) + x, -0.1 + y, 0.9 + z));
            let noise = Vector3::from_fn(|_, _| 1e-3 * r.normal());
            let q = turn * UnitQuaternion::from_scaled_axis(noise);
            // A sensor may report either sign of a quaternion.
            orientation.push(if i % 3 == 0 { UnitQuaternion::new_unchecked(-q.into_inner()) } else { q });
        }
        s.orientation = Some(orientation);
        s
    }

    #[test]
    fn the_mean_is_within_its_standard_error() {
        let (mut inside, mut turned) = (0, 0);
        for seed in 0..100 {
            let (mean, warnings) = mean_pose(&body(seed, 2000, 0.8, |_| 0.0)).expect("frames");
            assert!(warnings.is_empty(), "{warnings:?}");
            let error = mean.pose.translation.vector - Vector3::new(0.4, -0.1, 0.9);
            inside += usize::from(error.x.abs() < 2.0 * mean.covariance_m2[(0, 0)].sqrt());
            let angle = mean.pose.rotation.angle_to(&UnitQuaternion::from_euler_angles(0.2, -0.4, 2.9));
            // 95 % of a chi distribution with three degrees of freedom: 2.80.
            turned += usize::from(angle < 2.80 * mean.orientation_sigma_rad);
            assert!((120.0..400.0).contains(&mean.effective_samples), "{}", mean.effective_samples);
        }
        assert!(inside >= 89 && turned >= 89, "{inside} {turned} of 100");
    }

    #[test]
    fn a_jump_a_drift_and_an_excursion_are_told_apart() {
        let said = |shift: fn(f64) -> f64| {
            let (_, warnings) = mean_pose(&body(7, 6000, 0.0, shift)).expect("frames");
            warnings.first().map(|w| w.message.clone()).unwrap_or_default()
        };
        let jump = said(|t| if t > 40.0 { 1e-3 } else { 0.0 });
        assert!(jump.contains("jumped by 1.0") && jump.contains("40.0 s"), "{jump}");
        let drift = said(|t| 2e-3 * t / 60.0);
        assert!(drift.contains("drifted by 2.0"), "{drift}");
        let away = said(|t| if (30.0..31.0).contains(&t) { 5e-3 } else { 0.0 });
        assert!(away.contains("away between 30.0 s"), "{away}");
    }

    #[test]
    fn too_few_frames_are_an_error() {
        assert!(matches!(mean_pose(&PoseSamples::default()), Err(DwellError::NoSamples { .. })));
    }
}
