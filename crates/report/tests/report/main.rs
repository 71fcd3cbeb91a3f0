//! What the written files say, read back by other means than they were written with.

#![allow(clippy::unwrap_used)] // A test that cannot go on may stop.

mod input;
mod synthetic;

/// What was found: arrays to plot, maps to look at, layouts that point at them.
mod findings;

/// Layouts by the keys that the viewers' panels document.
mod layouts;

/// `run.mcap`: input untouched, every message decodable, pictures in the right place.
mod recording;

/// The robots and the board as URDF.
mod robots;

/// Terminal, page and viewer end with the same sentences.
mod story;

/// `summary.json` keeps its contract and its numbers.
mod summary;

/// `report.html`: what it embeds, and what a name from outside can do to it.
mod page;

/// Parquet tables, parameters, the calibrated model.
mod tables;

/// `observations.json`: what the fit saw comes back to the last bit.
mod stored_observations;

/// `model.json`: the calibrated model comes back as it was.
mod stored_model;

/// What a person reads.
mod terminal;

/// Hostile names, folders that cannot be written, runs that contradict themselves.
mod trouble;
