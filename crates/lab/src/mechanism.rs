//! Where hidden physics plugs in: a mechanism is one thing inside the rig that is not rigid geometry.
//!
//! The engine itself knows only axis lines, motors and hands. A gap in a gear, a spring, a link that grows, a
//! pulley that slips or a marker that was knocked is a [`Mechanism`] in a file of its own, handed to
//! [`crate::simulate_with`]; the engine asks each of them at the places where it could matter, in this order:
//!
//! 1. the motor turns the link ([`Mechanism::motor_to_link`]), or the hand turns the motor through the gear
//!    ([`Mechanism::link_to_motor`]): whichever side drives, the other follows;
//! 2. the links and the frames are what they are at this moment ([`Mechanism::reshape_arm`],
//!    [`Mechanism::move_base`], [`Mechanism::move_board`]);
//! 3. the sensors report it in their own way ([`Mechanism::distort_encoder`], [`Mechanism::distort_camera`]).
//!
//! Mechanisms may keep state: both turning hooks are called once for each step of the integration, in order of
//! time, for one recording. The remaining hooks must not change state.

use crate::arm::AxisArm;
use armcal_core::Pose;

/// What a mechanism can know about the present moment.
#[derive(Debug, Clone, Copy)]
pub struct RigState<'a> {
    /// Time since the start of the recording [s].
    pub time_s: f64,
    /// Time since the start of the session [s].
    pub session_s: f64,
    /// Index of the recording.
    pub recording: usize,
    /// How much warmer the arm is than at the start of the session [K].
    pub warmer_k: f64,
    /// Whether a path that is given on the link side is driven by the motors: they lead, and the links follow.
    pub motors_lead: bool,
    /// The arm as it is at this moment.
    pub arm: &'a AxisArm,
    /// True mass of each link [kg].
    pub masses_kg: &'a [f64],
    /// True mass at the tip, tool and load [kg].
    pub tip_kg: f64,
    /// Gravity in the base frame [m/s^2].
    pub gravity_m_s2: &'a nalgebra::Vector3<f64>,
    /// Link-side joint angles [rad].
    pub link_rad: &'a [f64],
    /// Gravity's torque on each joint, `> 0` pushing towards `+q` [N m].
    pub gravity_nm: &'a [f64],
}

/// A body that the cameras track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// The end effector.
    Tip,
    /// The calibration table.
    Table,
    /// The robot's base.
    Base,
    /// A marker on a link of the arm, by its index in `[[vicon.markers]]`.
    Marker(usize),
}

/// What has a name.
pub trait Named {
    /// Its name, as the truth file records it.
    fn name(&self) -> &str;
}

/// One hidden physical effect. Every hook defaults to "does nothing".
pub trait Mechanism: Named + std::fmt::Debug + Send {
    /// The joint, from 1, whose link it puts ahead of the motor while all joints are at these angles, and by how much [rad]:
    /// all that both turning hooks do where it does not matter which side drives.
    fn ahead(&mut self, _now: &RigState<'_>, _joint_rad: &[f64]) -> Option<(usize, f64)> {
        None
    }

    /// The motor drives: turns motor-side angles into link-side angles, in place.
    fn motor_to_link(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        if let Some((joint, by_rad)) = self.ahead(now, joint_rad) {
            joint_rad[joint - 1] += by_rad;
        }
    }

    /// The hand drives: turns link-side angles into motor-side angles, in place. With [`RigState::motors_lead`] it is
    /// the motors that take the links there.
    fn link_to_motor(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        if let Some((joint, by_rad)) = self.ahead(now, joint_rad) {
            joint_rad[joint - 1] -= by_rad;
        }
    }

    /// Changes the arm's geometry.
    fn reshape_arm(&self, _now: &RigState<'_>, _arm: &mut AxisArm) {}

    /// Moves the base in the world.
    fn move_base(&self, _now: &RigState<'_>, _world_from_base: &mut Pose) {}

    /// Moves the board in the world.
    fn move_board(&self, _now: &RigState<'_>, _world_from_board: &mut Pose) {}

    /// Changes what the encoders read [rad, motor side].
    fn distort_encoder(&self, _now: &RigState<'_>, _reading_rad: &mut [f64]) {}

    /// Changes what the cameras make of the true pose of a body in the world.
    fn distort_camera(&self, _now: &RigState<'_>, _body: Body, _world_from_body: &mut Pose) {}
}

/// Makes the mechanisms of one recording, given its index. They all start in their initial state.
pub type MechanismFactory<'a> = dyn Fn(usize) -> Vec<Box<dyn Mechanism>> + Sync + 'a;

/// A rig with nothing hidden: geometry only.
pub fn nothing_hidden(_recording: usize) -> Vec<Box<dyn Mechanism>> {
    Vec::new()
}
