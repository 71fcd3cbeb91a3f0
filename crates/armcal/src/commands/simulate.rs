//! `armcal simulate`: the virtual rig.

use super::{Outcome, print};
use crate::error::Error;
use armcal_config::read_text;
use armcal_lab::pair::{self, PairConfig};
use armcal_lab::planted::{check_family, seal};
use armcal_lab::scenario::{Scenario, parse_word};
use armcal_lab::{LabConfig, simulate};
use armcal_recording::input::Kind;
use std::path::{Path, PathBuf};

/// Simulates the rig that `lab` describes, of one arm or (with `[[arms]]`) of two, and writes its recordings and their truth to `out`.
pub fn run(lab: Option<&Path>, out: &Path, seed: Option<u64>) -> Result<Outcome, Error> {
    let lab = lab.unwrap_or(Path::new(""));
    let text = read_text("lab file", Kind::Text, lab)?;
    if text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("arms")) {
        let mut config = PairConfig::from_toml(&text, lab)?;
        config.seed = seed.unwrap_or(config.seed);
        let simulated = pair::simulate(&config, out)?;
        print_paths(simulated.recordings.iter().chain([&simulated.truth]))?;
        return Ok(Outcome::Done);
    }
    let mut config = LabConfig::from_toml(&text, lab)?;
    config.seed = seed.unwrap_or(config.seed);
    let folder = lab.parent().unwrap_or(Path::new(""));
    let simulated = simulate(&config, folder, out)?;
    print_paths(simulated.recordings.iter().chain([&simulated.truth]))?;
    Ok(Outcome::Done)
}

/// Draws a rig that hides `family`, and writes what the product may see to `out` and the truth beside it.
pub fn hide_effect(family: &str, design: &str, size: &str, out: &Path, seed: u64) -> Result<Outcome, Error> {
    check_family(family).map_err(Error::of_usage)?;
    let size = parse_word("size", size).map_err(Error::of_usage)?;
    let design = parse_word("design", design).map_err(Error::of_usage)?;
    let scenario = Scenario { size, ..Scenario::new(family, design, seed) };
    let mut truth = out.as_os_str().to_owned();
    truth.push("-truth.json");
    let sealed = seal(&scenario, out, Path::new(&truth))?;
    print_paths(sealed.recordings.iter().chain([&sealed.pipeline, &sealed.truth]))?;
    Ok(Outcome::Done)
}

fn print_paths<'p>(mut paths: impl Iterator<Item = &'p PathBuf>) -> Result<(), Error> {
    paths.try_for_each(|path| print(&format!("{}\n", path.display())))
}
