//! `armcal view`: the report, live.

use super::{Outcome, print};
use crate::error::Error;
use crate::progress::Progress;
use crate::view::{Given, Live, serve};
use armcal_recording::input::{Kind, read_to_string};
use armcal_result::SUMMARY;
use std::path::Path;

/// Runs the pipeline behind `input` and serves its report until the user stops it.
pub fn run(input: &Path, port: u16) -> Result<Outcome, Error> {
    let given = Given::by(input)?;
    let path = given.pipeline.clone();
    let progress = Progress::new();
    let live = Live::of(given, &progress)?;
    progress.finish();
    let written = read_to_string(&input.join(SUMMARY), Kind::Data);
    if written.is_ok_and(|text| text != live.summary()) {
        print(&format!(
            "{} holds other results than its pipeline and recordings give now; the page shows what they give now.\n",
            input.display()
        ))?;
    }
    crate::stdout::print_warnings(&armcal_recording::data_loss_warnings());
    serve(live, port, |address| print(&format!("{}\nOpen {address} (Ctrl-C stops it)\n", path.display())))?;
    Ok(Outcome::Done)
}
