//! What the page's tables say about the data themselves.

use crate::past_observations::ObservedFile;
use crate::run::{RecordingErrors, RecordingRun, Run};
use crate::text::millimetres;
use armcal_recording::StreamReport;

/// One recording.
pub(crate) struct RecordingRow {
    pub name: String,
    pub dwells: usize,
    pub used: usize,
    pub rejected: usize,
    /// Nominal, calibrated, as a new day [mm]; empty where no recording was held out.
    pub mean_mm: Vec<String>,
    pub clock: String,
    pub drift: String,
    /// With what is damaged in each.
    pub files: Vec<(ObservedFile, String)>,
    pub streams: Vec<StreamRow>,
}

/// One of its streams.
pub(crate) struct StreamRow {
    pub role: String,
    pub topic: String,
    pub rows: usize,
    pub rate: String,
    pub gap: String,
    pub occluded: String,
    pub dropped: u64,
    pub clock: String,
}

/// Dwells of one recording that were rejected for one reason.
pub(crate) struct RejectionRow {
    pub recording: String,
    pub why: String,
    pub dwells: String,
}

/// All recordings.
pub(crate) fn recordings(run: &Run) -> Vec<RecordingRow> {
    let errors = run.errors_by_recording();
    run.recordings.iter().zip(&errors).map(|(r, errors)| recording(run, r, errors)).collect()
}

fn recording(run: &Run, r: &RecordingRun, errors: &RecordingErrors) -> RecordingRow {
    let no_clock = || {
        let why = if r.earlier.is_some() { "–" } else { "one clock" };
        [why, "–"].map(str::to_owned)
    };
    let [clock, drift] = r.clock_shown().unwrap_or_else(no_clock);
    RecordingRow {
        name: r.name.clone(),
        dwells: r.found(),
        used: run.used(r),
        rejected: r.rejected(),
        mean_mm: errors
            .unseen
            .map(|unseen| [errors.nominal, errors.calibrated, unseen].map(|e| millimetres(e.mean_m)).to_vec())
            .unwrap_or_default(),
        clock,
        drift,
        files: r.files().into_iter().enumerate().map(|(at, file)| (file, damage(r, at))).collect(),
        streams: r.report.streams.iter().map(stream).collect(),
    }
}

fn damage(r: &RecordingRun, file: usize) -> String {
    match r.report.files.get(file).map(|f| (f.truncated_at, f.damaged.len())) {
        // Its own result says so.
        None => "–".into(),
        Some((None, 0)) => "none".into(),
        Some((cut, parts)) => {
            let cut = cut.map_or(String::new(), |at| format!("cut off at byte {at}; "));
            format!("{cut}{parts} damaged parts")
        }
    }
}

fn stream(s: &StreamReport) -> StreamRow {
    let seen = s.rows as u64 + s.occluded.total();
    let share = if seen > 0 { 100.0 * s.occluded.total() as f64 / seen as f64 } else { 0.0 };
    StreamRow {
        role: s.role.clone(),
        topic: s.topic.clone(),
        rows: s.rows,
        rate: format!("{:.1}", s.rate_hz),
        gap: format!("{:.3}", s.largest_gap_s),
        occluded: format!("{} ({share:.1} %)", s.occluded.total()),
        dropped: s.undecodable
            + s.non_finite
            + s.impossible
            + s.unstamped
            + s.stray_stamps
            + s.duplicate_stamps,
        clock: format!("{}: {}", s.clock.word(), s.clock_reason),
    }
}

/// Rejected dwells, by reason.
pub(crate) fn rejections(run: &Run) -> Vec<RejectionRow> {
    let mut rows: Vec<(String, String, Vec<String>)> = Vec::new();
    for r in &run.recordings {
        for rejection in &r.rejections {
            let dwell = rejection.dwell.dwell.to_string();
            match rows.iter_mut().find(|(name, why, _)| *name == r.name && *why == rejection.why) {
                Some((.., dwells)) => dwells.push(dwell),
                None => rows.push((r.name.clone(), rejection.why.clone(), vec![dwell])),
            }
        }
    }
    rows.into_iter()
        .map(|(recording, why, dwells)| RejectionRow { recording, why, dwells: dwells.join(", ") })
        .collect()
}
