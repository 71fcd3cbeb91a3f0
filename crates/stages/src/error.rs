//! What stops a run, in words that say what was being done and to what.

use armcal_config::{ConfigError, Pipeline};
use armcal_core::Code;

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum RunError {
    /// The pipeline, or another text that people write.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file of the pipeline is not there, and the pipeline says where its data come from.
    #[error("{source}; the pipeline's data: {data}")]
    MissingData { source: Box<RunError>, data: String },
    /// A recording without a message.
    #[error(
        "recording `{recording}` holds no message: there is nothing to calibrate with; was anything recorded?"
    )]
    NoMessages { recording: String },
    /// A recording that is not what the pipeline relies on.
    #[error("recording `{recording}`: {problem}")]
    InRecording { recording: String, problem: String },
    /// A trial that whoever asked for it ended.
    #[error("nothing more could come of this trial")]
    GivenUp,
    /// No dwell became an observation.
    #[error("none of the {dwells} dwells became an observation; {hint}")]
    NoObservations { dwells: usize, hint: String },
    /// Reading a recording.
    #[error("recording `{recording}`: {source}")]
    Recording { recording: String, source: armcal_recording::RecordingError },
    /// Finding dwells.
    #[error("recording `{recording}`: {source}")]
    Dwell { recording: String, source: armcal_dwell::DwellError },
    /// The same readings in two recordings of a pipeline.
    #[error(
        "recordings `{first}` and `{second}` hold the same readings at the same times, {overlap_s:.1} s of them: counted \
         twice they would make the result look surer than it is; remove one of them from [[recordings]], or cut what both hold \
         out of one"
    )]
    RecordedTwice {
        first: String,
        second: String,
        /// How long they are alike [s].
        overlap_s: f64,
    },
    /// Associating dwells to cavities.
    #[error("recording `{recording}`: {source}")]
    Association { recording: String, source: armcal_table::TableError },
    /// A measurement that no dwell was.
    #[error("[[measure]] `{name}`: {problem}")]
    Measure { name: String, problem: String },
    /// Joined tips that cannot be calibrated against each other.
    #[error("joined tips: {problem}")]
    TwoArms { problem: String },
    /// The board file.
    #[error(transparent)]
    Board(#[from] armcal_table::TableError),
    /// The model.
    #[error(transparent)]
    Model(#[from] armcal_model::ModelError),
    /// The fit.
    #[error(transparent)]
    Calibrate(#[from] armcal_calibrate::CalibrateError),
    /// Looking for the missing effect.
    #[error(transparent)]
    Diagnose(#[from] armcal_diagnose::DiagnoseError),
    /// Nothing can be calibrated, and a mistake of the setup explains it.
    #[error("{mistakes} (as it is: {source})")]
    Setup { source: Box<RunError>, mistakes: String },
    /// A fit whose parameters follow anything says nothing of what is missing.
    #[error("what is missing cannot be looked for: {why}")]
    TooFewDwells { why: String },
    /// A mistake of the setup stands before any diagnosis.
    #[error(
        "the setup of `{pipeline}` contradicts the data, so no physical effect is looked for [{code}]: {message}"
    )]
    SetupFirst { pipeline: String, code: Code, message: String },
}

/// Makes the errors of the steps of a run those of what leans on runs, by way of its `From<RunError>`.
#[macro_export]
macro_rules! stopped_as_run {
    ($error:ident: $($source:ty),+ $(,)?) => {$(
        impl From<$source> for $error {
            fn from(source: $source) -> Self {
                $crate::RunError::from(source).into()
            }
        }
    )+};
}

impl RunError {
    /// The same about a file that is not there, with what the pipeline says about where its data come from.
    pub fn where_data_come_from(self, pipeline: &Pipeline) -> RunError {
        match &pipeline.data {
            Some(data) if self.is_missing_file() => {
                RunError::MissingData { source: Box::new(self), data: data.clone() }
            }
            _ => self,
        }
    }

    /// Whether it is about a file of the pipeline that is not there.
    fn is_missing_file(&self) -> bool {
        let missing = |source: &std::io::Error| source.kind() == std::io::ErrorKind::NotFound;
        match self {
            RunError::Config(ConfigError::ReadFile { source, .. }) => missing(source),
            RunError::Recording { source: armcal_recording::RecordingError::Open { source, .. }, .. } => {
                missing(source)
            }
            _ => false,
        }
    }
}
