//! Every dwell the rig could do next, as the observation it would become.

use super::reach::{Limits, joint_step, nearest_dwell, solve_closure, solve_position};
use super::{Allowed, Known, Tracking};
use armcal_core::{Arrival, DwellId, Observation, Reference};
use armcal_model::EffectSpec;
use nalgebra::{Point3, Vector3};
use serde::Serialize;

/// Time from the last dwell to the proposed ones [ns]: five minutes.
const LATER_NS: i64 = 300_000_000_000;
/// How far away a joint turns before it arrives from its side [rad]: 5 deg.
const AWAY_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// A joint that turns less than this in the last part of the way shows no side [rad]: 0.3 deg.
const SHOWS_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// The last part of the way into a cavity [m].
const SLIDE_M: f64 = 0.012;
/// Sides from which a tip slides into a cavity.
const SIDES: usize = 8;
/// Free poses in the pool.
const POSES: usize = 48;
/// Draws before the poses found so far have to do.
const DRAWS: usize = 4000;
/// Height of a free pose above a board [m].
const ABOVE_BOARD_M: f64 = 0.05;
/// How far beyond its outermost cavities a board reaches [m].
const RIM_M: f64 = 0.10;
/// Seated dwells in the pool, at most.
const MOST_SEATED: usize = 3000;

/// Where a dwell is.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "where", rename_all = "lowercase")]
pub enum Place {
    /// In a cavity.
    Cavity {
        /// Its name.
        cavity: String,
        /// The board as tilted in this recording.
        recording: String,
        /// Side of the cavity from which the tip slides in, from the board's x towards its y [deg]; straight down when
        /// absent.
        slide_from_deg: Option<f64>,
    },
    /// Away from the board, seen by the sensor.
    Free,
    /// Both tips joined, both arms as the readings say.
    Joined,
    /// A recorded free pose once more.
    Again {
        /// The recorded dwell.
        dwell: DwellId,
    },
}

/// A dwell that could be recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Possible {
    /// Where.
    pub place: Place,
    /// What it would become.
    pub observation: Observation,
}

/// All of them. With an event among the rivals only the board as it stands now.
pub fn candidate_dwells(
    known: &Known<'_>,
    limits: &Limits,
    allowed: &Allowed,
    rivals: &[EffectSpec],
) -> Vec<Possible> {
    let mut loads_kg: Vec<f64> =
        known.observations.iter().map(|o| o.load_kg).chain(allowed.loads_kg.clone()).collect();
    loads_kg.sort_by(f64::total_cmp);
    loads_kg.dedup();
    let event = rivals.iter().any(|r| r.since.is_some());
    let mut places = seated_candidates(known, limits, event);
    let step = (places.len() * loads_kg.len()).div_ceil(MOST_SEATED).max(1);
    places = places.into_iter().step_by(step).collect();
    places.extend(joined_candidates(known, limits));
    places.extend(known.tracked.iter().flat_map(|tracking| free_candidates(known, limits, tracking)));
    let mut pool = Vec::new();
    for load_kg in loads_kg {
        for possible in &places {
            let mut one = possible.clone();
            one.observation.load_kg = load_kg;
            one.observation.dwell.dwell += pool.len();
            pool.push(one);
        }
    }
    pool
}

/// Every cavity at every tilt, entered from every side that makes a difference.
fn seated_candidates(known: &Known<'_>, limits: &Limits, last_only: bool) -> Vec<Possible> {
    let Some(board) = known.board else { return Vec::new() };
    let last = known.session.recordings.saturating_sub(1);
    let mut all = Vec::new();
    for recording in if last_only { last } else { 0 }..=last {
        let Some(pose) = known.model.board_in_world(&known.values, recording) else { continue };
        for cavity in &board.cavities {
            let target_m = (pose * Point3::from(cavity.in_board_m)).coords;
            let Some(from) = nearest_dwell(known, &target_m) else { continue };
            let Some(joint_rad) = solve_position(known, from, &target_m).filter(|q| limits.hold(q, 0.0))
            else {
                continue;
            };
            let mut at = later_dwell(known, from, recording, joint_rad);
            let in_board_m = cavity.in_board_m;
            at.reference = Reference::Seated { cavity: cavity.name.clone(), in_board_m };
            at.covariance_m2 = board.seat_covariance_m2();
            let mut known_sides: Vec<Vec<Arrival>> = Vec::new();
            for side in 0..=SIDES {
                let slide_from_deg = (side < SIDES).then(|| side as f64 * 360.0 / SIDES as f64);
                let way = pose.rotation * way_in(slide_from_deg) * SLIDE_M;
                let Some(step) = joint_step(known, &at, &way) else { continue };
                let arrival: Vec<Arrival> = step.iter().map(|dq| side_of(*dq)).collect();
                if known_sides.contains(&arrival) {
                    continue;
                }
                known_sides.push(arrival.clone());
                let recording = known.recordings.get(recording).cloned().unwrap_or_default();
                let place = Place::Cavity { cavity: cavity.name.clone(), recording, slide_from_deg };
                all.push(Possible { place, observation: with_arrival(&at, arrival) });
            }
        }
    }
    all
}

/// Direction of the last part of the way into a cavity, board frame.
fn way_in(slide_from_deg: Option<f64>) -> Vector3<f64> {
    match slide_from_deg.map(f64::to_radians) {
        Some(side) => Vector3::new(-side.cos(), -side.sin(), -0.15).normalize(),
        None => -Vector3::z(),
    }
}

/// Free poses spread over the joint ranges (Halton points), and the recorded ones again, from every side.
fn free_candidates(known: &Known<'_>, limits: &Limits, tracking: &Tracking) -> Vec<Possible> {
    let last = known.session.recordings.saturating_sub(1);
    let keep = Clearance::of(known);
    let mut poses: Vec<(Place, Vec<f64>)> = Vec::new();
    for draw in 1..=DRAWS {
        if poses.len() == POSES {
            break;
        }
        let joint_rad = limits.drawn(draw, AWAY_RAD);
        if keep.clear(known, &joint_rad) {
            poses.push((Place::Free, joint_rad));
        }
    }
    let recorded =
        known.observations.iter().filter(|o| o.cavity().is_none() && o.joint_velocity_radps.is_none());
    let recorded: Vec<&Observation> = recorded.collect();
    for o in recorded.iter().step_by(recorded.len().div_ceil(POSES / 2).max(1)) {
        poses.push((Place::Again { dwell: o.dwell }, o.joint_rad.clone()));
    }
    let mut all = Vec::new();
    for (i, (place, joint_rad)) in poses.into_iter().enumerate() {
        let Some(from) = known.observations.iter().min_by(|a, b| {
            let way = |o: &Observation| largest_difference_rad(&o.joint_rad, &joint_rad);
            way(a).total_cmp(&way(b))
        }) else {
            continue;
        };
        let mut at = later_dwell(known, from, last, joint_rad);
        let tip =
            known.model.base_in_world(&known.values) * known.model.tip_in_base(&known.values, &at.joint_rad);
        at.reference = Reference::Tracked {
            position_m: tip.translation.vector,
            orientation: tracking.orientation_sigma_rad.map(|_| tip.rotation),
            orientation_sigma_rad: tracking.orientation_sigma_rad.unwrap_or(0.0),
        };
        at.covariance_m2 = tracking.covariance_m2;
        for arrival in arrival_sides(at.joint_rad.len(), i) {
            all.push(Possible { place: place.clone(), observation: with_arrival(&at, arrival) });
        }
    }
    all
}

/// Poses of both arms spread over the joint ranges (Halton points), from each of which the tips are brought together, from every
/// side.
fn joined_candidates(known: &Known<'_>, limits: &Limits) -> Vec<Possible> {
    let last = known.session.recordings.saturating_sub(1);
    let Some(like) = known.observations.iter().rfind(|o| o.against().is_some()) else { return Vec::new() };
    let clear = AWAY_RAD / 2.0;
    let closed = |draw: usize| {
        let from = later_dwell(known, like, last, limits.drawn(draw, AWAY_RAD));
        solve_closure(known, &from).filter(|q| limits.hold(q, clear))
    };
    let mut all = Vec::new();
    for (pose, joint_rad) in (1..=DRAWS).filter_map(closed).take(2 * POSES).enumerate() {
        let at = later_dwell(known, like, last, joint_rad);
        let sides = arrival_sides(at.joint_rad.len(), pose).into_iter();
        all.extend(
            sides.map(|arrival| Possible { place: Place::Joined, observation: with_arrival(&at, arrival) }),
        );
    }
    all
}

/// Sides from which the joints arrive: all combinations of up to three joints, four of more.
fn arrival_sides(joints: usize, pose: usize) -> Vec<Vec<Arrival>> {
    let sign = |up: bool| if up { Arrival::Positive } else { Arrival::Negative };
    if joints <= 3 {
        return (0..1usize << joints)
            .map(|bits| (0..joints).map(|j| sign(bits >> j & 1 == 1)).collect())
            .collect();
    }
    // Two columns of a Walsh matrix a pose and their opposites: over the poses every pair of joints is mixed.
    let mixed = |flip: bool, row: usize| {
        (0..joints).map(|j| sign(((row & (j + 1)).count_ones() % 2 == 1) != flip)).collect()
    };
    vec![mixed(false, 0), mixed(true, 0), mixed(false, pose + 1), mixed(true, pose + 1)]
}

/// What must not be touched.
struct Clearance {
    up: Vector3<f64>,
    floor_m: f64,
    reach_m: f64,
    half_board_m: Vector3<f64>,
}

impl Clearance {
    fn of(known: &Known<'_>) -> Clearance {
        let base = known.model.base_in_world(&known.values);
        let down = known
            .session
            .gravity_in_base_mps2
            .map_or(known.session.gravity_in_world_mps2, |g| base.rotation * g);
        let up = -down.try_normalize(1e-9).unwrap_or(-Vector3::z());
        let tips = || known.observations.iter().map(|o| known.model.predicted_tip_in_world(&known.values, o));
        let from_base = |tip: Vector3<f64>| (tip - base.translation.vector).norm();
        let half_board_m = known.board.map_or(Vector3::zeros(), |board| {
            let outermost =
                |axis: usize| board.cavities.iter().map(|c| c.in_board_m[axis].abs()).fold(0.0, f64::max);
            Vector3::new(outermost(0) + RIM_M, outermost(1) + RIM_M, 0.0)
        });
        Clearance {
            up,
            floor_m: tips().map(|tip| tip.dot(&up)).fold(f64::INFINITY, f64::min),
            reach_m: tips().map(from_base).fold(f64::INFINITY, f64::min),
            half_board_m,
        }
    }

    /// Whether the tip keeps above every board and above the lowest recorded tip, and away from the arm's foot.
    fn clear(&self, known: &Known<'_>, joint_rad: &[f64]) -> bool {
        let base = known.model.base_in_world(&known.values);
        let tip: Point3<f64> =
            base * Point3::from(known.model.tip_in_base(&known.values, joint_rad).translation.vector);
        let over = |recording: usize| {
            let Some(board) = known.model.board_in_world(&known.values, recording) else { return true };
            let on_board: Point3<f64> = board.inverse() * tip;
            let beside = on_board.x.abs() > self.half_board_m.x || on_board.y.abs() > self.half_board_m.y;
            beside || on_board.z > ABOVE_BOARD_M
        };
        let tip_m: &Vector3<f64> = &tip.coords;
        tip_m.dot(&self.up) > self.floor_m
            && (tip_m - base.translation.vector).norm() > 0.5 * self.reach_m
            && (0..known.session.recordings).all(over)
    }
}

/// A dwell like a recorded one, later, at other joint readings.
fn later_dwell(known: &Known<'_>, like: &Observation, recording: usize, joint_rad: Vec<f64>) -> Observation {
    let dwells = known.observations.iter().filter(|o| o.dwell.recording == recording);
    let dwell = dwells.map(|o| o.dwell.dwell + 1).max().unwrap_or(0);
    let newest = known.observations.iter().max_by_key(|o| o.time_ns);
    Observation {
        dwell: DwellId { recording, dwell },
        time_ns: known.session.end_ns + LATER_NS,
        joint_rad,
        temperature_c: newest.and_then(|o| o.temperature_c),
        joint_velocity_radps: None,
        moved_rad: None,
        ..like.clone()
    }
}

fn with_arrival(at: &Observation, arrival: Vec<Arrival>) -> Observation {
    let memory = |(q, side): (&f64, &Arrival)| match side {
        Arrival::Unknown => Vec::new(),
        _ => vec![q - side.sign() * AWAY_RAD, *q],
    };
    let path_memory_rad = Some(at.joint_rad.iter().zip(&arrival).map(memory).collect());
    let moved_rad = Some(arrival.iter().map(|side| side.sign() * AWAY_RAD).collect());
    Observation { path_memory_rad, moved_rad, arrival, ..at.clone() }
}

fn side_of(turn_rad: f64) -> Arrival {
    match () {
        () if turn_rad > SHOWS_RAD => Arrival::Positive,
        () if turn_rad < -SHOWS_RAD => Arrival::Negative,
        () => Arrival::Unknown,
    }
}

fn largest_difference_rad(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_joints_arrive_from_all_sides_and_seven_from_mixed_ones() {
        let three = arrival_sides(3, 0);
        assert_eq!(three.len(), 8);
        for (j, k) in (0..7).flat_map(|j| (0..j).map(move |k| (j, k))) {
            let apart = (0..POSES).flat_map(|pose| arrival_sides(7, pose)).any(|s| s[j] != s[k]);
            assert!(apart, "joints {j} and {k} always arrive from the same side");
        }
    }
}
