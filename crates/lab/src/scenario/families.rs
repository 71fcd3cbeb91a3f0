//! The families of the catalogue: what each hides, and what a right answer would be.

use super::{Design, Hidden, Size};
use crate::config::{LabConfig, value};
use crate::mechanisms::*;
use crate::random::Stream;
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
    pub build: fn(&mut Draw, &mut LabConfig) -> Result<Made, LabError>,
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
            mechanism: made.mechanism.hidden().mechanism().name().to_owned(),
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
                return Err(value("scenario.design", "has too few dwells for an event between two".into()));
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

fn made(mechanism: MechanismConfig, effect: String, enters: [String; 2]) -> Made {
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

fn angle(draw: &Draw) -> [String; 2] {
    [draw.joint_channel(), format!("q{}", draw.joint)]
}

fn shape_relatives(joint: usize) -> Vec<String> {
    ["eccentricity", "second_harmonic", "gear_ratio"].map(|name| format!("{name}:{joint}")).to_vec()
}

/// Every family.
pub(super) const FAMILIES: &[Family] = &[
    Family { name: "backlash", joints: &[1, 2, 3], range: [0.2, 1.2], unit: "deg", build: backlash },
    Family {
        name: "gravity_backlash",
        joints: &[2, 3],
        range: [0.2, 1.2],
        unit: "deg",
        build: gravity_backlash,
    },
    Family { name: "belt_backlash", joints: &[3], range: [0.2, 1.2], unit: "deg", build: belt_backlash },
    Family {
        name: "crossed_backlash",
        joints: &[2],
        range: [0.2, 1.0],
        unit: "deg",
        build: crossed_backlash,
    },
    Family {
        name: "friction_windup",
        joints: &[2, 3],
        range: [0.1, 0.8],
        unit: "deg",
        build: friction_windup,
    },
    Family { name: "compliance", joints: &[2, 3], range: [0.1, 0.8], unit: "deg", build: compliance },
    Family {
        name: "hardening_compliance",
        joints: &[2, 3],
        range: [0.1, 0.8],
        unit: "deg",
        build: hardening_compliance,
    },
    Family { name: "belt_compliance", joints: &[3], range: [0.1, 0.8], unit: "deg", build: belt_compliance },
    Family { name: "link_bending", joints: &[2], range: [0.3, 3.0], unit: "mm", build: link_bending },
    Family { name: "base_compliance", joints: &[], range: [0.1, 0.6], unit: "deg", build: base_compliance },
    Family { name: "axis_tilt", joints: &[3], range: [0.1, 1.5], unit: "deg", build: axis_tilt },
    Family { name: "eccentricity", joints: &[1, 2, 3], range: [0.1, 1.0], unit: "deg", build: eccentricity },
    Family {
        name: "second_harmonic",
        joints: &[1, 2, 3],
        range: [0.1, 0.5],
        unit: "deg",
        build: second_harmonic,
    },
    Family { name: "periodic", joints: &[1, 2, 3], range: [0.05, 0.4], unit: "deg", build: periodic },
    Family { name: "gear_ratio", joints: &[1, 2, 3], range: [0.2, 2.0], unit: "%", build: gear_ratio },
    Family { name: "belt_coupling", joints: &[3], range: [0.3, 3.0], unit: "%", build: belt_coupling },
    Family { name: "zero_slip", joints: &[1, 2, 3], range: [0.1, 1.0], unit: "deg", build: zero_slip },
    Family {
        name: "zero_slip@dwell",
        joints: &[1, 2, 3],
        range: [0.1, 1.0],
        unit: "deg",
        build: zero_slip_within,
    },
    Family {
        name: "zero_slip@dwells",
        joints: &[1, 2, 3],
        range: [0.3, 2.0],
        unit: "deg",
        build: zero_slip_passing,
    },
    Family { name: "tool_shift", joints: &[], range: [0.3, 3.0], unit: "mm", build: tool_shift },
    Family { name: "tool_shift@dwell", joints: &[], range: [1.0, 5.0], unit: "mm", build: tool_shift_within },
    Family {
        name: "tool_shift@dwells",
        joints: &[],
        range: [1.0, 5.0],
        unit: "mm",
        build: tool_shift_passing,
    },
    Family { name: "frame_shift", joints: &[], range: [0.3, 3.0], unit: "mm", build: frame_shift },
    Family {
        name: "frame_shift@dwell",
        joints: &[],
        range: [1.0, 5.0],
        unit: "mm",
        build: frame_shift_within,
    },
    Family {
        name: "unsettled_reading",
        joints: &[1, 2, 3],
        range: [0.01, 0.06],
        unit: "of a move",
        build: unsettled_reading,
    },
    Family {
        name: "zero_drift",
        joints: &[1, 2, 3],
        range: [0.1, 0.8],
        unit: "deg/session",
        build: zero_drift,
    },
    Family { name: "frame_drift", joints: &[], range: [0.2, 2.0], unit: "mm/session", build: frame_drift },
    Family { name: "thermal_growth", joints: &[], range: [0.03, 0.15], unit: "%", build: thermal_growth },
    Family { name: "warm_up", joints: &[], range: [0.03, 0.15], unit: "%", build: warm_up },
    Family { name: "sensor_scale", joints: &[], range: [0.1, 1.0], unit: "%", build: sensor_scale },
    Family {
        name: "volume_distortion",
        joints: &[],
        range: [0.5, 3.0],
        unit: "mm at the edge",
        build: volume_distortion,
    },
    Family { name: "board_scale", joints: &[], range: [0.1, 0.5], unit: "%", build: board_scale },
];

mod elastic;
mod lost_motion;
mod slow;
mod transmission;

use elastic::*;
use lost_motion::*;
use slow::*;
use transmission::*;
