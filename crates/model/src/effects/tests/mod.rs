//! Tests of the effects, by question.

mod contract;
mod declared;
mod gravity;
mod neighbours;
mod physics;
mod rig;
mod words;
