//! What the page's tables say about the data themselves.

use armcal_core::units::format_mm;
use armcal_recording::StreamReport;
use armcal_result::{ObservedFile, RecordingErrors, RecordingRun, Run};

/// One recording.
pub(crate) struct RecordingRow<'a> {
    pub of: &'a RecordingRun,
    pub used: usize,
    /// Nominal, calibrated, as a new day [mm]; empty where no recording was held out.
    pub mean_mm: Vec<String>,
    /// Offset and drift.
    pub clock: [String; 2],
    /// With what is damaged in each.
    pub files: Vec<(ObservedFile, String)>,
}

/// Dwells of one recording that were rejected for one reason.
pub(crate) struct RejectionRow {
    pub recording: String,
    pub why: String,
    pub dwells: String,
}

/// All recordings.
pub(crate) fn recording_rows(run: &Run) -> Vec<RecordingRow<'_>> {
    let errors = run.errors_by_recording();
    run.recordings.iter().zip(&errors).map(|(r, errors)| recording_row(run, r, errors)).collect()
}

fn recording_row<'a>(run: &Run, of: &'a RecordingRun, errors: &RecordingErrors) -> RecordingRow<'a> {
    let mean_mm = |unseen| [errors.nominal, errors.calibrated, unseen].map(|e| format_mm(e.mean_m)).to_vec();
    let no_clock = || {
        let why = if of.earlier.is_some() { "–" } else { "one clock" };
        [why, "–"].map(str::to_owned)
    };
    RecordingRow {
        of,
        used: run.used(of),
        mean_mm: errors.unseen.map(mean_mm).unwrap_or_default(),
        clock: of.clock_shown().unwrap_or_else(no_clock),
        files: of.files().into_iter().enumerate().map(|(at, file)| (file, damage_text(of, at))).collect(),
    }
}

fn damage_text(r: &RecordingRun, file: usize) -> String {
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

/// Frames of a stream in which nothing was seen, and their share.
pub(crate) fn occluded(s: &StreamReport) -> String {
    let seen = s.rows as u64 + s.occluded.total();
    let share = if seen > 0 { 100.0 * s.occluded.total() as f64 / seen as f64 } else { 0.0 };
    format!("{} ({share:.1} %)", s.occluded.total())
}

/// Messages of a stream that were left out.
pub(crate) fn dropped(s: &StreamReport) -> u64 {
    s.undecodable + s.non_finite + s.impossible + s.unstamped + s.stray_stamps + s.duplicate_stamps
}

/// Rejected dwells, by reason.
pub(crate) fn rejection_rows(run: &Run) -> Vec<RejectionRow> {
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
