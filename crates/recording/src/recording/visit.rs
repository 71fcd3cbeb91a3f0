//! Messages, attachments and metadata of a recording, handed out one after the other.

use crate::RecordingError;
use crate::recording::Recording;
use crate::recording::file::RecordingFile;
use crate::recording::sweep::{
    Batch, block_records, blocks_for_channels, blocks_within_budget, for_each_batch, inflate_block,
};
use crate::structure::raw::{
    Attachment, MetadataVisitor, RawChannel, RawMessage, RawMetadata, RawVisitor, parse_metadata,
};
use crate::structure::records::Message;
use crate::structure::survey::BlockSurvey;
use mcap::records::op;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

impl Recording {
    /// Hands every sound message to `f`, file by file in time order, in file order within each. Messages whose
    /// channel definition is lost are not handed out. The first error stops the pass.
    pub fn for_each_raw(&self, f: &mut RawVisitor<'_>) -> Result<(), RecordingError> {
        self.for_each_raw_of(&|_| true, f)
    }

    /// The same for the messages of wanted channels. Of files read by ranges only the chunks with such are read.
    pub fn for_each_raw_of(
        &self,
        wanted: &dyn Fn(&RawChannel) -> bool,
        f: &mut RawVisitor<'_>,
    ) -> Result<(), RecordingError> {
        let ids = |file: &RecordingFile| -> BTreeSet<u16> {
            file.channels().filter(|(_, channel)| wanted(channel)).map(|(id, _)| id).collect()
        };
        let ids: Vec<BTreeSet<u16>> = self.files.iter().map(ids).collect();
        let blocks = blocks_for_channels(&self.files, &ids);
        self.pays(&blocks)?;
        let done = for_each_batch(&self.files, &blocks, |batch| self.hand_out(&batch, &ids, f));
        self.files.iter().try_for_each(RecordingFile::unshortened)?;
        done
    }

    fn hand_out(
        &self,
        batch: &Batch<'_>,
        ids: &[BTreeSet<u16>],
        f: &mut RawVisitor<'_>,
    ) -> Result<(), RecordingError> {
        // A few blocks ahead in parallel, so that memory stays at a few of them whatever the file's size.
        let ahead = 2 * rayon::current_num_threads();
        let (mut blocks_left, mut fetched_left) = (batch.blocks, &batch.fetched[..]);
        while !blocks_left.is_empty() {
            let count = blocks_within_budget(&self.files, blocks_left, ahead);
            let (blocks, fetched);
            (blocks, blocks_left) = blocks_left.split_at(count);
            (fetched, fetched_left) = fetched_left.split_at(count);
            let work = blocks.par_iter().zip(fetched);
            let inflated: Vec<(Vec<u8>, BlockSurvey)> =
                work.map(|(at, fetched)| inflate_block(&self.files, *at, fetched.as_ref())).collect();
            let mut surveys = Vec::with_capacity(inflated.len());
            for (bytes, (at, survey)) in inflated {
                let file = &self.files[at.file];
                let messages = block_records(&bytes).filter(|r| r.op == op::MESSAGE);
                for message in messages.filter_map(|r| Message::parse(r.body)) {
                    if !ids[at.file].contains(&message.channel_id) {
                        continue;
                    }
                    if let Some(channel) = file.layout.definitions.channel(message.channel_id) {
                        f(RawMessage {
                            channel,
                            sequence: message.sequence,
                            log_ns: message.log_ns,
                            publish_ns: message.publish_ns,
                            data: message.data,
                        })?;
                    }
                }
                file.bytes.passed(file.layout.blocks[at.block].range());
                surveys.push((at, survey));
            }
            self.remember(surveys);
        }
        Ok(())
    }

    /// Hands every sound attachment to `f`, one at a time in memory, in file order. The first error stops the pass.
    pub fn for_each_attachment(
        &self,
        f: &mut dyn FnMut(Attachment<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        for file in &self.files {
            for range in &file.layout.attachments {
                let body = file.bytes.read(range.clone())?;
                Attachment::parse(&body).map_or(Ok(()), &mut *f)?;
                file.bytes.passed(range.clone());
            }
        }
        Ok(())
    }

    /// Hands every metadata record that can be read to `f`, one at a time in memory, in file order. The first error stops
    /// the pass.
    pub fn for_each_metadata(&self, f: &mut MetadataVisitor<'_>) -> Result<(), RecordingError> {
        for file in &self.files {
            for range in &file.layout.metadata {
                let body = file.bytes.read(range.clone())?;
                parse_metadata(&body).map_or(Ok(()), |(name, entries)| f(&name, &entries))?;
                file.bytes.passed(range.clone());
            }
        }
        Ok(())
    }

    /// All of them, as (name, entries).
    pub fn metadata(&self) -> Result<Vec<RawMetadata>, RecordingError> {
        let mut all = Vec::new();
        self.for_each_metadata(&mut |name, entries| {
            all.push((name.to_owned(), entries.clone()));
            Ok(())
        })?;
        Ok(all)
    }

    /// Every channel of the recording, in file order, each once.
    pub fn channels(&self) -> Vec<Arc<RawChannel>> {
        let mut known: HashSet<&RawChannel> = HashSet::new();
        let all = self.files.iter().flat_map(|file| file.channels().map(|(_, channel)| channel));
        all.filter(|channel| known.insert(channel)).cloned().collect()
    }
}
