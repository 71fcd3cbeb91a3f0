//! Which observations are held out, in which turns.

pub(crate) mod calibration;

use crate::objective::poses::{Sets, each_pose_pair, pose_groups};
use crate::{CalibrateError, HoldoutConfig, RecordingKey};
use armcal_core::{Code, DwellId, Observation, Severity, Stage, Warning};
use std::collections::{BTreeMap, BTreeSet};

/// The hold-out of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Holdout {
    /// Observations held out in each turn, as indices in rising order.
    pub turns: Vec<Vec<usize>>,
    /// Whether the written parameters come from all observations (every one is held out in some turn) rather than
    /// from those outside the only turn.
    pub in_turn: bool,
    /// What is to be said about it.
    pub warnings: Vec<Warning>,
}

/// Finds the observations a config means. `boards` are the names of the recordings' board frames.
pub(crate) fn resolve(
    config: &HoldoutConfig,
    observations: &[Observation],
    boards: &[String],
) -> Result<Holdout, CalibrateError> {
    let holdout = |turns, in_turn| Holdout { turns, in_turn, warnings: Vec::new() };
    let once = |held: BTreeSet<usize>| holdout(vec![held.into_iter().collect()], false);
    let mut holdout = match config {
        HoldoutConfig::None => holdout(Vec::new(), false),
        HoldoutConfig::Cavities { names } => once(by_cavities(names, observations)?),
        HoldoutConfig::EveryNthCavity { n, offset } => {
            if *n < 2 || offset >= n {
                return Err(bad_config(
                    "holdout.n",
                    format!("{n}, offset {offset}"),
                    "n of 2 or more, offset below n",
                ));
            }
            let cavities = cavities_of(observations);
            let chosen = cavities.values().skip(*offset).step_by(*n);
            once(with_their_poses(chosen.flatten().copied().collect(), observations))
        }
        HoldoutConfig::Recordings { recordings } => once(by_recordings(recordings, observations, boards)?),
        HoldoutConfig::EachRecording => holdout(of_recordings(observations), true),
        HoldoutConfig::RecordingFolds { k } => holdout(recording_folds(*k, observations)?, true),
        HoldoutConfig::CavityFolds { k } => holdout(cavity_folds(*k, observations)?, true),
        HoldoutConfig::Random { share, seed } => {
            if !(*share > 0.0 && *share < 1.0) {
                return Err(bad_config("holdout.share", share.to_string(), "a number between 0 and 1"));
            }
            once(random_poses(*share, *seed, observations))
        }
        HoldoutConfig::Dwells { dwells } => once(by_dwells(dwells, observations)?),
    };
    for turn in &holdout.turns {
        if turn.len() == observations.len() {
            let context = format!(" outside the hold-out (it takes all {} of them)", turn.len());
            return Err(CalibrateError::NoObservations { context });
        }
    }
    holdout.turns.retain(|turn| !turn.is_empty());
    holdout.warnings.extend(poses_on_both_sides(&holdout.turns, observations));
    Ok(holdout)
}

/// A hold-out that its config spells out may part dwells of one pose: it is done as told, and said.
fn poses_on_both_sides(turns: &[Vec<usize>], observations: &[Observation]) -> Option<Warning> {
    let mut turn_of: Vec<Option<usize>> = vec![None; observations.len()];
    for (turn, held) in turns.iter().enumerate() {
        held.iter().for_each(|i| turn_of[*i] = Some(turn));
    }
    let mut seen = vec![false; observations.len()];
    each_pose_pair(observations, |a, b| {
        if turn_of[a] != turn_of[b] {
            seen[a] |= turn_of[a].is_some();
            seen[b] |= turn_of[b].is_some();
        }
    });
    let (parted, held) = (seen.iter().filter(|s| **s).count(), turn_of.iter().flatten().count());
    let message = format!(
        "{parted} of the {held} held-out dwells are at a pose at which the fit saw another dwell: there the error tells how well \
         the pose is repeated, not how well other poses are predicted; hold out whole poses (`cavity-folds`, `random`) for that"
    );
    (parted > 0)
        .then(|| Warning::new(Severity::Notice, Stage::Calibrate, Code::PoseOnBothSides, "hold-out", message))
}

/// These observations and all others of their poses.
fn with_their_poses(held: BTreeSet<usize>, observations: &[Observation]) -> BTreeSet<usize> {
    let groups = pose_groups(observations);
    let poses: BTreeSet<usize> = held.iter().map(|i| groups[*i]).collect();
    (0..observations.len()).filter(|i| poses.contains(&groups[*i])).collect()
}

fn bad_config(key: &'static str, value: String, why: &str) -> CalibrateError {
    CalibrateError::BadConfig { key, value, why: format!("give {why}") }
}

fn by_cavities(names: &[String], observations: &[Observation]) -> Result<BTreeSet<usize>, CalibrateError> {
    let cavities = cavities_of(observations);
    let mut held = BTreeSet::new();
    for name in names {
        let visits = cavities.get(&natural_key(name)).ok_or_else(|| {
            let present = observations.iter().filter_map(Observation::cavity);
            CalibrateError::UnknownHoldout {
                kind: "cavity",
                name: name.clone(),
                hint: nearest_hint(name, present),
            }
        })?;
        held.extend(visits);
    }
    Ok(held)
}

fn by_recordings(
    recordings: &[RecordingKey],
    observations: &[Observation],
    boards: &[String],
) -> Result<BTreeSet<usize>, CalibrateError> {
    let short = |board: &str| board.strip_prefix("board.").unwrap_or(board).to_string();
    let mut held = BTreeSet::new();
    for key in recordings {
        let index = match key {
            RecordingKey::Index(index) => Some(*index),
            RecordingKey::Name(name) => boards.iter().position(|b| b == name || short(b) == *name),
        };
        let before = held.len();
        held.extend((0..observations.len()).filter(|&i| Some(observations[i].dwell.recording) == index));
        if held.len() == before {
            let names: Vec<String> = boards.iter().map(|b| short(b)).collect();
            let hint = match key {
                RecordingKey::Name(name) if !names.is_empty() => {
                    nearest_hint(name, names.iter().map(String::as_str))
                }
                _ => "; recordings without a board are named by their index in the pipeline, from 0"
                    .to_string(),
            };
            return Err(CalibrateError::UnknownHoldout { kind: "recording", name: key.to_string(), hint });
        }
    }
    Ok(held)
}

fn by_dwells(dwells: &[[usize; 2]], observations: &[Observation]) -> Result<BTreeSet<usize>, CalibrateError> {
    let mut held = BTreeSet::new();
    for &[recording, dwell] in dwells {
        let id = DwellId { recording, dwell };
        let own: Vec<usize> = (0..observations.len()).filter(|i| observations[*i].dwell == id).collect();
        if own.is_empty() {
            return Err(CalibrateError::UnknownHoldout {
                kind: "dwell",
                name: format!("[{recording}, {dwell}]"),
                hint: " (it may have been rejected or not associated)".to_string(),
            });
        }
        held.extend(own);
    }
    Ok(held)
}

/// Observations of each recording.
fn of_recordings(observations: &[Observation]) -> Vec<Vec<usize>> {
    let mut turns: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, o) in observations.iter().enumerate() {
        turns.entry(o.dwell.recording).or_default().push(i);
    }
    turns.into_values().collect()
}

/// `k` groups of recordings, dealt out like cards, so that each group covers the whole time.
fn recording_folds(k: usize, observations: &[Observation]) -> Result<Vec<Vec<usize>>, CalibrateError> {
    let recordings = of_recordings(observations);
    if k < 2 || k > recordings.len() {
        let why = format!("a number from 2 to {}, the number of recordings", recordings.len());
        return Err(bad_config("holdout.k", k.to_string(), &why));
    }
    let mut turns = vec![Vec::new(); k];
    recordings.into_iter().enumerate().for_each(|(r, own)| turns[r % k].extend(own));
    turns.iter_mut().for_each(|turn| turn.sort_unstable());
    Ok(turns)
}

/// `k` groups of cavities, dealt out like cards in natural order, so that each group covers the whole board. Tracked dwells
/// go by their poses, and with the cavity whose pose they share.
fn cavity_folds(k: usize, observations: &[Observation]) -> Result<Vec<Vec<usize>>, CalibrateError> {
    let mut sets = Sets::new(observations.len());
    for visits in cavities_of(observations).values() {
        visits.windows(2).for_each(|pair| sets.join(pair[0], pair[1]));
    }
    each_pose_pair(observations, |a, b| sets.join(a, b));
    let mut groups = members(&sets.numbered());
    if k < 2 || k > groups.len() {
        let why = format!("a number from 2 to {}, the number of cavities and tracked poses", groups.len());
        return Err(bad_config("holdout.k", k.to_string(), &why));
    }
    // Dealt out in the order of their hashes: a round of poses repeated in the recording must not fill one turn.
    groups.sort_by_key(|group| group.first().map(|&i| dwell_hash(0, &observations[i])));
    let mut turns = vec![Vec::new(); k];
    for (g, group) in groups.into_iter().enumerate() {
        turns[g % k].extend(group);
    }
    turns.iter_mut().for_each(|turn| turn.sort_unstable());
    Ok(turns)
}

/// A hash of seed, recording and dwell, the same on every machine.
fn dwell_hash(seed: u64, o: &Observation) -> u64 {
    mix_bits(mix_bits(mix_bits(seed) ^ o.dwell.recording as u64) ^ o.dwell.dwell as u64)
}

/// The poses with the smallest hashes of (seed, recording, dwell), by the smallest of their dwells, until there are enough
/// dwells: adding a dwell never reshuffles the others.
fn random_poses(share: f64, seed: u64, observations: &[Observation]) -> BTreeSet<usize> {
    let hash = |pose: &Vec<usize>| pose.iter().map(|i| dwell_hash(seed, &observations[*i])).min();
    let mut ranked = members(&pose_groups(observations));
    ranked.sort_by_key(hash);
    let count = (share * observations.len() as f64).round() as usize;
    let mut held = BTreeSet::new();
    for pose in ranked {
        if held.len() >= count {
            break;
        }
        held.extend(pose);
    }
    held
}

/// Members of each group, by its number.
fn members(groups: &[usize]) -> Vec<Vec<usize>> {
    let count = groups.iter().max().map_or(0, |last| last + 1);
    let mut members = vec![Vec::new(); count];
    groups.iter().enumerate().for_each(|(i, group)| members[*group].push(i));
    members
}

/// Finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix_bits(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Visits of each cavity, cavities in natural order.
fn cavities_of(observations: &[Observation]) -> BTreeMap<Vec<Chunk>, Vec<usize>> {
    let mut visits: BTreeMap<Vec<Chunk>, Vec<usize>> = BTreeMap::new();
    for (i, o) in observations.iter().enumerate() {
        if let Some(cavity) = o.cavity() {
            visits.entry(natural_key(cavity)).or_default().push(i);
        }
    }
    visits
}

/// Part of a name: a run of digits, compared as a number (then by its text, so that `1` and `01` differ), or a letter.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Chunk {
    Number(u64, String),
    Letter(char),
}

fn natural_key(name: &str) -> Vec<Chunk> {
    let mut chunks = Vec::new();
    let mut digits = String::new();
    for c in name.chars().chain(['\0']) {
        if c.is_ascii_digit() {
            digits.push(c);
            continue;
        }
        if !digits.is_empty() {
            chunks.push(Chunk::Number(digits.parse().unwrap_or(u64::MAX), std::mem::take(&mut digits)));
        }
        chunks.push(Chunk::Letter(c));
    }
    chunks
}

fn nearest_hint<'a>(name: &str, present: impl Iterator<Item = &'a str>) -> String {
    let best = present
        .map(|p| (strsim::jaro_winkler(name, p), p))
        .max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(a.1)));
    best.map_or_else(|| "; none is named".to_string(), |(_, p)| format!("; did you mean `{p}`?"))
}
