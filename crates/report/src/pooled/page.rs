//! The page of a pool.

use super::PooledRun;
use crate::ReportError;
use crate::page::overview::{DwellPlace, Overview, RecordingLine, overview_html};
use crate::story::Story;
use armcal_calibrate::Estimate;

/// The pool as one offline HTML page.
///
/// # Errors
/// A template or document that cannot be written.
pub fn pooled_html(run: &PooledRun) -> Result<String, ReportError> {
    let estimates = run.calibration.fit.estimates.iter().zip(run.shared());
    let of = |is_shared: bool| -> Vec<&Estimate> {
        estimates.clone().filter(|(_, shared)| *shared == is_shared).map(|(e, _)| e).collect()
    };
    let place = |o: &armcal_core::Observation| DwellPlace {
        time_ns: o.time_ns,
        cavity: o.cavity().map(str::to_owned),
    };
    overview_html(&Overview {
        pipeline: &run.pipeline_name,
        pipeline_text: &run.pipeline_text,
        about: match run.recordings.len() {
            1 => "one recording of one arm".to_owned(),
            n => format!("{n} recordings of one arm, calibrated together"),
        },
        error: "position error",
        story: Story::of_pool(run),
        calibration: &run.calibration,
        unseen: run.transfer.as_ref(),
        dwells: run.observations.iter().map(place).collect(),
        recordings: run.recordings.iter().enumerate().map(|(at, _)| line(run, at)).collect(),
        shared: of(true),
        own: of(false),
    })
}

fn line(run: &PooledRun, at: usize) -> RecordingLine {
    let recording = &run.recordings[at];
    RecordingLine {
        name: recording.name.clone(),
        dwells: recording.dwells,
        used: run.observations.iter().filter(|o| o.dwell.recording == at).count(),
        left_out: match recording.rejected {
            0 => String::new(),
            1 => "1 dwell; its own result says why".to_owned(),
            n => format!("{n} dwells; its own result says why"),
        },
        files: recording.files.iter().map(|f| (f.path.clone(), f.sha256.clone())).collect(),
    }
}
