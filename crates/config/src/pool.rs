//! `[pool]`: what each recording has for itself, and how it is asked whether the rest carries over.

use crate::ConfigError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How recordings are calibrated together: what they share in `armcal run` and `armcal pool`, and how the latter asks whether
/// that carries over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PoolSection {
    /// Names or globs of parameters that each recording has for itself beside its board's pose: `["base.*"]` where the
    /// camera was set up anew, `["joint1.theta"]` where a belt may have slipped. Bounds and priors are those of the
    /// parameter. None by default.
    pub per_recording: Vec<String>,
    /// Recordings are held out in turn, in this many groups at most; default 10, at least 2.
    pub turns: usize,
}

impl Default for PoolSection {
    fn default() -> PoolSection {
        PoolSection { per_recording: Vec::new(), turns: 10 }
    }
}

impl PoolSection {
    /// Refuses impossible values; `path` is the pipeline, for the message.
    pub fn check(&self, path: &Path) -> Result<(), ConfigError> {
        if self.turns >= 2 {
            return Ok(());
        }
        let problem = format!("is {}: give 2 or more groups of recordings to hold out in turn", self.turns);
        Err(ConfigError::Contradiction { path: path.to_owned(), key: "pool.turns".into(), problem })
    }
}
