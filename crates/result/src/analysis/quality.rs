//! What the data are like: clocks, occlusion, damage, and dwells that do not take part.

use super::{finite, round_significant};
use crate::proto::saturating_u32;
use crate::proto::{Quality, RecordingQuality, RejectedDwell};
use crate::run::{RecordingRun, Run};

/// What the data of a run are like.
pub fn quality(run: &Run) -> Quality {
    let mut recordings: Vec<RecordingQuality> =
        run.recordings.iter().map(|r| recording_quality(run, r)).collect();
    columns_of_all(&mut recordings);
    let rejected = run.recordings.iter().flat_map(|r| {
        r.rejections.iter().map(|rejection| RejectedDwell {
            recording: r.name.clone(),
            dwell: saturating_u32(rejection.dwell.dwell),
            why: rejection.why.clone(),
        })
    });
    Quality { timestamp: None, recordings, rejected: rejected.collect() }
}

/// A table has the columns of its first row, so what a later recording has must not be absent there: it is no number.
fn columns_of_all(recordings: &mut [RecordingQuality]) {
    let clock: [fn(&mut RecordingQuality) -> &mut Option<f64>; 4] = [
        |r| &mut r.clock_offset_ms,
        |r| &mut r.clock_offset_sigma_ms,
        |r| &mut r.clock_drift_ppm,
        |r| &mut r.clock_correlation,
    ];
    for field in clock {
        if recordings.iter_mut().any(|r| field(r).is_some()) {
            recordings.iter_mut().for_each(|r| *field(r) = field(r).or(Some(f64::NAN)));
        }
    }
}

fn recording_quality(run: &Run, r: &RecordingRun) -> RecordingQuality {
    let first_ns = r.report.channels.iter().map(|c| c.first_ns).min();
    let last_ns = r.report.channels.iter().map(|c| c.last_ns).max();
    let duration_min =
        first_ns.zip(last_ns).map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 / 60e9);
    RecordingQuality {
        recording: r.name.clone(),
        dwells: saturating_u32(r.found()),
        used: saturating_u32(run.used(r)),
        rejected: saturating_u32(r.rejected()),
        duration_min: round_significant(duration_min),
        occluded: r.report.streams.iter().map(|s| s.occluded.total()).sum(),
        damaged: saturating_u32(r.report.files.iter().map(|f| f.damaged.len()).sum()),
        warnings: saturating_u32(r.all_warnings().len()),
        clock_offset_ms: r
            .clock
            .as_ref()
            .and_then(|c| finite(c.first_offset_s()[0] * 1e3).map(round_significant)),
        clock_offset_sigma_ms: r
            .clock
            .as_ref()
            .filter(|c| !c.declared)
            .and_then(|c| finite(c.first_offset_s()[1] * 1e3).map(round_significant)),
        clock_drift_ppm: r.clock.as_ref().and_then(|c| finite(c.drift * 1e6).map(round_significant)),
        clock_correlation: r.clock.as_ref().and_then(|c| finite(c.correlation).map(round_significant)),
    }
}
