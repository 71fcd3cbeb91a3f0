//! Two arms in one recording, their tips joined: each calibrates the other, without a camera.
//!
//! [`pipeline`] is what a user writes (recognised by its `[closed_chain]`), [`joined`] reads the two joint streams as one,
//! [`check`] refuses dwells that place no arm against the
//! other. Everything else is as with one arm: the model
//! is one, with both arms in it.

pub mod check;
pub mod joined;
pub mod pipeline;

pub use pipeline::TwoArms;
