//! What can go wrong with a recording, in words that say what to do next.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Why a recording could not be opened, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum RecordingError {
    /// No path was given.
    #[error("a recording needs at least one file, none was given")]
    NoFiles,
    /// A path was given twice.
    #[error("{} is listed twice in one recording: list each split file once", path.display())]
    ListedTwice { path: PathBuf },
    /// A file could not be opened or mapped.
    #[error("cannot open recording {}: {source}", path.display())]
    Open { path: PathBuf, source: std::io::Error },
    /// A file could not be read on.
    #[error("cannot read recording {}: {source}; was it shortened meanwhile?", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    /// An object cannot be reached or read.
    #[error("cannot read {url}: {why}")]
    Object { url: String, why: String },
    /// A file without a usable summary cannot be copied to where it can be searched.
    #[error(
        "{} has no usable summary and must be copied to be searched, but its {bytes} bytes cannot be written to {}: \
         {source}; set TMPDIR to a folder with enough room",
        path.display(),
        std::env::temp_dir().display()
    )]
    Spool {
        path: PathBuf,
        /// Size [bytes].
        bytes: u64,
        source: std::io::Error,
    },
    /// The messages of another format cannot be copied to where they can be read.
    #[error(
        "the messages of {} cannot be copied to {}: {source}; set TMPDIR to a folder with enough room",
        path.display(),
        std::env::temp_dir().display()
    )]
    Copy { path: PathBuf, source: std::io::Error },
    /// A recording in another format cannot be read.
    #[error("cannot read {}: {why}", path.display())]
    Foreign { path: PathBuf, why: String },
    /// What is compressed in a recording inflates to more than its size allows for.
    #[error("{} is not read on: {limit}; set it to more where the recording is sound", path.display())]
    Inflates { path: PathBuf, limit: String },
    /// Two files of one recording are the same part of it.
    #[error("{} and {} are one part in two forms: name one of them", path.display(), other.display())]
    TwoForms { path: PathBuf, other: PathBuf },
    /// A file is not an MCAP file.
    #[error("{} is not an MCAP recording: {why}", path.display())]
    NotMcap { path: PathBuf, why: String },
    /// A stream names a topic that no file has.
    #[error(
        "stream `{role}`: no topic {topic:?} in the recording{}; present: {}",
        did_you_mean(nearest),
        list(present)
    )]
    TopicMissing { role: &'static str, topic: String, nearest: Option<String>, present: Vec<String> },
    /// No channel matches a topic asked for by name or pattern.
    #[error("no topic {pattern:?} in the recording{}; present: {}", did_you_mean(nearest), list(present))]
    NoSuchTopic { pattern: String, nearest: Option<String>, present: Vec<String> },
    /// No channel of the topic can be read in the role.
    #[error("stream `{role}`: topic {topic:?} cannot be read: {why}")]
    NotDecodable { role: &'static str, topic: String, why: String },
    /// Several joint streams that cannot be read as one.
    #[error("the joint streams {what}; record them together, and stamp all by one clock")]
    NotTogether { what: String },
    /// The topic exists, but no usable row came out of it.
    #[error("stream `{role}`: topic {topic:?} has {messages} messages, but no usable row: {why}")]
    NoRows { role: &'static str, topic: String, messages: u64, why: String },
    /// No message names the wanted joint.
    #[error(
        "stream `joints`: topic {topic:?} has no joint {joint:?}{}; present: {}",
        did_you_mean(nearest),
        list(present)
    )]
    JointMissing { topic: String, joint: String, nearest: Option<String>, present: Vec<String> },
    /// The wanted body is not in the stream, or several are and none was chosen.
    #[error("stream `{role}`: topic {topic:?} {why}{}; present: {}", did_you_mean(nearest), list(present))]
    Body { role: &'static str, topic: String, why: String, nearest: Option<String>, present: Vec<String> },
    /// The numbers of a stream cannot be in the declared unit.
    #[error("stream `{role}`: topic {topic:?}: {why}")]
    WrongUnit {
        role: &'static str,
        topic: String,
        /// The unit that they look like, as the configuration spells it, where there is one.
        likely: Option<&'static str>,
        why: String,
    },
    /// A clock was asked for that the stream does not have.
    #[error("stream `{role}`: topic {topic:?} cannot use clock = \"{clock}\": {why}")]
    NoClock { role: &'static str, topic: String, clock: &'static str, why: String },
    /// The configuration of the streams contradicts itself.
    #[error("configuration of stream `{role}`: {why}")]
    Config { role: &'static str, why: String },
    /// A file could not be written.
    #[error("cannot write {}: {why}; nothing was left behind", path.display())]
    Write { path: PathBuf, why: String },
    /// A folder for results cannot be made.
    #[error("making the folder {}: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// An output that is no file of this machine.
    #[error(
        "cannot write to {}: results are written to files of this machine only; choose a folder or file here, and copy it there \
         when it is done",
        path.display()
    )]
    NoFile { path: PathBuf },
    /// An output would replace an input.
    #[error(
        "{} is an input of this command (read as {}), and no input is ever written over: choose another output",
        path.display(),
        input.display()
    )]
    IsInput { path: PathBuf, input: PathBuf },
    /// An output would replace what armcal did not make, or made for something else.
    #[error(
        "{} is there and {what}, so it is not written over: choose another output, or move it away",
        path.display()
    )]
    NotOurs { path: PathBuf, what: String },
    /// A callback of [`crate::Recording::for_each_raw`] stopped the pass.
    #[error("{0}")]
    Stopped(String),
}

/// Says that a copy cannot be written.
pub(crate) fn no_room(path: &Path) -> impl Fn(std::io::Error) -> RecordingError {
    move |source| RecordingError::Copy { path: path.to_owned(), source }
}

/// ` (did you mean "x"?)`, or nothing.
pub(crate) fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |n| format!(" (did you mean {n:?}?)"))
}

/// At most twenty names, quoted.
fn list(names: &[String]) -> String {
    const SHOWN: usize = 20;
    if names.is_empty() {
        return "none".to_owned();
    }
    let mut text =
        names.iter().take(SHOWN).map(|n| format!("{:?}", shortened(n))).collect::<Vec<_>>().join(", ");
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}

/// Longest text from a recording that is shown or searched whole [characters]; names are far shorter.
const LONGEST: usize = 200;

/// A text from a recording as it is shown: cut, with its length, where it would fill screens.
pub fn shortened(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(LONGEST) {
        None => Cow::Borrowed(text),
        Some((end, _)) => Cow::Owned(format!("{}... ({} bytes)", &text[..end], text.len())),
    }
}

/// The candidate most like `wanted`, when one is like it at all.
pub fn nearest_name<S: AsRef<str>>(wanted: &str, candidates: impl IntoIterator<Item = S>) -> Option<String> {
    let lower = wanted.to_lowercase();
    let candidates: Vec<S> = candidates.into_iter().collect();
    candidates
        .iter()
        .map(S::as_ref)
        // Likeness takes time and memory in proportion to both lengths.
        .filter(|c| c.len() <= LONGEST)
        .map(|c| (name_similarity(&lower, &c.to_lowercase()), c))
        .filter(|(likeness, _)| *likeness > 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(a.1)))
        .map(|(_, c)| c.to_owned())
}

/// Common beginnings count (Jaro-Winkler), and so do few edits with transpositions (Damerau-Levenshtein).
fn name_similarity(a: &str, b: &str) -> f64 {
    strsim::jaro_winkler(a, b).max(strsim::normalized_damerau_levenshtein(a, b))
}
