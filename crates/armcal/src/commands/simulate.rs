//! `armcal simulate`: the virtual rig.

use super::{Outcome, print};
use crate::error::Error;
use armcal_lab::{LabConfig, simulate};
use std::path::Path;

/// Simulates a rig and writes its recordings and their truth to `out`.
pub fn run(lab: &Path, out: &Path, seed: Option<u64>) -> Result<Outcome, Error> {
    let text = std::fs::read_to_string(lab).map_err(|source| Error::ReadFile {
        what: "lab file",
        path: lab.to_owned(),
        source,
    })?;
    let mut config = LabConfig::from_toml(&text, lab)?;
    config.seed = seed.unwrap_or(config.seed);
    let folder = lab.parent().unwrap_or(Path::new(""));
    let simulated = simulate(&config, folder, out)?;
    for path in simulated.recordings.iter().chain([&simulated.truth]) {
        print(&format!("{}\n", path.display()));
    }
    Ok(Outcome::Done)
}
