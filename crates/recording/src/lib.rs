//! MCAP recordings in and out.
//!
//! Reading, in the order data flows through the rooms:
//! * `bytes`: a `map` of a file, or `ranges` of one that is read on demand, such as an `object` behind a `url`, within a `budget`;
//! * `structure`: `records` (envelopes), `layout` (where messages lie, by walking a map) or `index` (by the summary alone),
//!   `chunk` (inflated and checked), `channels`;
//! * `foreign`: of another format (bags of ROS 1 and 2, tables), a copy of its messages;
//! * `recording`: its files, opened; `judge` holds the records of a block against its indexes, `sweep` passes over all blocks in
//!   parallel, results in file order; channels without a usable definition get one (`substitute`); what was read is compared with whatever else says what was written (`witness`, of rosbag2
//!   `bag`). A disagreement is data lost, which the process remembers ([`data_loss_warnings`]);
//! * `decode`: messages to rows;
//! * `streams`: `gather` (rows of a stream; of bodies that hang on others the `transforms` between), `reading` (columns: clock,
//!   cleaning, units). `read` takes all streams of a pipeline through these.
//!
//! [`Recording::open`] takes any MCAP: chunked or not, indexed or not, zstd, lz4 or uncompressed, finished, cut
//! off or damaged. What is sound is used; what is not is reported with its byte offset and reason. Nothing panics
//! on bad input.
//!
//! Writing (`write`): [`output::McapOutput`] into an [`atomic::AtomicFile`]; same messages, same bytes. [`extract()`] does both: it
//! writes a thin recording of the wanted channels. What was read as an [`input`] is never written over, nor is anything
//! else whose content does not say that armcal made it (`guard`, `mark`).

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod bytes;
pub mod decode;
mod error;
mod foreign;
mod recording;
mod report;
pub mod ros2;
mod streams;
mod structure;
mod write;

pub use bytes::Access;
pub use bytes::budget::Allowance;
pub use bytes::input;
pub use bytes::remote::list_objects;
pub use bytes::url::{is_url, resolve_path};
pub use error::{RecordingError, nearest_name, shortened};
pub use foreign::inflate_message;
pub use foreign::names::{files_of, is_recording, is_table, recordings_at, without_ending};
pub use recording::Recording;
pub use recording::bag::read_with;
pub use recording::losses::data_loss_warnings;
pub use recording::whole::{identity_of, sha256_of};
pub use report::*;
pub use streams::fingerprint::{Fingerprint, SharedTime};
pub use streams::transforms::{Chain, Transforms};
pub use streams::{
    Axis, Encoder, GaugeStream, JointStream, JointUnit, LengthUnit, PoseStream, ScalarStream, Streams,
};
pub use structure::raw::{
    Attachment, MetadataVisitor, RawChannel, RawMessage, RawMetadata, RawSchema, RawVisitor, ReadBy,
};
pub use write::extract::{Extract, Extracted, extract};
pub use write::guard::{
    Over, file_has_content, make_folder, make_folder_in, may_put, may_write, may_write_all, may_write_over,
};
pub use write::mark::{EXTRACT_METADATA, SET_POINTS_METADATA};
pub use write::seal::{is_marked, seal_text};
pub use write::{atomic, output};

#[cfg(test)]
mod tests;
