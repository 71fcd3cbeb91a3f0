//! Does what was learnt in one place help in another?
//!
//! [`recordings`]: what all recordings of a session but one taught, judged on that one. [`sessions`]: what one session
//! taught, judged in another.

mod recordings;
mod sessions;

pub use recordings::{Transfer, transfer_between_recordings};
pub use sessions::{Asked, SessionTransfer, transfer_between_sessions};

use armcal_model::EffectSpec;
use serde::Serialize;

/// An effect that does not go along.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// As a pipeline spells it.
    pub effect: String,
    /// Why.
    pub reason: String,
}

impl LeftOut {
    /// A formula of absolute time, or of the recording.
    pub fn of_time(effect: &EffectSpec) -> LeftOut {
        let reason = "a formula of this session's time or recordings, which no other session has".to_owned();
        LeftOut { effect: effect.to_string(), reason }
    }

    /// An event of one session.
    fn event(effect: &EffectSpec) -> LeftOut {
        let reason = "an event of this session: no other one can tell whether it happened".to_owned();
        LeftOut { effect: effect.to_string(), reason }
    }
}
