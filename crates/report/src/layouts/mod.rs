//! Foxglove layouts made for one run, so that every panel has something to show: one spec, written in the current format
//! and in the legacy one, which Lichtblick reads.
//!
//! Paths keep to what both applications understand: names, slices and indices, no functions. All arrays of a plot are
//! of one message, because a plot has one x for all its series and pairs them by position.

mod config;
mod current;
mod drawn;
mod joints;
mod legacy;
mod panels;
mod scale;
mod spec;
mod tabs;
mod views;

use crate::findings::Findings;
use armcal_result::{Point, Run};

/// The two files of a layout.
pub(crate) struct Layouts {
    /// For Foxglove of 2026 and later.
    pub current: String,
    /// For Foxglove Studio and Lichtblick.
    pub legacy: String,
}

/// The layout of a run, in both formats, ending in a newline.
pub(crate) fn run_layouts(run: &Run, points: &[Point], findings: &Findings) -> Layouts {
    let content = tabs::all_tabs(run, points, findings);
    let text = |value: &serde_json::Value| format!("{value:#}\n");
    Layouts { current: text(&current::layout(&content)), legacy: text(&legacy::layout(&content)) }
}
