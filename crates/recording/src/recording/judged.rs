//! What the files of a recording are found to be, and what of them is damaged.

use crate::decode::Role;
use crate::recording::bag;
use crate::recording::file::{Hashed, RecordingFile};
use crate::recording::losses;
use crate::recording::sweep::sweep;
use crate::recording::witness;
use crate::recording::{JudgedFiles, Recording};
use crate::structure::damage::{Damage, Faults};
use crate::structure::raw::{RawChannel, RawSchema};
use crate::structure::records::saturating_ns;
use crate::structure::survey::{FileSurvey, Tally};
use crate::{ChannelReport, RecordingError, RecordingReport, decode};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Recording {
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
            let compiled = (channel.definition().map(Arc::as_ptr), &*channel.message_encoding);
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

/// What decides how messages are read: a schema in memory, and the message encoding.
type Compiled<'a> = (Option<*const RawSchema>, &'a str);

/// What makes channels one in a report: topic, schema, its encoding, that of the messages.
fn channel_key(channel: &RawChannel) -> [&str; 4] {
    let (schema, encoding) = channel.schema.as_ref().map_or(("", ""), |s| (&*s.name, &*s.encoding));
    [&channel.topic, schema, encoding, &channel.message_encoding]
}

fn readable_as(channel: &RawChannel) -> Result<&'static str, Arc<str>> {
    let Some(schema) = channel.definition() else {
        return Err("the channel has no schema".into());
    };
    decode::readable_as(&schema.name, &schema.encoding, &schema.data, &channel.message_encoding)
        .map(Role::name)
        .map_err(|e| e.to_string().into())
}
