//! Tests of the effects, by question.

mod contract;
mod neighbours;
mod physics;
mod rig;
mod words;
