//! A recording: one or more files, opened, laid out, and reported on.

use crate::budget::Allowance;
use crate::bytes::{Access, FileBytes};
use crate::damage::{Damage, Faults};
use crate::decode::Role;
use crate::foreign::names::{files_of, is_recording, without_ending};
use crate::foreign::{self, Converted, DEFINITION_FROM};
use crate::index::{self, Found};
use crate::layout::Layout;
use crate::raw::{RawChannel, RawSchema};
use crate::sweep::{At, BlockSurvey, FileSurvey, Tally, blocks_within_budget, sweep};
use crate::{
    ChannelReport, Fetched, FileReport, ObjectIdentity, RecordingError, RecordingReport, Source, bag, decode,
    losses, witness,
};
use armcal_core::{Severity, Stage, Warning};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// An opened recording, which may consist of several split files.
pub struct Recording {
    pub(crate) files: Vec<RecordingFile>,
    /// What the passes made so far have found in each file.
    surveys: Mutex<Vec<FileSurvey>>,
    judged: OnceLock<JudgedFiles>,
    /// What all passes may still inflate.
    passes: Allowance,
}

/// What a recording is found to be.
struct JudgedFiles {
    report: RecordingReport,
    /// A file that could not be read to its end, and why.
    unread: Option<(PathBuf, String)>,
}

/// One file of a recording.
pub(crate) struct RecordingFile {
    pub path: PathBuf,
    pub bytes: FileBytes,
    /// Set where `bytes` are a copy.
    copied: Option<Copied>,
    pub layout: Layout,
}

/// Channels that were not read whole.
pub(crate) enum Unread {
    All,
    Some(BTreeSet<u16>),
}

impl Unread {
    pub fn has(&self, channel: u16) -> bool {
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
        /// What of it could not be used, or disagrees with the rest.
        damage: Vec<Damage>,
        /// Identity of the log that was read with it.
        log: String,
        /// Of a database: the types whose definitions are not its own. None where the messages are in an MCAP file of somebody
        /// else's.
        known_here: Option<BTreeSet<String>>,
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
        let open = |path: &PathBuf| RecordingFile::open(path, access, paths.len());
        let mut files = paths.par_iter().map(open).collect::<Result<Vec<_>, _>>()?;
        files.sort_by_key(|f| f.layout.first_ns.unwrap_or(u64::MAX));
        let surveys = Mutex::new(vec![FileSurvey::default(); files.len()]);
        let passes = Allowance::of_passes(files.iter().map(|file| file.original().len()).sum());
        let mut recording = Recording { files, surveys, judged: OnceLock::new(), passes };
        recording.complete_definitions()?;
        Ok(recording)
    }

    /// What the messages of one pass may inflate to that are compressed one by one.
    pub fn allowance(&self) -> Allowance {
        Allowance::of(self.files.iter().map(|file| file.original().len()).sum(), 1)
    }

    /// Whether a pass stayed within its allowance, and all passes within theirs.
    ///
    /// # Errors
    /// It did not, so that messages are missing from what it gave.
    pub fn within(&self, allowance: &Allowance) -> Result<(), RecordingError> {
        match self.files.first().filter(|_| allowance.is_exceeded()) {
            Some(file) => Err(allowance.exceeded(&file.path)),
            None => self.pay(allowance.taken()),
        }
    }

    /// Pays for what a pass over these blocks inflates.
    ///
    /// # Errors
    /// The passes before it took all that there was.
    pub(crate) fn pays(&self, blocks: &[At]) -> Result<(), RecordingError> {
        let claims = blocks.iter().map(|at| self.files[at.file].layout.blocks[at.block].claim);
        self.pay(claims.fold(0, u64::saturating_add))
    }

    fn pay(&self, bytes: u64) -> Result<(), RecordingError> {
        match self.files.first().filter(|_| !self.passes.takes(bytes)) {
            Some(file) => Err(self.passes.exceeded(&file.path)),
            None => Ok(()),
        }
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
    /// read by ranges it tells what has been read until then. Bytes that cannot be read again to hash them are a warning
    /// here; [`Recording::whole_report`] fails.
    pub fn report(&self) -> &RecordingReport {
        &self.judged().report
    }

    /// The same of files that could be read to their ends.
    ///
    /// # Errors
    /// Bytes that cannot be read, which is no damage of the file.
    pub fn whole_report(&self) -> Result<&RecordingReport, RecordingError> {
        let judged = self.judged();
        match &judged.unread {
            None => Ok(&judged.report),
            Some((path, why)) => {
                let source = std::io::Error::other(why.clone());
                Err(RecordingError::Read { path: path.clone(), source })
            }
        }
    }

    /// The same, where nothing else is wanted of the recording.
    ///
    /// # Errors
    /// As [`Recording::whole_report`].
    pub fn into_report(self) -> Result<RecordingReport, RecordingError> {
        self.whole_report()?;
        Ok(self.judged.into_inner().map(|judged| judged.report).unwrap_or_default())
    }

    fn judged(&self) -> &JudgedFiles {
        self.judged.get_or_init(|| {
            // Only fetching can fail, and of mapped files nothing is fetched.
            if let Ok((found, _)) = sweep(self, &self.unread(), |_| (), |(), _, _| ()) {
                self.remember(found);
            }
            let hashed: Vec<_> = self.files.par_iter().map(RecordingFile::hashed).collect();
            let surveys = self.surveys();
            let compared = self.files.iter().zip(surveys.iter()).map(|(f, s)| witness::compare(f, s));
            let mut damage: Vec<Faults> = compared.collect();
            let mut unread = None;
            for ((file, faults), hashed) in self.files.iter().zip(&mut damage).zip(&hashed) {
                match hashed {
                    Ok(hashed) => witness::compare_crc(file, hashed.crc, faults),
                    Err(e) => {
                        faults.lost(0, || format!("its bytes cannot be hashed: {e}"));
                        unread.get_or_insert((file.path.clone(), e.to_string()));
                    }
                }
            }
            for (file, why) in bag::compare(&self.files, &surveys) {
                match why {
                    Ok(why) => damage[file].lost(0, || why),
                    Err((path, e)) => {
                        damage[file].lost(0, || format!("{} cannot be read: {e}", path.display()));
                        unread.get_or_insert((path, e.to_string()));
                    }
                }
            }
            let damage: Vec<Vec<Damage>> = damage.into_iter().map(Faults::in_words).collect();
            let identity = |hashed: &Result<Hashed, RecordingError>| {
                hashed.as_ref().map_or_else(|_| String::new(), |hashed| hashed.identity.clone())
            };
            let per_file = || self.files.iter().zip(&hashed).zip(&damage);
            let report = RecordingReport {
                files: per_file().map(|((f, hashed), damage)| f.report(identity(hashed), damage)).collect(),
                channels: self.channel_reports(&surveys),
                streams: Vec::new(),
                warnings: per_file().flat_map(|((f, _), damage)| f.warnings(damage)).collect(),
            };
            losses::add_warnings(&report.warnings);
            JudgedFiles { report, unread }
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

    /// Counts the messages of a block, unless a pass has; `remember` takes in the rest once the pass is over. The sum is the
    /// same in any order.
    pub(crate) fn count(&self, at: At, tallies: BTreeMap<u16, Tally>) {
        self.surveys()[at.file].count_block(at.block, tallies);
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
            // Some blocks at a time, so that what each of them repeats is not held at once.
            let (unread, most) = (self.unread(), 4 * rayon::current_num_threads());
            let mut left = &unread[..];
            while !left.is_empty() {
                let now;
                (now, left) = left.split_at(blocks_within_budget(&self.files, left, most));
                let (found, _) = sweep(self, now, |_| (), |(), _, _| ())?;
                self.remember(found);
                let surveys = self.surveys.get_mut().unwrap_or_else(PoisonError::into_inner);
                for (file, survey) in self.files.iter_mut().zip(surveys) {
                    if let Err(why) = file.layout.definitions.merge(std::mem::take(&mut survey.definitions)) {
                        file.layout.faults.lost(0, || format!("in its chunks: {why}"));
                    }
                }
            }
            let surveys = self.surveys.get_mut().unwrap_or_else(PoisonError::into_inner);
            for (file, survey) in self.files.iter_mut().zip(surveys) {
                // Whoever reads a block again only compares with these.
                file.layout.definitions_complete = true;
                let first = survey.tallies.values().map(|t| t.first_ns).min();
                file.layout.first_ns = first.or(file.layout.first_ns);
            }
        }
        for file in &mut self.files {
            file.layout.definitions.resolve();
            file.annotate();
        }
        Ok(())
    }

    fn channel_reports(&self, surveys: &[FileSurvey]) -> Arc<[ChannelReport]> {
        let count = self.files.iter().map(|file| file.channels().count()).sum();
        let mut found: Vec<(&RawChannel, Option<Tally>)> = Vec::with_capacity(count);
        for (file, survey) in self.files.iter().zip(surveys) {
            let unread = file.unread(survey);
            found.extend(file.channels().map(|(id, channel)| (&**channel, file.tally(survey, &unread, id))));
        }
        // The same channel of several files, or of several numbers, is one.
        found.sort_by_key(|(channel, _)| channel_key(channel));
        found.dedup_by(|(channel, more), (before, tally)| {
            let same = channel_key(channel) == channel_key(before);
            if let Some(more) = more.filter(|_| same) {
                tally.get_or_insert(Tally { messages: 0, ..more }).add(more);
            }
            same
        });
        // Thousands of channels may share one schema, which is compiled once.
        let mut known: BTreeMap<Compiled<'_>, Result<&'static str, Arc<str>>> = BTreeMap::new();
        let none: Arc<str> = "".into();
        let report = |(channel, tally): (_, Option<Tally>)| {
            let channel: &RawChannel = channel;
            let tally = tally.unwrap_or(Tally { messages: 0, first_ns: 0, last_ns: 0 });
            let schema = channel.schema.as_ref();
            let compiled = (schema.map(Arc::as_ptr), &*channel.message_encoding);
            ChannelReport {
                topic: channel.topic.clone(),
                schema: schema.map_or(&none, |schema| &schema.name).clone(),
                schema_encoding: schema.map_or(&none, |schema| &schema.encoding).clone(),
                message_encoding: channel.message_encoding.clone(),
                messages: tally.messages,
                first_ns: saturating_ns(tally.first_ns),
                last_ns: saturating_ns(tally.last_ns),
                decodable: known.entry(compiled).or_insert_with(|| readable_as(channel)).clone(),
            }
        };
        found.into_iter().map(report).collect()
    }
}

/// What hashing a file gives.
struct Hashed {
    identity: String,
    /// Of the data section, where all of it was read.
    crc: Option<u32>,
}

impl RecordingFile {
    /// One of so many files.
    fn open(path: &Path, access: Access, files: usize) -> Result<RecordingFile, RecordingError> {
        let mut file = RecordingFile {
            path: path.to_owned(),
            bytes: FileBytes::open(path, access)?,
            copied: None,
            layout: Layout::default(),
        };
        let allowance = Allowance::of(file.bytes.len(), files);
        if let FileBytes::Ranged(ranged) = &file.bytes {
            match index::find_within(ranged, &allowance)? {
                Found::Layout(layout) => file.layout = *layout,
                Found::NotMcap(why) => return file.converted(why, &allowance),
                Found::Unusable(why) => {
                    let map = ranged.spool(path)?;
                    let copied =
                        Copied::Whole { fetched: ranged.fetched(), object: ranged.object.clone(), why };
                    (file.copied, file.bytes) = (Some(copied), FileBytes::Mapped(map));
                }
            }
        }
        if let FileBytes::Mapped(map) = &mut file.bytes {
            // A copy has an allowance of its own: what the summary was thought to be worth is void.
            let allowance = Allowance::of(map.len() as u64, files);
            match Layout::of(map, &allowance) {
                Ok(layout) => file.layout = layout,
                Err(why) => return file.converted(why, &allowance),
            }
            map.want_crc(file.layout.data_crc.map_or(0, |data| data.end));
        }
        Ok(file)
    }

    /// The same of a file in another format; `why` it is no MCAP file.
    fn converted(mut self, why: String, allowance: &Allowance) -> Result<RecordingFile, RecordingError> {
        let not_mcap = |why: String| RecordingError::NotMcap { path: self.path.clone(), why };
        let converted = foreign::convert(&self.bytes, &self.path, allowance)?;
        let Some(Converted { map, damage, log, known_here }) = converted else {
            return Err(not_mcap(why));
        };
        self.layout = Layout::of(&map, allowance).map_err(not_mcap)?;
        let original = std::mem::replace(&mut self.bytes, FileBytes::Mapped(map));
        self.copied = Some(Copied::Messages { original, damage, log, known_here });
        Ok(self)
    }

    /// Its channels by number.
    pub fn channels(&self) -> impl Iterator<Item = (u16, &Arc<RawChannel>)> {
        self.layout.definitions.channels()
    }

    /// Notes at the channels of a database where their definitions are from.
    fn annotate(&mut self) {
        let Some(Copied::Messages { known_here: Some(known), .. }) = &self.copied else { return };
        self.layout.definitions.annotate(|channel| {
            let schema = channel.schema.as_ref().filter(|schema| !schema.data.is_empty())?;
            let from = if known.contains(&*schema.name) { "armcal" } else { "bag" };
            Some((DEFINITION_FROM.to_owned(), from.to_owned()))
        });
    }

    /// An object is identified by its store, copied or not.
    fn hashed(&self) -> Result<Hashed, RecordingError> {
        let data_end = self.layout.data_crc.map_or(0, |data| data.end);
        let bytes = self.original();
        let (mut identity, mut crc) = match self.object() {
            Some(object) if self.copied.is_some() => (object.identity(bytes.len()), None),
            _ => bytes.identity(data_end)?,
        };
        match (&self.copied, &self.bytes) {
            (Some(Copied::Messages { log, known_here, .. }), FileBytes::Mapped(map)) => {
                identity += log;
                crc = known_here.is_none().then(|| map.crc(data_end));
            }
            (Some(_), FileBytes::Mapped(map)) if crc.is_none() => crc = Some(map.crc(data_end)),
            _ => {}
        }
        self.unshortened()?;
        Ok(Hashed { identity, crc })
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
    pub fn unread(&self, survey: &FileSurvey) -> Unread {
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

    /// What copying it showed.
    pub fn copy_damage(&self) -> Vec<Damage> {
        match &self.copied {
            Some(Copied::Whole { why, .. }) => {
                vec![Damage { offset: 0, why: format!("{why}, so all of it was read"), lost: false }]
            }
            Some(Copied::Messages { damage, .. }) => damage.clone(),
            None => Vec::new(),
        }
    }

    fn report(&self, identity: String, damage: &[Damage]) -> FileReport {
        FileReport {
            path: self.path.clone(),
            bytes: self.original().len(),
            identity,
            object: self.object().cloned(),
            fetched: match &self.copied {
                Some(Copied::Whole { fetched, .. }) => Some(*fetched),
                _ => self.original().fetched(),
            },
            source: self.layout.source.unwrap_or(Source::Scan),
            profile: self.layout.profile.clone(),
            library: self.layout.library.clone(),
            chunks: self.layout.chunks,
            truncated_at: self.layout.truncated_at.map(|at| at as u64),
            damaged: damage.iter().map(|d| (d.offset as u64, d.why.clone())).collect(),
        }
    }

    fn warnings(&self, damage: &[Damage]) -> Vec<Warning> {
        let warn = |d: &Damage| {
            let (severity, code) = match d.lost {
                true => (Severity::DataLost, "recording-damaged"),
                false => (Severity::Notice, "recording-irregular"),
            };
            let subject = self.path.display().to_string();
            let text = format!("at byte {}: {}", d.offset, d.why);
            Warning::new(severity, Stage::Recording, code, subject, text)
        };
        damage.iter().map(warn).collect()
    }
}

/// Log times are unsigned in MCAP; beyond the year 2262 they saturate.
pub(crate) fn saturating_ns(unsigned: u64) -> i64 {
    i64::try_from(unsigned).unwrap_or(i64::MAX)
}

/// What decides how messages are read: a schema in memory, and the message encoding.
type Compiled<'a> = (Option<*const RawSchema>, &'a str);

/// What makes channels one in a report: topic, schema, its encoding, that of the messages.
fn channel_key(channel: &RawChannel) -> [&str; 4] {
    let (schema, encoding) = channel.schema.as_ref().map_or(("", ""), |s| (&*s.name, &*s.encoding));
    [&channel.topic, schema, encoding, &channel.message_encoding]
}

fn readable_as(channel: &RawChannel) -> Result<&'static str, Arc<str>> {
    let Some(schema) = &channel.schema else {
        return Err("the channel has no schema".into());
    };
    decode::readable_as(&schema.name, &schema.encoding, &schema.data, &channel.message_encoding)
        .map(Role::name)
        .map_err(|e| e.to_string().into())
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
