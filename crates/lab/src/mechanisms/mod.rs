//! What can be hidden in the rig: `[[mechanisms]]` of a lab file, each simulated by its own physics.
//!
//! `joint` and `link` count from 1; links are named by the joint that carries them. Mechanisms combine
//! freely; at a joint they act from motor to link in the order of the file. Nothing here is a signature of
//! something to be found again: a gap is two flanks, a spring balances a torque, a link is heated.
//!
//! | kind | what happens | keys |
//! |---|---|---|
//! | `gap` | a gear with play: two flanks, friction, gravity | `joint`, `width_deg`, `friction_nm`, `belt_over`, `worn_deg`, `worn_centre_deg`, `worn_span_deg` |
//! | `friction_windup` | Coulomb friction winds a shaft up | `joint`, `stiffness_nm_rad`, `friction_nm`, `load_share`, `balanced` |
//! | `compliance` | a torsion spring under gravity | `joint`, `stiffness_nm_rad`, `hardening_nm_rad3` |
//! | `belt_compliance` | the same where motor 3 stands on the base | `joint`, `stiffness_nm_rad`, `belt_stiffness_nm_rad` |
//! | `link_bending` | a beam sags | `link`, `stiffness_nm2` |
//! | `base_compliance` | the base plate rocks | `stiffness_nm_rad` |
//! | `eccentricity` | a gear or encoder disc is mounted off its centre | `joint`, `offset_mm`, `radius_mm`, `phase_deg`, `on` |
//! | `second_harmonic` | an elliptic ring | `joint`, `amplitude_deg`, `phase_deg` |
//! | `tooth_runout` | a pinion or tooth that comes round many times a turn | `joint`, `amplitude_deg`, `per_turn`, `phase_deg` |
//! | `gear_ratio` | the gear has another ratio than the drawing | `joint`, `error_percent` |
//! | `belt_coupling` | a joint drags another one along | `joint`, `by`, `share_percent` |
//! | `axis_tilt` | an axis is not parallel to the one before | `joint`, `tilt_deg` |
//! | `zero_slip` | a pulley slips on its shaft | `joint`, `slip_deg`, `recording`, `at_s`, `until_s` |
//! | `bump` | tool, marker, base, board or cameras are knocked | `body`, `marker`, `shift_mm`, `turn_deg`, `recording`, `at_s`, `until_s` |
//! | `marker_sag` | the markers of the tip hang on a stalk that bends | `sag_mm`, `stalk` |
//! | `thermal_growth` | links follow the thermometer | `links`, `per_kelvin_ppm` |
//! | `warm_up` | links are heated by motors the thermometer does not see | `links`, `per_kelvin_ppm`, `rise_k`, `time_constant_s` |
//! | `lag` | a joint that approaches its drive exponentially | `joint`, `time_constant_s` |
//! | `zero_drift` | the zero of a potentiometer drifts | `joint`, `deg_per_hour` |
//! | `frame_drift` | base, board or cameras creep | `body`, `mm_per_hour` |
//! | `camera_scale` | the camera system is scaled wrongly | `percent`, `centre_m` |
//! | `camera_distortion` | its volume is distorted | `mm_at_1m`, `centre_m` |
//! | `crossed_friction` | a joint's motion drags another joint against its spring | `joint`, `by`, `friction_nm`, `stiffness_nm_rad` |
//! | `board_scale` | the board is printed to a wrong scale | `percent` |
//!
//! Outside the catalogue of the product, on purpose:
//!
//! | kind | what happens | keys |
//! |---|---|---|
//! | `gap` with `worn_deg` | play in one region of the gear | above |
//! | `axis_wobble` | a joint's axis wobbles as it turns | `joint`, `tilt_deg`, `per_turn`, `phase_deg` |
//! | `cable_drag` | a cable pulls at a joint once another has turned far enough | `joint`, `by`, `cable_nm_rad`, `slack_deg`, `anchor_deg`, `gear_nm_rad` |
//! | `damaged_teeth` | the gear has one bad region | `joint`, `height_deg`, `centre_deg`, `span_deg` |
//! | `sawtooth` | each tooth is cut askew | `joint`, `amplitude_deg`, `per_turn` |
//! | `soft_stop` | a rubber buffer beyond some angle | `joint`, `from_deg`, `give_percent` |
//! | `twist` | a clamped link twists about its length as a joint turns | `link`, `by`, `deg_at_45` |
//! | `room_temperature` | an air conditioner cycles | `links`, `per_kelvin_ppm`, `swing_k`, `period_s`, `time_constant_s` |
//! | `waves` | all the rest: the tip is off by a smooth function of the pose | `waves` of `per_rad`, `phase_rad`, `shift_mm` |

mod axis_tilt;
mod base_compliance;
mod belt_compliance;
mod belt_coupling;
mod board_scale;
mod bump;
mod cable_drag;
mod camera;
mod compliance;
mod crossed_friction;
mod drift;
mod eccentricity;
mod friction_windup;
mod gap;
mod gear;
mod heat;
mod lag;
mod link_bending;
mod marker_sag;
mod shapes;
mod twist;
mod waves;
mod wobble;
mod zero_slip;

pub use axis_tilt::AxisTilt;
pub use base_compliance::BaseCompliance;
pub use belt_compliance::BeltCompliance;
pub use belt_coupling::BeltCoupling;
pub use board_scale::BoardScale;
pub use bump::{Bump, BumpedBody};
pub use cable_drag::CableDrag;
pub use camera::{CameraDistortion, CameraScale};
pub use compliance::Compliance;
pub use crossed_friction::CrossedFriction;
pub use drift::{DriftingBody, FrameDrift, ZeroDrift};
pub use eccentricity::{Eccentricity, MountedOn};
pub use friction_windup::FrictionWindup;
pub use gap::Gap;
pub use heat::{RoomTemperature, ThermalGrowth, WarmUp};
pub use lag::Lag;
pub use link_bending::LinkBending;
pub use marker_sag::MarkerSag;
pub use shapes::{DamagedTeeth, GearRatio, Sawtooth, SecondHarmonic, SoftStop, ToothRunout};
pub use twist::Twist;
pub use waves::{Wave, Waves};
pub use wobble::AxisWobble;
pub use zero_slip::ZeroSlip;

use crate::arm::AxisArm;
use crate::board::Board;
use crate::checks::{check_not_negative, check_positive, value_error};
use crate::mechanism::{Body, Named};
use crate::{LabError, Mechanism, RigState};
use armcal_core::Pose;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Settings of a mechanism, which are the mechanism itself as long as nothing has happened to it.
pub trait Hidden: Mechanism {
    /// Checks the values.
    fn check(&self, keys: &Keys) -> Result<(), LabError>;

    /// What it does to the board while that is made.
    fn machine_board(&self, _board: &mut Board) {}
}

macro_rules! mechanisms {
    ($($kind:ident: $name:ident),* $(,)?) => {
        /// One `[[mechanisms]]` table.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        pub enum MechanismConfig {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name)),*
        }

        impl MechanismConfig {
            /// What all kinds have in common.
            pub fn hidden(&self) -> &dyn Hidden {
                match self { $(MechanismConfig::$name(settings) => settings),* }
            }

            /// The mechanism at the start of a recording.
            pub fn mechanism(&self) -> Box<dyn Mechanism> {
                match self { $(MechanismConfig::$name(settings) => Box::new(settings.clone())),* }
            }
        }

        $(impl Named for $name {
            fn name(&self) -> &str {
                stringify!($kind)
            }
        })*
    };
}

mechanisms!(
    gap: Gap,
    friction_windup: FrictionWindup,
    compliance: Compliance,
    belt_compliance: BeltCompliance,
    link_bending: LinkBending,
    base_compliance: BaseCompliance,
    eccentricity: Eccentricity,
    second_harmonic: SecondHarmonic,
    tooth_runout: ToothRunout,
    gear_ratio: GearRatio,
    belt_coupling: BeltCoupling,
    axis_tilt: AxisTilt,
    zero_slip: ZeroSlip,
    bump: Bump,
    marker_sag: MarkerSag,
    thermal_growth: ThermalGrowth,
    warm_up: WarmUp,
    zero_drift: ZeroDrift,
    frame_drift: FrameDrift,
    camera_scale: CameraScale,
    camera_distortion: CameraDistortion,
    board_scale: BoardScale,
    axis_wobble: AxisWobble,
    cable_drag: CableDrag,
    damaged_teeth: DamagedTeeth,
    sawtooth: Sawtooth,
    soft_stop: SoftStop,
    twist: Twist,
    room_temperature: RoomTemperature,
    crossed_friction: CrossedFriction,
    lag: Lag,
    waves: Waves,
);

/// Checks the values of one `[[mechanisms]]` table and names the key at fault.
#[derive(Debug)]
pub struct Keys {
    /// Index of the table.
    pub table: usize,
    /// Number of joints of the arm.
    pub joints: usize,
    /// Number of recordings of the session.
    pub recordings: usize,
    /// Number of markers on links of the arm.
    pub markers: usize,
}

impl Keys {
    fn wrong(&self, key: &str, why: String) -> LabError {
        value_error(&self.path(key), why)
    }

    fn path(&self, key: &str) -> String {
        format!("mechanisms[{}].{key}", self.table)
    }

    fn joint(&self, key: &str, number: usize) -> Result<(), LabError> {
        if (1..=self.joints).contains(&number) {
            return Ok(());
        }
        Err(self.wrong(key, format!("must be a joint from 1 to {}, is {number}", self.joints)))
    }

    fn marker(&self, number: usize, is_one: bool) -> Result<(), LabError> {
        if !is_one {
            return Err(self.wrong("marker", "needs body = \"marker\"".to_owned()));
        }
        if (1..=self.markers).contains(&number) {
            return Ok(());
        }
        Err(self.wrong("marker", format!("must be one of {} [[vicon.markers]], is {number}", self.markers)))
    }

    fn finite(&self, key: &str, v: f64) -> Result<(), LabError> {
        if v.is_finite() { Ok(()) } else { Err(self.wrong(key, format!("must be a number, is {v}"))) }
    }

    fn within(&self, key: &str, v: f64, [low, high]: [f64; 2]) -> Result<(), LabError> {
        if (low..=high).contains(&v) {
            return Ok(());
        }
        Err(self.wrong(key, format!("must lie between {low} and {high}, is {v}")))
    }

    fn stiff(&self, key: &str, v: f64) -> Result<(), LabError> {
        check_positive(&self.path(key), v)
    }

    fn not_negative(&self, key: &str, v: f64) -> Result<(), LabError> {
        check_not_negative(&self.path(key), v)
    }

    fn event(&self, recording: usize, at_s: f64, until_s: Option<f64>) -> Result<(), LabError> {
        if recording >= self.recordings {
            let why = format!("is {recording}, but recordings count from 0 to {}", self.recordings - 1);
            return Err(self.wrong("recording", why));
        }
        self.not_negative("at_s", at_s)?;
        match until_s {
            Some(until_s) if until_s.is_nan() || until_s <= at_s => {
                Err(self.wrong("until_s", format!("is {until_s}, not after at_s = {at_s}")))
            }
            _ => Ok(()),
        }
    }
}

/// Where the motor of a play of `half_rad` to either side is, for a link that came to `link_rad`; `before` are
/// motor and link of the moment before.
fn motor_of_play(now: &RigState<'_>, before: Option<[f64; 2]>, link_rad: f64, half_rad: f64) -> f64 {
    let Some([motor, link]) = before else { return link_rad };
    let moved = link_rad - link;
    if now.motors_lead && moved.abs() > STILL_RAD {
        // Only by pushing a flank does the motor move the link.
        return link_rad + half_rad * moved.signum();
    }
    motor.clamp(link_rad - half_rad, link_rad + half_rad)
}

/// A link that moved less between two moments stood still [rad].
const STILL_RAD: f64 = 1e-9;

/// Whether something that happens `at_s` into a recording, and is put back `until_s` into it, holds now.
fn event_holds(now: &RigState<'_>, recording: usize, at_s: f64, until_s: Option<f64>) -> bool {
    let reached = |time_s| now.recording > recording || (now.recording == recording && now.time_s >= time_s);
    reached(at_s) && !until_s.is_some_and(reached)
}

#[cfg(test)]
mod tests;
