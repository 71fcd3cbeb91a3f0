//! MCAP recordings in and out.
//!
//! Reading, in the order data flows through the modules:
//! `bytes` (a `map` of a file, or `ranges` of one that is read on demand, such as an `object` behind a `url`; of a `foreign`
//! format, such as rosbag2's database, a copy of its messages) ->
//! `records` (record envelopes) -> `layout` (where messages lie, by walking a map) or `index` (by the summary alone) ->
//! `chunk` (inflated and checked, within a `budget`) -> `judge` (the records of a block against its indexes) -> `sweep` (all
//! blocks in parallel, results in file order) ->
//! `decode` (messages to rows) -> `gather` (rows of a stream; of bodies that hang on others the `transforms`
//! between) -> `reading` (columns: clock, cleaning, units). `read` takes all streams of a pipeline through these.
//!
//! What was read is compared with whatever else says what was written: `witness`, and of rosbag2 `bag` and `foreign`. A
//! disagreement is data lost, which the process remembers ([`data_loss_warnings`]).
//!
//! [`Recording::open`] takes any MCAP: chunked or not, indexed or not, zstd, lz4 or uncompressed, finished, cut
//! off or damaged. What is sound is used; what is not is reported with its byte offset and reason. Nothing panics
//! on bad input.
//!
//! Writing: [`output::McapOutput`] into an [`atomic::AtomicFile`]; same messages, same bytes. [`extract()`] does both: it
//! writes a thin recording of the wanted channels. What was read as an [`input`] is never written over, nor is anything
//! else whose content does not say that armcal made it (`guard`, `mark`).

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod atomic;
mod bag;
mod budget;
mod bytes;
mod channels;
mod chunk;
mod clean;
mod clock;
mod damage;
pub mod decode;
mod error;
mod extract;
mod fingerprint;
mod foreign;
mod gather;
mod guard;
mod identity;
mod index;
pub mod input;
mod joints;
mod judge;
mod layout;
mod losses;
mod map;
mod mark;
#[cfg(any(test, not(feature = "s3")))]
mod no_object;
#[cfg(feature = "s3")]
mod object;
mod occlusion;
mod open;
pub mod output;
mod poses;
mod ranges;
mod raw;
mod read;
mod reading;
mod records;
mod report;
pub mod ros2;
mod seal;
mod shortened;
mod streams;
mod sweep;
mod temperature;
mod together;
mod transforms;
mod url;
mod witness;

pub use bag::read_with;
pub use budget::Allowance;
pub use bytes::{Access, identity_of, sha256_of};
pub use error::{RecordingError, nearest_name, shortened};
pub use extract::{EXTRACT_METADATA, Extract, Extracted, extract};
pub use fingerprint::{Fingerprint, SharedTime};
pub use foreign::inflate_message;
pub use foreign::names::{files_of, is_recording, recordings_at, without_ending};
pub use guard::{
    Over, file_has_content, make_folder, make_folder_in, may_put, may_write, may_write_all, may_write_over,
};
pub use losses::data_loss_warnings;
pub use mark::SET_POINTS_METADATA;
pub use open::Recording;
pub use raw::{Attachment, MetadataVisitor, RawChannel, RawMessage, RawMetadata, RawSchema, RawVisitor};
pub use report::*;
pub use seal::{is_marked, seal_text};
pub use streams::{
    Encoder, GaugeStream, JointStream, JointUnit, LengthUnit, PoseStream, ScalarStream, Streams,
};
pub use transforms::{Chain, Transforms};
pub use url::{is_url, list_objects, resolve_path};

#[cfg(test)]
mod tests;
