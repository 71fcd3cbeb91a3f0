//! How the arm moves, and who moves it.

use crate::config::{LabConfig, Order, PassConfig, RecordingConfig};
use serde::{Deserialize, Serialize};

/// A design of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Design {
    /// The board flat, each cavity once: 33 dwells.
    OneTiltOnePass,
    /// The board flat, forward and backward: 66.
    OneTiltBothWays,
    /// Three tilts, each cavity once: 99.
    ThreeTiltsOnePass,
    /// Three tilts, forward and backward: 198.
    ThreeTiltsBothWays,
    /// The same, each cavity entered by the same final descent.
    Plunge,
    /// Three tilts both ways, and 33 tracked free poses in each recording: 297.
    FreePoses,
    /// Three tilts both ways, without and with 0.5 kg: 396.
    Load,
    /// Three tilts both ways with free poses, without and with 0.5 kg: 594.
    FreePosesAndLoad,
    /// Tracked free poses only, 66 in each of three recordings.
    TrackedOnly,
}

/// Who moves the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Driving {
    /// The motors drive it everywhere, and jog the tip into the cavities: the motor leads, the link follows.
    #[default]
    Motor,
    /// A hand leads it everywhere, back-driving the gears: the link leads, the motor follows, and where the link is in
    /// a gap that the motor has not crossed no encoder can tell.
    Hand,
    /// A hand seats the tip, the motors drive to the free poses under control: there the motor leads, and swings
    /// beyond its targets.
    Mixed,
}

impl Design {
    /// Every design.
    pub const ALL: [Design; 9] = [
        Design::OneTiltOnePass,
        Design::OneTiltBothWays,
        Design::ThreeTiltsOnePass,
        Design::ThreeTiltsBothWays,
        Design::Plunge,
        Design::FreePoses,
        Design::Load,
        Design::FreePosesAndLoad,
        Design::TrackedOnly,
    ];

    /// Whether joints move over a wide range.
    pub fn is_wide(self) -> bool {
        matches!(self, Design::FreePoses | Design::FreePosesAndLoad | Design::TrackedOnly)
    }

    /// Lets the rig move this way.
    pub(crate) fn apply(self, config: &mut LabConfig, driving: Driving) {
        let pass = |order| PassConfig { order, share: 1.0 };
        config.task.passes = match self {
            Design::TrackedOnly => Vec::new(),
            Design::OneTiltOnePass | Design::ThreeTiltsOnePass => vec![pass(Order::Forward)],
            _ => vec![pass(Order::Forward), pass(Order::Backward)],
        };
        config.task.free.poses = match self {
            Design::FreePoses | Design::FreePosesAndLoad => 33,
            Design::TrackedOnly => 66,
            _ => 0,
        };
        // Led exactly: the swing of the controllers beyond their targets is part of `Mixed` only.
        config.task.free.by_hand = driving != Driving::Mixed;
        config.hand.motors_lead = driving == Driving::Motor;
        // Pauses at home and above a cavity are no dwells of the design.
        config.task.home_s = 0.3;
        config.hand.hover_share = 0.0;
        config.hand.plunge = self == Design::Plunge;
        let tilts: &[(&str, f64, f64)] = match self {
            Design::OneTiltOnePass | Design::OneTiltBothWays => &[("normal", 0.0, 0.0)],
            _ => &[("normal", 0.0, 0.0), ("roll", 11.7, 0.0), ("pitch", 0.0, 11.8)],
        };
        let loads: &[(&str, f64)] = match self {
            Design::Load | Design::FreePosesAndLoad => &[("", 0.0), ("-loaded", 0.5)],
            _ => &[("", 0.0)],
        };
        let recording = |(name, roll_deg, pitch_deg): &(&str, f64, f64), (suffix, load_kg): &(&str, f64)| {
            RecordingConfig {
                name: format!("{name}{suffix}"),
                roll_deg: *roll_deg,
                pitch_deg: *pitch_deg,
                load_kg: *load_kg,
            }
        };
        config.recordings =
            loads.iter().flat_map(|load| tilts.iter().map(move |tilt| recording(tilt, load))).collect();
    }
}
