//! MCAP recordings in and out.
//!
//! Reading, in the order data flows through the modules:
//! `map` (the file's bytes) -> `records` (record envelopes) -> `layout` (where messages lie, by index or by
//! walking) -> `chunk` (inflated and checked) -> `sweep` (all blocks in parallel, results in file order) ->
//! `decode` (messages to rows) -> `gather` (rows of a stream) -> `read` (columns: clock, cleaning, units).
//!
//! [`Recording::open`] takes any MCAP: chunked or not, indexed or not, zstd, lz4 or uncompressed, finished, cut
//! off or damaged. What is sound is used; what is not is reported with its byte offset and reason. Nothing panics
//! on bad input.
//!
//! Writing: [`output::McapOutput`] into an [`atomic::AtomicFile`]; same messages, same bytes.

pub mod atomic;
mod channels;
mod chunk;
mod clean;
mod clock;
pub mod decode;
mod error;
mod gather;
mod joints;
mod layout;
mod map;
mod occlusion;
mod open;
pub mod output;
mod poses;
mod raw;
mod read;
mod records;
mod report;
pub mod ros2;
mod scalars;
mod streams;
mod sweep;

pub use error::RecordingError;
pub use map::sha256_of_file;
pub use open::Recording;
pub use raw::{Attachment, RawChannel, RawMessage, RawSchema};
pub use report::*;
pub use streams::{Encoder, JointStream, JointUnit, LengthUnit, PoseStream, ScalarStream, Streams};

#[cfg(test)]
mod tests;
