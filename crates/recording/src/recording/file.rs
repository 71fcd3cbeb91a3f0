//! One file of a recording: opened, copied where it must be, laid out, and reported on.

use crate::bytes::budget::Allowance;
use crate::bytes::{Access, FileBytes};
use crate::foreign::{self, Converted, Origin};
use crate::structure::channels::DEFINITION_FROM;
use crate::structure::damage::Damage;
use crate::structure::index::{self, Found};
use crate::structure::layout::Layout;
use crate::structure::raw::RawChannel;
use crate::structure::survey::{FileSurvey, Tally};
use crate::{Fetched, FileReport, ObjectIdentity, RecordingError, Source};
use armcal_core::{Code, Severity, Stage, Warning};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
        /// What is assumed of it.
        notes: Vec<String>,
        /// Identity of the log that was read with it.
        log: String,
        origin: Origin,
    },
}

/// What hashing a file gives.
pub(crate) struct Hashed {
    pub identity: String,
    /// Of the data section, where all of it was read.
    pub crc: Option<u32>,
}

impl RecordingFile {
    /// One of so many files.
    pub fn open(path: &Path, access: Access, files: usize) -> Result<RecordingFile, RecordingError> {
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
        let Some(Converted { map, damage, notes, log, origin }) = converted else {
            return Err(not_mcap(why));
        };
        self.layout = Layout::of(&map, allowance).map_err(not_mcap)?;
        let original = std::mem::replace(&mut self.bytes, FileBytes::Mapped(map));
        self.copied = Some(Copied::Messages { original, damage, notes, log, origin });
        Ok(self)
    }

    /// Its channels by number.
    pub fn channels(&self) -> impl Iterator<Item = (u16, &Arc<RawChannel>)> {
        self.layout.definitions.channels()
    }

    /// Notes at the channels of a bag where their definitions are from.
    pub fn annotate(&mut self) {
        let Some(Copied::Messages { origin: Origin::Bag(known), .. }) = &self.copied else { return };
        self.layout.definitions.annotate(|channel| {
            let schema = channel.schema.as_ref().filter(|schema| !schema.data.is_empty())?;
            let from = if known.contains(&*schema.name) { "armcal" } else { "bag" };
            Some((DEFINITION_FROM.to_owned(), from.to_owned()))
        });
    }

    /// An object is identified by its store, copied or not.
    pub fn hashed(&self) -> Result<Hashed, RecordingError> {
        let data_end = self.layout.data_crc.map_or(0, |data| data.end);
        let bytes = self.original();
        let (mut identity, mut crc) = match self.object() {
            Some(object) if self.copied.is_some() => (object.identity(bytes.len()), None),
            _ => bytes.identity(data_end)?,
        };
        match (&self.copied, &self.bytes) {
            (Some(Copied::Messages { log, origin, .. }), FileBytes::Mapped(map)) => {
                identity += log;
                crc = matches!(origin, Origin::Mcap).then(|| map.crc(data_end));
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
    pub fn original(&self) -> &FileBytes {
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
    pub fn tally(&self, survey: &FileSurvey, unread: &Unread, channel: u16) -> Option<Tally> {
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

    pub fn report(&self, identity: String, damage: &[Damage]) -> FileReport {
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

    pub fn warnings(&self, damage: &[Damage]) -> Vec<Warning> {
        let warn = |d: &Damage| {
            let (severity, code) = match d.lost {
                true => (Severity::DataLost, Code::RecordingDamaged),
                false => (Severity::Notice, Code::RecordingIrregular),
            };
            let subject = self.path.display().to_string();
            let text = format!("at byte {}: {}", d.offset, d.why);
            Warning::new(severity, Stage::Recording, code, subject, text)
        };
        let notes: &[String] = match &self.copied {
            Some(Copied::Messages { notes, .. }) => notes,
            _ => &[],
        };
        let note = |said: &String| {
            let subject = self.path.display().to_string();
            Warning::new(Severity::Notice, Stage::Recording, Code::TableRead, subject, said.clone())
        };
        damage.iter().map(warn).chain(notes.iter().map(note)).collect()
    }
}
