//! Errors over recorded time.

use crate::points::Point;
use crate::proto::Course;
use crate::run::Run;

/// Errors of the points over recorded time; `in_time` is their order.
pub fn course(run: &Run, points: &[Point], in_time: &[usize]) -> Course {
    let time_min = recorded_min(run, points);
    let fitted = run.calibration.fit.values();
    let mut m = Course::default();
    for &i in in_time {
        let p = &points[i];
        let norms_m = [p.residual.nominal_m.norm(), p.residual.fitted_m.norm(), p.residual.expected_norm_m];
        let after_m = p.steps_m.last().map(|r| r.norm());
        // At the base itself there is no direction away from it; nothing reaches there.
        let away = (p.measured_m - run.base_m(&fitted, p.observation.dwell.recording)).normalize();
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
pub(crate) fn recorded_min(run: &Run, points: &[Point]) -> Vec<f64> {
    let time = run.recorded_time();
    points.iter().map(|p| time.at_min(p.observation)).collect()
}
