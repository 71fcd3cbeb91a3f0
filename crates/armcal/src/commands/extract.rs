//! `armcal extract`: a thin recording of the wanted channels.

use super::{Outcome, json_text, print};
use crate::error::Error;
use armcal_config::Pipeline;
use armcal_core::Severity;
use armcal_core::printable_name;
use armcal_recording::{
    Extract, Extracted, Recording, RecordingError, RecordingReport, extract, files_of, input,
};
use armcal_stages::RunError;
use clap::Args;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What the command is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Recordings (parts of one: .mcap, .db3, also compressed), folders, or s3://BUCKET/KEY.
    #[arg(required = true)]
    pub inputs: Vec<PathBuf>,
    /// File for the thin recording.
    #[arg(long)]
    pub out: PathBuf,
    /// Keep the channels that this pipeline reads.
    #[arg(long, required_unless_present = "topics")]
    pub pipeline: Option<PathBuf>,
    /// Keep this topic; `*` stands for any characters. May be given again.
    #[arg(long = "topic", value_name = "TOPIC")]
    pub topics: Vec<String>,
    /// Keep attachments too.
    #[arg(long)]
    pub attachments: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Writes the thin recording, and says what is in it and what of the input was lost.
pub fn run(asked: &Request) -> Result<Outcome, Error> {
    let mut topics = asked.pipeline.as_deref().map_or(Ok(Vec::new()), topics_of)?;
    topics.extend_from_slice(&asked.topics);
    let name = asked.inputs.first().map(|p| p.display().to_string()).unwrap_or_default();
    files_of(&asked.inputs).iter().for_each(|path| input::register_path(path));
    super::may_write([&asked.out])?;
    let recording = Recording::open(&asked.inputs)
        .map_err(|source| RunError::Recording { recording: name.clone(), source })?;
    let wanted = Extract { topics: &topics, attachments: asked.attachments };
    let extracted = extract(&recording, &wanted, &asked.out);
    let done = extracted.and_then(|extracted| Ok((extracted, recording.whole_report()?)));
    let (extracted, report) = done.map_err(|source| match source {
        RecordingError::NoSuchTopic { ref pattern, .. } if asked.topics.contains(pattern) => {
            Error::of_usage(RunError::Recording { recording: name, source })
        }
        source => RunError::Recording { recording: name, source }.into(),
    })?;
    print(&if asked.json {
        extraction_json(&extracted, report)?
    } else {
        extraction_text(&asked.out, &extracted, report)
    })?;
    let lost = report.warnings.iter().any(|w| w.severity >= Severity::Inadequate);
    Ok(if lost { Outcome::CompletedWithWarnings } else { Outcome::Done })
}

/// The topics that a pipeline reads, as patterns that match nothing else.
fn topics_of(path: &Path) -> Result<Vec<String>, Error> {
    let literal = |topic: &str| glob::Pattern::escape(topic);
    Ok(Pipeline::load(path)?.streams.topics().into_iter().map(literal).collect())
}

fn extraction_text(out: &Path, extracted: &Extracted, report: &RecordingReport) -> String {
    let bytes: u64 = report.files.iter().map(|f| f.bytes).sum();
    let size = std::fs::metadata(out).map(|about| about.len()).unwrap_or(0);
    let mut text = format!("{}: {:.2} of {:.2} MB", out.display(), size as f64 / 1e6, bytes as f64 / 1e6);
    for fetched in report.files.iter().filter_map(|f| f.fetched) {
        let _ = write!(text, ", {:.2} MB read by {} requests", fetched.bytes as f64 / 1e6, fetched.requests);
    }
    text.push('\n');
    for (topic, messages) in &extracted.topics {
        let _ = writeln!(text, "  {}: {messages} messages", printable_name(topic));
    }
    if extracted.attachments > 0 {
        let _ = writeln!(text, "  {} attachments", extracted.attachments);
    }
    for warning in &report.warnings {
        let _ = writeln!(text, "  warning: {warning}");
    }
    text
}

fn extraction_json(extracted: &Extracted, report: &RecordingReport) -> Result<String, Error> {
    let topics: Vec<_> = extracted
        .topics
        .iter()
        .map(|(topic, messages)| serde_json::json!({"topic": topic, "messages": messages}))
        .collect();
    json_text(&serde_json::json!({
        "topics": topics,
        "attachments": extracted.attachments,
        "files": report.files,
        "warnings": report.warnings,
    }))
}
