//! `armcal init`: what recordings show of their rig, as a pipeline that runs, with the reason for each line.
//!
//! `files -> channels -> arm -> read -> evidence -> roles -> sockets -> proposal -> page`, then the proposal is tried.
//!
//! What a body is follows from how it moves; what it is called decides nothing. Nothing is asked that can be seen, and what
//! could not be seen is said.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod arm;
mod attitude;
mod channels;
mod draft;
mod error;
mod evidence;
mod fields;
mod files;
mod frames;
mod known;
mod links;
mod lists;
mod missing;
mod motion;
mod page;
mod points;
mod proposal;
mod read;
mod roles;
mod seats;
mod singles;
mod sockets;
mod telescope;
mod topics;

pub use arm::Told;
pub use error::InitError;
pub use proposal::Proposal;
pub use roles::{Cast, Role};
pub use topics::BodyTopic;

use armcal_calibrate::HoldoutConfig;
use armcal_core::Mend;
use armcal_recording::Streams;
use armcal_recording::input::Kind;
use armcal_stages::associated::Associated;
use armcal_stages::preprocess;
use armcal_stages::{Inputs, Silent, Steps};
use armcal_table::Board;
use known::Known;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Mistakes that are undone one after the other.
const MOST_MENDED: usize = 3;
/// Pauses below which nothing can be calibrated.
const FEWEST_PAUSES: usize = 6;

/// What a proposal is made from.
#[derive(Debug, Clone)]
pub struct Asked {
    /// Recordings: files, folders, patterns.
    pub inputs: Vec<String>,
    /// What the user says of the arm.
    pub told: Told,
    /// Board file.
    pub board: Option<PathBuf>,
    /// What a laser tracker exported: a file for each recording, in their order, or none.
    pub points: Vec<PathBuf>,
    /// Where the pipeline will be.
    pub out: PathBuf,
}

/// Looks at the recordings and proposes a pipeline for them; nothing is written. What contradicts the data and can be undone where
/// they are read is undone, and said.
///
/// # Errors
/// What is no recording, no arm, joints that are not recorded, an arm that never pauses, nothing that says where the tip was.
pub fn propose(asked: &Asked, progress: &dyn Steps) -> Result<Proposal, InitError> {
    let as_seen = mended(asked, Taken::default(), progress);
    let settled = match &as_seen {
        Ok(seen) => seen.is_plausible() || seen.bodies.iter().any(|(_, cast)| cast.role == Role::Tip),
        Err(refused) => !matches!(refused, InitError::NothingSeen { .. }),
    };
    if settled {
        return as_seen;
    }
    // A reading that is wrong at the last joints moves the tip from its link to one before.
    let last = mended(asked, Taken { at_end: true, ..Taken::default() }, progress);
    last.ok().filter(|last| last.is_plausible()).map_or(as_seen, Ok)
}

/// A proposal, and the one in which the mistakes that its trial showed are undone, one after the other, while each is the better one.
fn mended(asked: &Asked, mut taken: Taken, progress: &dyn Steps) -> Result<Proposal, InitError> {
    let mut best = propose_taken(asked, &taken, progress)?;
    for _ in 0..MOST_MENDED {
        let Some(Ok(tried)) = &best.tried else { break };
        let mut streams = best.pipeline.streams.clone();
        let undone = !tried.mends.is_empty()
            && tried.mends.iter().all(|mend| mend.as_ref().is_some_and(|mend| streams.mend(mend)));
        if !undone {
            break;
        }
        taken.mended = Some(streams);
        taken.why.extend(tried.mistakes.iter().cloned());
        match propose_taken(asked, &taken, progress) {
            Ok(again) if again.error_m() < best.error_m() => best = again,
            _ => break,
        }
    }
    taken.noise_mm = best.quieter_mm();
    if taken.noise_mm.is_some() {
        best = propose_taken(asked, &taken, progress)?;
    }
    Ok(best)
}

/// How the recordings are taken, beside what they show by themselves.
#[derive(Debug, Clone, Default)]
struct Taken {
    /// Streams with the keys that undo mistakes.
    mended: Option<Streams>,
    /// The mistakes.
    why: Vec<String>,
    /// Whether a body that follows a link before the last is on the last one.
    at_end: bool,
    /// Noise of a sensor of which each pause has one pose, where a first calibration left less than is assumed [mm].
    noise_mm: Option<f64>,
}

impl Taken {
    /// The same with all joints read in turns.
    fn in_turns(&self, mut streams: Streams, joints: usize) -> Taken {
        streams.mend(&Mend::Readings { factors: vec![TAU; joints], zeros_rad: vec![0.0; joints] });
        let why = "the readings of all joints are turns: the body moves 2 pi times as far as with radians; `factors` under \
                   [streams.joints] undoes it";
        Taken { mended: Some(streams), why: vec![why.to_owned()], ..self.clone() }
    }
}

fn propose_taken(asked: &Asked, taken: &Taken, progress: &dyn Steps) -> Result<Proposal, InitError> {
    progress.step("opening the recordings");
    let opened = files::open_all(&asked.inputs, &asked.out)?;
    let points =
        asked.points.iter().map(|path| points::inspect_file(path)).collect::<Result<Vec<_>, InitError>>()?;
    if !points.is_empty() && points.len() != opened.len() {
        let names: Vec<String> = opened.iter().map(|o| o.entry.name()).collect();
        let problem = format!(
            "--points was given {} times for {} recordings ({}): give one file for each, in this order",
            points.len(),
            opened.len(),
            names.join(", ")
        );
        return Err(InitError::Init { problem });
    }
    let mut channels = channels::scan_recordings(&opened)?;
    if !points.is_empty() {
        let seen = std::mem::take(&mut channels.bodies);
        let why = "--points says where the tip was, in the frame of another sensor";
        channels.left.extend(seen.iter().map(|body| (body.shown(), why.to_owned())));
    }
    let paths = opened.iter().flat_map(|o| &o.entry.paths);
    let folders = paths.filter_map(|p| p.parent()).map(Path::to_owned).collect();
    let arm = arm::find(&asked.told, &channels, &folders, &asked.out.with_extension("urdf"))?;
    progress.step("reading the recordings");
    let mut read = read::read_recordings(&arm, &channels, &opened, taken.mended.as_ref())?;
    let pauses: usize = read.recordings.iter().map(|r| r.dwells.len()).sum();
    if pauses < FEWEST_PAUSES {
        let problem = format!(
            "the joints on {} stand still {pauses} times in all recordings; a calibration takes {FEWEST_PAUSES} pauses of about a \
             second at the very least (docs/guide.md says how to record them)",
            arm.source.shown()
        );
        return Err(InitError::Init { problem });
    }
    progress.step("comparing motions");
    let board = asked.board.as_deref().map(read_board).transpose()?;
    let mut evidence = evidence::gather(&arm, &read);
    if taken.mended.is_none() && evidence::in_turns(&arm, &read, &evidence) {
        return propose_taken(asked, &taken.in_turns(read.streams, arm.names.len()), progress);
    }
    let rates = evidence::clock_rates(&arm, &read, &evidence);
    if !rates.is_empty() {
        rates.into_iter().for_each(|(body, rate)| read.set_clock_rate(body, rate));
        evidence = evidence::gather(&arm, &read);
    }
    for (body, turn) in attitude::other_axes(&arm, &read, &evidence) {
        read.set_orientation_axes(body, &turn);
    }
    let (cast, seats) = roles::assign_roles(&arm, &evidence, board.as_ref(), taken.at_end);
    let tracked = !points.is_empty()
        || cast.iter().any(|c| matches!(c.role, Role::Tip) || matches!(c.role, Role::Marker(_)) && c.sure);
    // Where no sensor sees the tip, its pauses show on which link it is, and without a board where it sat.
    let sockets = if tracked { None } else { sockets::find(&arm, &read)? };
    if board.is_none() && !tracked && sockets.is_none() {
        return Err(nothing_seen(&arm, &read, &cast));
    }
    let board = asked.board.as_deref().zip(board.as_ref());
    let mut known = Known {
        asked,
        opened: &opened,
        arm: &arm,
        read: &read,
        evidence: &evidence,
        cast: &cast,
        seats,
        board,
        sockets,
        points,
        warm: &channels.warm,
        mended: &taken.why,
        noise_mm: taken.noise_mm,
    };
    if known.sockets.is_some() && known.board.is_none() {
        progress.step("measuring the sockets");
        size_sockets(&mut known)?;
    }
    let mut left = channels.left;
    let used = |topic: &str| topic == arm.source.topic || read.bodies.iter().any(|b| b.topic == topic);
    left.retain(|(topic, _)| !used(topic));
    let mut proposal = known.propose(left)?;
    // The trial opens them again.
    drop((read, opened));
    progress.step("trying the proposal");
    proposal.tried = Some(try_proposal(&proposal));
    Ok(proposal)
}

fn read_board(path: &Path) -> Result<Board, InitError> {
    Ok(Board::from_toml(&armcal_config::read_text("board", Kind::Text, path)?, path)?)
}

fn nothing_seen(arm: &arm::Arm, read: &read::AllRead, cast: &[Cast]) -> InitError {
    let bodies = read.bodies.iter().zip(cast).map(|(body, cast)| format!("{}: {}", body.shown(), cast.why));
    let bodies: Vec<String> = bodies.collect();
    let bodies = if bodies.is_empty() { "no body is tracked".to_owned() } else { bodies.join("; ") };
    let left = read.left.iter().map(|(what, why)| format!("; not used: {what}: {why}")).collect::<String>();
    let unsure = arm.unsure.iter().map(|said| format!(". Unsure: {said}")).collect::<String>();
    let problem = format!(
        "nothing says where the tip was: {bodies}{left}; and its pauses are not in a few places that it came back to in other \
         postures. Give --board FILE if it sat in cavities of a board (docs/guide.md shows one){unsure}"
    );
    InitError::NothingSeen { problem }
}

/// Finds how large the fixture is, with the pipeline as it would be proposed.
fn size_sockets(known: &mut Known<'_>) -> Result<(), InitError> {
    let mut pipeline = known.propose(Vec::new())?.pipeline;
    pipeline.holdout = HoldoutConfig::None;
    let chain =
        match (known.sockets.as_ref().and_then(|s| s.tip_link.as_ref()), pipeline.model.urdf.is_some()) {
            (Some(tip), true) => known.arm.model_to(tip)?.chain().clone(),
            _ => known.arm.model.chain().clone(),
        };
    let chain = match &pipeline.model.deviation {
        Some(deviation) => chain.with_deviation(deviation, &known.arm.file)?,
        None => chain,
    };
    let recordings = preprocess::open_all(&pipeline, &Silent)?;
    let seen = preprocess::dwells_of_all(&pipeline, &chain, &recordings, &Silent, &mut drop)?;
    if let Some(sockets) = &mut known.sockets {
        let board = Some(sockets.board.clone());
        let (changes, most_rounds, known) = (Vec::new(), 2, Associated::default());
        sockets.sized(&Inputs { pipeline, chain, board, seen, changes, most_rounds, known });
    }
    Ok(())
}

/// What a first calibration with a proposal came to.
#[derive(Debug, Clone)]
pub struct Tried {
    /// Held-out points, or all where none is held out.
    pub points: usize,
    /// Mean error there before and after [m].
    pub mean_m: [f64; 2],
    /// Fewer equations than free parameters, in words.
    pub too_few: Option<String>,
    /// What contradicts the data about the setup, in words.
    pub mistakes: Vec<String>,
    /// What would undo each of them where the recordings are read.
    mends: Vec<Option<Mend>>,
}

/// Calibrates with a proposal whose files may not be written yet: they are put beside a copy of it.
fn try_proposal(proposal: &Proposal) -> Result<Tried, String> {
    let attempt = || -> Result<Tried, InitError> {
        let folder =
            tempfile::tempdir().map_err(|source| InitError::Folder { path: std::env::temp_dir(), source })?;
        let pipeline = proposal.in_folder(folder.path())?;
        let settled = armcal_pipeline::settle(&pipeline, &Silent)?;
        let judged = settled.fitted.calibration.judged();
        let (mistakes, mends) = settled.setup.mistakes().map(|m| (m.message.clone(), m.mend.clone())).unzip();
        let mean_m = [judged.nominal.mean_m, judged.fitted.mean_m];
        let too_few = settled.fitted.calibration.fit.too_few_dwells().map(|w| w.message.clone());
        Ok(Tried { points: judged.fitted.n, mean_m, too_few, mistakes, mends })
    };
    attempt().map_err(|e| e.to_string())
}
