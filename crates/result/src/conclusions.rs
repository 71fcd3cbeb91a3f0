//! `armcal/conclusions.toml` in `run.mcap`: what took a run longer than its fit, so that whoever opens its results does not
//! search again. TOML, because a number may be infinite.

use crate::called::Called;
use crate::error::ResultError;
use crate::files::hash_of_parts;
use crate::run::{Run, VERSION};
use crate::stored::{StoredResultError, attached_texts};
use armcal_calibrate::Calibration;
use armcal_core::{Observation, SetupReport};
use armcal_diagnose::{Calibrated, Diagnosis};
use armcal_table::Board;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Name of the attachment.
pub const FILE: &str = "conclusions.toml";
/// Format of the text.
const SCHEMA: &str = "armcal.conclusions/1";

/// What a run concluded from its calibration.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Conclusions {
    schema: String,
    /// Hash of the [`Grounds`].
    grounds: String,
    /// Hash of the [`InputFiles`]; empty of a version that did not write it.
    #[serde(default)]
    inputs: String,
    /// How the run calls things.
    pub called: Called,
    /// What contradicts the data about the setup.
    pub setup: SetupReport,
    /// What is missing in the model.
    pub diagnosis: Diagnosis,
}

/// What conclusions are drawn from.
#[derive(Debug, Clone, Copy)]
pub struct Grounds<'a> {
    /// Text of the pipeline.
    pub pipeline_text: &'a str,
    /// Texts of the nominal arms.
    pub model_texts: &'a [String],
    /// The board.
    pub board: Option<&'a Board>,
    /// What was observed.
    pub observations: &'a [Observation],
    /// The calibration on it.
    pub calibration: &'a Calibration,
}

impl Grounds<'_> {
    /// Hash of all of it, every number in full: what differs in the last digit is another calibration.
    fn hash(&self) -> String {
        let Grounds { pipeline_text, model_texts, board, observations, calibration } = self;
        let models = model_texts.iter().cloned();
        let numbers =
            format!("{board:?} {observations:?} {:?}", (calibration.fit.values(), &calibration.residuals));
        hash_of_parts([VERSION.to_owned(), (*pipeline_text).to_owned(), numbers].into_iter().chain(models))
    }
}

/// What a run reads, known before anything of a recording is decoded: the same version makes the same of it.
#[derive(Debug, Clone)]
pub struct InputFiles<'a> {
    /// Text of the pipeline.
    pub pipeline_text: &'a str,
    /// Texts of the nominal arms.
    pub model_texts: &'a [String],
    /// The board.
    pub board: Option<&'a Board>,
    /// What tells the files of every recording from others.
    pub identities: Vec<Vec<String>>,
}

impl InputFiles<'_> {
    fn hash(&self) -> String {
        let InputFiles { pipeline_text, model_texts, board, identities } = self;
        let others = [VERSION.to_owned(), (*pipeline_text).to_owned(), format!("{board:?} {identities:?}")];
        hash_of_parts(others.into_iter().chain(model_texts.iter().cloned()))
    }
}

impl Conclusions {
    /// Those of a run; none of one that was not diagnosed.
    pub fn of(run: &Run) -> Option<Conclusions> {
        let Run { pipeline_text, model_texts, board, observations, calibration, .. } = run;
        let board = board.as_ref();
        let grounds = Grounds { pipeline_text, model_texts, board, observations, calibration };
        let identities = run.recordings.iter().map(|r| r.files().into_iter().map(|f| f.identity).collect());
        let inputs = InputFiles { pipeline_text, model_texts, board, identities: identities.collect() };
        let diagnosis = run.diagnosis.clone()?;
        Some(Conclusions {
            schema: SCHEMA.to_owned(),
            grounds: grounds.hash(),
            inputs: inputs.hash(),
            called: run.called(),
            setup: run.setup.clone(),
            diagnosis,
        })
    }

    /// Those in the results of a run (`run.mcap`, or its folder); none where it has none, or those of another version.
    ///
    /// # Errors
    /// Results that cannot be read.
    pub fn open(path: &Path) -> Result<Option<Conclusions>, StoredResultError> {
        let [text] = attached_texts(path, [FILE])?;
        let read = text.and_then(|text| toml::from_str::<Conclusions>(&text).ok());
        Ok(read.filter(|own| own.schema == SCHEMA))
    }

    /// As text.
    pub fn text(&self) -> Result<String, ResultError> {
        toml::to_string(self).map_err(|e| ResultError::Inconsistent(format!("{FILE}: {e}")))
    }

    /// The diagnosis, what it found fitted again.
    pub fn diagnosis_of(&self, calibrated: &Calibrated<'_>) -> Diagnosis {
        let mut diagnosis = self.diagnosis.clone();
        diagnosis.refitted = None;
        if self.called.is_refitted {
            diagnosis.refit(calibrated);
        }
        diagnosis
    }

    /// Whether they are of a run that read these.
    pub fn are_of_inputs(&self, inputs: &InputFiles<'_>) -> bool {
        self.inputs == inputs.hash()
    }

    /// Whether they were drawn from these.
    pub fn are_of(&self, grounds: &Grounds<'_>) -> bool {
        self.grounds == grounds.hash()
    }
}
