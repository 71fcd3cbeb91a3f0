//! Which files are one recording: bag folders, globs, the parts of a split bag.

use crate::error::InitError;
use armcal_config::{ConfigError, Manifest, RecordingEntry, recordings_below};
use armcal_recording::{Recording, is_recording, is_table, is_url, without_ending};
use armcal_stages::RunError;
use std::collections::BTreeSet;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Parts of a split recording follow each other within this time.
const NEXT_PART_NS: i64 = 5_000_000_000;

/// A recording that was opened, and its place in the pipeline.
pub struct Opened {
    /// Name and paths.
    pub entry: RecordingEntry,
    /// The recording.
    pub recording: Recording,
}

/// Opens what the user named: files, globs, folders. Files of one rosbag2 folder are one recording, and so are
/// `NAME_0.mcap`, `NAME_1.mcap`, .. (or `.db3`) of a folder that follow each other in time.
pub fn open_all(inputs: &[String], out: &Path) -> Result<Vec<Opened>, InitError> {
    inputs.iter().try_for_each(|input| refuse_non_recording(Path::new(input)))?;
    let entries = Manifest::of(inputs, out)?.entries;
    let opened = entries.into_iter().map(open_entry).collect::<Result<Vec<Opened>, InitError>>()?;
    let mut whole: Vec<Vec<Opened>> = Vec::new();
    for next in opened {
        match whole.last_mut() {
            Some(parts) if parts.last().is_some_and(|before| is_continuation(before, &next)) => {
                parts.push(next)
            }
            _ => whole.push(vec![next]),
        }
    }
    let joined = |mut parts: Vec<Opened>| match parts.len() {
        1 => parts.pop().map(Ok),
        _ => {
            let paths: Vec<PathBuf> = parts.iter().flat_map(|part| part.entry.paths.clone()).collect();
            let name = paths.first().and_then(|path| split_part_number(path)).map(|(name, _)| name);
            // Opened once more, however many they are.
            parts.pop().map(|last| open_entry(RecordingEntry { name, paths, ..last.entry }))
        }
    };
    join_halves(whole.into_iter().filter_map(joined).collect::<Result<_, InitError>>()?)
}

/// Files that hold the joints, and as many others that hold what a sensor saw meanwhile, are the halves of as many recordings, made
/// on two computers; in the order of their times.
fn join_halves(whole: Vec<Opened>) -> Result<Vec<Opened>, InitError> {
    let has_joints = |o: &Opened| {
        o.recording.report().channels.iter().any(|c| c.messages > 0 && c.decodable.as_deref() == Ok("joints"))
    };
    let topics = |of: &[&Opened]| -> BTreeSet<String> {
        let used = of.iter().flat_map(|o| o.recording.report().channels.iter()).filter(|c| c.messages > 0);
        used.map(|c| c.topic.clone()).collect()
    };
    let begins = |o: &&Opened| used_span_ns(&o.recording).map_or(i64::MAX, |(first, _)| first);
    let (mut robots, mut sensors): (Vec<&Opened>, Vec<&Opened>) = whole.iter().partition(|o| has_joints(o));
    if robots.len() != sensors.len() || !topics(&robots).is_disjoint(&topics(&sensors)) {
        return Ok(whole);
    }
    robots.sort_by_key(begins);
    sensors.sort_by_key(begins);
    let pair = |(robot, sensor): (&&Opened, &&Opened)| {
        let paths = [&robot.entry.paths[..], &sensor.entry.paths].concat();
        open_entry(RecordingEntry { paths, ..robot.entry.clone() })
    };
    robots.iter().zip(&sensors).map(pair).collect()
}

/// First and last log time of a message.
fn used_span_ns(recording: &Recording) -> Option<(i64, i64)> {
    let used = recording.report().channels.iter().filter(|c| c.messages > 0);
    let bounds = used.map(|c| (c.first_ns, c.last_ns));
    bounds.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
}

fn open_entry(entry: RecordingEntry) -> Result<Opened, InitError> {
    let failed = |source| RunError::Recording { recording: entry.name(), source };
    let recording = Recording::open(&entry.paths).map_err(failed)?;
    Ok(Opened { entry, recording })
}

/// Whether a recording begins where the one before was split.
fn is_continuation(before: &Opened, next: &Opened) -> bool {
    let [last, first] =
        [before.entry.paths.last(), next.entry.paths.first()].map(|p| p.and_then(|p| split_part_number(p)));
    let in_order = last.zip(first).is_some_and(|((a, i), (b, j))| a == b && i + 1 == j);
    if !in_order || before.entry.paths[0].parent() != next.entry.paths[0].parent() {
        return false;
    }
    let spans = used_span_ns(&before.recording).zip(used_span_ns(&next.recording));
    spans.is_some_and(|((_, end), (start, _))| start.abs_diff(end) < NEXT_PART_NS as u64)
}

/// `NAME_3.mcap` is part 3 of `NAME`.
fn split_part_number(path: &Path) -> Option<(String, u64)> {
    let stem = without_ending(path);
    let stem = stem.file_name()?.to_str()?;
    let (name, number) = stem.rsplit_once('_')?;
    Some((name.to_owned(), number.parse().ok()?))
}

/// What is no recording is told for what it is, with the way to one.
fn refuse_non_recording(path: &Path) -> Result<(), InitError> {
    let refused = |why: String| Err(ConfigError::Recordings { what: path.display().to_string(), why }.into());
    if is_url(path) {
        return Ok(());
    }
    if path.is_dir() && recordings_below(path).is_empty() {
        let why = "is a folder without any recording or bag; for deeper ones give a pattern such as 'lab/**/*.mcap' or 'lab/**/*.db3'";
        return refused(why.to_owned());
    }
    if !path.is_file() {
        return Ok(());
    }
    let read = |source| ConfigError::ReadFile { what: "recording", path: path.to_owned(), source };
    let (mut head, mut file) = (Vec::new(), armcal_recording::input::open(path).map_err(read)?);
    file.by_ref().take(16).read_to_end(&mut head).map_err(read)?;
    let (what, ending) = match head.as_slice() {
        b if b.starts_with(b"\x89MCAP") => ("a recording (MCAP)", ".mcap"),
        b if b.starts_with(b"SQLite format 3\0") => ("a database (SQLite)", ".db3"),
        [0x28, 0xb5, 0x2f, 0xfd, ..] => ("compressed (zstd)", ".mcap.zstd or .db3.zstd"),
        b if b.starts_with(b"#ROSBAG") => ("a ROS 1 bag", ".bag"),
        [] => {
            return refused(
                "is empty: nothing was recorded, or the recorder was ended before it wrote".into(),
            );
        }
        _ if path.file_name().is_some_and(|name| name == "metadata.yaml") => {
            return refused("is the description of a bag: give the folder that it is in".into());
        }
        b if b.trim_ascii_start().starts_with(b"<") => {
            return refused("is XML and no recording: a URDF is given with --urdf".into());
        }
        _ if is_table(path) => return Ok(()),
        _ => {
            return refused("is no MCAP recording, no bag, and no table (.csv, .tsv, .parquet, .npz)".into());
        }
    };
    match is_recording(path) {
        true => Ok(()),
        false => refused(format!("is {what} whose name does not end in {ending}: rename it")),
    }
}
