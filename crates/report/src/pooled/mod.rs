//! Results of many recordings of one arm, pooled: what is shared, and what each recording has for itself.
//!
//! `PooledRun -> write_pooled -> files`: `report.html` for people, `pool.json` for programs, `parameters.toml`, and the calibrated
//! model as `model.json`.

mod files;
mod page;
mod story;
mod terminal;

pub use files::{POOL_SCHEMA, pooled_files, pooled_json, write_pooled};
pub use terminal::pooled_terminal;

use crate::past_observations::ObservedFile;
use crate::recording_names::RecordingNames;
use crate::run::{Status, status_of, without_repeats};
use armcal_calibrate::{Calibration, Residual};
use armcal_core::{ErrorStats, Observation, Warning};
use armcal_model::{Model, Session};
use std::path::PathBuf;

/// A finished pooled calibration.
#[derive(Debug, Clone)]
pub struct PooledRun {
    /// Name of the pipeline.
    pub pipeline_name: String,
    /// Text of the pipeline.
    pub pipeline_text: String,
    /// Text of the model file.
    pub model_text: String,
    /// The recordings in the order of time; the index is that of the observations' dwells.
    pub recordings: Vec<PooledRecordingRun>,
    /// The model, and what each recording has for itself.
    pub model: Model,
    /// What the fit saw, and what was held out of it, in the order of the recordings.
    pub observations: Vec<Observation>,
    /// What effects know of all observations.
    pub session: Session,
    /// The calibration with the hold-out of the pipeline; its residuals are in the order of `observations`.
    pub calibration: Calibration,
    /// The same with whole recordings held out in turn: what the calibration is worth on a day it never saw. `None` with one
    /// recording.
    pub transfer: Option<Calibration>,
    /// What concerns the pool as a whole.
    pub warnings: Vec<Warning>,
}

/// One recording of the pool.
#[derive(Debug, Clone, PartialEq)]
pub struct PooledRecordingRun {
    /// Its name: that of its earlier run, made unique.
    pub name: String,
    /// Where its observations were read.
    pub result: PathBuf,
    /// Its files.
    pub files: Vec<ObservedFile>,
    /// Dwells found.
    pub dwells: usize,
    /// Dwells that did not become an observation.
    pub rejected: usize,
}

/// Errors of one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RecordingErrors {
    /// Nominal arm.
    pub nominal: ErrorStats,
    /// Calibrated; held out where the pipeline holds out.
    pub calibrated: ErrorStats,
    /// As a day that the calibration never saw.
    pub unseen: Option<ErrorStats>,
}

impl PooledRun {
    /// The gravest thing any warning says.
    pub fn status(&self) -> Status {
        status_of(self.all_warnings().into_iter())
    }

    /// Warnings of the pool and of its calibration, each once. (Those of the transfer say of every recording that its own
    /// parameters were fitted to its own dwells, which is what a transfer is.)
    pub fn all_warnings(&self) -> Vec<&Warning> {
        let of_calibration = self.calibration.warnings.iter().chain(&self.calibration.fit.warnings);
        without_repeats(self.warnings.iter().chain(of_calibration))
    }

    /// Its recordings as sentences call them.
    pub(crate) fn recording_names(&self) -> RecordingNames {
        RecordingNames::new(self.recordings.iter().map(|r| r.name.clone()))
    }

    /// Errors of every recording.
    pub(crate) fn errors(&self) -> Vec<RecordingErrors> {
        let own = |c: &Calibration, norm: fn(&Residual) -> f64| -> Vec<ErrorStats> {
            let mut norms = vec![Vec::new(); self.recordings.len()];
            c.residuals.iter().for_each(|r| norms[r.dwell.recording].push(norm(r)));
            norms.iter().map(|norms| ErrorStats::of_norms(norms)).collect()
        };
        let nominal = own(&self.calibration, |r| r.nominal_m.norm());
        let calibrated = own(&self.calibration, |r| r.fitted_m.norm());
        let unseen = self.transfer.as_ref().map(|c| own(c, |r| r.fitted_m.norm()));
        let of = |at: usize| RecordingErrors {
            nominal: nominal[at],
            calibrated: calibrated[at],
            unseen: unseen.as_ref().map(|unseen| unseen[at]),
        };
        (0..self.recordings.len()).map(of).collect()
    }

    /// Whether a parameter is shared, by its index.
    pub(crate) fn shared(&self) -> Vec<bool> {
        let mut shared = vec![true; self.model.parameters().len()];
        for recording in 0..self.recordings.len() {
            self.model.own_parameters(recording).into_iter().for_each(|index| shared[index] = false);
        }
        shared
    }
}
