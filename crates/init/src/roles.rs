//! Which body is the tip, the base, the table: from how they move, never from what they are called.

use super::arm::Arm;
use super::evidence::{Evidence, STANDS_M};
use super::seats::{Seats, find_seats};
use armcal_core::Pose;
use armcal_core::robust::median;
use armcal_table::Board;
use nalgebra::Vector3;

/// Off its link by less than this share of its motion, a body is on the arm; below the smaller one surely.
const ON_ARM: f64 = 0.4;
const SURELY_ON_ARM: f64 = 0.25;
/// No arm is built, and no sensor sees it, as exactly as this [m].
const COMPUTED_M: f64 = 3e-5;
/// Speeds that are alike, where too few pauses show a link.
const ALIKE: f64 = 0.7;
/// A link that explains a body so many times better than the others is its link.
const SURE_LEAD: f64 = 1.5;
/// A body on the last link nearer to the model's tip than any other by this is the tip [m].
const NEARER_M: f64 = 0.015;
/// The nominal arm puts its base this far from where it is [m], [rad].
const BASE_M: f64 = 0.08;
const BASE_RAD: f64 = 0.2;
/// A board that turned by this between recordings was tilted [rad].
const TILTS_RAD: f64 = 0.03;
/// A table is not further than this from where the tip pauses [m].
const REACH_M: f64 = 0.6;

/// What a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The tip, or the marker body at the end of the arm.
    Tip,
    /// A marker on the link of this joint, from 0.
    Marker(usize),
    /// The robot's base.
    Base,
    /// The calibration table.
    Table,
    /// It stands still, and nothing says what it is.
    Still,
    /// It moves, but not with the arm.
    Other,
    /// Somebody's forward kinematics of the same arm and joints.
    Computed,
    /// It was never seen, or only while nothing could be told.
    Unknown,
}

impl Role {
    /// Its name in the pipeline and in what is printed.
    pub fn word(self) -> &'static str {
        match self {
            Role::Tip => "tip",
            Role::Marker(_) => "marker",
            Role::Base => "base",
            Role::Table => "table",
            Role::Still => "stands still",
            Role::Other => "moves by itself",
            Role::Computed => "computed",
            Role::Unknown => "unknown",
        }
    }
}

/// A body with its role.
#[derive(Debug, Clone)]
pub struct Cast {
    /// What it is.
    pub role: Role,
    /// Whether the evidence leaves no other role.
    pub sure: bool,
    /// The evidence, in words.
    pub why: String,
    /// Of the tip: whether its origin is the tool point, as cavities show.
    pub is_tool_point: bool,
}

/// Every body with its role, and what the board says where there is one. `at_end` puts what follows a link on the last one.
pub fn assign_roles(
    arm: &Arm,
    evidence: &[Evidence],
    board: Option<&Board>,
    at_end: bool,
) -> (Vec<Cast>, Option<Seats>) {
    let mut all: Vec<Cast> = evidence.iter().map(|e| first_look(arm, e)).collect();
    let last = arm.carried.len() - 1;
    for cast in all.iter_mut().filter(|cast| at_end && matches!(cast.role, Role::Marker(_))) {
        (cast.role, cast.sure) = (Role::Marker(last), true);
    }
    let at_end: Vec<usize> = (0..all.len()).filter(|b| all[*b].role == Role::Marker(last)).collect();
    let still: Vec<usize> = (0..all.len()).filter(|b| all[*b].role == Role::Still).collect();
    let seats = board.and_then(|board| find_seats(board, evidence, &at_end, &still));
    if let Some(tip) = the_tip(arm, evidence, &at_end, seats.as_ref(), &mut all) {
        the_base(evidence, tip, &still, seats.as_ref(), &mut all);
    }
    the_table(evidence, board.is_some(), seats.as_ref(), &mut all);
    (all, seats)
}

/// What its own motion says of a body.
fn first_look(arm: &Arm, e: &Evidence) -> Cast {
    let said = |role, sure, why: String| Cast { role, sure, why, is_tool_point: false };
    let travel_mm = e.travel_m() * 1e3;
    if e.recordings.iter().all(Option::is_none) {
        return said(Role::Unknown, true, "never seen".to_owned());
    }
    if e.travel_m() < STANDS_M {
        return said(Role::Still, true, format!("stays within {travel_mm:.1} mm"));
    }
    let correlation = e.likeness().map(|l| l.correlation);
    let speeds = correlation
        .map_or(String::new(), |c| format!(", correlation of its speed with that of the arm {c:.2}"));
    match e.best_link() {
        Some(best) if best.off_m < COMPUTED_M && e.pauses() >= 8 => {
            let (pauses, off_mm) = (e.pauses(), best.off_m * 1e3);
            let why = format!(
                "in half of {pauses} pauses within {off_mm:.3} mm of the nominal arm: forward kinematics, no measurement"
            );
            said(Role::Computed, true, why)
        }
        Some(best) if best.share < ON_ARM && e.pauses() >= 8 => {
            let carried = &arm.carried[best.link];
            // Nothing follows the last link: where no motion shows the last joint, the link before it is the same.
            let sure =
                best.share < SURELY_ON_ARM && (best.lead > SURE_LEAD || best.link + 1 == arm.carried.len());
            let rival = if best.lead > SURE_LEAD { "" } else { "; another link explains it about as well" };
            let why = format!(
                "follows {carried}: in {} pauses {:.1} mm off the nominal arm while it moves by {travel_mm:.0} mm{speeds}{rival}",
                e.pauses(),
                best.off_m * 1e3
            );
            said(Role::Marker(best.link), sure, why)
        }
        _ if correlation.is_some_and(|c| c > ALIKE) => {
            let why =
                format!("moves by {travel_mm:.0} mm{speeds}, but its pauses do not show on which link it is");
            said(Role::Marker(arm.carried.len() - 1), false, why)
        }
        _ => {
            let alike = correlation.map_or(String::new(), |c| format!(" (correlation of speeds {c:.2})"));
            said(
                Role::Other,
                correlation.is_none_or(|c| c < 0.5),
                format!("moves by {travel_mm:.0} mm, not as any link of the arm{alike}"),
            )
        }
    }
}

/// The tip among the bodies on the last link.
fn the_tip(
    arm: &Arm,
    evidence: &[Evidence],
    at_end: &[usize],
    seats: Option<&Seats>,
    all: &mut [Cast],
) -> Option<usize> {
    let last = arm.carried.len() - 1;
    let poses = arm.poses(&vec![0.0; arm.carried.len()]);
    let tip_m = (poses[last].inverse() * poses[last + 1]).translation.vector;
    let away = |body: usize| {
        let away: Vec<f64> =
            evidence[body].placed(last).map(|(_, placed)| (placed.at_m - tip_m).norm()).collect();
        median(&away)
    };
    let mut nearest: Vec<(usize, f64)> = at_end.iter().map(|b| (*b, away(*b))).collect();
    nearest.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (tip, away_m) = *nearest.first()?;
    let tip = seats.map_or(tip, |s| s.tip);
    let own = &mut all[tip];
    own.role = Role::Tip;
    if seats.is_some() {
        own.is_tool_point = true;
        own.why = format!("sits in cavities of the board, {}", own.why);
    } else if let Some((_, second_m)) = nearest.get(1) {
        let clear = second_m - away_m > NEARER_M;
        own.sure &= clear;
        let said = if clear {
            "nearer to the model's tip than the others on its link"
        } else {
            "one of several on the last link"
        };
        own.why = format!(
            "{said} ({:.0} mm from it, the next {:.0} mm), {}",
            away_m * 1e3,
            second_m * 1e3,
            own.why
        );
    }
    Some(tip)
}

/// The base among the bodies that stand still: where the nominal arm has it.
fn the_base(evidence: &[Evidence], tip: usize, still: &[usize], seats: Option<&Seats>, all: &mut [Cast]) {
    let Some(best) = evidence[tip].best_link() else { return };
    let apart = |body: usize| {
        let of = |(at, placed): (usize, armcal_stages::links::Placed)| {
            let seen = evidence[body].recordings[at].as_ref()?;
            let turned = seen.mean.map_or(f64::NAN, |mean| mean.rotation.angle_to(&placed.base.rotation));
            Some(((seen.middle_m - placed.base.translation.vector).norm(), turned))
        };
        let (far, turned): (Vec<f64>, Vec<f64>) = evidence[tip].placed(best.link).filter_map(of).unzip();
        (median(&far), median(&turned))
    };
    let table = seats.map(|s| s.table);
    let mut near: Vec<(usize, f64, f64)> =
        still.iter().filter(|b| Some(**b) != table).map(|b| (*b, apart(*b).0, apart(*b).1)).collect();
    near.sort_by(|a, b| a.1.total_cmp(&b.1));
    let Some((base, far_m, turned)) = near.first().copied() else { return };
    // Positions alone cannot stand for a frame, and a frame that is turned is not the base's.
    let is_there = far_m < BASE_M && turned < BASE_RAD;
    if !is_there {
        return;
    }
    let rival = near.get(1).is_some_and(|(_, far_m, turned)| *far_m < BASE_M && *turned < BASE_RAD);
    let cast = &mut all[base];
    cast.role = Role::Base;
    cast.sure = !rival;
    let also = if rival { "; another body that stands still is there too" } else { "" };
    cast.why = format!(
        "{}, {:.0} mm and {:.1} deg from where the nominal arm has its base{also}",
        cast.why,
        far_m * 1e3,
        turned.to_degrees()
    );
}

/// The table: where cavities fit the pauses of the tip, or what was tilted between recordings, or what is left near the tip.
fn the_table(evidence: &[Evidence], has_board: bool, seats: Option<&Seats>, all: &mut [Cast]) {
    if let Some(seats) = seats {
        let cast = &mut all[seats.table];
        (cast.role, cast.sure) = (Role::Table, seats.clear);
        cast.why = format!("{}, {}", cast.why, seats.why);
        return;
    }
    let still: Vec<usize> = (0..all.len()).filter(|b| all[*b].role == Role::Still).collect();
    let tilted = |body: &usize| {
        let means: Vec<Pose> = evidence[*body].recordings.iter().flatten().filter_map(|r| r.mean).collect();
        let turns = means.iter().map(|m| m.rotation.angle_to(&means[0].rotation));
        turns.fold(0.0, f64::max)
    };
    let turned: Vec<usize> = still.iter().copied().filter(|b| tilted(b) > TILTS_RAD).collect();
    let tip = all.iter().position(|c| c.role == Role::Tip);
    let pauses_m: Vec<Vector3<f64>> = tip
        .iter()
        .flat_map(|tip| evidence[*tip].recordings.iter().flatten())
        .flat_map(|r| r.pauses.iter().map(|p| p.at_m))
        .collect();
    let reached = |body: &usize| {
        let at = evidence[*body].recordings.iter().flatten().map(|r| r.middle_m).next();
        at.is_some_and(|at| pauses_m.iter().any(|p| (p - at).norm() < REACH_M))
    };
    let near: Vec<usize> = still.iter().copied().filter(reached).collect();
    let (table, sure, why) = match (&turned[..], &near[..]) {
        ([only], _) => (
            *only,
            !has_board,
            format!("was turned by {:.1} deg between recordings", tilted(only).to_degrees()),
        ),
        ([], [only]) => (*only, false, "is the only other thing that stands still near the tip".to_owned()),
        _ => return,
    };
    let cast = &mut all[table];
    (cast.role, cast.sure, cast.why) = (Role::Table, sure, format!("{}, {why}", cast.why));
}
