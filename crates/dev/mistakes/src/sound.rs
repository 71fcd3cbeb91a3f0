//! Sound recordings, half of them with a physical effect hidden in the rig: nothing is wrong with their setup.

use crate::judge::{NOTHING, SHOWN};
use crate::rigs::{Hidden, six_axis};
use crate::run::{Place, Said};
use crate::{Draw, Error, Rig, Session, draw, run};
use armcal_lab::planted::catalogue_families;
use armcal_lab::scenario::{Design, Scenario};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Codes of warnings that accuse the setup, where there is no section of its own to do it.
const ACCUSING: [&str; 4] = ["unit-doubtful", "board-turned", "frame-declared-wrong", "recording-twice"];

/// Families that are faults of the setup by themselves: something was moved between two dwells, or has another scale than
/// declared. Reporting them as such would be no false alarm.
const FAULTS: [&str; 5] = ["zero_slip", "tool_shift", "frame_shift", "sensor_scale", "board_scale"];

/// One sound session and what was said to it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Sound {
    /// Its number.
    pub number: usize,
    /// The rig.
    pub rig: Rig,
    /// The effect that is hidden, or `nothing`.
    pub hidden: String,
    /// What was said.
    pub said: Said,
    /// What of it is false: a mistake reported, a run refused, `nothing_missing` where something is.
    pub alarms: Vec<String>,
}

/// Draws sound session `number`, runs the program on it in `folder`, and judges.
pub fn run_session(armcal: &Path, number: usize, seed: u64, folder: &Path) -> Result<Sound, Error> {
    let (rig, hidden, session) = draw_session(number, seed)?;
    let said = run::run(armcal, &session, folder)?;
    let alarms = false_alarms(&said, &hidden);
    Ok(Sound { number, rig, hidden, said, alarms })
}

impl Sound {
    /// Judges again what was said.
    pub fn judged_again(self) -> Sound {
        Sound { alarms: false_alarms(&self.said, &self.hidden), ..self }
    }
}

/// The rigs in turn, and on each by turns nothing hidden and one effect of a drawn size.
fn draw_session(number: usize, seed: u64) -> Result<(Rig, String, Session), Error> {
    let rig = Rig::ALL[number % 3];
    let case = format!("sound {number}");
    let mut draw = Draw::new(seed, &case, rig.word());
    if (number / 3).is_multiple_of(2) {
        return Ok((rig, "nothing".to_owned(), Session::sound(rig, seed, &case)?));
    }
    let seed = draw::case_seed(seed, &case, rig.word());
    if rig == Rig::Poses {
        let hidden = Hidden::draw(&mut draw);
        let lab = six_axis::Lab { hidden: Some(hidden), ..six_axis::Lab::new(seed) };
        return Ok((rig, hidden.word().to_owned(), Session::of_six_axis(lab)?));
    }
    let physical = |family: &&str| !FAULTS.iter().any(|fault| family.starts_with(fault));
    let families: Vec<&str> = catalogue_families().into_iter().filter(physical).collect();
    let family = families[draw.pick(families.len())];
    let design = [Design::ThreeTiltsOnePass, Design::ThreeTiltsBothWays, Design::FreePoses][draw.pick(3)];
    let config = Scenario::new(family, design, seed).plant()?.config;
    Ok((rig, family.to_owned(), Session::of_lab(rig, config)?))
}

fn false_alarms(said: &Said, hidden: &str) -> Vec<String> {
    let mut alarms = Vec::new();
    if !matches!(said.exit, Some(0 | 3)) {
        let text = said.statements.last().map(|s| s.text.lines().next().unwrap_or_default().to_owned());
        alarms.push(format!("refused: {}", text.unwrap_or_default()));
    }
    for s in &said.statements {
        if s.place == Place::Setup || (s.place == Place::Warning && ACCUSING.contains(&s.code.as_str())) {
            alarms.push(format!("{}: {}", s.code, s.text));
        }
    }
    let above = |floors: f64| said.ratio().is_some_and(|ratio| ratio > floors);
    match said.verdict.as_deref() {
        Some("nothing_missing") if above(NOTHING) => {
            alarms.push("nothing_missing above the floor".to_owned())
        }
        Some("unexplained") if hidden == "nothing" && !above(SHOWN) => {
            alarms.push("unexplained at the floor".to_owned())
        }
        _ => {}
    }
    alarms
}
