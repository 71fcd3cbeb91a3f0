//! What came out of a run of two arms: in sentences, over recorded time, and as a table.

use super::{Messages, facts, findings};
use crate::closed_chain::ClosedRun;
use crate::proto::Course;
use crate::recorded_time::RecordedTime;
use crate::story::Story;

pub(super) fn put(run: &ClosedRun, out: &mut Messages) {
    let begin_ns = run.start_ns();
    let table = facts::parameter_table(&run.calibration.fit, &run.recording_names(), begin_ns);
    out.put("/armcal/parameter_table", begin_ns, &table);
    out.put("/armcal/story", begin_ns, &findings::story(&Story::of_two_arms(run), begin_ns));
    out.put("/armcal/course", begin_ns, &course(run));
}

/// Closing errors in the order of time.
fn course(run: &ClosedRun) -> Course {
    let times: Vec<(usize, i64)> =
        run.observations.iter().map(|o| (o.dwell().recording, o.arms[0].time_ns)).collect();
    let time = RecordedTime::of_times(times.iter().copied(), run.recordings.len());
    let mut in_time: Vec<usize> = (0..run.observations.len().min(run.calibration.residuals.len())).collect();
    in_time.sort_by_key(|&i| (times[i].1, run.observations[i].dwell()));
    let mut m = Course { timestamp: facts::time(run.start_ns()), ..Default::default() };
    for i in in_time {
        let r = &run.calibration.residuals[i];
        let norms_m = [r.nominal_m.norm(), r.fitted_m.norm(), r.expected_norm_m];
        if !norms_m.iter().all(|x| x.is_finite()) {
            continue;
        }
        m.time_min.push(time.time_min(times[i].0, times[i].1));
        m.recording.extend(run.recordings.get(times[i].0).map(|recording| recording.name.clone()));
        m.nominal_mm.push(norms_m[0] * 1e3);
        m.fitted_mm.push(norms_m[1] * 1e3);
        m.expected_mm.push(norms_m[2] * 1e3);
    }
    m
}
