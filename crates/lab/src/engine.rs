//! The rig in motion: motors drive planned paths, a hand seats the tip, every step is recorded.

mod by_hand;
mod commanded;
mod quickly;

use crate::LabError;
use crate::arm::AxisArm;
use crate::config::LabConfig;
use crate::hand::Tremor;
use crate::mechanism::{Body, Mechanism, RigState};
use crate::random::{Purpose, Stream};
use crate::rig::{BoardPlace, Rig};
use crate::servo::{Servo, quantise_angle};
use crate::spline::Path;
use crate::trace::{Rest, STEP_S, Trace};
use armcal_core::Pose;
use nalgebra::Vector3;

/// Shortest duration of one section of a planned path [s].
const SHORTEST_SECTION_S: f64 = 0.4;

/// Waypoints between two poses far apart, so that a Cartesian path follows the arm's natural arc.
const WAYPOINTS_BETWEEN_POSES: usize = 4;

/// How closely motion is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Every [`STEP_S`], with inertia and control.
    Full,
    /// As far as hysteresis needs it: a few positions along each movement, motors exactly on their plan.
    Quick,
}

/// Time between two positions of a movement on the quick path [s].
const QUICK_STEP_S: f64 = 0.1;

/// Steps of a rest on the quick path: enough for gravity and springs to agree.
const QUICK_REST_STEPS: usize = 3;

/// One recording under way.
pub struct Engine<'a> {
    config: &'a LabConfig,
    rig: &'a Rig,
    place: &'a BoardPlace,
    recording: usize,
    pace: Pace,
    time_s: f64,
    mechanisms: Vec<Box<dyn Mechanism>>,
    servo: Servo,
    tremor: Tremor,
    driven_by_hand: bool,
    /// On the quick path: whether the motors' own dynamics are followed.
    swinging: bool,
    link_rad: Vec<f64>,
    reading_rad: Vec<f64>,
    set_point_rad: Vec<f64>,
    gravity_nm: Vec<f64>,
    arm: AxisArm,
    world_from_base: Pose,
    world_from_board: Pose,
    trace: Trace,
    rests: Vec<Rest>,
}

impl<'a> Engine<'a> {
    /// The arm waits at home, held by its motors.
    pub fn new(
        config: &'a LabConfig,
        rig: &'a Rig,
        place: &'a BoardPlace,
        recording: usize,
        mechanisms: Vec<Box<dyn Mechanism>>,
        pace: Pace,
    ) -> Engine<'a> {
        let home: Vec<f64> = config.arm.home_deg.iter().map(|deg| deg.to_radians()).collect();
        let hand = Stream::new(config.seed, Purpose::Hand, recording);
        let mut engine = Engine {
            config,
            rig,
            place,
            recording,
            pace,
            time_s: 0.0,
            mechanisms,
            servo: Servo::new(&config.arm.drives, &home),
            tremor: Tremor::new(
                hand,
                config.hand.tremor_s,
                if pace == Pace::Full { STEP_S } else { QUICK_STEP_S },
            ),
            driven_by_hand: true,
            swinging: false,
            link_rad: home.clone(),
            reading_rad: home.clone(),
            set_point_rad: home.clone(),
            gravity_nm: vec![0.0; home.len()],
            arm: rig.built.clone(),
            world_from_base: rig.world_from_base,
            world_from_board: place.world_from_board,
            trace: Trace::default(),
            rests: Vec::new(),
        };
        engine.motors_turn_links();
        engine.record();
        engine.motors_take_over();
        engine
    }

    /// What happened.
    pub fn finish(self) -> (Trace, Vec<Rest>, Vec<Box<dyn Mechanism>>) {
        (self.trace, self.rests, self.mechanisms)
    }

    /// Drives the tip of the nominal arm through waypoints in the base frame [m] and stops at the last.
    pub fn drive_through(
        &mut self,
        waypoints_m: &[Vector3<f64>],
        speed_m_s: f64,
        what: &str,
    ) -> Result<(), LabError> {
        self.motors_take_over();
        let mut points = vec![self.rig.nominal.tip(&self.set_point_rad)];
        points.extend_from_slice(waypoints_m);
        let path = Path::through(&points, speed_m_s, SHORTEST_SECTION_S);
        if self.pace == Pace::Quick {
            return self.follow(&path, what);
        }
        let steps = (path.duration_s() / STEP_S).ceil() as usize;
        let steps_a_set_point = self.steps_a_set_point();
        let mut planned_rad = self.set_point_rad.clone();
        for step in 0..=steps {
            if step % steps_a_set_point == 0 || step == steps {
                let wanted = path.position(step as f64 * STEP_S).unwrap_or(points[0]);
                planned_rad = self
                    .rig
                    .nominal
                    .solve(&wanted, &planned_rad)
                    .map_err(|miss| self.unreachable("nominal", what, miss.short_by_m))?;
                self.set_point_rad = planned_rad.iter().map(|q| self.counted(*q)).collect();
            }
            self.motor_step();
        }
        Ok(())
    }

    /// Drives to joint angles [rad], along the arc the joints would take.
    pub fn drive_to_pose(&mut self, joint_rad: &[f64], speed_m_s: f64, what: &str) -> Result<(), LabError> {
        self.motors_take_over();
        let from = self.set_point_rad.clone();
        let waypoints: Vec<Vector3<f64>> = (1..=WAYPOINTS_BETWEEN_POSES)
            .map(|i| i as f64 / WAYPOINTS_BETWEEN_POSES as f64)
            .map(|share| from.iter().zip(joint_rad).map(|(a, b)| a + (b - a) * share).collect::<Vec<_>>())
            .map(|pose| self.rig.nominal.tip(&pose))
            .collect();
        // How far a joint swings beyond its target decides on which flank of a gap it comes to rest.
        self.swinging = true;
        self.drive_through(&waypoints, speed_m_s, what)
    }

    /// Holds still under motor control for `duration_s`, and notes the rest if it is one.
    pub fn hold(&mut self, duration_s: f64, rest: Option<Rest>) {
        self.motors_take_over();
        let mut first = self.trace.len();
        if self.pace == Pace::Quick {
            first = self.quick_hold(duration_s);
        } else {
            (0..step_count(duration_s)).for_each(|_| self.motor_step());
        }
        self.note(rest, first);
    }

    fn note(&mut self, rest: Option<Rest>, first: usize) {
        let last = self.trace.len() - 1;
        self.rests.extend(rest.filter(|_| last > first).map(|rest| Rest { first, last, ..rest }));
    }

    fn motors_take_over(&mut self) {
        if self.driven_by_hand {
            self.driven_by_hand = false;
            self.swinging = false;
            self.set_point_rad = self.reading_rad.iter().map(|q| self.counted(*q)).collect();
            self.servo.take_over(&self.set_point_rad, &self.gravity_nm);
        }
    }

    fn motor_step(&mut self) {
        self.pass(STEP_S);
        let reading: Vec<f64> = self.reading_rad.iter().map(|q| self.counted(*q)).collect();
        self.servo.step(&self.set_point_rad, &reading, &self.gravity_nm, STEP_S);
        self.motors_turn_links();
        self.record();
    }

    /// Lets time pass; at full pace it is the number of steps that counts, so that no rounding adds up.
    fn pass(&mut self, step_s: f64) {
        self.time_s = match self.pace {
            Pace::Full => self.trace.len() as f64 * STEP_S,
            Pace::Quick => self.time_s + step_s,
        };
    }

    fn motors_turn_links(&mut self) {
        let mut link = self.servo.angle_rad.clone();
        let mut mechanisms = std::mem::take(&mut self.mechanisms);
        mechanisms.iter_mut().for_each(|m| m.motor_to_link(&self.moment(), &mut link));
        self.mechanisms = mechanisms;
        self.link_rad = link;
    }

    fn moment(&self) -> RigState<'_> {
        let session_s = self.session_s();
        RigState {
            time_s: self.time_s,
            session_s,
            recording: self.recording,
            warmer_k: self.config.temperature.at(session_s) - self.config.temperature.start_c,
            motors_lead: self.config.hand.motors_lead,
            arm: &self.arm,
            masses_kg: &self.rig.masses_kg,
            tip_kg: self.tip_kg(),
            gravity_m_s2: &self.rig.gravity_m_s2,
            link_rad: &self.link_rad,
            gravity_nm: &self.gravity_nm,
        }
    }

    /// Time since the start of the session [s].
    fn session_s(&self) -> f64 {
        self.time_s + self.recording as f64 * self.config.interval_s
    }

    /// Mass at the tip: the tool and what it carries [kg].
    fn tip_kg(&self) -> f64 {
        self.rig.tip_kg + self.config.recordings[self.recording].load_kg
    }

    /// Brings frames, geometry, gravity and readings up to date and adds a row to the trace.
    fn record(&mut self) {
        let (gravity, masses) = (&self.rig.gravity_m_s2, &self.rig.masses_kg);
        self.gravity_nm = self.arm.gravity_torque(&self.link_rad, gravity, masses, self.tip_kg());
        let mut mechanisms = std::mem::take(&mut self.mechanisms);
        if !mechanisms.is_empty() {
            let (mut arm, mut base) = (self.rig.built.clone(), self.rig.world_from_base);
            let mut board = self.place.world_from_board;
            for mechanism in &mechanisms {
                mechanism.reshape_arm(&self.moment(), &mut arm);
                mechanism.move_base(&self.moment(), &mut base);
                mechanism.move_board(&self.moment(), &mut board);
            }
            (self.arm, self.world_from_base, self.world_from_board) = (arm, base, board);
        }
        let mut reading = self.servo.angle_rad.clone();
        let tip = self.world_from_base * self.arm.tip_pose(&self.link_rad);
        let mut seen = self.bodies(&tip);
        let mut markers = self.markers();
        for mechanism in &mut mechanisms {
            mechanism.distort_encoder(&self.moment(), &mut reading);
            for (body, pose) in [Body::Tip, Body::Table, Body::Base].into_iter().zip(&mut seen) {
                mechanism.distort_camera(&self.moment(), body, pose);
            }
            for (marker, pose) in markers.iter_mut().enumerate() {
                mechanism.distort_camera(&self.moment(), Body::Marker(marker), pose);
            }
        }
        self.mechanisms = mechanisms;
        self.reading_rad = reading;
        self.push(tip, seen);
        self.trace.push_markers(markers);
    }

    /// Where the marker sets of tip, table and base are in the world.
    fn bodies(&self, world_from_tip: &Pose) -> [Pose; 3] {
        let vicon = &self.config.vicon;
        let offset = Vector3::from(vicon.tip_offset_mm) * 1e-3;
        let table = match vicon.table_markers {
            crate::config::TableMarkers::Board => self.world_from_board,
            crate::config::TableMarkers::Frame => {
                self.world_from_board * self.place.world_from_board.inverse() * self.rig.world_from_table
            }
        };
        [
            world_from_tip * nalgebra::Translation3::from(offset),
            table,
            self.world_from_base * self.rig.base_from_plate,
        ]
    }

    /// Where the markers on the links are in the world.
    fn markers(&self) -> Vec<Pose> {
        let at = |marker: &crate::config::MarkerConfig| {
            let at_m = Vector3::from(marker.at_mm) * 1e-3;
            self.world_from_base * self.arm.carried_pose(marker.link - 1, &at_m, &self.link_rad)
        };
        self.config.vicon.markers.iter().map(at).collect()
    }

    fn push(&mut self, tip: Pose, [seen_tip, seen_table, seen_base]: [Pose; 3]) {
        let temperature_c = self.config.temperature.at(self.session_s());
        let trace = &mut self.trace;
        trace.time_s.push(self.time_s);
        trace.temperature_c.push(temperature_c);
        trace.link_rad.push(self.link_rad.clone());
        trace.motor_rad.push(self.servo.angle_rad.clone());
        trace.reading_rad.push(self.reading_rad.clone());
        trace.set_point_rad.push(self.set_point_rad.clone());
        trace.world_from_tip.push(tip);
        trace.world_from_base.push(self.world_from_base);
        trace.world_from_board.push(self.world_from_board);
        trace.seen_tip.push(seen_tip);
        trace.seen_table.push(seen_table);
        trace.seen_base.push(seen_base);
    }

    fn steps_a_set_point(&self) -> usize {
        (1.0 / (self.config.task.set_point_hz * STEP_S)).round().max(1.0) as usize
    }

    /// The last step so far.
    pub fn last_step(&self) -> usize {
        self.trace.len() - 1
    }

    fn counted(&self, angle_rad: f64) -> f64 {
        quantise_angle(angle_rad, self.config.joints.count_rad())
    }

    fn unreachable(&self, arm: &'static str, what: &str, short_by_m: f64) -> LabError {
        LabError::Unreachable {
            recording: self.config.recordings[self.recording].name.clone(),
            arm,
            what: what.to_owned(),
            short_by_mm: short_by_m * 1e3,
        }
    }
}

fn step_count(duration_s: f64) -> usize {
    (duration_s / STEP_S).round() as usize
}
