//! Offset and drift between the robot's clock and the sensor's, from the motion both saw.

mod coarse;
mod fine;
mod profile;
mod scale;

use armcal_core::robust::percentile;
use armcal_core::{JointSamples, PoseSamples, Severity, Stage, Warning};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::series::{check_joints, check_poses, seconds_between};
use crate::{ClockAlignment, ClockConfig, DwellError};
use coarse::Coarse;
use fine::{BEND_RAD, Fine, Start};
use scale::{Scale, Track};

const DOING: &str = "aligning the clocks";

/// Standard error below which the offset is not believed [s]: stamps are rounded and written with jitter.
const SIGMA_FLOOR_S: f64 = 1e-6;

/// Correlation of speeds from which on the model predicts the path of the tip.
const PATH_PREDICTED: f64 = 0.9;

/// Positions whose distances are compared.
const POSITIONS: usize = 400;

/// Lengths of the smoothing kernels, in units of the shortest.
const KERNELS: [f64; 3] = [1.0, 3.0, 10.0];

/// Estimates offset and drift of the sensor's clock against the robot's.
///
/// `tip_from_joints` gives the tip predicted by the nominal model, in any fixed frame [m]; only its speed is
/// compared, so base frame and tool direction do not matter and the model may be wrong by centimetres. The
/// standard errors take the correlation of that model error along each movement into account.
///
/// Speeds are compared under kernels of three lengths. The shortest one times a motion best, but needs the
/// predicted path; under the longest one only the displacement from pose to pose counts, which finds the
/// motion even where the path between poses is not the predicted one. Then the logarithms of the speed time
/// the beginnings and ends of motion whatever the path.
///
/// Warnings: `clock-displacement-ratio`, `clock-ambiguous`, `clock-drift-unknown`, `clock-uncertain`,
/// `clock-not-linear`.
///
/// # Errors
/// No rows, no common time, no or too little motion, no resemblance of the two speeds, an offset beyond the
/// search, or speeds that differ by the ratio of two units (mm and m, degrees and radians).
pub fn align_clocks(
    joints: &JointSamples,
    tip: &PoseSamples,
    tip_from_joints: &(dyn Fn(&[f64]) -> Vector3<f64> + Sync),
    config: &ClockConfig,
) -> Result<(ClockAlignment, Vec<Warning>), DwellError> {
    config.check()?;
    check_joints(joints, DOING)?;
    check_poses(tip, DOING, "tip")?;
    if tip.is_empty() {
        return Err(DwellError::NoSamples { doing: DOING, stream: "tip" });
    }
    let streams = Streams::of(joints, tip, tip_from_joints, config)?;
    let (scale, coarse) = streams.coarse()?;
    let ratio = streams.ratio(&coarse);
    check_units(ratio, coarse.correlation)?;
    if coarse.correlation < config.min_correlation {
        return Err(streams.too_low(&coarse));
    }
    let found = streams.fine(scale, &coarse, ratio)?;
    let fine = &found.fine;
    if fine.offset_s.abs() > config.max_offset_s {
        let offset_s = config.initial_offset_s + fine.offset_s;
        return Err(DwellError::OffsetAtEdge { offset_s, max_offset_s: config.max_offset_s });
    }
    let alignment = streams.alignment(&found, ratio);
    let warnings = streams.warnings(&alignment, fine, &coarse);
    Ok((alignment, warnings))
}

/// Both streams, and their speed profiles at every usable scale. Sensor times count from the sensor's first
/// stamp, robot times from that stamp minus the initial offset.
struct Streams<'a> {
    joints: &'a JointSamples,
    tip: &'a PoseSamples,
    config: &'a ClockConfig,
    sensor: Track,
    robot: Track,
    /// From the shortest kernel to the longest.
    scales: Vec<Scale>,
    reference_s: f64,
}

/// A fine estimate, and the correlation of the profiles under it.
struct Found {
    fine: Fine,
    correlation: f64,
}

impl<'a> Streams<'a> {
    fn of(
        joints: &'a JointSamples,
        tip: &'a PoseSamples,
        tip_from_joints: &(dyn Fn(&[f64]) -> Vector3<f64> + Sync),
        config: &'a ClockConfig,
    ) -> Result<Streams<'a>, DwellError> {
        let origin_ns = tip.time_ns[0];
        let robot_origin_ns = shifted(origin_ns, -config.initial_offset_s);
        let predict = |bent: Option<usize>| -> Track {
            let tip_m = |row: usize| {
                let mut joint_rad = joints.row_rad(row);
                if let Some(joint) = bent {
                    joint_rad[joint] += BEND_RAD;
                }
                tip_from_joints(&joint_rad)
            };
            let predicted_m = (0..joints.len()).into_par_iter().map(tip_m).collect();
            Track::of(&joints.time_ns, robot_origin_ns, predicted_m, config)
        };
        let sensor = Track::of(&tip.time_ns, origin_ns, tip.position_m.clone(), config);
        let robot = predict(None);
        let bent: Vec<Track> = (0..joints.joint_rad.len()).map(|joint| predict(Some(joint))).collect();
        // Two samples in each half of the kernel, or a slow stream would be smoothed differently.
        let h_s = (0.5 * config.smoothing_s).max(2.0 * sensor.period_s).max(2.0 * robot.period_s);
        let tried = KERNELS.map(|times| Scale::of(&sensor, &robot, &bent, times * h_s, config));
        let reference_s = 0.5 * seconds_between(origin_ns, tip.time_ns[tip.len() - 1]);
        let mut first_reason = None;
        let mut scales = Vec::new();
        for scale in tried {
            match scale {
                Ok(scale) => scales.push(scale),
                Err(reason) => first_reason = first_reason.or(Some(reason)),
            }
        }
        match first_reason {
            Some(reason) if scales.is_empty() => Err(reason),
            _ => Ok(Streams { joints, tip, config, sensor, robot, scales, reference_s }),
        }
    }

    fn max_drift(&self) -> f64 {
        self.config.max_drift_ppm * 1e-6
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
        best.ok_or_else(|| {
            let (j, t) = (&self.joints.time_ns, &self.tip.time_ns);
            let (j, t) = ((j[0], j[j.len() - 1]), (t[0], t[t.len() - 1]));
            let on_robot = |ns: i64| shifted(ns, -config.initial_offset_s);
            DwellError::NoOverlap {
                joints_first_ns: j.0,
                joints_last_ns: j.1,
                tip_first_ns: t.0,
                tip_last_ns: t.1,
                overlap_s: seconds_between(j.0.max(on_robot(t.0)), j.1.min(on_robot(t.1))).max(0.0),
                max_offset_s: config.max_offset_s,
                suggested_offset_s: seconds_between(j.0, t.0),
            }
        })
    }

    /// The fine estimate: from the sharp speeds where the model predicts the path well; else from their
    /// logarithms; else from the scale of the coarse estimate itself.
    fn fine(&self, from: &Scale, coarse: &Coarse, ratio: f64) -> Result<Found, DwellError> {
        let start = Start { offset_s: coarse.offset_s, drift: coarse.drift };
        let own = self.found(from, start)?;
        let start = Start { offset_s: own.fine.offset_s, drift: own.fine.drift };
        let near = |found: &Found| (found.fine.offset_s - start.offset_s).abs() < from.h_s;
        let sharp = &self.scales[..self.scales.len().min(KERNELS.len() - 1)];
        let best = sharp
            .iter()
            .filter_map(|scale| self.found(scale, start).ok())
            .filter(|found| near(found) && found.correlation >= PATH_PREDICTED)
            .max_by(|a, b| a.correlation.total_cmp(&b.correlation));
        if let Some(found) = best {
            return Ok(found);
        }
        let logarithmic = self.scales.first().and_then(|s| self.found(&s.logarithmic(ratio), start).ok());
        Ok(logarithmic.filter(|f| near(f) && f.correlation >= self.config.min_correlation).unwrap_or(own))
    }

    fn found(&self, scale: &Scale, start: Start) -> Result<Found, DwellError> {
        let fine = scale.solve(start, self.reference_s, self.max_drift())?;
        let points = scale.sensor.points(2);
        let correlation =
            coarse::correlation(&points, &scale.robot, self.reference_s, fine.offset_s, fine.drift);
        Ok(Found { fine, correlation })
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
                "a joint spans {widest:.0} rad, which looks like degrees: set unit = \"deg\" for the joint stream"
            )
        } else {
            "check that both streams are of the same session, the order, unit and direction of the joints, and \
             that the stream shows the tip; or raise clock.max_offset_s"
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
    fn alignment(&self, found: &Found, displacement_ratio: f64) -> ClockAlignment {
        let (fine, correlation) = (&found.fine, found.correlation);
        let cov = &fine.covariance;
        let last_s = 2.0 * self.reference_s;
        let shift_s = -cov[(0, 1)] / cov[(1, 1)];
        let wished_s = self.reference_s + if shift_s.is_finite() { shift_s } else { 0.0 };
        let reference_s = wished_s.clamp(0.0, last_s);
        let shift_s = reference_s - self.reference_s;
        let variance = cov[(0, 0)] + 2.0 * shift_s * cov[(0, 1)] + shift_s * shift_s * cov[(1, 1)];
        let drift_sigma = if fine.with_drift {
            cov[(1, 1)].sqrt().max(SIGMA_FLOOR_S / last_s.max(1.0))
        } else {
            self.max_drift()
        };
        ClockAlignment {
            offset_s: self.config.initial_offset_s + fine.offset_s + fine.drift * shift_s,
            offset_sigma_s: variance.max(0.0).sqrt().max(SIGMA_FLOOR_S),
            drift: fine.drift,
            drift_sigma,
            reference_ns: shifted(self.tip.time_ns[0], reference_s),
            correlation: if correlation.is_finite() { correlation.clamp(0.0, 1.0) } else { 0.0 },
            displacement_ratio,
        }
    }

    fn warnings(&self, found: &ClockAlignment, fine: &Fine, coarse: &Coarse) -> Vec<Warning> {
        let say = |severity, code, message| Warning::new(severity, Stage::Dwell, code, "clock", message);
        let mut warnings = Vec::new();
        if !(0.8..=1.25).contains(&found.displacement_ratio) {
            let message = format!(
                "the tip moves {:.3} times as far as the nominal model predicts; check units, link lengths and \
                 which point of the arm the sensor sees",
                found.displacement_ratio
            );
            let far = !(0.5..=2.0).contains(&found.displacement_ratio);
            let severity = if far { Severity::Inadequate } else { Severity::Notice };
            warnings.push(say(severity, "clock-displacement-ratio", message));
        }
        if let Some(rival_s) = coarse.rival_s {
            let message = format!(
                "the motion repeats itself: an offset of {:+.2} s fits nearly as well as {:+.2} s; set \
                 clock.initial_offset_s and a small clock.max_offset_s if it is known",
                self.config.initial_offset_s + rival_s,
                found.offset_s
            );
            warnings.push(say(Severity::Inadequate, "clock-ambiguous", message));
        }
        if !fine.with_drift && self.max_drift() > 0.0 {
            let message = format!(
                "the recording is too short to tell the drift better than clock.max_drift_ppm = {}; taken as \
                 zero with that standard error",
                self.config.max_drift_ppm
            );
            warnings.push(say(Severity::Notice, "clock-drift-unknown", message));
        }
        if found.offset_sigma_s > 0.02 {
            let message = format!(
                "the offset is known to {:.0} ms only; record more and faster moves",
                found.offset_sigma_s * 1e3
            );
            warnings.push(say(Severity::Notice, "clock-uncertain", message));
        }
        let worst = fine.windows.iter().filter(|w| w.1.abs() > 6.0 * w.2 && w.1.abs() > 5e-3);
        if let Some((at_s, off_s, _)) = worst.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) {
            let message = format!(
                "offset and drift do not describe the clocks: about {at_s:.0} s after the start the offset \
                 differs by {:+.1} ms; a clock was probably set during the recording, split it there",
                off_s * 1e3
            );
            warnings.push(say(Severity::Inadequate, "clock-not-linear", message));
        }
        warnings
    }
}

/// `t_ns` plus some seconds, without overflow.
fn shifted(t_ns: i64, by_s: f64) -> i64 {
    t_ns.saturating_add((by_s * 1e9).round() as i64)
}

/// Ratios of measured to predicted distance that only a wrong unit explains.
fn check_units(ratio: f64, correlation: f64) -> Result<(), DwellError> {
    let near = |unit: f64| (ratio / unit).ln().abs() < 2f64.ln();
    let advice = if near(1e3) {
        "its positions look like millimetres: set unit = \"mm\" for the tip stream"
    } else if near(1e-3) {
        "the lengths of the model look like millimetres, or the tip stream is in metres but declared unit = \"mm\""
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
