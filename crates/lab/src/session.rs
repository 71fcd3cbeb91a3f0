//! One recording from start to end, told in order: home, a fast sweep, the cavities, free poses, home.

use crate::LabError;
use crate::checks::value_error;
use crate::commands::Commands;
use crate::config::{LabConfig, StopConfig};
use crate::engine::{Engine, Pace};
use crate::mechanism::Mechanism;
use crate::plan::{Plan, Visit};
use crate::random::{Purpose, Stream};
use crate::rig::{BoardPlace, Rig};
use crate::trace::{Rest, RestKind, Trace};
use nalgebra::{Point3, Vector3};

/// What happened in one recording.
#[derive(Debug)]
pub struct Session {
    /// Where the board was.
    pub place: BoardPlace,
    /// Every step.
    pub trace: Trace,
    /// Every rest.
    pub rests: Vec<Rest>,
    /// When each set-point from a file was due.
    pub due: Vec<Due>,
    /// What was hidden in the rig, in its final state.
    pub mechanisms: Vec<Box<dyn Mechanism>>,
}

/// When a set-point from a file was due.
#[derive(Debug, Clone, PartialEq)]
pub struct Due {
    /// The set-point [rad].
    pub joint_rad: Vec<f64>,
    /// First step: halfway through a stop, or the moment on a path.
    pub first: usize,
    /// Last step.
    pub last: usize,
}

impl Session {
    /// Lets the rig carry out recording `recording`.
    pub fn perform(
        config: &LabConfig,
        rig: &Rig,
        recording: usize,
        mechanisms: Vec<Box<dyn Mechanism>>,
        pace: Pace,
    ) -> Result<Session, LabError> {
        let place = rig.place_board(config, recording)?;
        let plan = Plan::draw(config, rig, &place, recording)?;
        let mut engine = Engine::new(config, rig, &place, recording, mechanisms, pace);
        let home: Vec<f64> = config.arm.home_deg.iter().map(|deg| deg.to_radians()).collect();
        let at_home = || Some(empty_rest(RestKind::Free));

        engine.hold(config.task.home_s, at_home());
        if !plan.sweep_m.is_empty() {
            engine.drive_through(&plan.sweep_m, config.task.sweep.speed_m_s, "the sweep")?;
        }
        let name = &config.recordings[recording].name;
        let mut due = Vec::new();
        let mut visits = Visits::new(config, rig, &place, recording);
        let mut pauses = Stream::new(config.seed, Purpose::Pauses, 2 * recording + 1);
        if let Some(commands) = rig.commands.iter().find(|commands| commands.recording == *name) {
            due = follow_set_points(&mut engine, commands, &home);
        } else if let Some(tour) = config.task.tours.iter().find(|tour| tour.recording == *name) {
            visits.tour(&mut engine, &tour.stops, &mut pauses)?;
        } else {
            visits.perform(&mut engine, &plan.visits)?;
            for (i, pose) in plan.free_rad.iter().enumerate() {
                let hold_s = pauses.uniform(config.task.free.hold_s);
                hold_free(config, &mut engine, pose, hold_s, &format!("free pose {i}"))?;
            }
        }
        engine.drive_to_pose(&home, config.task.free.speed_m_s, "home")?;
        engine.hold(config.task.home_s, at_home());

        let (trace, rests, mechanisms) = engine.finish();
        Ok(Session { place, trace, rests, due, mechanisms })
    }
}

/// Drives the arm along set-points from a file, from home.
fn follow_set_points(engine: &mut Engine<'_>, commands: &Commands, home: &[f64]) -> Vec<Due> {
    engine.drive_joints(home, commands.speed_rad_s);
    engine.hold(commands.hold_s, Some(empty_rest(RestKind::Free)));
    let Some(time_s) = &commands.time_s else {
        let mut stop = |joint_rad: &Vec<f64>| {
            engine.drive_joints(joint_rad, commands.speed_rad_s);
            let first = engine.last_step();
            engine.hold(commands.hold_s, Some(empty_rest(RestKind::Free)));
            let last = engine.last_step();
            Due { joint_rad: joint_rad.clone(), first: first + (last - first) / 2, last }
        };
        return commands.joint_rad.iter().map(&mut stop).collect();
    };
    engine.drive_joints(&commands.joint_rad[0], commands.speed_rad_s);
    engine.hold(commands.hold_s, Some(empty_rest(RestKind::Free)));
    let steps = engine.follow_joints(time_s, &commands.joint_rad);
    engine.hold(commands.hold_s, Some(empty_rest(RestKind::Free)));
    let due = |(q, step): (&Vec<f64>, usize)| Due { joint_rad: q.clone(), first: step, last: step };
    commands.joint_rad.iter().zip(steps).map(due).collect()
}

/// The part with the board: hands, cavities, pauses.
struct Visits<'a> {
    config: &'a LabConfig,
    rig: &'a Rig,
    place: &'a BoardPlace,
    pauses: Stream,
    seats: Stream,
    tails: Stream,
    seat: Vector3<f64>,
}

impl<'a> Visits<'a> {
    fn new(config: &'a LabConfig, rig: &'a Rig, place: &'a BoardPlace, recording: usize) -> Visits<'a> {
        let stream = |purpose, index| Stream::new(config.seed, purpose, index);
        Visits {
            config,
            rig,
            place,
            pauses: stream(Purpose::Pauses, 2 * recording),
            seats: stream(Purpose::Seat, recording),
            tails: stream(Purpose::Tails, 2 * recording),
            seat: Vector3::zeros(),
        }
    }

    fn perform(&mut self, engine: &mut Engine<'_>, visits: &[Visit]) -> Result<(), LabError> {
        let mut travel = Vector3::x();
        for (i, visit) in visits.iter().enumerate() {
            let here = self.rig.board.cavities[visit.cavity].drawn_m;
            if i > 0 {
                let step = here - self.rig.board.cavities[visits[i - 1].cavity].drawn_m;
                travel = step.try_normalize(1e-9).unwrap_or(travel);
            }
            if self.config.hand.plunge {
                travel = Vector3::x();
            }
            let turned_rad = self.config.hand.slide_spread_deg.to_radians() * self.pauses.normal();
            self.visit(engine, visit, &travel, if self.config.hand.plunge { 0.0 } else { turned_rad })?;
        }
        Ok(())
    }

    /// Visits given places, each exactly from the side that is asked for.
    fn tour(
        &mut self,
        engine: &mut Engine<'_>,
        stops: &[StopConfig],
        pauses: &mut Stream,
    ) -> Result<(), LabError> {
        let radians = |deg: &[f64]| deg.iter().map(|q| q.to_radians()).collect::<Vec<_>>();
        for (i, stop) in stops.iter().enumerate() {
            match stop {
                StopConfig::Cavity { name, slide_from_deg } => {
                    let found = self.rig.board.cavities.iter().position(|cavity| cavity.name == *name);
                    let cavity = found.ok_or_else(|| {
                        value_error("task.tours.stops", format!("cavity `{name}` is not on the board"))
                    })?;
                    let side = slide_from_deg.map(f64::to_radians);
                    let travel = side.map_or(Vector3::zeros(), |s| -Vector3::new(s.cos(), s.sin(), 0.0));
                    self.visit(engine, &Visit { cavity, pass: 0 }, &travel, 0.0)?;
                }
                StopConfig::Pose { joint_deg, from_deg } => {
                    let hold_s = pauses.uniform(self.config.task.free.hold_s);
                    let what = format!("stop {i}");
                    hold_free(self.config, engine, &radians(from_deg), PASSING_S, &what)?;
                    hold_free(self.config, engine, &radians(joint_deg), hold_s, &what)?;
                }
            }
        }
        Ok(())
    }

    /// Where in the clearance the tip comes to sit [m, board frame].
    fn seat_m(&mut self) -> Vector3<f64> {
        let hand = &self.config.hand;
        let (fresh, keep) = (self.seats.normal3(), hand.seat_correlation);
        self.seat = if keep == 0.0 { fresh } else { self.seat * keep + fresh * (1.0 - keep * keep).sqrt() };
        let tail = if hand.seat_tail_degrees == 0.0 { 1.0 } else { self.tails.tail(hand.seat_tail_degrees) };
        self.seat * self.rig.board.seat_sigma_m * tail
    }

    /// One visit: drive above the cavity, guide the tip over it, slide it in, let it rest, lift it out.
    fn visit(
        &mut self,
        engine: &mut Engine<'_>,
        visit: &Visit,
        travel: &Vector3<f64>,
        turned_rad: f64,
    ) -> Result<(), LabError> {
        let (hand, task) = (&self.config.hand, &self.config.task);
        let cavity = &self.rig.board.cavities[visit.cavity];
        let what = format!("cavity `{}`", cavity.name);
        let marked = |kind, seat_m| Rest {
            cavity: Some(visit.cavity),
            pass: Some(visit.pass),
            seat_m,
            ..empty_rest(kind)
        };
        let above = cavity.drawn_m + Vector3::z() * (task.transit_height_mm * 1e-3);
        let waypoint = self.place.base_from_board * Point3::from(above);
        engine.drive_through(&[waypoint.coords], task.speed_m_s, &what)?;

        let (tremor_m, rattle_m) = (hand.tremor_mm * 1e-3, hand.rattle_mm * 1e-3);
        let seat_m = self.seat_m();
        let mut draw = |range| self.pauses.uniform(range);
        let lift = |height_mm: f64, aside_m: Vector3<f64>| {
            cavity.true_m + aside_m + Vector3::z() * (height_mm * 1e-3)
        };
        let hover = lift(draw(hand.hover_height_mm), -travel * (draw([0.0, 3.0]) * 1e-3));
        engine.guide(hover, draw(hand.move_s), [tremor_m; 2], &what)?;
        if draw([0.0, 1.0]) < hand.hover_share {
            engine.hold(draw(hand.hover_s), Some(marked(RestKind::Hover, None)));
        }

        let behind = slide_direction(travel, turned_rad);
        let touch = lift(1.5, behind * (draw(hand.slide_mm) * 1e-3));
        engine.guide(touch, draw(hand.move_s), [tremor_m; 2], &what)?;
        let seated = cavity.true_m + seat_m;
        engine.guide(seated, draw(hand.move_s), [tremor_m, rattle_m], &what)?;
        let still_m = hand.seated_tremor_mm * 1e-3;
        engine.guide(seated, draw(hand.rattle_s), [rattle_m, still_m], &what)?;
        engine.rest_by_hand(
            seated,
            draw(hand.seated_s),
            still_m,
            marked(RestKind::Seated, Some(seat_m)),
            &what,
        )?;

        let lifted = lift(draw(hand.hover_height_mm), travel * (draw([0.0, 3.0]) * 1e-3));
        engine.guide(lifted, draw(hand.move_s), [0.0, tremor_m], &what)?;
        if draw([0.0, 1.0]) < hand.hover_share {
            engine.hold(draw(hand.hover_s), Some(marked(RestKind::Hover, None)));
        }
        Ok(())
    }
}

/// How long a pose is held that is only passed through [s].
const PASSING_S: f64 = 0.1;

/// Goes to a free pose, as the configuration has it, and holds it.
fn hold_free(
    config: &LabConfig,
    engine: &mut Engine<'_>,
    joint_rad: &[f64],
    hold_s: f64,
    what: &str,
) -> Result<(), LabError> {
    let speed_m_s = config.task.free.speed_m_s;
    if config.task.free.by_hand {
        engine.lead_to_pose(joint_rad, speed_m_s, hold_s, empty_rest(RestKind::Free));
    } else {
        engine.drive_to_pose(joint_rad, speed_m_s, what)?;
        engine.hold(hold_s, Some(empty_rest(RestKind::Free)));
    }
    Ok(())
}

fn empty_rest(kind: RestKind) -> Rest {
    Rest { kind, cavity: None, pass: None, seat_m: None, first: 0, last: 0 }
}

/// Where a slide begins, seen from the cavity: behind it along the direction of travel, turned on the board.
fn slide_direction(travel: &Vector3<f64>, turned_rad: f64) -> Vector3<f64> {
    crate::screw::rotate_vector(&Vector3::z(), &-Vector3::new(travel.x, travel.y, 0.0), turned_rad)
}

#[cfg(test)]
mod tests {
    use crate::config::{StopConfig, TourConfig};
    use crate::observe;
    use crate::scenario::{Design, Scenario};
    use armcal_core::Arrival::{Negative, Positive};

    #[test]
    fn a_tour_goes_where_it_is_sent_and_arrives_from_there() {
        let planted = Scenario::new("nothing:white", Design::OneTiltOnePass, 3).plant().unwrap();
        let (mut config, mut before) =
            (planted.config.clone(), observe(&planted.config).unwrap().observations);
        let mut next = config.recordings[0].clone();
        (next.name, next.load_kg) = ("next".into(), 0.5);
        config.recordings.push(next);
        let pose = StopConfig::Pose { joint_deg: vec![20.0, -30.0, 10.0], from_deg: vec![15.0, -25.0, 5.0] };
        let cavity = StopConfig::Cavity { name: "circle03".into(), slide_from_deg: Some(90.0) };
        config.task.tours.push(TourConfig { recording: "next".into(), stops: vec![pose, cavity] });
        let after = observe(&config).unwrap().observations;
        let tour: Vec<_> = after.iter().filter(|o| o.dwell.recording == 1).collect();
        assert_eq!(tour.len(), 2);
        let reached = tour[0].joint_rad.iter().zip([20.0_f64, -30.0, 10.0]);
        assert!(reached.into_iter().all(|(q, deg)| (q - deg.to_radians()).abs() < 1e-3));
        assert_eq!(tour[0].arrival, [Positive, Negative, Positive]);
        assert_eq!((tour[1].cavity(), tour[1].load_kg), (Some("circle03"), 0.5));
        // Slid in from the left, towards the right: joint 1 turns clockwise.
        assert_eq!(tour[1].arrival[0], Negative);
        before.retain(|o| o.dwell.recording == 0);
        assert_eq!(before, after[..before.len()], "a tour changes what came before it");
    }
}
