//! The facts as protobuf messages of `proto/armcal.proto`.

use super::{Messages, run_start_ns, start_ns, to_sensor_ns, unsigned_ns};
use armcal_calibrate::{Calibration, Estimate, Fit, Residual, SideErrors};
use armcal_core::{Dwell, ErrorStats, TipMeasurement};
use armcal_dwell::ClockAlignment;
use armcal_result::proto::{parameter_message, saturating_u32};
use armcal_result::{Point, RecordingNames, Run, VERSION, effect_part_names, proto, status_word};
use armcal_table::{Assignment, Place};
use armcal_wording::{conclusion, estimate_remark, estimate_shown};
use nalgebra::Vector3;

pub(super) fn put(run: &Run, points: &[Point], out: &mut Messages) {
    let begin_ns = run_start_ns(run);
    out.put("/armcal/parameters", begin_ns, &parameters_message(&run.calibration.fit, begin_ns));
    out.put(
        "/armcal/parameter_table",
        begin_ns,
        &parameter_table(&run.calibration.fit, &run.recording_names(), begin_ns),
    );
    out.put(
        "/armcal/report",
        begin_ns,
        &calibration_message(&run.pipeline_name, &run.calibration, conclusion(&run.calibration), begin_ns),
    );
    let used = run.observed();
    for (index, recording) in run.recordings.iter().enumerate() {
        let start_ns = start_ns(recording);
        let (assigned, why_not) = (recording.assigned(), recording.why_not());
        if let Some(clock) = &recording.clock {
            let message = clock_alignment(clock, &recording.name, index, start_ns);
            out.put("/armcal/clock", start_ns, &message);
        }
        for dwell in &recording.dwells {
            let time_ns = dwell.mid_ns();
            let seen = recording.clock.as_ref().filter(|_| dwell.tip.is_some());
            let publish_ns = seen.map_or(time_ns, |clock| to_sensor_ns(clock, time_ns));
            out.put_published("/armcal/dwells", time_ns, publish_ns, &dwell_message(&recording.name, dwell));
            let place = (assigned.get(&dwell.id).copied(), why_not.get(&dwell.id).copied());
            let message = assignment_message(&recording.name, dwell, place, used.contains(&dwell.id));
            out.put("/armcal/assignments", time_ns, &message);
        }
    }
    for point in points {
        out.put("/armcal/residuals", point.observation.time_ns, &residual_message(run, point));
    }
}

/// A dwell of the recording of this name.
pub(super) fn dwell_message(recording: &str, d: &Dwell) -> proto::Dwell {
    proto::Dwell {
        timestamp: proto_time(d.mid_ns()),
        recording: recording.to_owned(),
        recording_index: saturating_u32(d.id.recording),
        dwell: saturating_u32(d.id.dwell),
        start: proto_time(d.start_ns),
        end: proto_time(d.end_ns),
        duration_s: d.duration_s(),
        joint_rad: d.joint_rad.clone(),
        joint_deg: d.joint_rad.iter().map(|q| q.to_degrees()).collect(),
        joint_spread_rad: d.joint_spread_rad.clone(),
        joint_sigma_rad: d.joint_sigma_rad.clone(),
        effort_nm: d.effort_nm.clone().unwrap_or_default(),
        arrival_sign: d.arrival.iter().map(|a| a.sign() as i32).collect(),
        samples: saturating_u32(d.samples),
        effective_samples: d.effective_samples,
        tip: d.tip.as_ref().map(tip_message),
        temperature_c: d.temperature_c,
    }
}

fn tip_message(t: &TipMeasurement) -> proto::TipMeasurement {
    let q = t.orientation.map(|q| proto::Quaternion { x: q.i, y: q.j, z: q.k, w: q.w });
    proto::TipMeasurement {
        position_m: Some(proto_vector(&t.position_m)),
        position_sigma_mm: Some(proto_vector(&t.covariance_m2.diagonal().map(|v| v.sqrt() * 1e3))),
        orientation: q,
        orientation_sigma_rad: t.orientation.map(|_| t.orientation_sigma_rad),
        samples: saturating_u32(t.samples),
        effective_samples: t.effective_samples,
    }
}

/// Where a dwell of the recording of this name was, and why it was not used.
fn assignment_message(
    recording: &str,
    dwell: &Dwell,
    (assigned, why_not): (Option<&Assignment>, Option<&str>),
    used: bool,
) -> proto::Assignment {
    use proto::assignment::Place as P;
    let mut message = proto::Assignment {
        timestamp: proto_time(dwell.mid_ns()),
        recording: recording.to_owned(),
        recording_index: saturating_u32(dwell.id.recording),
        dwell: saturating_u32(dwell.id.dwell),
        distance_mm: assigned.map(|a| a.distance_m * 1e3).filter(|d| d.is_finite()),
        used,
        why: why_not.unwrap_or_default().to_owned(),
        ..Default::default()
    };
    match assigned.map(|a| &a.place) {
        None => message.set_place(P::None),
        Some(Place::Seated { cavity, confidence }) => {
            message.set_place(P::Seated);
            message.cavity.clone_from(cavity);
            message.confidence = Some(*confidence).filter(|c| c.is_finite());
        }
        Some(Place::Hovering { height_m, above }) => {
            message.set_place(P::Hovering);
            message.cavity.clone_from(above);
            message.height_mm = Some(height_m * 1e3);
        }
        Some(Place::FreeSpace) => message.set_place(P::FreeSpace),
        Some(Place::Ambiguous { cavities }) => {
            message.set_place(P::Ambiguous);
            message.candidates.clone_from(cavities);
        }
        Some(Place::Unassigned { why }) => {
            message.set_place(P::Unassigned);
            if message.why.is_empty() {
                message.why.clone_from(why);
            }
        }
    }
    message
}

fn residual_message(run: &Run, point: &Point) -> proto::Residual {
    let o = point.observation;
    proto::Residual {
        cavity: o.cavity().unwrap_or_default().to_owned(),
        feature: run.model.measured_name(o),
        measured_m: Some(proto_vector(&point.measured_m)),
        predicted_m: Some(proto_vector(&point.predicted_m)),
        step_norm_mm: point.steps_m.iter().map(|r| r.norm() * 1e3).collect(),
        ..residual_errors(run.recording_name(o.dwell), o.time_ns, point.residual)
    }
}

/// The errors of one observation, without its places.
pub(super) fn residual_errors(recording: &str, time_ns: i64, r: &Residual) -> proto::Residual {
    proto::Residual {
        timestamp: proto_time(time_ns),
        recording: recording.to_owned(),
        recording_index: saturating_u32(r.dwell.recording),
        dwell: saturating_u32(r.dwell.dwell),
        held_out: r.held_out,
        nominal_mm: Some(proto_vector(&(r.nominal_m * 1e3))),
        nominal_norm_mm: r.nominal_m.norm() * 1e3,
        fitted_mm: Some(proto_vector(&(r.fitted_m * 1e3))),
        fitted_norm_mm: r.fitted_m.norm() * 1e3,
        whitened: Some(proto_vector(&r.whitened)),
        weight: r.weight,
        expected_norm_mm: r.expected_norm_m * 1e3,
        ..Default::default()
    }
}

/// Every parameter of a fit.
pub(super) fn parameters_message(fit: &Fit, time_ns: i64) -> proto::Parameters {
    proto::Parameters {
        timestamp: proto_time(time_ns),
        parameters: fit.estimates.iter().map(parameter_message).collect(),
        undetermined: fit.undetermined.iter().map(|u| u.text.clone()).collect(),
    }
}

/// The free parameters of a fit as people read them, in the order in which they tell something, because a viewer shows ten rows
/// at a time: those that the data determine before the others, and the most changed first, counted in standard deviations.
pub(super) fn parameter_table(fit: &Fit, names: &RecordingNames, time_ns: i64) -> proto::ParameterTable {
    let row = |e: &Estimate| {
        let [nominal, calibrated, change, half] = estimate_shown(e);
        proto::ParameterRow {
            parameter: names.label(&e.parameter.name),
            nominal,
            calibrated,
            change,
            interval95: format!("± {half}"),
            unit: e.parameter.unit.display_symbol().into(),
            remark: estimate_remark(e).into(),
            meaning: e.parameter.meaning.clone(),
        }
    };
    let changed = |e: &Estimate| {
        let sigmas = ((e.value - e.parameter.nominal) / e.sigma).abs();
        if sigmas.is_finite() { sigmas } else { 0.0 }
    };
    let mut free: Vec<&Estimate> = fit.estimates.iter().filter(|e| e.parameter.free).collect();
    free.sort_by(|a, b| b.determined.cmp(&a.determined).then(changed(b).total_cmp(&changed(a))));
    proto::ParameterTable { timestamp: proto_time(time_ns), rows: free.into_iter().map(row).collect() }
}

/// The calibration of the pipeline of this name, and what it comes to in a sentence.
pub(super) fn calibration_message(
    pipeline: &str,
    c: &Calibration,
    conclusion: String,
    time_ns: i64,
) -> proto::Calibration {
    proto::Calibration {
        timestamp: proto_time(time_ns),
        pipeline: pipeline.to_owned(),
        version: VERSION.into(),
        objective: c.fit.objective.clone(),
        effects: effect_part_names(c).into_iter().map(str::to_owned).collect(),
        status: status_word(c.fit.status).into(),
        iterations: saturating_u32(c.fit.iterations),
        noise_floor_mm: c.noise_floor_m * 1e3,
        train: Some(side_message(&c.train)),
        holdout: Some(side_message(&c.holdout)),
        rank: saturating_u32(c.fit.rank),
        undetermined: c.fit.undetermined.iter().map(|u| u.text.clone()).collect(),
        sigma_scale: c.fit.sigma_scale,
        sum_of_distances: c.fit.paper.map(|p| proto::SumOfDistances {
            sum_mm: p.sum_of_distances_m * 1e3,
            limit_mm: p.limit_m * 1e3,
            feasible: p.feasible,
        }),
        conclusion,
    }
}

fn side_message(s: &SideErrors) -> proto::Side {
    proto::Side {
        observations: saturating_u32(s.fitted.n),
        nominal: Some(errors_message(&s.nominal)),
        fitted: Some(errors_message(&s.fitted)),
    }
}

fn errors_message(s: &ErrorStats) -> proto::Errors {
    proto::Errors {
        mean_mm: s.mean_m * 1e3,
        rms_mm: s.rms_m * 1e3,
        p95_mm: s.p95_m * 1e3,
        max_mm: s.max_m * 1e3,
    }
}

fn clock_alignment(c: &ClockAlignment, recording: &str, index: usize, time_ns: i64) -> proto::ClockAlignment {
    let [offset_s, offset_sigma_s] = c.first_offset_s();
    proto::ClockAlignment {
        timestamp: proto_time(time_ns),
        recording: recording.to_owned(),
        recording_index: saturating_u32(index),
        offset_ms: offset_s * 1e3,
        offset_sigma_ms: offset_sigma_s * 1e3,
        drift_ppm: c.drift * 1e6,
        drift_sigma_ppm: c.drift_sigma * 1e6,
        reference: proto_time(c.first_ns),
        correlation: c.correlation,
        displacement_ratio: c.displacement_ratio,
    }
}

pub(super) fn proto_vector(v: &Vector3<f64>) -> proto::Vector {
    proto::Vector { x: v.x, y: v.y, z: v.z }
}

pub(super) fn proto_time(time_ns: i64) -> Option<prost_types::Timestamp> {
    let time_ns = unsigned_ns(time_ns);
    let seconds = i64::try_from(time_ns / 1_000_000_000).unwrap_or(i64::MAX);
    Some(prost_types::Timestamp { seconds, nanos: (time_ns % 1_000_000_000) as i32 })
}
