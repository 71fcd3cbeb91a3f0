//! From weighed explanations to a place for every dwell, and to what the user should know.

use super::emission::State;
use super::problem::Problem;
use super::refine::{Explanation, seat_matches};
use super::rigid::fit_rigid;
use super::{BoardStart, DwellTip};
use crate::{Assignment, Association, Board, Place, TableError};
use armcal_core::{Code, Pose, Severity, Stage, Warning};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Scatter per axis, as a share of the spacing, beyond which a board does not fit, and is doubtful: doubtful,
/// and no dwell surely seated, does not fit either.
const LOOSE: f64 = 0.2;
const DOUBTFUL: f64 = 0.15;
/// Share of the dwells near the board that must be explained for the board to fit.
const LEAST_EXPLAINED: f64 = 0.5;
/// A tip further from its cavity than this many times the scatter (one in a thousand) is not surely seated.
const FAR_SIGMAS: f64 = 4.0;
/// Cavities less probable than this are not listed as alternatives.
const LISTED: f64 = 0.02;

/// Weighs the explanations.
pub(super) fn judge(
    board: &Board,
    tips: &[DwellTip],
    start: &BoardStart,
    problem: &Problem,
    explanations: &[Explanation],
) -> Result<Association, TableError> {
    let unusable = |tip: &DwellTip| Assignment {
        dwell: tip.dwell,
        place: Place::Unassigned { why: "the position of its tip is not a finite number".into() },
        distance_m: f64::NAN,
    };
    let mut assignments: Vec<Assignment> = tips.iter().map(unusable).collect();
    let Some(best) = explanations.first() else {
        if tips.is_empty() {
            let board_in_world = world_from_board(start, problem, None);
            let warnings =
                association_warnings(board, tips, start, problem, &assignments, None, &board_in_world);
            return Ok(Association { assignments, board_in_world, warnings });
        }
        return Err(TableError::DoesNotFit {
            board: board.name.clone(),
            what: format!("no alignment brings any of the {} dwells to a cavity", tips.len()),
            best_rms_m: f64::NAN,
        });
    };
    let weights = posterior_weights(explanations);
    for (i, &input) in problem.index.iter().enumerate() {
        let chances = state_probabilities(explanations, &weights, i);
        let (place, distance_m) = assign_place(problem, best, i, &chances);
        assignments[input].place = place;
        assignments[input].distance_m = distance_m;
    }
    check_fit(board, problem, best, &assignments)?;
    let board_in_world = world_from_board(start, problem, Some(best));
    let warnings =
        association_warnings(board, tips, start, problem, &assignments, Some(best), &board_in_world);
    Ok(Association { assignments, board_in_world, warnings })
}

/// Undoes the sorting by time.
pub(super) fn in_input_order(association: Association, in_time: &[usize]) -> Association {
    let mut placed: Vec<(usize, Assignment)> = in_time.iter().copied().zip(association.assignments).collect();
    placed.sort_by_key(|p| p.0);
    Association { assignments: placed.into_iter().map(|p| p.1).collect(), ..association }
}

/// Whether a found pose has its normal where the configuration allows it.
pub(super) fn normal_is_possible(problem: &Problem, e: &Explanation) -> bool {
    let up = Vector3::from(problem.config.normal_in_world);
    let normal = e.field.board_from_world.rotation.inverse() * Vector3::z();
    !problem.free_pose || !e.normal_known || normal.angle(&up).to_degrees() <= problem.config.max_normal_deg
}

fn posterior_weights(explanations: &[Explanation]) -> Vec<f64> {
    let top = explanations.iter().map(|e| e.ln_posterior).fold(f64::NEG_INFINITY, f64::max);
    let raw: Vec<f64> = explanations.iter().map(|e| (e.ln_posterior - top).exp()).collect();
    let total: f64 = raw.iter().sum();
    raw.into_iter().map(|w| w / total).collect()
}

/// Probability of every state of dwell `i`, over all explanations.
fn state_probabilities(explanations: &[Explanation], weights: &[f64], i: usize) -> BTreeMap<State, f64> {
    let mut chances = BTreeMap::new();
    for (explanation, weight) in explanations.iter().zip(weights) {
        for &(state, p) in &explanation.sequence.states[i] {
            *chances.entry(state).or_insert(0.0) += weight * p;
        }
    }
    chances
}

fn assign_place(
    problem: &Problem,
    best: &Explanation,
    i: usize,
    chances: &BTreeMap<State, f64>,
) -> (Place, f64) {
    let aligned_m = best.field.aligned_m(&problem.tips_m[i]);
    let sure = problem.config.min_confidence;
    let (mut seat, mut hover) = (0.0, 0.0);
    let mut by_cavity: BTreeMap<usize, f64> = BTreeMap::new();
    for (state, p) in chances {
        match state {
            State::Seat(_) => seat += p,
            State::Hover(_) => hover += p,
            State::Out => {}
        }
        if let Some(k) = state.cavity() {
            *by_cavity.entry(k).or_insert(0.0) += p;
        }
    }
    let over = seat + hover;
    let mut cavities: Vec<(usize, f64)> = by_cavity.into_iter().collect();
    cavities.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let Some(&(k, _)) = cavities.first().filter(|_| over >= 0.5) else {
        return place_off_cavity(problem, aligned_m);
    };
    let gap = aligned_m - problem.layout.points_m[k];
    let name = problem.layout.names[k].clone();
    let part = |state: State| chances.get(&state).copied().unwrap_or(0.0);
    if cavities[0].1 < sure * over {
        let listed = cavities.iter().filter(|c| c.1 >= LISTED * over);
        let cavities = listed.map(|c| problem.layout.names[c.0].clone()).collect();
        return (Place::Ambiguous { cavities }, gap.norm());
    }
    let far_m = FAR_SIGMAS * best.sigma_m.hypot(problem.extra_sigma_m[i]);
    // Hovering lower than this could be a badly seated tip.
    let lowest_hover_m = far_m.max(0.75e-3 * problem.config.hover_min_mm);
    if part(State::Seat(k)) >= sure && gap.norm() <= far_m {
        (Place::Seated { cavity: name, confidence: part(State::Seat(k)).min(1.0) }, gap.norm())
    } else if part(State::Hover(k)) >= sure && gap.z >= lowest_hover_m {
        (Place::Hovering { height_m: gap.z, above: name }, gap.norm())
    } else {
        let why = format!(
            "it is {:.1} mm beside and {:.1} mm above cavity {name}: {}",
            gap.xy().norm() * 1e3,
            gap.z * 1e3,
            if hover > 1.0 - sure {
                "seated or hovering cannot be told"
            } else {
                "too far off to be seated for sure"
            }
        );
        (Place::Unassigned { why }, gap.norm())
    }
}

/// A dwell at no cavity: in free space, or near the board and unexplained.
fn place_off_cavity(problem: &Problem, aligned_m: Vector3<f64>) -> (Place, f64) {
    let (k, distance_m) = problem.layout.nearest(&aligned_m);
    if distance_m * 1e3 > problem.config.near_mm {
        return (Place::FreeSpace, f64::NAN);
    }
    let gap = aligned_m - problem.layout.points_m[k];
    let (side, height_mm) = if gap.z < 0.0 { ("below", -gap.z * 1e3) } else { ("above", gap.z * 1e3) };
    let why = format!(
        "no cavity is where its tip is: the nearest, {}, is {:.1} mm beside it, and the tip is {height_mm:.1} mm \
         {side} the seated height",
        problem.layout.names[k],
        gap.xy().norm() * 1e3,
    );
    (Place::Unassigned { why }, f64::NAN)
}

/// Refuses a board that was not the one visited.
fn check_fit(
    board: &Board,
    problem: &Problem,
    best: &Explanation,
    all: &[Assignment],
) -> Result<(), TableError> {
    let near = all.iter().filter(|a| a.place != Place::FreeSpace).count();
    let lost = all.iter().filter(|a| matches!(a.place, Place::Unassigned { .. })).count();
    let explained = near - lost;
    let enough = explained > 0 && explained as f64 >= LEAST_EXPLAINED * near as f64;
    let rms_m = best.sigma_m;
    let seated = all.iter().any(|a| matches!(a.place, Place::Seated { .. }));
    let enough = enough && (seated || rms_m <= DOUBTFUL * problem.layout.spacing_m);
    if enough && rms_m <= LOOSE * problem.layout.spacing_m {
        return Ok(());
    }
    Err(TableError::DoesNotFit {
        board: board.name.clone(),
        what: format!(
            "the best alignment explains {explained} of {} dwells with a scatter of {:.1} mm per axis, cavities \
             being {:.1} mm apart",
            all.len(),
            rms_m * 1e3,
            problem.layout.spacing_m * 1e3
        ),
        best_rms_m: rms_m,
    })
}

/// The rigid pose that brings cavities onto the tips seated in them.
fn world_from_board(start: &BoardStart, problem: &Problem, best: Option<&Explanation>) -> Pose {
    match best {
        Some(e) => {
            let world_from_supposed = e.field.board_from_world.inverse();
            world_from_supposed
                * fit_rigid(&seat_matches(problem, &e.field, &e.sequence.states), &Pose::identity())
        }
        None => match start {
            BoardStart::Known(pose) => *pose,
            BoardStart::Unknown => Pose::identity(),
        },
    }
}

fn association_warnings(
    board: &Board,
    tips: &[DwellTip],
    start: &BoardStart,
    problem: &Problem,
    all: &[Assignment],
    best: Option<&Explanation>,
    board_in_world: &Pose,
) -> Vec<Warning> {
    let config = problem.config;
    let subject = match tips.first() {
        Some(tip) => format!("recording {}", tip.dwell.recording),
        None => format!("board {}", board.name),
    };
    let mut warnings = Vec::new();
    let mut warn = |severity, code, message: String| {
        warnings.push(Warning::new(severity, Stage::Table, code, subject.clone(), message));
    };
    let count = |is: fn(&Place) -> bool| all.iter().filter(|a| is(&a.place)).count();
    let seated = count(|p| matches!(p, Place::Seated { .. }));
    let ambiguous = count(|p| matches!(p, Place::Ambiguous { .. }));
    let lost = count(|p| matches!(p, Place::Unassigned { .. }));
    let near = all.len() - count(|p| matches!(p, Place::FreeSpace));
    if ambiguous > 0 {
        warn(Severity::Inadequate, Code::AssociationAmbiguous, ambiguity_message(all, ambiguous));
    }
    if seated < config.min_seated {
        let message = format!(
            "only {seated} of {} dwells are surely seated in a cavity, {} are wanted; record more cavities, or \
             lower min_seated",
            all.len(),
            config.min_seated
        );
        warn(Severity::Inadequate, Code::TooFewSeated, message);
    }
    if lost > 0 {
        let many = lost as f64 > config.max_unassigned_share * near as f64;
        let severity = if many { Severity::Inadequate } else { Severity::Notice };
        let message = format!(
            "{lost} of {near} dwells near the board belong to no cavity{}; see each dwell's reason",
            if many {
                ", more than max_unassigned_share allows; the board file may lack cavities, the board may be elsewhere, or \
                 those dwells may be no rest in a cavity"
            } else {
                ""
            }
        );
        warn(severity, Code::DwellsUnassigned, message);
    }
    if let Some(e) = best.filter(|e| e.sigma_m > DOUBTFUL * problem.layout.spacing_m) {
        let message = format!(
            "aligned tips scatter by {:.1} mm per axis about cavities {:.1} mm apart; the board fits only loosely",
            e.sigma_m * 1e3,
            problem.layout.spacing_m * 1e3
        );
        warn(Severity::Inadequate, Code::BoardFitsLoosely, message);
    }
    if let BoardStart::Known(given) = start {
        let turn_deg = given.rotation.angle_to(&board_in_world.rotation).to_degrees();
        if turn_deg > config.max_turn_deg {
            let message = format!(
                "the dwells want the board turned by {turn_deg:.1} deg from the pose given, more than \
                 max_turn_deg = {}; check the declared tilt and the board's pose",
                config.max_turn_deg
            );
            warn(Severity::Inadequate, Code::BoardTurned, message);
        }
    }
    warnings
}

fn ambiguity_message(all: &[Assignment], count: usize) -> String {
    let example = all.iter().find_map(|a| match &a.place {
        Place::Ambiguous { cavities } => {
            Some(format!("dwell {} may be {}", a.dwell.dwell, cavities.join(" or ")))
        }
        _ => None,
    });
    format!(
        "{count} of {} dwells fit more than one cavity ({}); visit a cavity that breaks the symmetry (the end of a \
         line, one beside it), set visiting_order, or give the board's pose",
        all.len(),
        example.unwrap_or_default()
    )
}
