//! What a pause is worth: means, spreads, standard errors, the tip, temperature and effort.

use armcal_core::robust::median;
use armcal_core::{GaugeReading, JointSamples, PoseSamples, ScalarSamples, TipMeasurement, gaps};
use nalgebra::{Matrix3, Matrix4, SymmetricEigen, UnitQuaternion, Vector3, Vector4};
use std::ops::Range;

use crate::DwellConfig;
use crate::creep;
use crate::series::seconds_between;
use crate::stats::{HUBER_K, Mean, effective_samples, huber_mean};

/// Median length of a standard normal vector in three dimensions.
const MEDIAN_NORM_3: f64 = 1.538_172;

/// Fewest readings that make one of an instrument.
const MIN_READINGS: usize = 3;

/// Fewest frames that make a tip measurement.
const MIN_TIP_FRAMES: usize = 3;

/// Means of all joints over the rows of a pause, in which they may creep.
pub(crate) fn joint_means(
    joints: &JointSamples,
    rows: &Range<usize>,
    step_rad: &[f64],
    creeps: bool,
) -> Vec<Mean> {
    let mean = |(column, step): (&Vec<f64>, &f64)| {
        let (time_ns, values) = (&joints.time_ns[rows.clone()], &column[rows.clone()]);
        if creeps { Mean::of_creeping(time_ns, values, *step) } else { Mean::of(values, *step) }
    };
    joints.joint_rad.iter().zip(step_rad).filter_map(mean).collect()
}

/// Independent readings: the median over the joints whose readings vary; 1 when none does, because then
/// all readings share one quantisation error.
pub(crate) fn effective_of(means: &[Mean]) -> f64 {
    let counts: Vec<f64> = means.iter().filter_map(|m| m.effective).collect();
    if counts.is_empty() { 1.0 } else { median(&counts) }
}

/// Mean effort of each joint [N m]; NaN of one without a reading, none where that is all of them.
pub(crate) fn effort_means(joints: &JointSamples, rows: &Range<usize>) -> Option<Vec<f64>> {
    let mean = |column: &Vec<f64>| {
        let finite: Vec<f64> = column[rows.clone()].iter().copied().filter(|v| v.is_finite()).collect();
        huber_mean(&finite, 0.0).unwrap_or(f64::NAN)
    };
    gaps::if_any_known(joints.effort_nm.as_ref()?.iter().map(mean).collect())
}

/// Temperature of a pause: the mean of its readings, else the neighbours within `max_age_s` interpolated.
pub(crate) fn mean_temperature_c(
    stream: &ScalarSamples,
    start_ns: i64,
    end_ns: i64,
    max_age_s: f64,
) -> Option<f64> {
    let rows = stream.time_ns.len().min(stream.value.len());
    let (time_ns, value) = (&stream.time_ns[..rows], &stream.value[..rows]);
    let first = time_ns.partition_point(|t| *t < start_ns);
    let end = time_ns.partition_point(|t| *t <= end_ns).max(first);
    let within: Vec<f64> = value[first..end].iter().copied().filter(|v| v.is_finite()).collect();
    if let Some(mean) = huber_mean(&within, 0.0) {
        return Some(mean);
    }
    let before = (0..first).rev().find(|&i| value[i].is_finite());
    let after = (end..rows).find(|&i| value[i].is_finite());
    let before = before.map(|i| (seconds_between(time_ns[i], start_ns), value[i]));
    let after = after.map(|i| (seconds_between(end_ns, time_ns[i]), value[i]));
    match (before.filter(|b| b.0 <= max_age_s), after.filter(|a| a.0 <= max_age_s)) {
        (Some((b_s, b)), Some((a_s, a))) => Some(b + (a - b) * b_s / (b_s + a_s)),
        (one, other) => one.or(other).map(|(_, value)| value),
    }
}

/// What an instrument read in a pause; none where it read fewer than three times.
pub(crate) fn gauge_reading(stream: &ScalarSamples, start_ns: i64, end_ns: i64) -> Option<GaugeReading> {
    let first = stream.time_ns.partition_point(|t| *t < start_ns);
    let end = stream.time_ns.partition_point(|t| *t <= end_ns).max(first);
    let within: Vec<f64> = stream.value[first..end].iter().copied().filter(|v| v.is_finite()).collect();
    if within.len() < MIN_READINGS {
        return None;
    }
    let steps = within.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0);
    let step = steps.fold(f64::INFINITY, f64::min);
    let mean = Mean::of(&within, if step.is_finite() { step } else { 0.0 })?;
    Some(GaugeReading { mean_m: mean.mean, sigma_m: mean.sigma })
}

/// The tip over the rows `frames`; none where it was seen fewer than three times, but for a stream of one pose a stop.
pub(crate) fn tip_measurement(
    samples: &PoseSamples,
    frames: Range<usize>,
    config: &DwellConfig,
    creeps: bool,
) -> Option<TipMeasurement> {
    let floor_m = config.tip_sigma_floor_mm * 1e-3;
    let floor_rad = config.orientation_sigma_floor_deg.to_radians();
    if frames.len() < MIN_TIP_FRAMES && samples.is_one_a_stop() {
        return single_pose(samples, frames.last()?, floor_m, floor_rad);
    }
    if !creeps {
        return pose_mean(samples, frames, floor_m, floor_rad);
    }
    // The line that the tip creeps along is a uniform error, and only what is left beside it is noise.
    let axis = |k: usize| {
        let column: Vec<f64> = samples.position_m[frames.clone()].iter().map(|p| p[k]).collect();
        creep::subtract_line(&samples.time_ns[frames.clone()], &column)
    };
    let (Some(x), Some(y), Some(z)) = (axis(0), axis(1), axis(2)) else {
        return pose_mean(samples, frames, floor_m, floor_rad);
    };
    let mut level = samples.clone();
    for (i, row) in frames.clone().enumerate() {
        level.position_m[row] = Vector3::new(x.0[i], y.0[i], z.0[i]);
    }
    let crept_m = Vector3::new(x.1, y.1, z.1);
    let mut mean = pose_mean(&level, frames, floor_m, floor_rad)?;
    mean.covariance_m2 += crept_m * crept_m.transpose() / 12.0;
    Some(mean)
}

/// One pose, which shows no scatter: its noise is the floor, and what the pipeline declares.
fn single_pose(samples: &PoseSamples, row: usize, floor_m: f64, floor_rad: f64) -> Option<TipMeasurement> {
    let position_m = samples.position_m[row];
    let orientation = samples.orientation.as_ref().map(|turned| turned[row]);
    position_m.iter().all(|v| v.is_finite()).then(|| TipMeasurement {
        position_m,
        covariance_m2: Matrix3::identity() * floor_m * floor_m,
        orientation,
        orientation_sigma_rad: orientation.map_or(f64::INFINITY, |_| floor_rad),
        samples: 1,
        effective_samples: 1.0,
    })
}

/// Robust mean pose with the covariance of that mean, never below the floors.
pub(crate) fn pose_mean(
    samples: &PoseSamples,
    frames: Range<usize>,
    floor_m: f64,
    floor_rad: f64,
) -> Option<TipMeasurement> {
    let used: Vec<usize> = frames.filter(|&i| samples.position_m[i].iter().all(|v| v.is_finite())).collect();
    if used.len() < MIN_TIP_FRAMES {
        return None;
    }
    let positions_m: Vec<Vector3<f64>> = used.iter().map(|&i| samples.position_m[i]).collect();
    let cloud = Cloud::of(&positions_m)?;
    let covariance_m2 = at_least(cloud.covariance_of_mean(), floor_m * floor_m)?;
    let turned: Option<(UnitQuaternion<f64>, f64)> = samples
        .orientation
        .as_ref()
        .and_then(|o| orientation_mean(&used.iter().map(|&i| o[i]).collect::<Vec<_>>()));
    covariance_m2.iter().all(|v| v.is_finite()).then(|| TipMeasurement {
        position_m: cloud.centre,
        covariance_m2,
        orientation: turned.map(|(mean, _)| mean),
        orientation_sigma_rad: turned.map_or(f64::INFINITY, |(_, sigma)| sigma.max(floor_rad)),
        samples: used.len(),
        effective_samples: cloud.effective,
    })
}

/// A covariance with no direction better known than the floor.
fn at_least(covariance: Matrix3<f64>, floor: f64) -> Option<Matrix3<f64>> {
    let mut eigen = SymmetricEigen::try_new(covariance, f64::EPSILON, 500)?;
    if eigen.eigenvalues.iter().all(|v| *v >= floor) {
        return Some(covariance);
    }
    eigen.eigenvalues.apply(|v| *v = v.max(floor));
    let raised = eigen.recompose();
    Some(0.5 * (raised + raised.transpose()))
}

/// Markley's mean of unit quaternions (J. Guidance 30, 2007, eq. 12), reweighted once against outliers, and
/// its standard error per axis [rad], autocorrelation taken into account.
pub(crate) fn orientation_mean(orientations: &[UnitQuaternion<f64>]) -> Option<(UnitQuaternion<f64>, f64)> {
    let finite: Vec<UnitQuaternion<f64>> =
        orientations.iter().copied().filter(|q| q.coords.iter().all(|v| v.is_finite())).collect();
    let first = markley_mean(&finite, |_| 1.0)?;
    let angles: Vec<f64> = finite.iter().map(|q| q.angle_to(&first)).collect();
    let limit = HUBER_K * median(&angles) / MEDIAN_NORM_3 * 3f64.sqrt();
    let mean =
        markley_mean(&finite, |i| if angles[i] > limit && limit > 0.0 { limit / angles[i] } else { 1.0 })?;
    let turns: Vec<Vector3<f64>> = finite.iter().map(|q| (mean.inverse() * q).scaled_axis()).collect();
    let cloud = Cloud::of(&turns)?;
    Some((mean, (cloud.covariance_of_mean().trace() / 3.0).sqrt()))
}

fn markley_mean(
    orientations: &[UnitQuaternion<f64>],
    weight: impl Fn(usize) -> f64,
) -> Option<UnitQuaternion<f64>> {
    if orientations.is_empty() {
        return None;
    }
    let sum = orientations.iter().enumerate().fold(Matrix4::zeros(), |sum: Matrix4<f64>, (i, q)| {
        sum + weight(i) * q.coords * q.coords.transpose()
    });
    let eigen = SymmetricEigen::try_new(sum, f64::EPSILON, 500)?;
    let largest = eigen.eigenvalues.imax();
    let axis: Vector4<f64> = eigen.eigenvectors.column(largest).into();
    // The sign of a quaternion means nothing: keep that of the first, so that outputs do not flicker.
    let sign = if axis.dot(&orientations[0].coords) < 0.0 { -1.0 } else { 1.0 };
    Some(UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_vector(sign * axis)))
}

/// A point cloud in time: robust centre, covariance of the influence of one point on it, effective count.
struct Cloud {
    centre: Vector3<f64>,
    influence: Matrix3<f64>,
    effective: f64,
}

impl Cloud {
    /// Weights are Huber's on the distance from the centre, so that the result turns with the axes.
    fn of(points: &[Vector3<f64>]) -> Option<Cloud> {
        let axis = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let mut centre = Vector3::from_fn(|k, _| median(&axis(k)));
        let scale = |centre: &Vector3<f64>| {
            median(&points.iter().map(|p| (p - centre).norm()).collect::<Vec<_>>()) / MEDIAN_NORM_3
        };
        // 1.345 sigma cuts 18 % of a normal cloud in one dimension; sqrt(3) more does about that in three.
        let limit = HUBER_K * 3f64.sqrt() * scale(&centre);
        let weight = |p: &Vector3<f64>, centre: &Vector3<f64>| {
            let distance = (p - centre).norm();
            if distance > limit && limit > 0.0 { limit / distance } else { 1.0 }
        };
        for _ in 0..20 {
            let (sum, total) = points.iter().fold((Vector3::zeros(), 0.0), |(sum, total), p| {
                let w = weight(p, &centre);
                (sum + w * (p - centre), total + w)
            });
            centre += sum / total;
        }
        let weights: Vec<f64> = points.iter().map(|p| weight(p, &centre)).collect();
        let clipped: Vec<Vector3<f64>> =
            points.iter().zip(&weights).map(|(p, w)| (p - centre) * *w).collect();
        let n = points.len() as f64;
        let square = clipped.iter().fold(Matrix3::zeros(), |sum, d| sum + d * d.transpose()) / n;
        // Variance of an M-estimate, E[psi psi'] / E[psi']^2 (Huber 1981, eq. 3.2.13): a shrunk point still
        // moves along the two directions across its own.
        let slope = weights.iter().map(|w| if *w < 1.0 { 2.0 / 3.0 * w } else { 1.0 }).sum::<f64>() / n;
        let influence = square / (slope * slope);
        let counts: Vec<f64> = (0..3)
            .map(|k| clipped.iter().map(|d| d[k]).collect::<Vec<f64>>())
            .filter(|column| column.iter().any(|v| *v != 0.0))
            .map(|column| effective_samples(&column))
            .collect();
        let effective = if counts.is_empty() { 1.0 } else { median(&counts) };
        let finite = centre.iter().chain(influence.iter()).all(|v| v.is_finite());
        finite.then_some(Cloud { centre, influence, effective })
    }

    fn covariance_of_mean(&self) -> Matrix3<f64> {
        // The centre is estimated from the same points, which takes 1 / n_eff of the variance away.
        self.influence / (self.effective - 1.0).max(0.5)
    }
}
