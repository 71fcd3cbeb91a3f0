//! Two tips in one recording that are joined: each calibrates the other, without a camera.
//!
//! [`closure`] is what a user writes of that. The tips are those of two arms with a model file each ([`pipeline`], recognised by
//! its `[[arms]]`), or two points of one robot, such as the hands of a torso with two arms. [`fit`] finds the dwells in which they
//! are joined and calibrates on them. Everything else is as with one arm: the model is one, with all joints in it.

pub mod closure;
pub mod fit;
pub mod pipeline;

pub use closure::ClosedChainSection;
pub use pipeline::TwoArms;
