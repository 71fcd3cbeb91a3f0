//! `metadata.yaml`, in which rosbag2 counts the messages of a bag beside its files.
//!
//! Format: `rosbag2_storage/metadata.yaml` of ros2/rosbag2, versions 1 to 9. Only counts and names are read from it, of a
//! file that is among those it lists.

use crate::bytes::FileBytes;
use crate::bytes::input;
use crate::bytes::logs::logs_of;
use crate::is_url;
use crate::recording::file::RecordingFile;
use crate::structure::survey::FileSurvey;
use saphyr_parser::{Event, Parser};
use std::collections::BTreeMap;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Its name.
const FILE: &str = "metadata.yaml";
/// A larger one is not read.
const MAX_BYTES: u64 = 16 << 20;
/// What rosbag2 begins with.
const ROOT: &str = "rosbag2_bagfile_information";
/// Endings that compressing a file gives it, which the list may leave out.
const COMPRESSED: [&str; 2] = [".zstd", ".zst"];

/// Why a file disagrees, or the description that cannot be read from the disk.
type Said = Result<String, (PathBuf, io::Error)>;

/// What of a recording disagrees with the descriptions beside it: the file by its number, and why.
pub(crate) fn compare(files: &[RecordingFile], surveys: &[FileSurvey]) -> Vec<(usize, Said)> {
    let mut folders: BTreeMap<PathBuf, Vec<usize>> = BTreeMap::new();
    for (i, file) in files.iter().enumerate().filter(|(_, file)| !is_url(&file.path)) {
        folders.entry(file.path.parent().unwrap_or(Path::new("")).to_owned()).or_default().push(i);
    }
    let mut said = Vec::new();
    for (folder, members) in folders {
        let path = folder.join(FILE);
        let first = members[0];
        let text = match read_description(&path) {
            Ok(Some(text)) => text,
            Ok(None) => continue,
            Err(e) => {
                said.push((first, Err((path, e))));
                continue;
            }
        };
        match Description::parse(&text) {
            Some(description) => {
                let messages = |i: usize| messages_by_topic(&files[i], &surveys[i]);
                let named = members.iter().map(|i| (*i, name_of(&files[*i].path))).collect::<Vec<_>>();
                description.compare(&folder, &named, &messages, &mut said);
            }
            None if text.contains(ROOT) => {
                said.push((
                    first,
                    Ok(format!("{} cannot be read: it is damaged or cut off", path.display())),
                ));
            }
            None => {}
        }
    }
    said
}

/// Files beside a recording that are read with it: the logs of a database, which are part of its identity, and the description
/// of its bag.
pub fn read_with(path: &Path) -> (Vec<PathBuf>, Option<PathBuf>) {
    if is_url(path) {
        return (Vec::new(), None);
    }
    let logs = logs_of(path).into_iter().map(|(_, path)| path);
    let description = path.parent().unwrap_or(Path::new("")).join(FILE);
    let holds =
        |path: &PathBuf| std::fs::metadata(path).is_ok_and(|about| about.is_file() && about.len() > 0);
    (logs.collect(), Some(description).filter(holds))
}

/// The text, where there is a file of that name.
fn read_description(path: &Path) -> io::Result<Option<String>> {
    let about = match std::fs::metadata(path) {
        Ok(about) => about,
        Err(_) => return Ok(None),
    };
    if !about.is_file() || about.len() > MAX_BYTES {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    input::open(path)?.take(MAX_BYTES).read_to_end(&mut bytes)?;
    Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
}

/// Messages by topic; `None` of a file that was not read whole.
fn messages_by_topic(file: &RecordingFile, survey: &FileSurvey) -> Option<BTreeMap<String, u64>> {
    let whole = survey.passed.len() == file.layout.blocks.len();
    let ranged = matches!(file.bytes, FileBytes::Ranged(_));
    if ranged && !whole {
        return None;
    }
    let mut topics = BTreeMap::new();
    for (id, channel) in file.channels() {
        *topics.entry(channel.topic.clone()).or_default() +=
            survey.tallies.get(&id).map_or(0, |t| t.messages);
    }
    Some(topics)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A name without what compressing adds.
fn uncompressed_name(name: &str) -> &str {
    COMPRESSED.into_iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name)
}

/// What a description says.
#[derive(Debug, Default, PartialEq, Eq)]
struct Description {
    messages: Option<u64>,
    /// Names of the files.
    paths: Vec<String>,
    /// Messages by file, where the version has them.
    files: BTreeMap<String, u64>,
    topics: BTreeMap<String, u64>,
}

impl Description {
    /// What it says, which may be nothing; `None` of what is no YAML, or has a count that is none.
    fn parse(text: &str) -> Option<Description> {
        let mut found = Description::default();
        // Where the next scalar is: the keys that lead to it.
        let mut keys: Vec<Option<String>> = Vec::new();
        let (mut path, mut topic, mut count) = (None, None, None);
        for event in Parser::new_from_str(text) {
            match event.ok()?.0 {
                Event::MappingStart(..) => keys.push(None),
                Event::SequenceStart(..) => keys.push(Some("-".to_owned())),
                Event::MappingEnd => {
                    keys.pop();
                    let inside: Vec<&str> = keys.iter().flatten().map(String::as_str).collect();
                    match inside[..] {
                        [ROOT, "files", "-"] => found.files.extend(path.take().zip(count.take())),
                        [ROOT, "topics_with_message_count", "-"] => {
                            if let Some((topic, count)) = topic.take().zip(count.take()) {
                                *found.topics.entry(topic).or_default() += count;
                            }
                        }
                        _ => {}
                    }
                    end_value(&mut keys);
                }
                Event::SequenceEnd => {
                    keys.pop();
                    end_value(&mut keys);
                }
                Event::Alias(_) => end_value(&mut keys),
                Event::Scalar(value, ..) => {
                    if let Some(key @ None) = keys.last_mut() {
                        *key = Some(value.into_owned());
                        continue;
                    }
                    let inside: Vec<&str> = keys.iter().flatten().map(String::as_str).collect();
                    match inside[..] {
                        [ROOT, "message_count"] => found.messages = Some(value.parse().ok()?),
                        [ROOT, "relative_file_paths", "-"] => {
                            found.paths.push(name_of(Path::new(&*value)));
                        }
                        [ROOT, "files", "-", "path"] => path = Some(name_of(Path::new(&*value))),
                        [ROOT, "files" | "topics_with_message_count", "-", "message_count"] => {
                            count = Some(value.parse().ok()?);
                        }
                        [ROOT, "topics_with_message_count", "-", "topic_metadata", "name"] => {
                            topic = Some(value.into_owned());
                        }
                        _ => {}
                    }
                    end_value(&mut keys);
                }
                _ => {}
            }
        }
        Some(found)
    }

    /// Compares with the files of one folder, numbered and named, that are part of a recording.
    fn compare(
        &self,
        folder: &Path,
        members: &[(usize, String)],
        messages: &dyn Fn(usize) -> Option<BTreeMap<String, u64>>,
        said: &mut Vec<(usize, Said)>,
    ) {
        let is = |listed: &str, name: &str| uncompressed_name(listed) == uncompressed_name(name);
        let listed = |name: &str| self.paths.iter().any(|path| is(path, name));
        let own: Vec<&(usize, String)> = members.iter().filter(|(_, name)| listed(name)).collect();
        let Some((first, _)) = own.first() else { return };
        for (file, name) in &own {
            let declared = self.files.iter().find(|(path, _)| is(path, name));
            if let (Some((_, declared)), Some(found)) = (declared, messages(*file)) {
                let found: u64 = found.values().sum();
                if *declared != found {
                    let why =
                        format!("metadata.yaml counts {declared} messages in {name}, {found} are usable");
                    said.push((*file, Ok(why)));
                }
            }
        }
        let there = |path: &&String| own.iter().any(|(_, name)| is(path, name));
        let absent: Vec<&String> = self.paths.iter().filter(|path| !there(path)).collect();
        for path in &absent {
            let endings = [""].into_iter().chain(COMPRESSED);
            if !endings
                .into_iter()
                .any(|ending| folder.join(format!("{}{ending}", uncompressed_name(path))).exists())
            {
                said.push((*first, Ok(format!("metadata.yaml lists {path:?}, which is not there"))));
            }
        }
        // Of a part of the bag alone, the counts of all of it say nothing.
        let all: Option<Vec<_>> = own.iter().map(|(file, _)| messages(*file)).collect();
        let Some(all) = all.filter(|_| absent.is_empty()) else { return };
        let mut topics: BTreeMap<String, u64> = BTreeMap::new();
        for (topic, messages) in all.into_iter().flatten() {
            *topics.entry(topic).or_default() += messages;
        }
        let found: u64 = topics.values().sum();
        if let Some(declared) = self.messages.filter(|declared| *declared != found) {
            said.push((*first, Ok(format!("metadata.yaml counts {declared} messages, {found} are usable"))));
        }
        for (topic, declared) in &self.topics {
            let found = topics.get(topic).copied().unwrap_or(0);
            if *declared != found {
                let why = format!("metadata.yaml counts {declared} messages on {topic}, {found} are usable");
                said.push((*first, Ok(why)));
            }
        }
    }
}

/// A value has ended: what comes next in a mapping is a key.
fn end_value(keys: &mut [Option<String>]) {
    if let Some(key) = keys.last_mut()
        && key.as_deref() != Some("-")
    {
        *key = None;
    }
}
