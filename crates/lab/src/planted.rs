//! Sealed scenarios: one thing hidden in a rig drawn by a seed, seen by one design of motion.
//!
//! `Scenario -> Planted (LabConfig, what is hidden) -> observe (quick) or seal (recordings, and the truth apart)`.
//! The rig has the paper's geometry errors and masses up to 25 % off; sizes are log-uniform over what is realistic
//! for a low-cost arm. Families bear the names of the product's catalogue, but each is a mechanism with its own
//! physics: the names only say what a right answer would be.

mod discrepancy;
mod families;
mod outside;
mod seal;

pub use seal::{Sealed, seal};

use crate::checks::{parse_toml, value_error};
use crate::config::LabConfig;
use crate::random::{Purpose, Stream};
use crate::scenario::{Hidden, Scenario};
use crate::{LabError, Observed, observe};
use families::Draw;
use std::path::Path;

/// A rig with something hidden.
#[derive(Debug, Clone, PartialEq)]
pub struct Planted {
    /// The laboratory; needs no file.
    pub config: LabConfig,
    /// What is hidden; empty for nothing.
    pub hidden: Vec<Hidden>,
}

/// The families whose names are in the product's catalogue.
pub fn catalogue_families() -> Vec<&'static str> {
    families::FAMILIES.iter().map(|family| family.name).collect()
}

/// The ways of hiding nothing listed: noise as declared, noise that is worse, and a smooth displacement that has no name.
pub fn null_families() -> Vec<&'static str> {
    let displaced = discrepancy::FAMILIES.iter().map(|family| family.name);
    NOTHING.into_iter().chain(displaced).collect()
}

/// The mechanisms that are in no catalogue.
pub fn uncatalogued_families() -> Vec<&'static str> {
    outside::FAMILIES.iter().map(|family| family.name).collect()
}

/// Families to hide two at a time: a large effect beside a small one, two of one driver, two events.
pub fn family_pairs() -> Vec<&'static str> {
    PAIRS.to_vec()
}

const PAIRS: [&str; 14] = [
    "backlash+compliance",
    "backlash+eccentricity",
    "backlash+link_bending",
    "backlash+base_compliance",
    "backlash+axis_tilt",
    "backlash+thermal_growth",
    "backlash+frame_shift",
    "gear_ratio+eccentricity",
    "zero_drift+second_harmonic",
    "compliance+tool_shift",
    "link_bending+zero_slip",
    "belt_coupling+frame_shift@dwell",
    "axis_tilt+gear_ratio",
    "zero_slip+thermal_growth",
];

/// The ways of hiding nothing.
const NOTHING: [&str; 6] = [
    "nothing",
    "nothing:white",
    "nothing:cavities",
    "nothing:autocorrelated",
    "nothing:heavy_tails",
    "nothing:swaps",
];

/// Makes the noise what a name of [`NOTHING`] says; whether it is one.
fn worsen_noise(name: &str, config: &mut LabConfig) -> bool {
    match name {
        "nothing" => {}
        "nothing:white" => config.board.true_cavity_sigma_mm = Some(0.0),
        // Three times the tolerance that the board file declares.
        "nothing:cavities" => config.board.true_cavity_sigma_mm = Some(0.15),
        "nothing:autocorrelated" => {
            config.hand.seat_correlation = 0.7;
            (config.vicon.correlated_share, config.vicon.correlation_s) = (0.5, 15.0);
        }
        "nothing:heavy_tails" => {
            config.hand.seat_tail_degrees = 3.0;
            config.vicon.tail_degrees = 3.0;
        }
        "nothing:swaps" => {
            config.vicon.swaps_per_minute = 0.5;
            config.hand.seat_tail_degrees = 3.0;
        }
        _ => return false,
    }
    true
}

impl Scenario {
    /// Draws the rig and hides what is to be hidden.
    pub fn plant(&self) -> Result<Planted, LabError> {
        let mut config = paper_rig(self.seed)?;
        self.design.apply(&mut config, self.driving);
        let mut hidden = Vec::new();
        for (part, name) in self.family.split('+').map(str::trim).enumerate() {
            if worsen_noise(name, &mut config) {
                continue;
            }
            let family = find_family(name).ok_or_else(|| unknown_family(name))?;
            let draw = Stream::new(self.seed, Purpose::Scenario, part);
            let target = self.target.filter(|_| part == 0);
            let planted = Draw::new(draw, target, self.size, self.design).plant(family, &mut config)?;
            hidden.push(planted);
        }
        config.check()?;
        Ok(Planted { config, hidden })
    }

    /// Plants it and observes it on the quick path; the truth knows what is hidden.
    pub fn observe(&self) -> Result<Observed, LabError> {
        let planted = self.plant()?;
        let mut observed = observe(&planted.config)?;
        observed.truth.scenario = Some(self.clone());
        observed.truth.hidden = planted.hidden;
        Ok(observed)
    }
}

/// Everything about the rig that is not a default: its name tells nothing.
const RIG: &str = "name = 'rig'\nseed = 0\nrecordings = []\nboard.file = 'builtin:paper'";

/// The paper's rig of one seed, nothing hidden, nothing to do yet.
fn paper_rig(seed: u64) -> Result<LabConfig, LabError> {
    let mut config = LabConfig { seed, ..parse_toml("lab file", RIG, Path::new("rig"))? };
    config.arm.deviation.mass_percent = 25.0;
    Ok(config)
}

/// Whether these are families that can be hidden, one or several joined by `+`.
///
/// # Errors
/// The first that is none, with the nearest that is one.
pub fn check_family(words: &str) -> Result<(), LabError> {
    let known = |name: &str| NOTHING.contains(&name) || find_family(name).is_some();
    match words.split('+').map(str::trim).find(|name| !known(name)) {
        Some(name) => Err(unknown_family(name)),
        None => Ok(()),
    }
}

fn find_family(name: &str) -> Option<&'static families::Family> {
    let all = families::FAMILIES.iter().chain(outside::FAMILIES).chain(discrepancy::FAMILIES);
    all.into_iter().find(|family| family.name == name)
}

fn unknown_family(name: &str) -> LabError {
    let known: Vec<&str> =
        catalogue_families().into_iter().chain(null_families()).chain(uncatalogued_families()).collect();
    let nearest = armcal_recording::nearest_name(name, &known);
    let nearest = nearest.map(|n| format!(" (did you mean `{n}`?)")).unwrap_or_default();
    value_error(
        "scenario.family",
        format!("there is no family `{name}`{nearest}; they are: {}", known.join(", ")),
    )
}

#[cfg(test)]
mod tests;
