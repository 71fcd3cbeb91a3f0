//! What is in the bytes of an MCAP file: records, chunks, channels, and where they lie.

pub(crate) mod channels;
pub(crate) mod chunk;
pub(crate) mod damage;
pub(crate) mod index;
pub(crate) mod layout;
pub(crate) mod raw;
pub(crate) mod records;
pub(crate) mod survey;
