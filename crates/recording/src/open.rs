//! A recording: one or more files, opened, laid out, and reported on.

use crate::bytes::{Access, FileBytes};
use crate::foreign::names::{files_of, is_recording, without_ending};
use crate::foreign::{self, Converted};
use crate::index::{self, Found};
use crate::layout::{Damage, Layout};
use crate::raw::{Attachment, RawChannel, RawSchema, parse_metadata};
use crate::records::ENVELOPE;
use crate::sweep::{At, BlockSurvey, FileSurvey, Tally, sweep};
use crate::{
    ChannelReport, Fetched, FileReport, ObjectIdentity, RecordingError, RecordingReport, Source, decode,
};
use armcal_core::{Severity, Stage, Warning};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Places of damage told one by one; of more, only how many there are: a file can hold millions.
const DAMAGE_TOLD: usize = 50;

/// An opened recording, which may consist of several split files.
pub struct Recording {
    pub(crate) files: Vec<RecordingFile>,
    /// What the passes made so far have found in each file.
    surveys: Mutex<Vec<FileSurvey>>,
    report: OnceLock<RecordingReport>,
}

/// One file of a recording.
pub(crate) struct RecordingFile {
    pub path: PathBuf,
    pub bytes: FileBytes,
    /// Set where `bytes` are a copy.
    copied: Option<Copied>,
    pub layout: Layout,
    pub channels: BTreeMap<u16, Arc<RawChannel>>,
}

/// Channels that were not read whole.
enum Unread {
    All,
    Some(BTreeSet<u16>),
}

impl Unread {
    fn has(&self, channel: u16) -> bool {
        match self {
            Unread::All => true,
            Unread::Some(ids) => ids.contains(&channel),
        }
    }
}

/// What `bytes` are a copy of.
enum Copied {
    /// Of all bytes of the file.
    Whole {
        fetched: Fetched,
        object: Option<ObjectIdentity>,
        /// Why the whole file was needed.
        why: &'static str,
    },
    /// Of the messages of a file in another format.
    Messages {
        original: FileBytes,
        /// What of it could not be used.
        damage: Vec<Damage>,
    },
}

impl Recording {
    /// Opens the files of one recording, in any order: paths, or URLs such as `s3://bucket/key` (feature `s3`). Local
    /// files are mapped, unless the environment variable `ARMCAL_NO_MMAP` is set: see [`Access`].
    ///
    /// # Errors
    /// As [`Recording::open_with`].
    pub fn open(paths: &[PathBuf]) -> Result<Recording, RecordingError> {
        Recording::open_with(paths, Access::from_env())
    }

    /// Opens the files of one recording; a folder stands for the recordings in it. Their structure is found without
    /// inflating anything, unless a file has no sound summary. Objects, and local files with [`Access::Ranges`], are read by ranges: the summary first, later
    /// only chunks with a wanted channel. One without a sound summary is copied whole to an unnamed file in the folder
    /// for temporary files, and read from there; so are the messages of a rosbag2 database and of a file that is compressed
    /// as a whole.
    ///
    /// # Errors
    /// No paths, a path listed twice, a file that cannot be opened or is no recording, an object that is not there or cannot
    /// be reached. A damaged MCAP file is no error: see [`RecordingReport::warnings`].
    pub fn open_with(paths: &[PathBuf], access: Access) -> Result<Recording, RecordingError> {
        if paths.is_empty() {
            return Err(RecordingError::NoFiles);
        }
        let paths = &files_of(paths);
        refuse_repeated(paths)?;
        let open = |path: &PathBuf| RecordingFile::open(path, access);
        let mut files = paths.par_iter().map(open).collect::<Result<Vec<_>, _>>()?;
        files.sort_by_key(|f| f.layout.first_ns.unwrap_or(u64::MAX));
        let surveys = Mutex::new(vec![FileSurvey::default(); files.len()]);
        let mut recording = Recording { files, surveys, report: OnceLock::new() };
        recording.complete_definitions()?;
        Ok(recording)
    }

    /// Leaves the identity of the files out of the passes over them: whoever does not ask for the report need not pay for it.
    pub fn without_identity(mut self) -> Recording {
        for file in &mut self.files {
            if let FileBytes::Mapped(map) = &mut file.bytes {
                map.hashed = None;
            }
        }
        self
    }

    /// Files, channels and warnings about them; streams are empty until [`Recording::read`] has named them. The
    /// first call makes a pass over mapped files unless `read` has already made one, and hashes local files. Of files
    /// read by ranges it tells what has been read until then.
    pub fn report(&self) -> &RecordingReport {
        self.report.get_or_init(|| {
            let unread = self.unread();
            // Only fetching can fail, and of mapped files nothing is fetched.
            if let Ok((found, _)) = sweep(&self.files, &unread, |_| (), |(), _, _| ()) {
                self.remember(found);
            }
            let hashes: Vec<_> = self.files.par_iter().map(RecordingFile::identity).collect();
            let surveys = self.surveys();
            let damage = |(file, hash): (&RecordingFile, &Result<String, RecordingError>), survey| {
                let mut damage = file.damage(survey);
                damage.extend(hash.as_ref().err().map(|e| Damage {
                    offset: 0,
                    why: format!("its bytes cannot be hashed: {e}"),
                    lost: true,
                }));
                damage
            };
            let per_file = || self.files.iter().zip(&hashes).zip(surveys.iter());
            let damage: Vec<Vec<Damage>> = per_file().map(|(file, survey)| damage(file, survey)).collect();
            RecordingReport {
                files: per_file()
                    .zip(&damage)
                    .map(|(((f, hash), _), damage)| f.report(hash, damage))
                    .collect(),
                channels: self.channel_reports(&surveys),
                streams: Vec::new(),
                warnings: self.files.iter().zip(damage).flat_map(|(f, damage)| f.warnings(damage)).collect(),
            }
        })
    }

    /// Keeps what a pass found, so that the report needs no pass of its own.
    pub(crate) fn remember(&self, found: Vec<BlockSurvey>) {
        let mut surveys = self.surveys();
        for (at, survey) in found {
            surveys[at.file].add(at.block, survey);
        }
    }

    fn surveys(&self) -> MutexGuard<'_, Vec<FileSurvey>> {
        // Whoever panicked while holding it has at worst left a block out, which another pass finds.
        self.surveys.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Blocks of mapped files that no pass has seen.
    fn unread(&self) -> Vec<At> {
        let surveys = self.surveys();
        let of_file = |((file, f), survey): ((usize, &RecordingFile), &FileSurvey)| {
            let all = if let FileBytes::Mapped(_) = f.bytes { f.layout.blocks.len() } else { 0 };
            let unread = (0..all).filter(|block| !survey.passed.contains(block));
            unread.map(|block| At { file, block }).collect::<Vec<_>>()
        };
        self.files.iter().enumerate().zip(surveys.iter()).flat_map(of_file).collect()
    }

    /// Looks into the chunks for definitions where no summary repeats them all.
    fn complete_definitions(&mut self) -> Result<(), RecordingError> {
        if self.files.iter().any(|f| !f.layout.definitions_complete) {
            let (found, _) = sweep(&self.files, &self.unread(), |_| (), |(), _, _| ())?;
            self.remember(found);
            let surveys = self.surveys.get_mut().unwrap_or_else(PoisonError::into_inner);
            for (file, survey) in self.files.iter_mut().zip(surveys) {
                file.layout.definitions.merge(std::mem::take(&mut survey.definitions));
                let first = survey.tallies.values().map(|t| t.first_ns).min();
                file.layout.first_ns = first.or(file.layout.first_ns);
            }
        }
        for file in &mut self.files {
            file.channels = file.layout.definitions.resolve();
        }
        Ok(())
    }

    fn channel_reports(&self, surveys: &[FileSurvey]) -> Vec<ChannelReport> {
        type Key = (String, String, String, String);
        let mut merged: BTreeMap<Key, (Option<Tally>, Arc<RawChannel>)> = BTreeMap::new();
        for (file, survey) in self.files.iter().zip(surveys) {
            let unread = file.unread(survey);
            for (id, channel) in &file.channels {
                let (schema, encoding) = channel
                    .schema
                    .as_ref()
                    .map_or_else(Default::default, |s| (s.name.clone(), s.encoding.clone()));
                let key = (channel.topic.clone(), schema, encoding, channel.message_encoding.clone());
                let (tally, _) = merged.entry(key).or_insert_with(|| (None, channel.clone()));
                if let Some(found) = file.tally(survey, &unread, *id) {
                    tally.get_or_insert(Tally { messages: 0, ..found }).add(found);
                }
            }
        }
        // Thousands of channels may share one schema, which is compiled once.
        let mut known: BTreeMap<Compiled, Result<String, String>> = BTreeMap::new();
        let report = |(key, (tally, channel)): (Key, (Option<Tally>, Arc<RawChannel>))| {
            let tally = tally.unwrap_or(Tally { messages: 0, first_ns: 0, last_ns: 0 });
            ChannelReport {
                topic: key.0,
                schema: key.1,
                schema_encoding: key.2,
                message_encoding: key.3,
                messages: tally.messages,
                first_ns: ns(tally.first_ns),
                last_ns: ns(tally.last_ns),
                decodable: known.entry(compiled(&channel)).or_insert_with(|| readable_as(&channel)).clone(),
            }
        };
        merged.into_iter().map(report).collect()
    }
}

impl RecordingFile {
    fn open(path: &Path, access: Access) -> Result<RecordingFile, RecordingError> {
        let mut file = RecordingFile {
            path: path.to_owned(),
            bytes: FileBytes::open(path, access)?,
            copied: None,
            layout: Layout::default(),
            channels: BTreeMap::new(),
        };
        if let FileBytes::Ranged(ranged) = &file.bytes {
            match index::find(ranged)? {
                Found::Layout(layout) => file.layout = *layout,
                Found::NotMcap(why) => return file.converted(why),
                Found::Unusable(why) => {
                    let map = ranged.spool(path)?;
                    let copied =
                        Copied::Whole { fetched: ranged.fetched(), object: ranged.object.clone(), why };
                    (file.copied, file.bytes) = (Some(copied), FileBytes::Mapped(map));
                }
            }
        }
        if let FileBytes::Mapped(map) = &file.bytes {
            match Layout::of(map) {
                Ok(layout) => file.layout = layout,
                Err(why) => return file.converted(why),
            }
        }
        Ok(file)
    }

    /// The same of a file in another format; `why` it is no MCAP file.
    fn converted(mut self, why: String) -> Result<RecordingFile, RecordingError> {
        let not_mcap = |why: String| RecordingError::NotMcap { path: self.path.clone(), why };
        let Some(Converted { map, damage }) = foreign::convert(&self.bytes, &self.path)? else {
            return Err(not_mcap(why));
        };
        self.layout = Layout::of(&map).map_err(not_mcap)?;
        let original = std::mem::replace(&mut self.bytes, FileBytes::Mapped(map));
        self.copied = Some(Copied::Messages { original, damage });
        Ok(self)
    }

    /// An object is identified by its store, copied or not.
    fn identity(&self) -> Result<String, RecordingError> {
        let bytes = self.original();
        let identity =
            self.object().map_or_else(|| bytes.identity(), |object| Ok(object.identity(bytes.len())));
        self.unshortened()?;
        identity
    }

    /// # Errors
    /// The file became shorter since it was opened.
    pub fn unshortened(&self) -> Result<(), RecordingError> {
        self.original().unshortened(&self.path)
    }

    fn object(&self) -> Option<&ObjectIdentity> {
        match (&self.copied, self.original()) {
            (Some(Copied::Whole { object, .. }), _) => object.as_ref(),
            (_, FileBytes::Ranged(ranged)) => ranged.object.as_ref(),
            (_, FileBytes::Mapped(_)) => None,
        }
    }

    /// The bytes of the file itself, or the same bytes elsewhere.
    fn original(&self) -> &FileBytes {
        match &self.copied {
            Some(Copied::Messages { original, .. }) => original,
            Some(Copied::Whole { .. }) | None => &self.bytes,
        }
    }

    /// Channels of which no pass has seen every block that may hold messages; one walk over the blocks, however many
    /// channels there are.
    fn unread(&self, survey: &FileSurvey) -> Unread {
        let blocks = self.layout.blocks.iter().enumerate();
        let mut unread = Unread::Some(BTreeSet::new());
        for (_, block) in blocks.filter(|(block, _)| !survey.passed.contains(block)) {
            match (&mut unread, &block.holds) {
                (Unread::Some(ids), Some(holds)) => ids.extend(holds),
                (_, None) => return Unread::All,
                (Unread::All, _) => {}
            }
        }
        unread
    }

    /// Messages of a channel: those found, or, where it was not read, those that the summary declares.
    fn tally(&self, survey: &FileSurvey, unread: &Unread, channel: u16) -> Option<Tally> {
        let tallies = if unread.has(channel) { &self.layout.declared } else { &survey.tallies };
        tallies.get(&channel).copied()
    }

    /// Everything wrong with the file, as far as it was read, by offset.
    fn damage(&self, survey: &FileSurvey) -> Vec<Damage> {
        let mut all: Vec<Damage> = self.layout.damage.iter().chain(&survey.damage).cloned().collect();
        match &self.copied {
            Some(Copied::Whole { why, .. }) => {
                all.push(Damage { offset: 0, why: format!("{why}, so all of it was read"), lost: false });
            }
            Some(Copied::Messages { damage, .. }) => all.extend(damage.iter().cloned()),
            None => {}
        }
        let strangers = survey.tallies.iter().filter(|(id, _)| !self.channels.contains_key(id));
        all.extend(strangers.map(|(id, tally)| Damage {
            offset: 0,
            why: format!(
                "{} messages of channel {id}, whose definition is lost, cannot be used",
                tally.messages
            ),
            lost: true,
        }));
        all.extend(self.miscounted(survey));
        all.extend(self.bad_extras());
        all.sort_by_key(|d| d.offset);
        summarised(all)
    }

    /// Statistics that disagree with what was found; of a file read in parts, on the channels that were read.
    fn miscounted(&self, survey: &FileSurvey) -> Option<Damage> {
        let statistics = self.layout.statistics.as_ref()?;
        let found = |id: &u16| survey.tallies.get(id).map_or(0, |t| t.messages);
        let (declared, found): (u64, u64) = if survey.passed.len() == self.layout.blocks.len() {
            (statistics.message_count, survey.tallies.values().map(|t| t.messages).sum())
        } else {
            let unread = self.unread(survey);
            let read = || statistics.channel_message_counts.iter().filter(|(id, _)| !unread.has(**id));
            (read().map(|(_, declared)| declared).sum(), read().map(|(id, _)| found(id)).sum())
        };
        let why = format!("its statistics declare {declared} messages, {found} are usable");
        (declared != found).then_some(Damage { offset: 0, why, lost: declared > found })
    }

    /// Attachments and metadata that cannot be passed on; those of files read by ranges are judged when they are read.
    fn bad_extras(&self) -> Vec<Damage> {
        let FileBytes::Mapped(map) = &self.bytes else { return Vec::new() };
        let bad = |range: &Range<usize>, what| Damage {
            offset: range.start - ENVELOPE,
            why: format!("{what} is damaged and not passed on"),
            lost: true,
        };
        let mut damage = Vec::new();
        for range in &self.layout.attachments {
            damage.extend(
                Attachment::parse(&map[range.clone()]).is_none().then(|| bad(range, "an attachment")),
            );
            map.passed(range.clone());
        }
        for range in &self.layout.metadata {
            let sound = parse_metadata(&map[range.clone()]).is_some();
            damage.extend((!sound).then(|| bad(range, "a metadata record")));
        }
        damage
    }

    fn report(&self, identity: &Result<String, RecordingError>, damage: &[Damage]) -> FileReport {
        FileReport {
            path: self.path.clone(),
            bytes: self.original().len(),
            identity: identity.as_ref().cloned().unwrap_or_default(),
            object: self.object().cloned(),
            fetched: match &self.copied {
                Some(Copied::Whole { fetched, .. }) => Some(*fetched),
                _ => self.original().fetched(),
            },
            source: self.layout.source.unwrap_or(Source::Scan),
            profile: self.layout.profile.clone(),
            library: self.layout.library.clone(),
            chunks: self.layout.chunks(),
            truncated_at: self.layout.truncated_at.map(|at| at as u64),
            damaged: damage.iter().map(|d| (d.offset as u64, d.why.clone())).collect(),
        }
    }

    fn warnings(&self, damage: Vec<Damage>) -> Vec<Warning> {
        let warn = |d: Damage| {
            let (severity, code) = match d.lost {
                true => (Severity::DataLost, "recording-damaged"),
                false => (Severity::Notice, "recording-irregular"),
            };
            let subject = self.path.display().to_string();
            let text = format!("at byte {}: {}", d.offset, d.why);
            Warning::new(severity, Stage::Recording, code, subject, text)
        };
        damage.into_iter().map(warn).collect()
    }
}

/// The first places of damage, and how many more there are.
fn summarised(mut all: Vec<Damage>) -> Vec<Damage> {
    let more = all.split_off(DAMAGE_TOLD.min(all.len()));
    if let Some(first) = more.first() {
        let why = format!("{} more places of damage from here on", more.len());
        all.push(Damage { offset: first.offset, why, lost: more.iter().any(|d| d.lost) });
    }
    all
}

/// Log times are unsigned in MCAP; beyond the year 2262 they saturate.
pub(crate) fn ns(unsigned: u64) -> i64 {
    i64::try_from(unsigned).unwrap_or(i64::MAX)
}

/// What decides how messages are read: a schema in memory, and the message encoding.
type Compiled = (Option<*const RawSchema>, String);

fn compiled(channel: &RawChannel) -> Compiled {
    (channel.schema.as_ref().map(Arc::as_ptr), channel.message_encoding.clone())
}

fn readable_as(channel: &RawChannel) -> Result<String, String> {
    let Some(schema) = &channel.schema else {
        return Err("the channel has no schema".to_owned());
    };
    decode::readable_as(&schema.name, &schema.encoding, &schema.data, &channel.message_encoding)
        .map(|role| role.name().to_owned())
        .map_err(|e| e.to_string())
}

/// The same file twice, or a part of a bag beside what it was converted to, would silently double every message.
fn refuse_repeated(paths: &[PathBuf]) -> Result<(), RecordingError> {
    let mut real: Vec<(PathBuf, &PathBuf)> =
        paths.iter().map(|p| (p.canonicalize().unwrap_or_else(|_| p.clone()), p)).collect();
    real.sort();
    if let Some(pair) = real.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(RecordingError::ListedTwice { path: pair[1].1.clone() });
    }
    let mut parts: Vec<(PathBuf, &PathBuf)> = real
        .into_iter()
        .filter(|(_, p)| is_recording(p))
        .map(|(real, p)| (without_ending(&real), p))
        .collect();
    parts.sort();
    match parts.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => Err(RecordingError::TwoForms { path: pair[0].1.clone(), other: pair[1].1.clone() }),
        None => Ok(()),
    }
}
