//! The page of two arms.

use super::{ClosedRecording, ClosedRun};
use crate::ReportError;
use crate::page::overview::{DwellPlace, Overview, RecordingLine, overview_html};
use crate::story::Story;
use crate::text::millimetres;

/// Two arms as one offline HTML page.
///
/// # Errors
/// A template or document that cannot be written.
pub fn closed_html(run: &ClosedRun) -> Result<String, ReportError> {
    let [first, second] = run.chain.arms();
    overview_html(&Overview {
        pipeline: &run.pipeline_name,
        pipeline_text: &run.pipeline_text,
        about: match run.chain.link_length_m(&run.chain.nominal()) {
            None => format!("two arms, {} and {}, their tips in one point", first.name, second.name),
            Some(length_m) => format!(
                "two arms, {} and {}, their tips on a rigid link of {} mm",
                first.name,
                second.name,
                millimetres(length_m)
            ),
        },
        error: "closing error",
        story: Story::of_two_arms(run),
        calibration: &run.calibration,
        unseen: None,
        dwells: (run.observations.iter())
            .map(|o| DwellPlace { time_ns: o.arms[0].time_ns, cavity: None })
            .collect(),
        recordings: run.recordings.iter().map(line).collect(),
        shared: run.calibration.fit.estimates.iter().collect(),
        own: Vec::new(),
    })
}

fn line(r: &ClosedRecording) -> RecordingLine {
    let open = r.open.iter().map(|o| format!("dwell {}: {}", o.dwell.dwell, o.why));
    RecordingLine {
        name: r.name.clone(),
        dwells: r.dwells.len(),
        used: r.dwells.len() - r.open.len(),
        left_out: open.collect::<Vec<_>>().join("; "),
        files: (r.paths.iter().zip(&r.report.files))
            .map(|(path, f)| (path.to_string_lossy().into_owned(), f.identity()))
            .collect(),
    }
}
