//! A recording: one or more files, opened, laid out, and reported on.

use crate::layout::{Damage, Layout};
use crate::map::{map, sha256_hex};
use crate::raw::{Attachment, RawChannel, RawSchema, parse_metadata};
use crate::records::ENVELOPE;
use crate::sweep::{FileSurvey, Tally, sweep};
use crate::{ChannelReport, FileReport, RecordingError, RecordingReport, Source, decode};
use armcal_core::{Severity, Stage, Warning};
use memmap2::Mmap;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Places of damage told one by one; of more, only how many there are: a file can hold millions.
const DAMAGE_TOLD: usize = 50;

/// An opened recording, which may consist of several split files.
pub struct Recording {
    pub(crate) files: Vec<RecordingFile>,
    /// What a full pass found; filled by the first pass that happens to be made.
    surveys: OnceLock<Vec<FileSurvey>>,
    report: OnceLock<RecordingReport>,
}

/// One file of a recording.
pub(crate) struct RecordingFile {
    pub path: PathBuf,
    pub map: Mmap,
    pub layout: Layout,
    pub channels: BTreeMap<u16, Arc<RawChannel>>,
}

impl Recording {
    /// Opens the files of one recording, in any order. Their structure is found without inflating anything, unless a
    /// file has no sound summary.
    ///
    /// # Errors
    /// No paths, a path listed twice, a file that cannot be opened or is not MCAP. A damaged MCAP file is no error:
    /// see [`RecordingReport::warnings`].
    pub fn open(paths: &[PathBuf]) -> Result<Recording, RecordingError> {
        if paths.is_empty() {
            return Err(RecordingError::NoFiles);
        }
        refuse_repeated(paths)?;
        let mut files = paths.par_iter().map(|p| RecordingFile::open(p)).collect::<Result<Vec<_>, _>>()?;
        files.sort_by_key(|f| f.layout.first_ns.unwrap_or(u64::MAX));
        let mut recording = Recording { files, surveys: OnceLock::new(), report: OnceLock::new() };
        recording.complete_definitions();
        Ok(recording)
    }

    /// Files, channels and warnings about them; streams are empty until [`Recording::read`] has named them. The
    /// first call makes a pass over the recording unless `read` has already made one, and hashes the files.
    pub fn report(&self) -> &RecordingReport {
        self.report.get_or_init(|| {
            let surveys = self.surveys.get_or_init(|| sweep(&self.files, |_| (), |(), _| (), |()| ()).0);
            let hashes: Vec<String> = self.files.par_iter().map(|f| sha256_hex(&f.map)).collect();
            let per_file = || self.files.iter().zip(surveys);
            RecordingReport {
                files: per_file().zip(hashes).map(|((f, s), sha256)| f.report(s, sha256)).collect(),
                channels: self.channel_reports(surveys),
                streams: Vec::new(),
                warnings: per_file().flat_map(|(f, s)| f.warnings(s)).collect(),
            }
        })
    }

    /// Keeps what a pass found, so that the report needs no pass of its own.
    pub(crate) fn remember(&self, surveys: Vec<FileSurvey>) {
        // A pass always finds the same, so it does not matter which one came first.
        let _ = self.surveys.set(surveys);
    }

    /// Looks into the chunks for definitions where no summary repeats them all.
    fn complete_definitions(&mut self) {
        if self.files.iter().any(|f| !f.layout.definitions_complete) {
            let (surveys, _) = sweep(&self.files, |_| (), |(), _| (), |()| ());
            for (file, survey) in self.files.iter_mut().zip(&surveys) {
                file.layout.definitions.merge(survey.definitions.clone());
                let first = survey.tallies.values().map(|t| t.first_ns).min();
                file.layout.first_ns = first.or(file.layout.first_ns);
            }
            self.remember(surveys);
        }
        for file in &mut self.files {
            file.channels = file.layout.definitions.resolve();
        }
    }

    fn channel_reports(&self, surveys: &[FileSurvey]) -> Vec<ChannelReport> {
        type Key = (String, String, String, String);
        let mut merged: BTreeMap<Key, (Option<Tally>, Arc<RawChannel>)> = BTreeMap::new();
        for (file, survey) in self.files.iter().zip(surveys) {
            for (id, channel) in &file.channels {
                let (schema, encoding) = channel
                    .schema
                    .as_ref()
                    .map_or_else(Default::default, |s| (s.name.clone(), s.encoding.clone()));
                let key = (channel.topic.clone(), schema, encoding, channel.message_encoding.clone());
                let (tally, _) = merged.entry(key).or_insert_with(|| (None, channel.clone()));
                if let Some(found) = survey.tallies.get(id) {
                    tally.get_or_insert(Tally { messages: 0, ..*found }).add(*found);
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
    fn open(path: &Path) -> Result<RecordingFile, RecordingError> {
        let map = map(path)?;
        let layout =
            Layout::of(&map).map_err(|why| RecordingError::NotMcap { path: path.to_owned(), why })?;
        Ok(RecordingFile { path: path.to_owned(), map, layout, channels: BTreeMap::new() })
    }

    /// Everything wrong with the file, by offset.
    fn damage(&self, survey: &FileSurvey) -> Vec<Damage> {
        let mut all: Vec<Damage> = self.layout.damage.iter().chain(&survey.damage).cloned().collect();
        let strangers = survey.tallies.iter().filter(|(id, _)| !self.channels.contains_key(id));
        all.extend(strangers.map(|(id, tally)| Damage {
            offset: 0,
            why: format!(
                "{} messages of channel {id}, whose definition is lost, cannot be used",
                tally.messages
            ),
            lost: true,
        }));
        let found: u64 = survey.tallies.values().map(|t| t.messages).sum();
        if let Some(declared) =
            self.layout.statistics.as_ref().map(|s| s.message_count).filter(|n| *n != found)
        {
            let why = format!("its statistics declare {declared} messages, {found} are usable");
            all.push(Damage { offset: 0, why, lost: declared > found });
        }
        all.extend(self.bad_extras());
        all.sort_by_key(|d| d.offset);
        summarised(all)
    }

    /// Attachments and metadata that cannot be passed on.
    fn bad_extras(&self) -> impl Iterator<Item = Damage> {
        let bad = |range: &Range<usize>, what| Damage {
            offset: range.start - ENVELOPE,
            why: format!("{what} is damaged and not passed on"),
            lost: true,
        };
        let layout = &self.layout;
        let attachments =
            layout.attachments.iter().filter(|r| Attachment::parse(&self.map[(*r).clone()]).is_none());
        let metadata = layout.metadata.iter().filter(|r| parse_metadata(&self.map[(*r).clone()]).is_none());
        attachments
            .map(move |r| bad(r, "an attachment"))
            .chain(metadata.map(move |r| bad(r, "a metadata record")))
    }

    fn report(&self, survey: &FileSurvey, sha256: String) -> FileReport {
        FileReport {
            path: self.path.clone(),
            bytes: self.map.len() as u64,
            sha256,
            source: self.layout.source.unwrap_or(Source::Scan),
            profile: self.layout.profile.clone(),
            library: self.layout.library.clone(),
            chunks: self.layout.chunks(),
            truncated_at: self.layout.truncated_at.map(|at| at as u64),
            damaged: self.damage(survey).into_iter().map(|d| (d.offset as u64, d.why)).collect(),
        }
    }

    fn warnings(&self, survey: &FileSurvey) -> Vec<Warning> {
        let warn = |d: Damage| {
            let (severity, code) = match d.lost {
                true => (Severity::DataLost, "recording-damaged"),
                false => (Severity::Notice, "recording-irregular"),
            };
            let subject = self.path.display().to_string();
            Warning::new(
                severity,
                Stage::Recording,
                code,
                subject,
                format!("at byte {}: {}", d.offset, d.why),
            )
        };
        self.damage(survey).into_iter().map(warn).collect()
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

/// The same file twice would silently double every message.
fn refuse_repeated(paths: &[PathBuf]) -> Result<(), RecordingError> {
    let mut real: Vec<(PathBuf, &PathBuf)> =
        paths.iter().map(|p| (p.canonicalize().unwrap_or_else(|_| p.clone()), p)).collect();
    real.sort();
    match real.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => Err(RecordingError::ListedTwice { path: pair[1].1.clone() }),
        None => Ok(()),
    }
}
