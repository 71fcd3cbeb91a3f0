//! Does what was learnt in one place help in another?
//!
//! [`recordings`]: what all recordings of a session but one taught, judged on that one. [`sessions`]: what one session
//! taught, judged in another.

mod recordings;
mod sessions;

pub use recordings::{Transfer, transfers};
pub use sessions::{Asked, Carried, LeftBehind, SessionTransfer, between};

use armcal_diagnose::HeldOut;

/// What an interval of a change says.
pub(crate) fn verdict(held_out: &HeldOut) -> &'static str {
    let [low, high] = held_out.change_ci95;
    match (high < 0.0, low > 0.0) {
        (true, _) => "it helps there",
        (_, true) => "it does harm there",
        _ => "no more than chance",
    }
}

/// Whether it raises the error by more than chance.
pub(crate) fn harms(held_out: &HeldOut) -> bool {
    held_out.change_ci95[0] > 0.0
}
