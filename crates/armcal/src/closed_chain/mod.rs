//! Two arms in one recording, their tips joined: each calibrates the other, without a camera.
//!
//! [`pipeline`] is what a user writes (recognised by its `[closed_chain]`), [`joined`] reads the two joint streams as one
//! and splits each dwell into both arms again, [`story`] goes from the recordings to the run.

pub mod joined;
pub mod pipeline;
pub mod story;

pub use pipeline::ClosedPipeline;
pub use story::run;
