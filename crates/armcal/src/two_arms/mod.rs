//! Two arms in one recording, their tips joined: each calibrates the other, without a camera.
//!
//! [`pipeline`] is what a user writes (recognised by its `[closed_chain]`), [`joined`] reads the two joint streams as one,
//! [`fit`] finds the dwells in which the tips are joined and calibrates on them. Everything else is as with one arm: the model
//! is one, with both arms in it.

pub mod fit;
pub mod joined;
pub mod pipeline;

pub use pipeline::TwoArms;
