//! Files that are written, and what may be written over.

pub mod atomic;
pub(crate) mod extract;
pub(crate) mod guard;
pub(crate) mod mark;
pub mod output;
pub(crate) mod seal;
