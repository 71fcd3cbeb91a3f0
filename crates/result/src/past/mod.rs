//! Results of an earlier run, read back.

mod model;
mod observations;
mod run;

pub use model::{model_of, open_model, visited};
pub use observations::{
    BoardFacts, OBSERVATIONS_FILE, ObservedRecording, PastObservations, StartFrame, observations_json,
};
pub use run::{PastDwell, PastRecording, PastResidual, PastRun, PastRunError, RUN, SUMMARY};
pub(crate) use run::{attachment, past_text, run_file};
