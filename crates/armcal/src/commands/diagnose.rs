//! `armcal diagnose`: where the model fails, what is missing, what to record next.

use super::{Outcome, print, terminal_style};
use crate::error::Error;
use crate::progress::Progress;
use armcal_config::Pipeline;
use armcal_core::{Code, Severity, Stage, Warning};
use armcal_report::{concluded_text, diagnosis_text, stored_diagnosis, summary_json};
use armcal_result::{Conclusions, Status, StoredRun};
use std::path::Path;

/// Diagnoses a pipeline, or prints the diagnosis of a finished run (`run.mcap` or its folder).
pub fn run(input: &Path, json: bool) -> Result<Outcome, Error> {
    if input.extension().is_none_or(|e| e != "toml") {
        let past = StoredRun::open(input)?;
        if json {
            print(&super::json_text(&past.summary["diagnosis"])?)?;
        } else {
            let concluded = Conclusions::open(input)?;
            print(&concluded.map_or_else(
                || stored_diagnosis(&past, terminal_style()),
                |c| concluded_text(&c, terminal_style()),
            ))?;
        }
        let lost = past.summary["status"] == Status::DataLost.word();
        if lost {
            let why = "recordings of this run lost data; its page and summary.json say which and what";
            let subject = input.display().to_string();
            let lost = Severity::DataLost;
            crate::stdout::print_warnings(&[Warning::new(
                lost,
                Stage::Recording,
                Code::RecordingDamaged,
                subject,
                why,
            )]);
        }
        return Ok(if lost { Outcome::CompletedWithWarnings } else { Outcome::Done });
    }
    let pipeline = Pipeline::load(input)?;
    let progress = Progress::new();
    let (run, _) = armcal_pipeline::run(&pipeline, &progress)?;
    progress.finish();
    if json {
        let summary: serde_json::Value = serde_json::from_str(&summary_json(&run)?).map_err(Error::Json)?;
        print(&super::json_text(&super::with_losses(summary["diagnosis"].clone()))?)?;
    } else {
        print(&diagnosis_text(&run, terminal_style()))?;
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::CompletedWithWarnings })
}
