//! Errors over recorded time.

use crate::points::Point;
use crate::proto::Course;
use crate::run::Run;
use std::collections::BTreeMap;

pub(super) fn course(run: &Run, points: &[Point], in_time: &[usize]) -> Course {
    let time_min = recorded_min(points);
    let base_m = run.model.base_in_world(&run.calibration.fit.values()).translation.vector;
    let mut m = Course::default();
    for &i in in_time {
        let p = &points[i];
        let norms_m = [p.residual.nominal_m.norm(), p.residual.fitted_m.norm(), p.residual.expected_norm_m];
        let after_m = p.steps_m.last().map(|r| r.norm());
        // At the base itself there is no direction away from it; nothing reaches there.
        let away = (p.measured_m - base_m).normalize();
        let outward_m = away.dot(&p.residual.fitted_m);
        let effect_m = p.effect_m.map(|effect_m| away.dot(&effect_m));
        if !norms_m.iter().copied().chain(after_m).chain(effect_m).chain([outward_m]).all(f64::is_finite) {
            continue;
        }
        m.outward_mm.push(outward_m * 1e3);
        m.effect_outward_mm.extend(effect_m.map(|effect_m| effect_m * 1e3));
        m.time_min.push(time_min[i]);
        m.recording.push(run.recording_name(p.observation.dwell).to_owned());
        m.nominal_mm.push(norms_m[0] * 1e3);
        m.fitted_mm.push(norms_m[1] * 1e3);
        m.expected_mm.push(norms_m[2] * 1e3);
        m.after_mm.extend(after_m.map(|after_m| after_m * 1e3));
    }
    m
}

/// When each point was taken, in minutes of recorded time.
pub(super) fn recorded_min(points: &[Point]) -> Vec<f64> {
    let times: Vec<(usize, i64)> =
        points.iter().map(|p| (p.observation.dwell.recording, p.observation.time_ns)).collect();
    without_gaps_min(&times)
}

/// Minutes of recorded time at times in recordings: these follow one another in the order of their first times, without
/// the gaps between them.
pub(crate) fn without_gaps_min(times: &[(usize, i64)]) -> Vec<f64> {
    let mut spans: BTreeMap<usize, (i64, i64)> = BTreeMap::new();
    for (recording, time_ns) in times {
        let span = spans.entry(*recording).or_insert((*time_ns, *time_ns));
        *span = (span.0.min(*time_ns), span.1.max(*time_ns));
    }
    let mut in_time: Vec<(i64, i64, usize)> =
        spans.into_iter().map(|(r, (first, last))| (first, last, r)).collect();
    in_time.sort_unstable();
    let mut begins: BTreeMap<usize, (i64, f64)> = BTreeMap::new();
    let mut elapsed_min = 0.0;
    for (first_ns, last_ns, recording) in in_time {
        begins.insert(recording, (first_ns, elapsed_min));
        elapsed_min += (last_ns - first_ns) as f64 / 60e9;
    }
    let at = |(recording, time_ns): &(usize, i64)| {
        let (first_ns, before_min) = begins.get(recording).copied().unwrap_or_default();
        before_min + (time_ns - first_ns) as f64 / 60e9
    };
    times.iter().map(at).collect()
}
