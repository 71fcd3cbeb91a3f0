//! The arm between its dwells: predicted from the encoders, and planned by the set-points.

use crate::error::HeldOutError;
use armcal_config::Pipeline;
use armcal_core::{DwellId, JointSamples, Observation, Samples};
use armcal_dwell::{ClockAlignment, TrackSample, track};
use armcal_stages::observe;
use armcal_stages::{Placed, PlacedBase};
use armcal_stages::{RecordingData, RunError};
use armcal_verify::{ClockError, Lateness, Passing, PathError, Planned, Polyline, lateness, stretch_name};
use nalgebra::{DVector, Vector3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A set-point older than this does not say where the arm should be [s].
const SET_POINT_MAX_AGE_S: f64 = 0.1;
/// Rounds in which the clock is found, and the change below which they end [s].
const CLOCK_ROUNDS: usize = 10;
const CLOCK_SETTLED_S: f64 = 1e-5;

/// The motion of one recording.
pub struct Motion {
    /// Where the tip was and should have been.
    pub errors: Vec<PathError>,
    /// Paths that the set-points command, motion by motion, where they are recorded.
    pub planned: BTreeMap<DwellId, Planned>,
    /// The sensor's clock as the motion tells it, where there are two clocks.
    pub clock: Option<ClockAlignment>,
    /// What its uncertainty changes.
    pub clock_error: Option<ClockError>,
}

/// Both models among the new recordings.
pub struct Judge<'a> {
    pipeline: &'a Pipeline,
    placed: &'a Placed,
    base: PlacedBase<'a>,
}

impl<'a> Judge<'a> {
    pub fn new(pipeline: &'a Pipeline, placed: &'a Placed) -> Judge<'a> {
        Judge { pipeline, placed, base: placed.base() }
    }

    /// Compares what the sensor saw of one recording's motion with both models.
    ///
    /// Dwells need the sensor's clock to a tenth of a second, paths to a millisecond: an arm with play lags behind its
    /// encoders, and the alignment of the nominal arm takes that for a late clock. So the clock is found again, by the
    /// calibrated model.
    pub fn follow(
        &self,
        recording: usize,
        seen: &RecordingData,
        samples: &Samples,
    ) -> Result<Motion, HeldOutError> {
        let one = Recorded { recording, seen, samples, dwell: &self.pipeline.dwell };
        let (mut clock, mut moments) = (seen.clock.clone(), one.moments(seen.clock.as_ref())?);
        for _ in 0..CLOCK_ROUNDS {
            // A declared clock stays as declared.
            let Some(thought) = clock.as_ref().filter(|c| !c.declared) else { break };
            let Some(found) = self.lateness(&one, thought, &moments) else { break };
            let corrected = correct_clock(thought, &found);
            moments = one.moments(Some(&corrected))?;
            clock = Some(corrected);
            if found.late_s.abs() < CLOCK_SETTLED_S {
                break;
            }
        }
        let errors = self.errors(&one, &moments);
        let clock_error = match clock.as_ref().map(|c| (c, over_recording_s(c, samples))) {
            Some((clock, sigma_s)) if sigma_s.is_finite() => {
                let later = ClockAlignment { offset_s: clock.offset_s + sigma_s, ..clock.clone() };
                let shifted = self.errors(&one, &one.moments(Some(&later))?);
                Some(clock_error(sigma_s, &errors, &shifted))
            }
            _ => None,
        };
        let planned = self.planned(&one, &moments);
        Ok(Motion { errors, planned, clock, clock_error })
    }

    fn lateness(
        &self,
        one: &Recorded<'_>,
        clock: &ClockAlignment,
        moments: &[TrackSample],
    ) -> Option<Lateness> {
        let (model, p) = (&self.placed.model, &self.placed.calibrated);
        let seen: Vec<(String, f64, Vector3<f64>, Vector3<f64>)> = moments
            .par_iter()
            .enumerate()
            .map(|(index, m)| {
                let o = one.observation(self.pipeline, index, m);
                let joints = DVector::from_column_slice(&m.joint_velocity_radps);
                let velocity_mps = model.joint_jacobian(p, &o) * joints;
                let error_m = model.residual(p, &o).position_m;
                (
                    stretch_name(one.motion(m), m.time_ns),
                    m.time_ns.saturating_sub(clock.reference_ns) as f64 * 1e-9,
                    Vector3::from_column_slice(velocity_mps.as_slice()),
                    error_m,
                )
            })
            .collect();
        let passings: Vec<Passing<'_>> = seen
            .iter()
            .map(|(group, since_s, velocity_mps, error_m)| Passing {
                group,
                since_s: *since_s,
                velocity_mps: *velocity_mps,
                error_m: *error_m,
            })
            .collect();
        lateness(&passings)
    }

    fn errors(&self, one: &Recorded<'_>, moments: &[TrackSample]) -> Vec<PathError> {
        let error = |(index, m): (usize, &TrackSample)| {
            let o = one.observation(self.pipeline, index, m);
            PathError {
                motion: one.motion(m),
                time_ns: m.time_ns,
                measured_m: self.base.from_world_m(&m.position_m),
                before_m: self.base.predicted_tip_m(&self.placed.nominal, &o),
                after_m: self.base.predicted_tip_m(&self.placed.calibrated, &o),
            }
        };
        moments.par_iter().enumerate().map(error).collect()
    }

    /// The path of each motion as its set-points command it; the joints arrive as they do in fact.
    fn planned(&self, one: &Recorded<'_>, moments: &[TrackSample]) -> BTreeMap<DwellId, Planned> {
        let Some(asked) = &one.samples.set_points else { return BTreeMap::new() };
        let mut ways: BTreeMap<DwellId, [Vec<Vector3<f64>>; 2]> = BTreeMap::new();
        for (index, m) in moments.iter().enumerate() {
            let Some(joint_rad) = set_point(asked, m.time_ns) else { continue };
            let o = Observation { joint_rad, ..one.observation(self.pipeline, index, m) };
            let [before, after] = ways.entry(one.motion(m)).or_default();
            before.push(self.base.predicted_tip_m(&self.placed.nominal, &o));
            after.push(self.base.predicted_tip_m(&self.placed.calibrated, &o));
        }
        let planned = |(motion, [before, after]): (DwellId, [Vec<Vector3<f64>>; 2])| {
            Some((motion, Planned { before: Polyline::through(before)?, after: Polyline::through(after)? }))
        };
        ways.into_iter().filter_map(planned).collect()
    }
}

/// One recording with its samples.
struct Recorded<'a> {
    recording: usize,
    seen: &'a RecordingData,
    samples: &'a Samples,
    dwell: &'a armcal_dwell::DwellConfig,
}

impl Recorded<'_> {
    /// Frames of the moving tip by this clock.
    fn moments(&self, clock: Option<&ClockAlignment>) -> Result<Vec<TrackSample>, HeldOutError> {
        let RecordingData { name, dwells, .. } = self.seen;
        let moments = track(self.samples, clock, dwells, self.dwell);
        Ok(moments.map_err(|source| RunError::Dwell { recording: name.clone(), source })?)
    }

    fn observation(&self, pipeline: &Pipeline, index: usize, m: &TrackSample) -> Observation {
        observe::moving_observation(pipeline, self.recording, index, self.seen, m)
    }

    fn motion(&self, m: &TrackSample) -> DwellId {
        DwellId { recording: self.recording, dwell: m.motion }
    }
}

/// The set-point in force at a time: the last one before it.
pub(super) fn set_point(stream: &JointSamples, time_ns: i64) -> Option<Vec<f64>> {
    let row = stream.time_ns.partition_point(|t| *t <= time_ns).checked_sub(1)?;
    let age_s = time_ns.saturating_sub(stream.time_ns[row]) as f64 * 1e-9;
    (age_s <= SET_POINT_MAX_AGE_S).then(|| stream.row_rad(row))
}

/// A clock whose stamps turned out to be late.
fn correct_clock(thought: &ClockAlignment, found: &Lateness) -> ClockAlignment {
    let reference_ns = thought.reference_ns.saturating_add((found.since_s * 1e9) as i64);
    ClockAlignment {
        offset_s: thought.offset_s + thought.drift * found.since_s + found.late_s,
        offset_sigma_s: found.sigma_s,
        drift: thought.drift + found.drift,
        drift_sigma: found.drift_sigma,
        reference_ns,
        ..thought.clone()
    }
}

/// Standard error of a clock over a recording: root mean square over its frames [s].
fn over_recording_s(clock: &ClockAlignment, samples: &Samples) -> f64 {
    let Some(tip) = &samples.tip else { return f64::NAN };
    let square: f64 = tip.time_ns.iter().map(|t| clock.sigma_s(*t).powi(2)).sum();
    (square / tip.len() as f64).sqrt()
}

/// What one standard error of the clock changes in the mean errors.
fn clock_error(sigma_s: f64, now: &[PathError], shifted: &[PathError]) -> ClockError {
    let mean = |errors: &[PathError], of: fn(&PathError) -> &Vector3<f64>| {
        errors.iter().map(|e| (e.measured_m - of(e)).norm()).sum::<f64>() / errors.len().max(1) as f64
    };
    let change = |of| (mean(shifted, of) - mean(now, of)).abs();
    ClockError { sigma_s, before_m: change(|e| &e.before_m), after_m: change(|e| &e.after_m) }
}
