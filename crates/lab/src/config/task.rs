//! What the arm does, and how the hand that seats it behaves.

use crate::LabError;
use crate::checks::{
    check_not_negative, check_positive, check_range, check_share, check_tail_degrees, value_error,
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The task of every recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TaskConfig {
    /// Passes over the cavities. Default: one forward, one backward.
    pub passes: Vec<PassConfig>,
    /// Chance that a cavity of a pass is left out. Default 0.02.
    pub skip_share: f64,
    /// Chance that a cavity of a pass changes places with the next. Default 0.03.
    pub swap_share: f64,
    /// Height of the waypoint above a cavity, where the planned motion ends [mm]. The nominal arm is tens of
    /// millimetres off, so it must be more than that. Default 60.
    pub transit_height_mm: f64,
    /// Speed along planned paths near the board [m/s]. Default 0.15.
    pub speed_m_s: f64,
    /// Pause at home at both ends of a recording [s]. Default 2.
    pub home_s: f64,
    /// Free-space poses.
    pub free: FreeConfig,
    /// A fast path through waypoints without stopping.
    pub sweep: SweepConfig,
    /// Rate of the set-points [Hz]. Default 100.
    pub set_point_hz: f64,
    /// Recordings that visit given places instead.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tours: Vec<TourConfig>,
    /// Recordings that are driven along set-points from a file instead.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub set_points: Vec<SetPointsConfig>,
}

/// A recording whose motors are given set-points from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetPointsConfig {
    /// Name of the recording.
    pub recording: String,
    /// CSV file, relative to the lab file: columns `<columns>.<joint>_rad` and, for a path, `t_s` [s].
    pub file: PathBuf,
    /// Beginning of the names of the joints' columns. Default `set_point`.
    #[serde(default = "set_point")]
    pub columns: String,
    /// Pause at each stop, or at both ends of a path [s]. Default 1.5.
    #[serde(default = "pause_s")]
    pub hold_s: f64,
    /// Speed of the joint that goes furthest between two stops [deg/s]. Default 30.
    #[serde(default = "speed_deg_s")]
    pub speed_deg_s: f64,
}

/// A recording that visits given places, in their order, instead of passes and free poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TourConfig {
    /// Name of the recording.
    pub recording: String,
    /// The places.
    pub stops: Vec<StopConfig>,
}

/// A place to visit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "lowercase", tag = "at")]
pub enum StopConfig {
    /// A cavity.
    Cavity {
        /// Its name.
        name: String,
        /// Side of the cavity from which the tip slides in, from the board's x towards its y [deg]; straight down when
        /// absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        slide_from_deg: Option<f64>,
    },
    /// A free pose.
    Pose {
        /// Joint angles [deg].
        joint_deg: Vec<f64>,
        /// The pose from which it is reached [deg].
        from_deg: Vec<f64>,
    },
}

/// One pass over the cavities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassConfig {
    /// Order of the visits.
    pub order: Order,
    /// How many of the cavities are visited, 0 to 1. Default 1.
    #[serde(default = "all")]
    pub share: f64,
}

/// Order of the visits of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// As the board file lists the cavities.
    Forward,
    /// The other way round.
    Backward,
    /// Shuffled.
    Random,
}

/// Free-space poses, held by the motors and seen by the cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FreeConfig {
    /// Poses a recording. Default 24.
    pub poses: usize,
    /// Range of each joint [deg]: `[smallest, largest]`.
    pub range_deg: Vec<[f64; 2]>,
    /// How long a pose is held [s]. Default 1.6 to 2.2; settling, about half a second, is part of it.
    pub hold_s: [f64; 2],
    /// Speed along the paths between them [m/s]. Default 0.4.
    pub speed_m_s: f64,
    /// Whether a hand leads the arm there and holds it, back-driving the gears (or, with `hand.motors_lead`, motors
    /// that follow the path exactly). Default false: the motors do under control.
    #[serde(skip_serializing_if = "super::is_default")]
    pub by_hand: bool,
}

/// A path through random waypoints above the board, passed with non-zero velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SweepConfig {
    /// Waypoints; 0 for none. Default 6, as the paper's second trajectory.
    pub points: usize,
    /// Speed along it [m/s]. Default 0.3.
    pub speed_m_s: f64,
}

/// The person who seats the tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HandConfig {
    /// Height above the cavity to which the hand first brings the tip [mm]. Default 15 to 25.
    pub hover_height_mm: [f64; 2],
    /// Chance of a pause there, before and after seating each. Default 0.15.
    pub hover_share: f64,
    /// Length of that pause [s]. Default 0.6 to 1.0.
    pub hover_s: [f64; 2],
    /// Distance from which the tip slides over the board into the cavity [mm]. Default 6 to 14: it decides from
    /// which side each joint arrives.
    pub slide_mm: [f64; 2],
    /// Spread of the direction it slides from about the direction of travel, 1 sigma [deg]. Default 60.
    pub slide_spread_deg: f64,
    /// Time the hand takes for each of its movements [s]. Default 0.5 to 0.8.
    pub move_s: [f64; 2],
    /// How long the tip rattles in the cavity before it rests [s]. Default 0.2 to 0.5.
    pub rattle_s: [f64; 2],
    /// How long it rests in the cavity [s]. Default 0.8 to 2.
    pub seated_s: [f64; 2],
    /// Tremor of the guided tip, 1 sigma per axis [mm]. Default 0.4.
    pub tremor_mm: f64,
    /// How far it rattles in the cavity at first, 1 sigma per axis [mm]. Default 0.1.
    pub rattle_mm: f64,
    /// Tremor left while the tip rests in the cavity, 1 sigma per axis [mm]. Default 0.01.
    pub seated_tremor_mm: f64,
    /// Correlation time of the tremor [s]. Default 0.03.
    pub tremor_s: f64,
    /// Whether it is not a hand but the motors that jog the tip into the cavities: without tremor, and the motors lead.
    /// Default false.
    #[serde(skip_serializing_if = "super::is_default")]
    pub motors_lead: bool,
    /// Whether every cavity is entered by the same final descent, instead of along the way. Default false.
    #[serde(skip_serializing_if = "super::is_default")]
    pub plunge: bool,
    /// Correlation of where the tip sits in the clearance from one visit to the next. Default 0.
    #[serde(skip_serializing_if = "super::is_default")]
    pub seat_correlation: f64,
    /// Degrees of freedom of Student's t for where the tip sits; 0 for normal. Default 0.
    #[serde(skip_serializing_if = "super::is_default")]
    pub seat_tail_degrees: f64,
}

impl Default for TaskConfig {
    fn default() -> TaskConfig {
        let pass = |order| PassConfig { order, share: 1.0 };
        TaskConfig {
            passes: vec![pass(Order::Forward), pass(Order::Backward)],
            skip_share: 0.02,
            swap_share: 0.03,
            transit_height_mm: 60.0,
            speed_m_s: 0.15,
            home_s: 2.0,
            free: FreeConfig::default(),
            sweep: SweepConfig::default(),
            set_point_hz: 100.0,
            tours: Vec::new(),
            set_points: Vec::new(),
        }
    }
}

impl Default for FreeConfig {
    fn default() -> FreeConfig {
        FreeConfig {
            poses: 24,
            range_deg: vec![[-60.0, 60.0], [-75.0, 20.0], [-60.0, 50.0]],
            hold_s: [1.6, 2.2],
            speed_m_s: 0.4,
            by_hand: false,
        }
    }
}

impl Default for SweepConfig {
    fn default() -> SweepConfig {
        SweepConfig { points: 6, speed_m_s: 0.3 }
    }
}

impl Default for HandConfig {
    fn default() -> HandConfig {
        HandConfig {
            hover_height_mm: [15.0, 25.0],
            hover_share: 0.15,
            hover_s: [0.6, 1.0],
            slide_mm: [6.0, 14.0],
            slide_spread_deg: 60.0,
            move_s: [0.5, 0.8],
            rattle_s: [0.2, 0.5],
            seated_s: [0.8, 2.0],
            tremor_mm: 0.4,
            rattle_mm: 0.1,
            seated_tremor_mm: 0.01,
            tremor_s: 0.03,
            motors_lead: false,
            plunge: false,
            seat_correlation: 0.0,
            seat_tail_degrees: 0.0,
        }
    }
}

impl TaskConfig {
    pub(super) fn check(&self) -> Result<(), LabError> {
        check_share("task.skip_share", self.skip_share)?;
        check_share("task.swap_share", self.swap_share)?;
        self.passes.iter().try_for_each(|pass| check_share("task.passes.share", pass.share))?;
        check_not_negative("task.transit_height_mm", self.transit_height_mm)?;
        check_positive("task.speed_m_s", self.speed_m_s)?;
        check_not_negative("task.home_s", self.home_s)?;
        check_positive("task.free.speed_m_s", self.free.speed_m_s)?;
        check_pause("task.free.hold_s", self.free.hold_s)?;
        self.free.range_deg.iter().try_for_each(|r| check_range("task.free.range_deg", *r))?;
        check_positive("task.sweep.speed_m_s", self.sweep.speed_m_s)?;
        for told in &self.set_points {
            check_pause("task.set_points.hold_s", [0.0, told.hold_s])?;
            check_positive("task.set_points.speed_deg_s", told.speed_deg_s)?;
        }
        if !(1.0..=500.0).contains(&self.set_point_hz) {
            return Err(value_error(
                "task.set_point_hz",
                format!("must lie in 1..500, is {}", self.set_point_hz),
            ));
        }
        Ok(())
    }
}

impl HandConfig {
    pub(super) fn check(&self) -> Result<(), LabError> {
        check_range("hand.hover_height_mm", self.hover_height_mm)?;
        check_share("hand.hover_share", self.hover_share)?;
        check_pause("hand.hover_s", self.hover_s)?;
        check_range("hand.slide_mm", self.slide_mm)?;
        check_not_negative("hand.slide_spread_deg", self.slide_spread_deg)?;
        check_pause("hand.move_s", self.move_s)?;
        check_pause("hand.rattle_s", self.rattle_s)?;
        check_pause("hand.seated_s", self.seated_s)?;
        check_not_negative("hand.tremor_mm", self.tremor_mm)?;
        check_not_negative("hand.rattle_mm", self.rattle_mm)?;
        check_not_negative("hand.seated_tremor_mm", self.seated_tremor_mm)?;
        check_share("hand.seat_correlation", self.seat_correlation)?;
        check_tail_degrees("hand.seat_tail_degrees", self.seat_tail_degrees)?;
        check_positive("hand.tremor_s", self.tremor_s)
    }
}

/// A range of durations: ordered, not negative, and short enough that a slip of the pen does not fill memory.
fn check_pause(key: &str, [low, high]: [f64; 2]) -> Result<(), LabError> {
    check_range(key, [low, high])?;
    check_not_negative(key, low)?;
    if high > 3600.0 { Err(value_error(key, format!("{high} s is more than an hour"))) } else { Ok(()) }
}

fn set_point() -> String {
    "set_point".into()
}

fn pause_s() -> f64 {
    1.5
}

fn speed_deg_s() -> f64 {
    30.0
}

fn all() -> f64 {
    1.0
}
