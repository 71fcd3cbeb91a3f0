//! `run.mcap`: the input's messages untouched, the result channels, attachments and metadata.

use crate::channels::{ResultMessage, result_messages, run_end_ns};
use crate::findings::Findings;
use armcal_recording::atomic::AtomicFile;
use armcal_recording::output::McapOutput;
use armcal_recording::{RawChannel, Recording, RecordingError};
use armcal_result::{INPUT_METADATA, OWN, PREFIX, Point, Run, VERSION};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

/// A result file attached to the recording.
pub(crate) struct Attachment<'a> {
    pub name: &'a str,
    pub media_type: &'a str,
    pub text: &'a str,
}

/// Writes the file, which has no name yet. Attachments carry the time of the last dwell, and nothing
/// carries the time of day: the same run gives the same bytes.
pub(crate) fn write_mcap(
    run: &Run,
    points: &[Point],
    findings: &Findings,
    inputs: &[Recording],
    attachments: &[Attachment],
    path: &Path,
) -> Result<AtomicFile, RecordingError> {
    let about = [("armcal/run", about_run(run)), (INPUT_METADATA, about_input(run))];
    write_results(result_messages(run, points, findings), inputs, attachments, run_end_ns(run), &about, path)
}

/// Writes results beside the messages of their inputs, with attachments stamped `end_ns` and metadata by name.
pub(crate) fn write_results(
    results: Vec<ResultMessage>,
    inputs: &[Recording],
    attachments: &[Attachment],
    end_ns: i64,
    about: &[(&str, BTreeMap<String, String>)],
    path: &Path,
) -> Result<AtomicFile, RecordingError> {
    // Neither `ros2` nor any other profile: those promise one encoding for all channels.
    let mut out = McapOutput::quickly(path, "")?;
    for input in inputs {
        copy_messages(input, &mut out)?;
    }
    put_results(results, &mut out)?;
    for input in inputs {
        copy_extras(input, &mut out)?;
    }
    let end_ns = u64::try_from(end_ns).unwrap_or(0);
    for Attachment { name, media_type, text } in attachments {
        out.attach(&format!("{OWN}{name}"), media_type, end_ns, 0, text.as_bytes())?;
    }
    for (name, entries) in about {
        out.metadata(name, entries)?;
    }
    out.stage()
}

fn copy_messages(input: &Recording, out: &mut McapOutput) -> Result<(), RecordingError> {
    // By the address at which the recording holds it, so that a schema is hashed once and not with every message.
    let mut known: BTreeMap<usize, u16> = BTreeMap::new();
    input.for_each_raw(&mut |message| {
        let channel = message.channel;
        if channel.topic.starts_with(PREFIX) {
            return Ok(());
        }
        let id = match known.entry(std::ptr::from_ref(channel).addr()) {
            Entry::Occupied(id) => *id.get(),
            Entry::Vacant(place) => *place.insert(add_channel(channel, out)?),
        };
        out.put(id, message.sequence, message.log_ns, message.publish_ns, message.data)
    })
}

fn add_channel(channel: &RawChannel, out: &mut McapOutput) -> Result<u16, RecordingError> {
    let schema = channel.schema.as_ref().map(|s| (&*s.name, &*s.encoding, s.data.as_slice()));
    let metadata = channel.metadata.iter().cloned().collect();
    out.add_channel(&channel.topic, schema, &channel.message_encoding, &metadata)
}

/// Attachments and metadata of the input, without those of an earlier run.
fn copy_extras(input: &Recording, out: &mut McapOutput) -> Result<(), RecordingError> {
    input.for_each_attachment(&mut |a| {
        if a.name.starts_with(OWN) {
            return Ok(());
        }
        out.attach(a.name, a.media_type, a.log_ns, a.create_ns, a.data)
    })?;
    input.for_each_metadata(&mut |name, entries| match name.starts_with(OWN) {
        true => Ok(()),
        false => out.metadata(name, entries),
    })
}

fn put_results(results: Vec<ResultMessage>, out: &mut McapOutput) -> Result<(), RecordingError> {
    // By topic: its channel, and how many messages it has.
    let mut channels: BTreeMap<String, (u16, u32)> = BTreeMap::new();
    for m in results {
        let (id, sequence) = match channels.entry(m.topic) {
            Entry::Occupied(channel) => channel.into_mut(),
            Entry::Vacant(place) => {
                let schema = (m.schema.name.as_str(), m.schema.encoding.as_str(), m.schema.data.as_ref());
                let id = out.add_channel(place.key(), Some(schema), &m.message_encoding, &BTreeMap::new())?;
                place.insert((id, 0))
            }
        };
        out.put(*id, *sequence, m.log_ns, m.publish_ns, &m.data)?;
        *sequence += 1;
    }
    Ok(())
}

/// What was run, and the seeds of everything random in it.
fn about_run(run: &Run) -> BTreeMap<String, String> {
    let mut entries = BTreeMap::from([
        ("version".to_owned(), VERSION.to_owned()),
        ("pipeline".to_owned(), run.pipeline_name.clone()),
        ("model".to_owned(), run.model.chain().name().to_owned()),
        ("objective".to_owned(), run.calibration.fit.objective.clone()),
        ("summary_schema".to_owned(), armcal_result::summary::SCHEMA.to_owned()),
    ]);
    if let Ok(pipeline) = run.pipeline_text.parse::<toml::Table>() {
        collect_seeds("", &pipeline, &mut entries);
    }
    entries
}

/// Every key `seed` of the pipeline, by its dotted path.
fn collect_seeds(path: &str, table: &toml::Table, entries: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match value {
            toml::Value::Table(inner) => collect_seeds(&path, inner, entries),
            toml::Value::Integer(seed) if key == "seed" => {
                entries.insert(path, seed.to_string());
            }
            _ => {}
        }
    }
}

/// Names and hashes of the input files.
fn about_input(run: &Run) -> BTreeMap<String, String> {
    let mut entries = BTreeMap::new();
    for (i, recording) in run.recordings.iter().enumerate() {
        entries.insert(format!("recording{i}.name"), recording.name.clone());
        for (j, file) in recording.files().into_iter().enumerate() {
            let prefix = format!("recording{i}.file{j}");
            entries.insert(format!("{prefix}.path"), file.path);
            entries.insert(format!("{prefix}.identity"), file.identity);
            entries.insert(format!("{prefix}.bytes"), file.bytes.to_string());
            if let Some(read) = recording.report.files.get(j) {
                entries.insert(format!("{prefix}.profile"), read.profile.clone());
            }
        }
    }
    entries
}
