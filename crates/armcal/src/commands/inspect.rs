//! `armcal inspect`: what is in a recording, and what a pipeline would use of it.

use super::{Outcome, print};
use crate::error::Error;
use armcal_config::{Pipeline, recording_name};
use armcal_core::Severity;
use armcal_core::printable_name;
use armcal_recording::{ChannelReport, FileReport, Recording, RecordingReport, StreamReport, shortened};
use armcal_report::RULED;
use armcal_stages::{RunError, Silent, preprocess};
use comfy_table::Table;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Channels shown in a table.
const SHOWN: usize = 500;

/// Inspects MCAP files as the parts of one recording, or every recording of a pipeline.
pub fn run(inputs: &[PathBuf], json: bool) -> Result<Outcome, Error> {
    let reports = match inputs {
        [only] if only.extension().is_some_and(|e| e == "toml") => of_pipeline(only)?,
        files => {
            let failed = |source| RunError::Recording { recording: "the files given".to_owned(), source };
            let recording = Recording::open(files).map_err(failed)?;
            vec![(recording_name(None, files), recording.into_report().map_err(failed)?)]
        }
    };
    if json {
        let named: Vec<Named<'_>> = reports.iter().map(|(name, report)| Named { name, report }).collect();
        crate::stdout::print_json(&named)?;
    } else {
        for (name, report) in &reports {
            print(&report_text(name, report))?;
        }
    }
    let empty = |(_, report): &&(String, RecordingReport)| {
        report.warnings.iter().all(|w| w.severity < Severity::DataLost)
            && report.channels.iter().all(|channel| channel.messages == 0)
    };
    if let Some((name, _)) = reports.iter().find(empty) {
        return Err(RunError::NoMessages { recording: name.clone() }.into());
    }
    let lost = reports.iter().flat_map(|(_, r)| &r.warnings).any(|w| w.severity >= Severity::Inadequate);
    Ok(if lost { Outcome::CompletedWithWarnings } else { Outcome::Done })
}

/// One recording in the JSON.
#[derive(serde::Serialize)]
struct Named<'a> {
    name: &'a str,
    report: &'a RecordingReport,
}

fn of_pipeline(path: &Path) -> Result<Vec<(String, RecordingReport)>, Error> {
    let pipeline = Pipeline::load(path)?;
    let recordings = preprocess::open_all(&pipeline, &Silent)?;
    let entries = pipeline.recordings.iter().zip(&recordings);
    entries
        .map(|(entry, recording)| {
            let name = entry.name();
            let read = recording.read(&pipeline.streams);
            let (_, streams, warnings) =
                read.map_err(|source| RunError::Recording { recording: name.clone(), source })?;
            let failed = |source| RunError::Recording { recording: name.clone(), source };
            let mut report = recording.whole_report().map_err(failed)?.clone();
            report.streams = streams;
            report.warnings.extend(warnings);
            Ok((name, report))
        })
        .collect()
}

fn report_text(name: &str, report: &RecordingReport) -> String {
    let mut out = format!("Recording {name}\n");
    for file in &report.files {
        let _ = writeln!(out, "  {}", file_line(file));
    }
    let _ = writeln!(out, "{}", channel_table(&report.channels));
    if let Some(more) = report.channels.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        let _ = writeln!(out, "  and {more} more channels; --json lists them");
    }
    if !report.streams.is_empty() {
        let _ = writeln!(out, "{}", stream_table(&report.streams));
        for stream in &report.streams {
            let _ =
                writeln!(out, "  {}: {} clock, {}", stream.role, stream.clock.word(), stream.clock_reason);
        }
    }
    for warning in &report.warnings {
        let _ = writeln!(out, "  warning: {}", printable_name(&warning.to_string()));
    }
    out.push('\n');
    out
}

fn file_line(file: &FileReport) -> String {
    let found = match file.source {
        armcal_recording::Source::Index => "index",
        armcal_recording::Source::Scan => "scan",
    };
    let mut line = format!(
        "{}: {:.2} MB, {} chunks by {found}, profile {:?}, library {:?}, {}",
        file.path.display(),
        file.bytes as f64 / 1e6,
        file.chunks,
        shortened(&file.profile),
        shortened(&file.library),
        file.identity,
    );
    if let Some(fetched) = file.fetched {
        let _ = write!(line, ", {:.2} MB read by {} requests", fetched.bytes as f64 / 1e6, fetched.requests);
    }
    if let Some(byte) = file.truncated_at {
        let _ = write!(line, ", cut off at byte {byte}");
    }
    for (offset, reason) in &file.damaged {
        let _ = write!(line, "\n    damaged at byte {offset}: {}", printable_name(reason));
    }
    line
}

fn channel_table(channels: &[ChannelReport]) -> Table {
    let mut table = Table::new();
    table.load_style(RULED);
    table.set_header(["topic", "schema", "encoding", "messages", "Hz", "from [s]", "for [s]", "read as"]);
    let start_ns = channels.iter().filter(|c| c.messages > 0).map(|c| c.first_ns).min().unwrap_or(0);
    for c in channels.iter().take(SHOWN) {
        let duration_s = (c.last_ns - c.first_ns) as f64 * 1e-9;
        let rate_hz = if duration_s > 0.0 { (c.messages.saturating_sub(1)) as f64 / duration_s } else { 0.0 };
        table.add_row([
            printable_name(&shortened(&c.topic)),
            printable_name(&shortened(&c.schema)),
            printable_name(&shortened(&format!("{}/{}", c.schema_encoding, c.message_encoding))),
            c.messages.to_string(),
            format!("{rate_hz:.1}"),
            format!("{:.2}", (c.first_ns - start_ns) as f64 * 1e-9),
            format!("{duration_s:.2}"),
            match &c.decodable {
                Ok(role) => (*role).to_owned(),
                Err(why) => format!("no: {}", printable_name(&shortened(why))),
            },
        ]);
    }
    table
}

fn stream_table(streams: &[StreamReport]) -> Table {
    let mut table = Table::new();
    table.load_style(RULED);
    table.set_header([
        "stream",
        "topic",
        "rows",
        "Hz",
        "gap [s]",
        "occluded",
        "NaN",
        "same stamp",
        "backward",
        "bad",
    ]);
    for s in streams {
        table.add_row([
            s.role.clone(),
            printable_name(&shortened(&s.topic)),
            format!("{}/{}", s.rows, s.messages),
            format!("{:.1}", s.rate_hz),
            format!("{:.3}", s.largest_gap_s),
            s.occluded.total().to_string(),
            s.non_finite.to_string(),
            s.duplicate_stamps.to_string(),
            s.backward_stamps.to_string(),
            s.undecodable.to_string(),
        ]);
    }
    table
}
