//! Results of an earlier run, read back.

mod model;
mod observations;
mod run;

pub use model::{model_of, open_model, visited_intervals};
pub use observations::{
    BoardFacts, OBSERVATIONS_FILE, ObservedRecording, StartFrame, StoredObservations, observations_json,
};
pub(crate) use run::stored_text;
pub use run::{
    REPORT, RUN, SUMMARY, StoredDwell, StoredRecording, StoredResidual, StoredResultError, StoredRun,
    attached_texts,
};
