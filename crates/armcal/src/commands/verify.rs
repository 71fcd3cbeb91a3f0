//! `armcal verify`: a calibrated model on recordings it never saw.

use super::{Outcome, may_write, print, terminal_style};
use crate::error::Error;
use crate::progress::Progress;
use armcal_config::Pipeline;
use armcal_held_out::verify;
use armcal_recording::{atomic, make_folder};
use armcal_report::{verification_files, verification_json, verification_paths, verification_text};
use armcal_result::Status;
use std::path::Path;

/// Verifies a result, prints the tables (or JSON), and writes files where a folder is given.
pub fn run(result: &Path, pipeline: &Path, out: Option<&Path>, json: bool) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load(pipeline)?;
    may_write(out.map(verification_paths).into_iter().flatten())?;
    let progress = Progress::new();
    let verification = verify(result, &pipeline, &progress)?;
    let files = out.map(|_| verification_files(&verification)).transpose()?;
    progress.finish();
    if let (Some(folder), Some(files)) = (out, files) {
        make_folder(folder).map_err(Error::Output)?;
        files
            .into_iter()
            .try_for_each(|(name, bytes)| atomic::write(&folder.join(name), &bytes))
            .map_err(Error::Output)?;
    }
    if json {
        print(&verification_json(&verification))?;
    } else {
        print(&verification_text(&verification, terminal_style()))?;
    }
    Ok(if verification.status() == Status::Ok { Outcome::Done } else { Outcome::CompletedWithWarnings })
}
