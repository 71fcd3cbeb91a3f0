//! Offset and drift between the robot's clock and the sensor's, from the motion both saw.

mod coarse;
mod declared;
mod deviated;
mod excerpt;
mod fine;
mod jump;
mod lags;
mod profile;
mod scale;
mod spread;
mod stamps;
mod steady;
mod warnings;

use armcal_core::robust::percentile;
use armcal_core::{JointSamples, PoseSamples, Warning};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::f64::consts::TAU;

use crate::series::{check_joints, check_poses, seconds_between};
use crate::{ClockAlignment, ClockConfig, DwellError};
use coarse::Coarse;
use deviated::predicted_path_m;
use excerpt::Excerpt;
use fine::{Point, Problem, Start};
use scale::{Scale, Track};
use spread::{Fine, Step};
use stamps::Stamps;

const DOING: &str = "aligning the clocks";

/// Standard error below which the offset is not believed [s]: stamps are rounded and written with jitter.
const SIGMA_FLOOR_S: f64 = 1e-6;

/// Correlation of speeds from which on the model predicts the path of the tip.
const PATH_PREDICTED: f64 = 0.9;

/// Positions whose distances are compared.
const POSITIONS: usize = 400;

/// Lengths of the smoothing kernels, in units of the shortest.
const KERNELS: [f64; 3] = [1.0, 3.0, 10.0];

/// Times the uncertain parameters are estimated anew, and the change at which they stay, in standard deviations.
const MODEL_ROUNDS: usize = 3;
const MODEL_SETTLED: f64 = 0.05;

/// The arm as it is known before it is calibrated.
pub trait NominalArm: Sync {
    /// Number of uncertain parameters.
    fn uncertain(&self) -> usize;

    /// The arm with each uncertain parameter off by so many standard deviations of its prior.
    fn with(&self, off: &[f64]) -> Box<dyn PlacedArm + '_>;
}

/// A nominal arm with its uncertain parameters where they are taken to be.
pub trait PlacedArm: Sync {
    /// Position of the tip in any fixed frame [m] at the joints' readings [rad].
    fn tip_m(&self, joint_rad: &[f64]) -> Vector3<f64>;

    /// The same, with its motion per standard deviation of each uncertain parameter [m].
    fn motions_m(&self, joint_rad: &[f64], moved_m: &mut [Vector3<f64>]) -> Vector3<f64>;
}

/// Estimates offset and drift of the sensor's clock against the robot's, or takes them as the configuration declares them
/// and says whether the motion contradicts.
///
/// Only the speed of the predicted tip is compared, so base frame and tool direction do not matter and the model may be
/// wrong by centimetres. The standard errors take in how far the arm's uncertain parameters may be off, and the
/// correlation of what is left along each movement and between movements.
///
/// Speeds are compared under kernels of three lengths. The shortest one times a motion best, but needs the
/// predicted path; under the longest one only the displacement from pose to pose counts, which finds the
/// motion even where the path between poses is not the predicted one. Then the logarithms of the speed time
/// the beginnings and ends of motion whatever the path.
///
/// Warnings: `clock-displacement-ratio`, `clock-ambiguous`, `clock-drift-unknown`, `clock-drift-limited`,
/// `clock-uncertain`, `clock-not-linear`, `clock-contradicted`, `clock-unchecked`.
///
/// # Errors
/// No rows, no common time, no or too little motion, no resemblance of the two speeds, an offset beyond the
/// search, or speeds that differ by the ratio of two units (mm and m, degrees and radians).
pub fn align_clocks(
    joints: &JointSamples,
    tip: &PoseSamples,
    arm: &dyn NominalArm,
    config: &ClockConfig,
) -> Result<(ClockAlignment, Vec<Warning>), DwellError> {
    config.check()?;
    check_joints(joints, DOING)?;
    check_poses(tip, DOING, "tip")?;
    if tip.is_empty() {
        return Err(DwellError::NoSamples { doing: DOING, stream: "tip" });
    }
    match config.declared() {
        Some(declared) => declared::align(joints, tip, arm, config, declared),
        None => estimate_alignment(joints, tip, arm, &around_log_time(joints, tip, config)),
    }
}

/// Clocks of other epochs are first compared by log time, where the pipeline says nothing of them.
fn around_log_time<'c>(
    joints: &JointSamples,
    tip: &PoseSamples,
    config: &'c ClockConfig,
) -> Cow<'c, ClockConfig> {
    match tip
        .clock_ahead_s(joints)
        .filter(|s| config.initial_offset_s == 0.0 && s.abs() > 0.5 * config.max_offset_s)
    {
        Some(initial_offset_s) => Cow::Owned(ClockConfig { initial_offset_s, ..config.clone() }),
        None => Cow::Borrowed(config),
    }
}

fn estimate_alignment(
    joints: &JointSamples,
    tip: &PoseSamples,
    arm: &dyn NominalArm,
    config: &ClockConfig,
) -> Result<(ClockAlignment, Vec<Warning>), DwellError> {
    let streams = Streams::of(joints, tip, arm, config)?;
    let (scale, coarse) = streams.coarse()?;
    let ratio = streams.ratio(&coarse);
    check_units(ratio, coarse.correlation)?;
    if coarse.correlation < config.min_correlation {
        return Err(streams.too_low(&coarse));
    }
    let (scale, found) = streams.fine(scale, &coarse, ratio)?;
    let estimate = streams.finish(&scale, &found)?;
    if estimate.fine.offset_s.abs() > config.max_offset_s {
        let offset_s = config.initial_offset_s + estimate.fine.offset_s;
        return Err(DwellError::OffsetAtEdge { offset_s, max_offset_s: config.max_offset_s });
    }
    let alignment = streams.alignment(&estimate, found.correlation, ratio);
    let jump = streams.jump(&scale, &estimate, alignment.offset_sigma_s);
    let warnings = streams.warnings(&alignment, &estimate, &coarse, jump.as_ref());
    Ok((alignment, warnings))
}

/// Both streams, and their speed profiles at every usable scale. Sensor times count from the sensor's first
/// stamp, robot times from that stamp minus the initial offset.
struct Streams<'a> {
    joints: &'a JointSamples,
    tip: &'a PoseSamples,
    arm: &'a dyn NominalArm,
    config: &'a ClockConfig,
    sensor: Track,
    robot: Track,
    /// By row of the robot's track its row in the joint stream.
    joint_rows: Vec<usize>,
    /// From the shortest kernel to the longest.
    scales: Vec<Scale>,
    reference_s: f64,
}

/// A fine estimate before its last step, and the correlation of the profiles under it.
#[derive(Clone, Copy)]
struct Found {
    start: Start,
    correlation: f64,
}

/// The estimate after its last step, and what became of the drift.
struct Estimate {
    fine: Fine,
    drift: Drift,
}

/// What the data say of the drift.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Drift {
    /// It was estimated.
    Estimated,
    /// They tell it no better than the largest credible one: zero.
    Unknown,
    /// They want more than the largest credible one.
    Limited { wanted: f64, sigma: f64 },
}

impl<'a> Streams<'a> {
    fn of(
        joints: &'a JointSamples,
        tip: &'a PoseSamples,
        arm: &'a dyn NominalArm,
        config: &'a ClockConfig,
    ) -> Result<Streams<'a>, DwellError> {
        let origin_ns = tip.time_ns[0];
        let robot_origin_ns = shift_ns(origin_ns, -config.initial_offset_s);
        let excerpt = Excerpt::of(joints, tip, config);
        let seen = || excerpt.tip.iter().cloned().flatten();
        let (time_ns, path_m): (Vec<i64>, Vec<_>) =
            seen().map(|i| (tip.time_ns[i], tip.position_m[i])).unzip();
        let sensor = Track::of(&time_ns, origin_ns, path_m, config);
        let joint_rows = excerpt.joints;
        let path_m = predicted_path_m(joints, &joint_rows, &*arm.with(&vec![0.0; arm.uncertain()]));
        let time_ns: Vec<i64> = joint_rows.iter().map(|row| joints.time_ns[*row]).collect();
        let robot = Track::of(&time_ns, robot_origin_ns, path_m, config);
        // Two samples in each half of the kernel, or a slow stream would be smoothed differently.
        let h_s = (0.5 * config.smoothing_s).max(2.0 * sensor.period_s).max(2.0 * robot.period_s);
        let tried = KERNELS.map(|times| Scale::of(&sensor, &robot, times * h_s, config));
        let reference_s = 0.5 * seconds_between(origin_ns, tip.time_ns[tip.len() - 1]);
        let mut first_reason = None;
        let mut scales = Vec::new();
        for scale in tried {
            match scale {
                Ok(scale) => scales.push(scale),
                Err(reason) => first_reason = first_reason.or(Some(reason)),
            }
        }
        let streams = Streams { joints, joint_rows, tip, arm, config, sensor, robot, scales, reference_s };
        match first_reason {
            Some(DwellError::Broken { stream, needed_s, .. }) if streams.scales.is_empty() => {
                Err(DwellError::Broken { stream, needed_s, rows: streams.rows_in_words() })
            }
            Some(reason) if streams.scales.is_empty() => Err(reason),
            _ => Ok(streams),
        }
    }

    fn max_drift(&self) -> f64 {
        self.config.max_drift_ppm * 1e-6
    }

    /// What the stamps show of missing and late rows; empty where they show nothing.
    fn rows_in_words(&self) -> String {
        let streams = [(&self.joints.time_ns, "joint"), (&self.tip.time_ns, "tip")];
        streams.map(|(time_ns, stream)| Stamps::of(time_ns).in_words(stream)).concat()
    }

    /// The scale at which the two speeds resemble each other most, and how they then lie.
    fn coarse(&self) -> Result<(&Scale, Coarse), DwellError> {
        let config = self.config;
        let search = |scale: &Scale| {
            let (sensor, robot) = (&scale.sensor, &scale.robot);
            coarse::search(sensor, robot, self.reference_s, scale.h_s, config.max_offset_s, self.max_drift())
        };
        let mut best: Option<(&Scale, Coarse)> = None;
        for scale in &self.scales {
            if let Some(found) = search(scale)
                && best.as_ref().is_none_or(|(_, b)| found.correlation > b.correlation)
            {
                best = Some((scale, found));
            }
        }
        best.ok_or_else(|| self.no_overlap())
    }

    fn no_overlap(&self) -> DwellError {
        let (j, t) = (&self.joints.time_ns, &self.tip.time_ns);
        let (j, t) = ((j[0], j[j.len() - 1]), (t[0], t[t.len() - 1]));
        let on_robot = |ns: i64| shift_ns(ns, -self.config.initial_offset_s);
        let overlap_s = seconds_between(j.0.max(on_robot(t.0)), j.1.min(on_robot(t.1))).max(0.0);
        if overlap_s > 0.5 * seconds_between(t.0, t.1) {
            return DwellError::RarelyTogether { rows: self.rows_in_words() };
        }
        DwellError::NoOverlap {
            joints_first_ns: j.0,
            joints_last_ns: j.1,
            tip_first_ns: t.0,
            tip_last_ns: t.1,
            overlap_s,
            max_offset_s: self.config.max_offset_s,
            suggested_offset_s: seconds_between(j.0, t.0),
        }
    }

    /// The fine estimate and its scale: from the sharp speeds where the model predicts the path well; else from their
    /// logarithms; else from the scale of the coarse estimate itself.
    fn fine(&self, from: &Scale, coarse: &Coarse, ratio: f64) -> Result<(Scale, Found), DwellError> {
        let own = self.found(from, Start { offset_s: coarse.offset_s, drift: coarse.drift })?;
        let found =
            |scale: &Scale| if std::ptr::eq(scale, from) { Ok(own) } else { self.found(scale, own.start) };
        let near = |found: &Found| (found.start.offset_s - own.start.offset_s).abs() < from.h_s;
        let sharp = &self.scales[..self.scales.len().min(KERNELS.len() - 1)];
        let best = sharp
            .iter()
            .filter_map(|scale| Some((scale, found(scale).ok()?)))
            .filter(|(_, found)| near(found) && found.correlation >= PATH_PREDICTED)
            .max_by(|a, b| a.1.correlation.total_cmp(&b.1.correlation));
        if let Some((scale, found)) = best {
            return Ok((scale.clone(), found));
        }
        let logarithmic = self.scales.first().map(|s| s.logarithmic(ratio));
        let found = logarithmic.and_then(|s| self.found(&s, own.start).ok().map(|found| (s, found)));
        let good = |f: &Found| near(f) && f.correlation >= self.config.min_correlation;
        Ok(found.filter(|(_, f)| good(f)).unwrap_or((from.clone(), own)))
    }

    fn found(&self, scale: &Scale, start: Start) -> Result<Found, DwellError> {
        let movements = scale.movements()?;
        let fixed = (self.max_drift() == 0.0).then_some(0.0);
        let problem = Problem::new(&scale.robot, &movements, self.reference_s, fixed);
        let state = problem.solve(start).ok_or_else(undetermined_error)?;
        let start = Start { offset_s: state.x, drift: state.y / problem.half_s };
        let points = scale.sensor.points(2);
        let correlation =
            coarse::correlation(&points, &scale.robot, self.reference_s, start.offset_s, start.drift);
        Ok(Found { start, correlation })
    }

    /// The last steps, with the uncertain parameters. The drift is kept within what is credible.
    fn finish(&self, scale: &Scale, found: &Found) -> Result<Estimate, DwellError> {
        let movements = scale.movements()?;
        let most = self.max_drift();
        let solve = |fixed: Option<f64>| {
            self.finish_with(scale, &movements, found.start, vec![0.0; self.arm.uncertain()], fixed)
                .ok_or_else(undetermined_error)
        };
        if most == 0.0 {
            return Ok(Estimate { fine: solve(Some(0.0))?, drift: Drift::Estimated });
        }
        let fine = solve(None)?;
        let (wanted, sigma) = (fine.drift, fine.covariance[(1, 1)].sqrt());
        if sigma.is_nan() || sigma > most {
            Ok(Estimate { fine: solve(Some(0.0))?, drift: Drift::Unknown })
        } else if wanted.abs() > most {
            let fine = solve(Some(most.copysign(wanted)))?;
            Ok(Estimate { fine, drift: Drift::Limited { wanted, sigma } })
        } else {
            Ok(Estimate { fine, drift: Drift::Estimated })
        }
    }

    /// Clocks and uncertain parameters in turn, until the parameters stay.
    fn finish_with(
        &self,
        scale: &Scale,
        movements: &[Point],
        mut start: Start,
        mut parameters: Vec<f64>,
        fixed: Option<f64>,
    ) -> Option<Fine> {
        let (mut last, mut near) = (None, None);
        for round in 0..MODEL_ROUNDS {
            // From the second round on the clock hardly moves, and what is left of it to find is finer than the first grid.
            let robot = match &near {
                None => self.robot_speeds(scale, &parameters),
                Some(near) => Cow::Owned(self.speeds_near(near, scale, &parameters)),
            };
            let problem = Problem::new(&robot, movements, self.reference_s, fixed);
            let Some(state) = problem.solve(start) else { break };
            near.get_or_insert_with(|| self.near(scale, problem.robot_times_s(&state)));
            let deviations = self.deviations(scale, &parameters, problem.robot_times_s(&state));
            let Some(step) = Step::of(&problem, &state, deviations.as_ref()) else { break };
            let by = parameters.iter().zip(&step.parameters).map(|(was, is)| (is - was).abs());
            let settled = by.fold(0.0, f64::max) < MODEL_SETTLED;
            parameters.clone_from(&step.parameters);
            start = step.to;
            last = Some(step);
            if settled && round > 0 {
                break;
            }
        }
        last?.fine()
    }

    /// Median ratio of measured to predicted distances of the tip between distant moments. Positions do not
    /// depend on the path between them, so this tells a wrong unit whatever the correlation of the speeds.
    fn ratio(&self, coarse: &Coarse) -> f64 {
        let n = self.sensor.time_s.len();
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = (0..n)
            .step_by(n.div_ceil(POSITIONS).max(1))
            .filter_map(|i| {
                let t_s = self.sensor.time_s[i];
                let at = t_s - coarse.offset_s - coarse.drift * (t_s - self.reference_s);
                let (measured, predicted) = (self.sensor.position_m[i], self.robot.nearest(at)?);
                measured
                    .iter()
                    .chain(predicted.iter())
                    .all(|v| v.is_finite())
                    .then_some((measured, predicted))
            })
            .collect();
        let apart = |from: usize, by: usize| {
            let ((m0, p0), (m1, p1)) = (pairs[from], pairs[from + by]);
            ((m1 - m0).norm(), (p1 - p0).norm())
        };
        let distances: Vec<(f64, f64)> = [2, 3, 7]
            .iter()
            .map(|share| (pairs.len() / share).max(1))
            .flat_map(|by| (0..pairs.len().saturating_sub(by)).map(move |from| (from, by)))
            .map(|(from, by)| apart(from, by))
            .collect();
        // The longer half: a short distance is mostly the error of the model.
        let long = percentile(&distances.iter().map(|d| d.1).collect::<Vec<_>>(), 0.5);
        let ratios: Vec<f64> = distances.iter().filter(|d| d.1 > long).map(|d| d.0 / d.1).collect();
        percentile(&ratios, 0.5)
    }

    fn too_low(&self, coarse: &Coarse) -> DwellError {
        let span = |column: &Vec<f64>| percentile(column, 0.99) - percentile(column, 0.01);
        let widest = self.joints.joint_rad.iter().map(span).fold(0.0, f64::max);
        let hint = if widest > 4.0 * std::f64::consts::PI {
            format!(
                "a joint spans {widest:.0} rad, which looks like degrees, or like a motor before its gear: set unit = \"deg\" for the \
                 joint stream, or divide by the gear ratio"
            )
        } else {
            "check that both streams are of the same session, the order, unit and direction of the joints, that the \
             stream shows the tip, and that no clock was set meanwhile; or raise clock.max_offset_s"
                .to_string()
        };
        DwellError::CorrelationTooLow {
            correlation: coarse.correlation,
            offset_s: self.config.initial_offset_s + coarse.offset_s,
            min_correlation: self.config.min_correlation,
            hint,
        }
    }

    /// Moves the reference to where the errors of offset and drift are uncorrelated.
    fn alignment(&self, found: &Estimate, correlation: f64, displacement_ratio: f64) -> ClockAlignment {
        let (fine, cov) = (&found.fine, &found.fine.covariance);
        let last_s = 2.0 * self.reference_s;
        let estimated = found.drift == Drift::Estimated && self.max_drift() > 0.0;
        let shift_s = if estimated { -cov[(0, 1)] / cov[(1, 1)] } else { 0.0 };
        let wished_s = self.reference_s + if shift_s.is_finite() { shift_s } else { 0.0 };
        let reference_s = wished_s.clamp(0.0, last_s);
        let shift_s = reference_s - self.reference_s;
        let variance = cov[(0, 0)] + 2.0 * shift_s * cov[(0, 1)] + shift_s * shift_s * cov[(1, 1)];
        let drift_sigma = match found.drift {
            Drift::Estimated => cov[(1, 1)].sqrt(),
            Drift::Unknown => self.max_drift(),
            // Where the data want it to be is not ruled out.
            Drift::Limited { wanted, sigma } => sigma.hypot(wanted - fine.drift),
        };
        ClockAlignment {
            offset_s: self.config.initial_offset_s + fine.offset_s + fine.drift * shift_s,
            offset_sigma_s: variance.max(0.0).sqrt().max(SIGMA_FLOOR_S),
            drift: fine.drift,
            drift_sigma: drift_sigma.max(SIGMA_FLOOR_S / last_s.max(1.0)),
            reference_ns: shift_ns(self.tip.time_ns[0], reference_s),
            first_ns: self.tip.time_ns[0],
            correlation: if correlation.is_finite() { correlation.clamp(0.0, 1.0) } else { 0.0 },
            displacement_ratio,
            declared: false,
        }
    }
}

fn undetermined_error() -> DwellError {
    DwellError::NoMotion {
        seen: "the movements do not determine an offset".to_owned(),
        advice: "record more moves between poses",
    }
}

/// `t_ns` plus some seconds, without overflow.
fn shift_ns(t_ns: i64, by_s: f64) -> i64 {
    t_ns.saturating_add((by_s * 1e9).round() as i64)
}

/// Ratios of measured to predicted distance that only a wrong unit explains.
fn check_units(ratio: f64, correlation: f64) -> Result<(), DwellError> {
    let near = |unit: f64| (ratio / unit).ln().abs() < 2f64.ln();
    let at = |unit: f64| (ratio / unit).ln().abs() < 0.05;
    let advice = if at(1.0 / 0.0254) {
        "the tip's positions look like inches read as metres: set their unit, or convert them where they are published"
    } else if at(25.4) {
        "the lengths of the model look like inches where millimetres belong, or the tip's positions are 25.4 times too large"
    } else if near(1e3) {
        "its positions look like millimetres: set unit = \"mm\" for the tip stream"
    } else if near(1e-3) {
        "the lengths of the model look like millimetres, or the tip stream is in metres but declared unit = \"mm\""
    } else if at(TAU) {
        "the joint stream looks like turns: give each joint 6.283185 in `factors` under [streams.joints]"
    } else if (6.0..200.0).contains(&ratio) {
        "the joint stream looks like radians that are declared unit = \"deg\""
    } else if !(1.0 / 6.0..6.0).contains(&ratio) {
        "check the units of both streams and of the model's lengths"
    } else {
        return Ok(());
    };
    Err(DwellError::UnitMismatch { ratio, correlation, advice })
}

#[cfg(test)]
mod tests;
