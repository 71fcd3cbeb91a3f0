//! Data lost from any recording that this process reported on.
//!
//! A command is a process: whatever it makes of recordings, it must not end as if all of them had been there. So reports
//! note what was lost here, and nothing has to be handed on for a command to ask.

use armcal_core::{Severity, Warning};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// So many are kept; campaigns have more, and count them by recording.
const KEPT: usize = 1000;

static LOSSES: Mutex<Vec<Warning>> = Mutex::new(Vec::new());

/// Every warning that data of a recording were lost, once, in the order in which they were found.
pub fn data_loss_warnings() -> Vec<Warning> {
    lock().clone()
}

/// Notes those of a report.
pub(crate) fn add_warnings(warnings: &[Warning]) {
    let mut known = lock();
    for warning in warnings.iter().filter(|w| w.severity == Severity::DataLost) {
        if known.len() < KEPT && !known.contains(warning) {
            known.push(warning.clone());
        }
    }
}

/// Nothing panics while it is held.
fn lock() -> MutexGuard<'static, Vec<Warning>> {
    LOSSES.lock().unwrap_or_else(PoisonError::into_inner)
}
