//! What armcal wrote into a recording, and what of it is left out of the next one.

use crate::{RecordingRun, Run};
use armcal_core::{Code, Severity, Stage, Warning};

/// Beginning of every topic, attachment name and metadata name of armcal's own.
pub const PREFIX: &str = "/armcal/";
/// Beginning of the names of armcal's attachments and metadata records.
pub const OWN: &str = "armcal/";

/// Name of the metadata record with names and hashes of the input files.
pub const INPUT_METADATA: &str = "armcal/input";

/// Messages of the input that are left out because armcal itself wrote them, one warning a recording.
pub fn earlier_results(run: &Run) -> Vec<Warning> {
    let of_recording = |r: &RecordingRun| {
        let own = r.report.channels.iter().filter(|c| c.topic.starts_with(PREFIX));
        let count: u64 = own.map(|c| c.messages).sum();
        (count > 0).then(|| {
            let (messages, are) =
                if count == 1 { ("message", "is a result") } else { ("messages", "are results") };
            let message =
                format!("{count} {messages} under {PREFIX} {are} of an earlier run, left out of run.mcap");
            Warning::new(Severity::Notice, Stage::Output, Code::EarlierResultsLeftOut, &r.name, message)
        })
    };
    run.recordings.iter().filter_map(of_recording).collect()
}
