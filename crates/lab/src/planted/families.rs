//! The families of the catalogue: what each hides, and what a right answer would be.

use crate::checks::value_error;
use crate::config::LabConfig;
use crate::mechanisms::*;
use crate::random::Stream;
use crate::scenario::{Design, Hidden, Size};
use crate::{LabError, observe};
use nalgebra::Vector3;

/// A family of scenarios.
pub(super) struct Family {
    /// Its name, the catalogue's where it is in it.
    pub name: &'static str,
    /// Joints it may strike; empty where it strikes none.
    pub joints: &'static [usize],
    /// Realistic range of its size.
    pub range: [f64; 2],
    /// Unit of that.
    pub unit: &'static str,
    /// Makes it.
    pub build: Build,
}

/// What a family made.
pub(super) struct Made {
    /// What is hidden in the rig.
    pub mechanism: MechanismConfig,
    /// Effect in the catalogue.
    pub effect: Option<String>,
    /// Effects that are the same to any data.
    pub same: Vec<String>,
    /// Effects that are nearly the same to data of a narrow range.
    pub alike: Vec<String>,
    /// Channel and driver.
    pub enters: [String; 2],
}

/// What is drawn for one family.
pub(super) struct Draw {
    pub draw: Stream,
    pub design: Design,
    pub joint: usize,
    pub size: f64,
    target: Option<usize>,
    wanted: Size,
    recording: Option<usize>,
    dwell: Option<usize>,
}

impl Draw {
    pub fn new(draw: Stream, target: Option<usize>, wanted: Size, design: Design) -> Draw {
        Draw { draw, design, joint: 0, size: 0.0, target, wanted, recording: None, dwell: None }
    }

    /// Hides one of `family` in the rig.
    pub fn plant(mut self, family: &Family, config: &mut LabConfig) -> Result<Hidden, LabError> {
        let pick = self.draw.uniform([0.0, 1.0]);
        if !family.joints.is_empty() {
            let drawn = family.joints[(pick * family.joints.len() as f64) as usize % family.joints.len()];
            self.joint = self.target.unwrap_or(drawn);
        }
        let [low, high] = family.range;
        let between = |share: f64| low * (high / low).powf(share);
        let share = self.draw.uniform([0.0, 1.0]);
        self.size = match self.wanted {
            Size::Small => between(1.0 / 6.0),
            Size::Medium => between(0.5),
            Size::Large => between(5.0 / 6.0),
            Size::Drawn => between(share),
            Size::Value(size) => size,
        };
        let made = (family.build)(&mut self, config)?;
        config.mechanisms.push(made.mechanism.clone());
        let [channel, driver] = made.enters;
        Ok(Hidden {
            family: family.name.to_owned(),
            mechanism: made.mechanism.hidden().name().to_owned(),
            joint: (self.joint > 0).then_some(self.joint),
            recording: self.recording,
            dwell: self.dwell,
            size: self.size,
            unit: family.unit.to_owned(),
            effect: made.effect,
            same: made.same,
            alike: made.alike,
            channel,
            driver,
        })
    }

    /// The size with a drawn sign; the size keeps it.
    pub fn signed(&mut self) -> f64 {
        if self.draw.chance(0.5) {
            self.size = -self.size;
        }
        self.size
    }

    pub fn phase_deg(&mut self) -> f64 {
        self.draw.uniform([-180.0, 180.0])
    }

    /// A drawn direction.
    pub fn direction(&mut self) -> Vector3<f64> {
        self.draw.normal3().normalize()
    }

    pub fn joint_channel(&self) -> String {
        format!("joint{}", self.joint)
    }

    /// An effect of this joint.
    pub fn at_joint(&self, name: &str) -> String {
        format!("{name}:{}", self.joint)
    }

    /// Draws when an event happens: before a recording, or between two dwells of one, and between which two it ends.
    pub fn event(&mut self, config: &LabConfig, timing: Timing) -> Result<Event, LabError> {
        let recordings = config.recordings.len();
        let pick = self.draw.uniform([0.0, 1.0]);
        if timing == Timing::Before && recordings > 1 {
            // Before the second recording only the first one differs from the rest, before the last only the last.
            let last = recordings - 1;
            let before = self.target.filter(|_| self.joint == 0).unwrap_or(if pick < 0.5 { 1 } else { last });
            let (before, odd) = if before <= 1 { (1, 0) } else { (last, last) };
            self.recording = Some(odd);
            return Ok(Event { recording: before, at_s: 0.0, until_s: None, when: format!("@{odd}") });
        }
        let recording = (pick * recordings as f64) as usize % recordings;
        let rehearsal = observe(config)?;
        let of_it = rehearsal.observations.iter().filter(|o| o.dwell.recording == recording);
        let times_ns: Vec<i64> = of_it.map(|o| o.time_ns).collect();
        let before_dwell = |dwell: usize| -> Result<f64, LabError> {
            let around = dwell.checked_sub(1).and_then(|from| times_ns.get(from..=dwell));
            let Some([before, after]) = around.and_then(|t| t.first_chunk()) else {
                return Err(value_error(
                    "scenario.design",
                    "has too few dwells for an event between two".into(),
                ));
            };
            Ok((before + (after - before) / 2 - config.start_ns(recording)) as f64 * 1e-9)
        };
        let share = self.draw.uniform([0.25, 0.75]);
        let dwell = ((share * times_ns.len() as f64) as usize).max(1);
        let at_s = before_dwell(dwell)?;
        (self.recording, self.dwell) = (Some(recording), Some(dwell));
        if timing != Timing::Passing {
            return Ok(Event { recording, at_s, until_s: None, when: format!("@{recording}.{dwell}") });
        }
        // A fifth of the recording, 4 to 12 dwells.
        let end = dwell + (times_ns.len() / 5).clamp(4, 12);
        let when = format!("@{recording}.{dwell}-{}", end - 1);
        Ok(Event { recording, at_s, until_s: Some(before_dwell(end)?), when })
    }
}

/// When an event may happen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Timing {
    /// Before a recording, where there are several.
    Before,
    /// Between two dwells of one.
    Within,
    /// Between two dwells of one, and it is over again before the recording is.
    Passing,
}

/// When an event happens.
pub(super) struct Event {
    pub recording: usize,
    /// Time in the recording [s].
    pub at_s: f64,
    /// When it ends there [s].
    pub until_s: Option<f64>,
    /// The moment as the catalogue would write it.
    pub when: String,
}

/// Largest torques of gravity on joints 2 and 3 of the drawn arm, stretched out level [N m].
pub(super) fn stretched_nm(config: &LabConfig) -> [f64; 3] {
    let arm = crate::arm::AxisArm::from_rows(&config.arm.rows);
    let masses: Vec<f64> = config.arm.drives.iter().map(|drive| drive.link_kg).collect();
    let down = Vector3::new(0.0, 0.0, -9.81);
    let torque = arm.gravity_torque(
        &[0.0, -std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2],
        &down,
        &masses,
        config.arm.tip_kg,
    );
    [torque[0].abs(), torque[1].abs(), torque[2].abs()]
}

fn known_effect(mechanism: MechanismConfig, effect: String, enters: [String; 2]) -> Made {
    Made { mechanism, effect: Some(effect), same: Vec::new(), alike: Vec::new(), enters }
}

impl Made {
    fn same(mut self, same: &[String]) -> Made {
        self.same.extend_from_slice(same);
        self
    }

    fn alike(mut self, alike: &[String]) -> Made {
        self.alike.extend_from_slice(alike);
        self
    }

    fn alike_unless(self, wide: bool, alike: &[String]) -> Made {
        if wide { self } else { self.alike(alike) }
    }
}

fn driven_by_angle(draw: &Draw) -> [String; 2] {
    [draw.joint_channel(), format!("q{}", draw.joint)]
}

fn shape_relatives(joint: usize) -> Vec<String> {
    ["eccentricity", "second_harmonic", "gear_ratio"].map(|name| format!("{name}:{joint}")).to_vec()
}

type Build = fn(&mut Draw, &mut LabConfig) -> Result<Made, LabError>;

pub(super) const fn family(
    name: &'static str,
    joints: &'static [usize],
    range: [f64; 2],
    unit: &'static str,
    build: Build,
) -> Family {
    Family { name, joints, range, unit, build }
}

/// Every family.
pub(super) const FAMILIES: &[Family] = &[
    family("backlash", &[1, 2, 3], [0.2, 1.2], "deg", backlash),
    family("gravity_backlash", &[2, 3], [0.2, 1.2], "deg", gravity_backlash),
    family("belt_backlash", &[3], [0.2, 1.2], "deg", belt_backlash),
    family("crossed_backlash", &[2], [0.2, 1.0], "deg", crossed_backlash),
    family("friction_windup", &[2, 3], [0.1, 0.8], "deg", friction_windup),
    family("compliance", &[2, 3], [0.1, 0.8], "deg", compliance),
    family("hardening_compliance", &[2, 3], [0.1, 0.8], "deg", hardening_compliance),
    family("belt_compliance", &[3], [0.1, 0.8], "deg", belt_compliance),
    family("link_bending", &[2], [0.3, 3.0], "mm", link_bending),
    family("base_compliance", &[], [0.1, 0.6], "deg", base_compliance),
    family("axis_tilt", &[3], [0.1, 1.5], "deg", axis_tilt),
    family("eccentricity", &[1, 2, 3], [0.1, 1.0], "deg", eccentricity),
    family("second_harmonic", &[1, 2, 3], [0.1, 0.5], "deg", second_harmonic),
    family("periodic", &[1, 2, 3], [0.05, 0.4], "deg", periodic),
    family("gear_ratio", &[1, 2, 3], [0.2, 2.0], "%", gear_ratio),
    family("belt_coupling", &[3], [0.3, 3.0], "%", belt_coupling),
    family("zero_slip", &[1, 2, 3], [0.1, 1.0], "deg", |d, c| zero_slip(d, c, Timing::Before)),
    family("zero_slip@dwell", &[1, 2, 3], [0.1, 1.0], "deg", |d, c| zero_slip(d, c, Timing::Within)),
    family("zero_slip@dwells", &[1, 2, 3], [0.3, 2.0], "deg", |d, c| zero_slip(d, c, Timing::Passing)),
    family("tool_shift", &[], [0.3, 3.0], "mm", |d, c| body_shift(d, c, BumpedBody::Tool, Timing::Before)),
    family("tool_shift@dwell", &[], [1.0, 5.0], "mm", |d, c| {
        body_shift(d, c, BumpedBody::Tool, Timing::Within)
    }),
    family("tool_shift@dwells", &[], [1.0, 5.0], "mm", |d, c| {
        body_shift(d, c, BumpedBody::Tool, Timing::Passing)
    }),
    family("tip_marker_shift", &[], [0.3, 3.0], "mm", |d, c| {
        body_shift(d, c, BumpedBody::Marker, Timing::Before)
    }),
    family("tip_marker_shift@dwell", &[], [1.0, 5.0], "mm", |d, c| {
        body_shift(d, c, BumpedBody::Marker, Timing::Within)
    }),
    family("frame_shift", &[], [0.3, 3.0], "mm", |d, c| body_shift(d, c, BumpedBody::Base, Timing::Before)),
    family("frame_shift@dwell", &[], [1.0, 5.0], "mm", |d, c| {
        body_shift(d, c, BumpedBody::Base, Timing::Within)
    }),
    family("unsettled_reading", &[1, 2, 3], [0.01, 0.06], "of a move", unsettled_reading),
    family("zero_drift", &[1, 2, 3], [0.1, 0.8], "deg/session", zero_drift),
    family("frame_drift", &[], [0.2, 2.0], "mm/session", frame_drift),
    family("thermal_growth", &[], [0.03, 0.15], "%", thermal_growth),
    family("warm_up", &[], [0.03, 0.15], "%", warm_up),
    family("sensor_scale", &[], [0.1, 1.0], "%", sensor_scale),
    family("volume_distortion", &[], [0.5, 3.0], "mm at the edge", volume_distortion),
    family("board_scale", &[], [0.1, 0.5], "%", board_scale),
];

mod elastic;
mod lost_motion;
mod slow;
mod transmission;

use elastic::*;
use lost_motion::*;
use slow::*;
use transmission::*;
