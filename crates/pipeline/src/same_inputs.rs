//! Whether results are those of a pipeline, without reading its recordings.

use armcal_config::Pipeline;
use armcal_recording::{identity_of, read_with};
use armcal_result::{Conclusions, InputFiles};
use armcal_stages::{RunError, frames};

/// Whether a run of this version that read just these files concluded this: then running them again gives the same. Never of files
/// that are read with others beside them.
///
/// # Errors
/// An input that cannot be read.
pub fn are_same_inputs(pipeline: &Pipeline, concluded: &Conclusions) -> Result<bool, RunError> {
    let (model_texts, _) = frames::nominal_chain(pipeline)?;
    let board = frames::read_board(pipeline)?;
    let mut identities = Vec::new();
    for entry in &pipeline.recordings {
        let paths: Vec<_> = entry.paths.iter().map(|path| pipeline.resolve(path)).collect();
        if entry.points.is_some() || paths.iter().any(|path| read_with(path).1.is_some()) {
            return Ok(false);
        }
        let own: Result<_, _> = paths.iter().map(|path| identity_of(path)).collect();
        identities.push(own.map_err(|source| RunError::Recording { recording: entry.name(), source })?);
    }
    let (pipeline_text, board) = (pipeline.text.as_str(), board.as_ref());
    let inputs = InputFiles { pipeline_text, model_texts: &model_texts, board, identities };
    Ok(concluded.are_of_inputs(&inputs))
}
