//! One command, one file.

pub mod add;
pub(crate) mod batch;
pub mod check;
pub(crate) mod compare;
pub mod compensate;
pub(crate) mod completions;
pub(crate) mod diagnose;
pub(crate) mod effects;
pub(crate) mod export;
pub mod extract;
pub mod init;
pub(crate) mod inspect;
pub(crate) mod man;
pub mod plan;
pub(crate) mod pool;
pub(crate) mod run;
pub(crate) mod simulate;
pub(crate) mod transfer;
pub(crate) mod verify;
pub(crate) mod view;
pub mod write;

use crate::error::Error;
use crate::stdout::{print, terminal_style};
use armcal_recording::data_loss_warnings;
use std::path::{Path, PathBuf};

/// How a command ended when it did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, but data were lost or the model is inadequate.
    CompletedWithWarnings,
    /// Done, and the result breaks a limit.
    LimitExceeded,
}

/// What recordings lost, in the JSON of a result, where anything was.
fn with_losses(mut value: serde_json::Value) -> serde_json::Value {
    let lost = data_loss_warnings();
    if let (Some(object), false) = (value.as_object_mut(), lost.is_empty()) {
        object.insert("data_lost".to_owned(), serde_json::json!(lost));
    }
    value
}

/// Whether outputs may be written at all, asked before long computations.
fn may_write(paths: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<(), Error> {
    armcal_recording::may_write_all(paths).map_err(Error::Output)
}

/// `JOINT=LOW..HIGH`: the joint by number from 1 or by name, and its range as written; `None` where it is not that.
fn joint_range(words: &str, joints: &[String]) -> Option<(usize, [f64; 2])> {
    let (joint, range) = words.split_once('=')?;
    let by_name = joints.iter().position(|name| name == joint.trim());
    let joint = by_name.or_else(|| joint.trim().parse::<usize>().ok()?.checked_sub(1))?;
    let (low, high) = range.split_once("..")?;
    let (low, high) = (low.trim().parse::<f64>().ok()?, high.trim().parse::<f64>().ok()?);
    let usable = joint < joints.len() && low.is_finite() && low < high && high.is_finite();
    usable.then_some((joint, [low, high]))
}

/// Says which files were written where.
fn print_written(out: &Path, written: &[PathBuf]) -> Result<(), Error> {
    let names: Vec<String> =
        written.iter().filter_map(|p| p.file_name()).map(|n| n.to_string_lossy().into()).collect();
    print(&format!("\nWritten to {}: {}\n", out.display(), names.join(", ")))
}

/// A value as indented JSON, ending in a newline.
fn json_text(value: &impl serde::Serialize) -> Result<String, Error> {
    serde_json::to_string_pretty(value).map(|text| text + "\n").map_err(Error::Json)
}
