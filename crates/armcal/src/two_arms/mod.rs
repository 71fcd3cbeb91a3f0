//! Two tips in one recording that are joined: each calibrates the other, without a camera.
//!
//! [`closure`] is what a user writes of that. The tips are those of two arms with a model file each ([`pipeline`], recognised by
//! its `[[arms]]`), or two points of one robot, such as the hands of a torso with two arms. [`check`] refuses dwells that place
//! neither against the other. Everything else is as with one arm: the model is one, with all joints in it.

pub mod check;
pub mod closure;
pub mod pipeline;

pub use closure::ClosedChainSection;
pub use pipeline::TwoArms;
