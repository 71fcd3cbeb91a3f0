//! What was read, compared with everything else that says what was written.
//!
//! A file tells the same thing many times: structure and CRCs are judged where it is walked ([`crate::structure::layout`]) and where a
//! block is read ([`crate::recording::judge`]); here are the witnesses that speak of a whole file. Where one disagrees, something was
//! lost or changed, and nobody can say that it was not a message: data are lost, whatever could still be read.

use crate::bytes::FileBytes;
use crate::recording::file::RecordingFile;
use crate::structure::damage::Faults;
use crate::structure::layout::Layout;
use crate::structure::raw::{Attachment, parse_metadata};
use crate::structure::records::{ENVELOPE, Statistics};
use crate::structure::survey::FileSurvey;
use std::ops::Range;

/// Everything wrong with the file, as far as it was read.
pub(crate) fn compare(file: &RecordingFile, survey: &FileSurvey) -> Faults {
    let mut faults = file.layout.faults.clone();
    faults.merge(survey.faults.clone());
    faults.extend(file.copy_damage());
    for (id, tally) in survey.tallies.iter().filter(|(id, _)| file.layout.definitions.channel(**id).is_none())
    {
        faults.lost(0, || {
            format!("{} messages of channel {id}, whose definition is lost, cannot be used", tally.messages)
        });
    }
    if let Some(statistics) = &file.layout.statistics {
        compare_messages(file, survey, statistics, &mut faults);
        compare_records(&file.layout, statistics, &mut faults);
    }
    bad_extras(file, &mut faults);
    faults
}

/// The CRC of the data section, where all of it was read.
pub(crate) fn compare_crc(file: &RecordingFile, found: Option<u32>, faults: &mut Faults) {
    if let (Some(data), Some(found)) = (file.layout.data_crc, found)
        && data.crc != found
    {
        faults.lost(data.end, || {
            format!(
                "the CRC of the data section disagrees ({found:08x} instead of {:08x}): bytes before it were changed after \
                 they were written",
                data.crc
            )
        });
    }
}

/// Statistics of messages; of a file read in parts, of the channels that were read.
fn compare_messages(file: &RecordingFile, survey: &FileSurvey, statistics: &Statistics, faults: &mut Faults) {
    let found = |id: &u16| survey.tallies.get(id).map_or(0, |tally| tally.messages);
    let unread = file.unread(survey);
    let by_channel = &statistics.channel_message_counts;
    let all_read = survey.passed.len() == file.layout.blocks.len();
    if all_read {
        let (declared, found) =
            (statistics.message_count, survey.tallies.values().map(|t| t.messages).sum::<u64>());
        if declared != found {
            faults.lost(0, || format!("its statistics declare {declared} messages, {found} are usable"));
        }
        let times = survey.tallies.values().map(|t| (t.first_ns, t.last_ns));
        let span = times.reduce(|(a, b), (c, d)| (a.min(c), b.max(d))).unwrap_or((0, 0));
        if declared == found && span != (statistics.start_ns, statistics.end_ns) {
            faults.lost(0, || {
                format!(
                    "its statistics declare messages from {} to {} ns, those that are there are from {} to {} ns",
                    statistics.start_ns, statistics.end_ns, span.0, span.1
                )
            });
        }
    }
    // Writers may leave the counts of channels out.
    if by_channel.is_empty() {
        return;
    }
    let undeclared = survey.tallies.keys().filter(|id| !by_channel.contains_key(id)).map(|id| (*id, 0));
    let declared = by_channel.iter().map(|(id, messages)| (*id, *messages));
    for (id, declared) in declared.chain(undeclared).filter(|(id, _)| !unread.has(*id)) {
        let found = found(&id);
        if declared != found {
            let channel = file.layout.definitions.channel(id);
            let name = channel.map_or_else(|| format!("channel {id}"), |c| c.topic.clone());
            faults.lost(0, || {
                format!("its statistics declare {declared} messages on {name}, {found} are usable")
            });
        }
    }
}

/// Statistics of other records.
fn compare_records(layout: &Layout, statistics: &Statistics, faults: &mut Faults) {
    let counts = [
        ("chunks", statistics.chunk_count, layout.chunks),
        ("attachments", statistics.attachment_count, layout.attachments.len()),
        ("metadata records", statistics.metadata_count, layout.metadata.len()),
    ];
    for (what, declared, found) in counts {
        if declared as usize != found {
            faults.lost(0, || format!("its statistics declare {declared} {what}, {found} are there"));
        }
    }
}

/// Attachments and metadata that cannot be passed on; those of files read by ranges are judged when they are read.
fn bad_extras(file: &RecordingFile, faults: &mut Faults) {
    let FileBytes::Mapped(map) = &file.bytes else { return };
    let mut bad = |range: &Range<usize>, what: &str| {
        faults.lost(range.start - ENVELOPE, || format!("{what} is damaged and not passed on"));
    };
    for range in &file.layout.attachments {
        if Attachment::parse(&map[range.clone()]).is_none() {
            bad(range, "an attachment");
        }
        map.passed(range.clone());
    }
    for range in &file.layout.metadata {
        if parse_metadata(&map[range.clone()]).is_none() {
            bad(range, "a metadata record");
        }
    }
}
