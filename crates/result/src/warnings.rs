//! What a run warns of, and whether its result stands.

use crate::adequate::as_wanted;
use crate::run::{RecordingRun, Run, without_repeats};
use armcal_campaign::Status;
use armcal_core::{Severity, Warning};

impl Run {
    /// The gravest thing any warning says.
    pub fn status(&self) -> Status {
        let of_recordings = self.recordings.iter().flat_map(RecordingRun::all_warnings);
        let overall = self.overall_warnings();
        status_of(of_recordings.chain(&overall))
    }

    /// Warnings that are not about one recording: pipeline, fit, hold-out, outputs; each once.
    pub fn overall_warnings(&self) -> Vec<Warning> {
        let of_recordings: Vec<&Warning> =
            self.recordings.iter().flat_map(RecordingRun::all_warnings).collect();
        let outputs = output_warnings(self);
        let of_diagnosis = self.diagnosis.iter().flat_map(|d| &d.warnings);
        let calibration = &self.calibration;
        let all = self.warnings.iter().chain(&calibration.warnings).chain(&calibration.fit.warnings);
        let of_setup: Vec<Warning> = self.setup.warnings();
        let all = of_setup.iter().chain(all).chain(of_diagnosis);
        let mut own = without_repeats(all.chain(&outputs));
        own.retain(|w| !of_recordings.contains(w));
        as_wanted(self, own.into_iter().cloned().collect())
    }
}

/// What the outputs cannot hold.
fn output_warnings(run: &Run) -> Vec<Warning> {
    let mut warnings = crate::left_out::earlier_results(run);
    // A model that cannot be written at all is an error of `write_all`, which says why.
    let models = crate::model_file::model_files(run).into_iter().flatten();
    warnings.extend(models.flat_map(|m| m.warnings));
    warnings
}

/// The gravest thing any of these says.
pub fn status_of<'a>(warnings: impl Iterator<Item = &'a Warning>) -> Status {
    match warnings.map(|w| w.severity).max() {
        None | Some(Severity::Notice) => Status::Ok,
        Some(Severity::Inadequate) => Status::Inadequate,
        Some(Severity::DataLost) => Status::DataLost,
    }
}
