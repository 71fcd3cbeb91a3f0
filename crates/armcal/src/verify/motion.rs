//! The arm between its dwells: predicted from the encoders, and planned by the set-points.

use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::stages::observe;
use crate::stages::past::Placed;
use crate::stages::perceive::Seen;
use armcal_core::{DwellId, JointSamples, Observation, Pose, Samples};
use armcal_dwell::{Moment, track};
use armcal_report::PathSample;
use armcal_verify::{ClockError, PathError, PathRow, Planned, Polyline, paths};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A set-point older than this does not say where the arm should be [s].
const SET_POINT_MAX_AGE_S: f64 = 0.1;

/// The motion of one recording.
pub struct Motion {
    /// Frames of the moving tip.
    pub moments: Vec<Moment>,
    /// The same with the sensor's clock off by one standard error, where there are two clocks.
    shifted: Option<Vec<Moment>>,
    /// Standard error of the offset between the clocks in the middle of the recording [s].
    pub clock_sigma_s: Option<f64>,
    /// Set-points at the time of each moment [rad], where they are recorded.
    set_points: Vec<Option<Vec<f64>>>,
}

/// What comes of the comparison.
pub struct Paths {
    /// Rows of the table.
    pub rows: Vec<PathRow>,
    /// Every moment.
    pub samples: Vec<PathSample>,
}

/// Collects the motion of a recording while its samples are at hand.
pub fn follow(pipeline: &Pipeline, samples: &Samples, seen: &Seen) -> Result<Motion, Error> {
    let in_recording = |source| Error::Dwell { recording: seen.name.clone(), source };
    let at = |shift_s: f64| {
        track(samples, seen.clock.as_ref(), shift_s, &seen.dwells, &pipeline.dwell).map_err(in_recording)
    };
    let moments = at(0.0)?;
    let middle_ns = samples.tip.as_ref().and_then(|t| t.time_ns.get(t.time_ns.len() / 2)).copied();
    let clock_sigma_s = seen.clock.as_ref().zip(middle_ns).map(|(clock, ns)| clock.sigma_s(ns));
    let shifted = clock_sigma_s.map(at).transpose()?;
    let asked = samples.set_points.as_ref();
    let set_points = moments.iter().map(|m| asked.and_then(|s| set_point(s, m.time_ns))).collect();
    Ok(Motion { moments, shifted, clock_sigma_s, set_points })
}

/// The set-point in force at a time: the last one before it.
fn set_point(stream: &JointSamples, time_ns: i64) -> Option<Vec<f64>> {
    let row = stream.time_ns.partition_point(|t| *t <= time_ns).checked_sub(1)?;
    let age_s = time_ns.saturating_sub(stream.time_ns[row]) as f64 * 1e-9;
    (age_s <= SET_POINT_MAX_AGE_S).then(|| stream.row_rad(row))
}

/// Compares what the sensor saw with both models.
pub fn compare(
    pipeline: &Pipeline,
    placed: &Placed,
    seen: &[Seen],
    motions: &[Motion],
    names: &[String],
) -> Paths {
    let judge = Judge { pipeline, placed, world_from_base: placed.model.base_in_world(&placed.calibrated) };
    let recordings = || seen.iter().zip(motions).enumerate();
    let errors: Vec<Vec<PathError>> =
        recordings().map(|(r, (s, m))| judge.errors(r, s.load_kg, &m.moments)).collect();
    let clocks: Vec<Option<ClockError>> = recordings()
        .zip(&errors)
        .map(|((r, (s, m)), now)| {
            let shifted = judge.errors(r, s.load_kg, m.shifted.as_ref()?);
            Some(clock_error(m.clock_sigma_s?, now, &shifted))
        })
        .collect();
    let mut planned = BTreeMap::new();
    for (r, (s, m)) in recordings() {
        planned.extend(judge.planned(r, s.load_kg, m));
    }
    let errors: Vec<PathError> = errors.into_iter().flatten().collect();
    let rows = paths(&errors, names, &clocks, &planned);
    Paths { rows, samples: errors.into_iter().map(|e| PathSample::of(&e, names)).collect() }
}

struct Judge<'a> {
    pipeline: &'a Pipeline,
    placed: &'a Placed,
    world_from_base: Pose,
}

impl Judge<'_> {
    fn errors(&self, recording: usize, load_kg: f64, moments: &[Moment]) -> Vec<PathError> {
        let error = |(index, m): (usize, &Moment)| {
            let o = observe::moving(self.pipeline, recording, index, load_kg, m);
            PathError {
                motion: DwellId { recording, dwell: m.motion },
                time_ns: m.time_ns,
                measured_m: self.in_base(&m.position_m),
                before_m: self.predicted_m(&self.placed.nominal, &o),
                after_m: self.predicted_m(&self.placed.calibrated, &o),
            }
        };
        moments.par_iter().enumerate().map(error).collect()
    }

    /// The path of each motion as its set-points command it; the joints arrive as they do in fact.
    fn planned(&self, recording: usize, load_kg: f64, motion: &Motion) -> BTreeMap<DwellId, Planned> {
        let mut ways: BTreeMap<DwellId, [Vec<Vector3<f64>>; 2]> = BTreeMap::new();
        for (index, (m, set_point)) in motion.moments.iter().zip(&motion.set_points).enumerate() {
            let Some(set_point) = set_point else { continue };
            let mut o = observe::moving(self.pipeline, recording, index, load_kg, m);
            o.joint_rad.clone_from(set_point);
            let [before, after] = ways.entry(DwellId { recording, dwell: m.motion }).or_default();
            before.push(self.predicted_m(&self.placed.nominal, &o));
            after.push(self.predicted_m(&self.placed.calibrated, &o));
        }
        ways.into_iter()
            .filter_map(|(motion, [before, after])| {
                let (before, after) = (Polyline::through(before)?, Polyline::through(after)?);
                Some((motion, Planned { before, after }))
            })
            .collect()
    }

    fn predicted_m(&self, p: &[f64], o: &Observation) -> Vector3<f64> {
        self.in_base(&self.placed.model.predicted_tip_in_world(p, o))
    }

    fn in_base(&self, in_world_m: &Vector3<f64>) -> Vector3<f64> {
        self.world_from_base.inverse_transform_point(&(*in_world_m).into()).coords
    }
}

/// What one standard error of the clock changes in the mean errors.
fn clock_error(sigma_s: f64, now: &[PathError], shifted: &[PathError]) -> ClockError {
    let mean = |errors: &[PathError], of: fn(&PathError) -> &Vector3<f64>| {
        errors.iter().map(|e| (e.measured_m - of(e)).norm()).sum::<f64>() / errors.len().max(1) as f64
    };
    let change = |of| (mean(shifted, of) - mean(now, of)).abs();
    ClockError { sigma_s, before_m: change(|e| &e.before_m), after_m: change(|e| &e.after_m) }
}
