//! Where the joined tips are, when: home, the meeting, pose after pose with a rest in each, home again.

use super::{Pair, PairConfig, TorsoConfig};
use crate::LabError;
use crate::hand::{Tremor, minimum_jerk};
use crate::random::{Purpose, Stream};
use nalgebra::{UnitQuaternion, Vector3};

/// Correlation time of the tremor [s], and the step it is drawn at [s].
const TREMOR_S: [f64; 2] = [0.03, 0.002];
/// Poses that may be drawn for each one wanted, before the region counts as out of reach.
const TRIES: usize = 200;
/// Steps in which the way to a pose is tried.
const WALK_STEPS: u32 = 16;
/// How much further than that an arm must reach [m].
const MARGIN_M: f64 = 0.01;
/// Joint angles beyond this are not what a hand would lead an arm to [rad].
const WIDEST_RAD: f64 = 2.4;

/// One recording of a pair.
#[derive(Debug)]
pub(crate) struct Motion {
    pub phases: Vec<Phase>,
    tremor_m: Vec<Vector3<f64>>,
}

/// A stretch of time: from rest to rest, or at rest.
#[derive(Debug, Clone)]
pub(crate) struct Phase {
    pub start_s: f64,
    pub end_s: f64,
    /// Where the tips are joined at its two ends; apart when there is none, and the joints go straight.
    held: Option<[Grip; 2]>,
    from_rad: [Vec<f64>; 2],
    /// Joint angles of both arms at its end [rad].
    pub to_rad: [Vec<f64>; 2],
    /// The torso at its two ends [rad]; zero without one.
    torso_rad: [f64; 2],
    moves: bool,
}

/// How the hand holds the joined tips.
#[derive(Debug, Clone, Copy)]
struct Grip {
    /// The first tip in the world [m].
    point_m: Vector3<f64>,
    /// From the first tip to the second.
    direction: Vector3<f64>,
    /// What the second tip is off by [m].
    slip_m: Vector3<f64>,
}

/// A grip with the joint angles of both arms [rad].
type Pose = (Grip, [Vec<f64>; 2]);

impl Phase {
    /// Whether it is a dwell with the tips joined.
    pub fn is_joined_rest(&self) -> bool {
        self.held.is_some() && !self.moves
    }

    /// Whether nothing moves.
    pub fn is_rest(&self) -> bool {
        !self.moves
    }

    /// Its middle [s].
    pub fn mid_s(&self) -> f64 {
        (self.start_s + self.end_s) / 2.0
    }

    fn share(&self, time_s: f64) -> f64 {
        ((time_s - self.start_s) / (self.end_s - self.start_s)).clamp(0.0, 1.0)
    }
}

impl Grip {
    fn tips_m(&self, link_m: f64) -> [Vector3<f64>; 2] {
        [self.point_m, self.point_m + self.direction * link_m + self.slip_m]
    }

    /// On the way from one grip to the other.
    fn between(from: &Grip, to: &Grip, share: f64) -> Grip {
        let turn = UnitQuaternion::rotation_between(&from.direction, &to.direction);
        let turn =
            turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
        Grip {
            point_m: from.point_m.lerp(&to.point_m, share),
            direction: UnitQuaternion::identity().slerp(&turn, share) * from.direction,
            slip_m: from.slip_m.lerp(&to.slip_m, share),
        }
    }
}

impl Motion {
    /// Draws the poses of a recording and leads the pair through them.
    pub fn perform(config: &PairConfig, pair: &Pair, recording: usize) -> Result<Motion, LabError> {
        let task = &config.task;
        let mut draw = Stream::new(config.seed, Purpose::Task, recording);
        let mut pauses = Stream::new(config.seed, Purpose::Pauses, recording);
        let home = [0, 1].map(|arm: usize| -> Vec<f64> {
            config.arms[arm].home_deg.iter().map(|deg| deg.to_radians()).collect()
        });
        let mut phases = vec![Phase {
            start_s: 0.0,
            end_s: 1.5,
            held: None,
            from_rad: home.clone(),
            to_rad: home.clone(),
            torso_rad: [0.0; 2],
            moves: false,
        }];
        let mut turning = Stream::new(config.seed, Purpose::Torso, recording);
        let mut before: Option<Pose> = None;
        let add = |phases: &mut Vec<Phase>,
                   last_s: f64,
                   held,
                   (to_rad, turn_rad): (&[Vec<f64>; 2], f64),
                   moves| {
            let Some(last) = phases.last() else { return };
            let (start_s, from_rad) = (last.end_s, last.to_rad.clone());
            let (end_s, torso_rad) = (start_s + last_s, [last.torso_rad[1], turn_rad]);
            phases.push(Phase { start_s, end_s, held, from_rad, to_rad: to_rad.clone(), torso_rad, moves });
        };
        for _ in 0..task.poses {
            let turn = |torso: &TorsoConfig| turning.uniform(torso.range_deg).to_radians();
            let turn_rad = config.torso.as_ref().map_or(0.0, turn);
            let next = draw_pose(config, pair, recording, &mut draw, before.as_ref(), &home)?;
            let way = before.as_ref().map(|(grip, _)| [*grip, next.0]);
            add(&mut phases, pauses.uniform(task.move_s), way, (&next.1, turn_rad), true);
            add(&mut phases, pauses.uniform(task.rest_s), Some([next.0; 2]), (&next.1, turn_rad), false);
            before = Some(next);
        }
        add(&mut phases, 2.0, None, (&home, 0.0), true);
        add(&mut phases, 1.5, None, (&home, 0.0), false);
        let duration_s = phases.last().map_or(0.0, |p| p.end_s);
        let mut hand =
            Tremor::new(Stream::new(config.seed, Purpose::Hand, recording), TREMOR_S[0], TREMOR_S[1]);
        let steps = (duration_s / TREMOR_S[1]).ceil() as usize + 2;
        let tremor_m = (0..steps).map(|_| hand.sample() * (task.tremor_mm * 1e-3)).collect();
        Ok(Motion { phases, tremor_m })
    }

    /// Duration [s].
    pub fn duration_s(&self) -> f64 {
        self.phases.last().map_or(0.0, |p| p.end_s)
    }

    /// The angle of the torso [rad].
    pub fn torso_rad(&self, time_s: f64) -> f64 {
        let phase = self.phase(time_s);
        let [from, to] = phase.torso_rad;
        from + (to - from) * minimum_jerk(phase.share(time_s))
    }

    fn phase(&self, time_s: f64) -> &Phase {
        let at = self.phases.partition_point(|p| p.end_s < time_s).min(self.phases.len() - 1);
        &self.phases[at]
    }

    /// Joint angles of one arm [rad], or behind the arms of the torso; `near_rad` are those a moment before.
    pub fn joint_rad(&self, pair: &Pair, arm: usize, time_s: f64, near_rad: &[f64]) -> Result<Vec<f64>, f64> {
        if arm == pair.arms.len() {
            return Ok(vec![self.torso_rad(time_s)]);
        }
        let phase = self.phase(time_s);
        if !phase.moves {
            return Ok(phase.to_rad[arm].clone());
        }
        let share = phase.share(time_s);
        let way = minimum_jerk(share);
        let Some([from, to]) = &phase.held else {
            let ends = phase.from_rad[arm].iter().zip(&phase.to_rad[arm]);
            return Ok(ends.map(|(from, to)| from + (to - from) * way).collect());
        };
        let grip = Grip::between(from, to, way);
        // The hand trembles on the way and lets go at rest, where friction holds the arms.
        let tremor = self.tremor(time_s) * (std::f64::consts::PI * share).sin().powi(2);
        pair.arms[arm].reach(&(grip.tips_m(pair.link_m)[arm] + tremor), near_rad)
    }

    fn tremor(&self, time_s: f64) -> Vector3<f64> {
        let at = time_s / TREMOR_S[1];
        let below = (at.floor() as usize).min(self.tremor_m.len() - 2);
        self.tremor_m[below].lerp(&self.tremor_m[below + 1], at - below as f64)
    }
}

/// Joint angles of an arm at the end of the way to a grip [rad], walked in steps, so that the elbow stays on its side; what
/// is missing [m] where a step, tremor included, is out of reach.
fn walk_to_grip(
    pair: &Pair,
    arm: usize,
    before: Option<&Pose>,
    to: &Grip,
    home: &[f64],
) -> Result<Vec<f64>, f64> {
    let built = &pair.arms[arm];
    let start_rad = before.map_or(home, |(_, q)| &q[arm]);
    let start_m = built.tip_in_world(start_rad);
    (1..=WALK_STEPS).try_fold(start_rad.to_vec(), |q, step| {
        let share = f64::from(step) / f64::from(WALK_STEPS);
        let target_m = match before {
            Some((from, _)) => Grip::between(from, to, share).tips_m(pair.link_m)[arm],
            None => start_m.lerp(&to.tips_m(pair.link_m)[arm], share),
        };
        let outwards = (target_m - built.world_from_base.translation.vector).normalize();
        built.reach(&(target_m + outwards * MARGIN_M), &q)?;
        built.reach(&target_m, &q)
    })
}

/// Draws poses until both arms reach one, and each point of the straight way to it.
fn draw_pose(
    config: &PairConfig,
    pair: &Pair,
    recording: usize,
    draw: &mut Stream,
    before: Option<&Pose>,
    home: &[Vec<f64>; 2],
) -> Result<Pose, LabError> {
    let mut shortest = f64::INFINITY;
    for _ in 0..TRIES {
        let point_m = Vector3::from_fn(|axis, _| draw.uniform(config.task.region_m[axis]));
        let direction = draw.normal3().normalize();
        let slip_m = draw.normal3() * (config.joined.slip_sigma_mm * 1e-3);
        let grip = Grip { point_m, direction, slip_m };
        match [0, 1].map(|arm| walk_to_grip(pair, arm, before, &grip, &home[arm])) {
            [Ok(first), Ok(second)] => {
                if first.iter().chain(&second).all(|q| q.abs() < WIDEST_RAD) {
                    return Ok((grip, [first, second]));
                }
            }
            [first, second] => {
                shortest = [first, second].into_iter().filter_map(Result::err).fold(shortest, f64::min);
            }
        }
    }
    Err(LabError::JoinedOutOfReach {
        recording: config.recordings[recording].clone(),
        what: "every meeting point drawn from `task.region_m`".into(),
        short_by_mm: shortest * 1e3,
    })
}
