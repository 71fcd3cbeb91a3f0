//! What a person would look at on the rig, by the effect that was named.

use armcal_model::{EffectKind, Family};

/// What to look at on the rig where an effect of this kind is named.
pub fn look_at(kind: &EffectKind) -> &'static str {
    match (kind.name, kind.family) {
        ("zero_slip", _) => {
            "An encoder or a belt slipped: look at that joint's encoder coupling, set-screws and belt teeth, and home it again."
        }
        ("frame_shift", _) => {
            "The robot's foot, the table or the cameras moved, or a tilt is not what was declared: look at their clamps and marker plates."
        }
        ("board_shift", _) => {
            "The board slipped on its stand or under its markers: look at its clamps, and measure it again before and after."
        }
        ("tool_shift", _) => {
            "The tool or its markers were remounted, bent or knocked: look at the last link."
        }
        ("marker_shift", _) => {
            "That marker came loose, was knocked or put on again: look at its mount, and at the recording around that time."
        }
        ("unsettled_reading", _) => {
            "Read the joints later, when arm and readings have settled: look at waiting times, filters and whether set-points are recorded."
        }
        ("undeclared_load", _) => {
            "Weigh what the tool carried in that recording, and declare it as `load_kg`."
        }
        (_, Family::LostMotion) => "Look at that gear's preload and at the belt's tension.",
        (_, Family::Elasticity) => {
            "Something gives way under load: look at clamps, bearings and the declared load."
        }
        (_, Family::Transmission) => "Look at how gear and encoder are mounted, and at the counts a turn.",
        (_, Family::Geometry) => "Look for a bent or remounted part.",
        (_, Family::Event) => "Look for what was touched at that time.",
        (_, Family::Drift) => {
            "Something creeps or warms up: let the rig settle first, and look at clamps and temperature."
        }
        (_, Family::Sensor) => "Calibrate the position sensor again.",
        (_, Family::Board) => "Measure the board again, and compare it with its file.",
        (_, Family::Timing) => "Look at the clocks of robot and sensor.",
        (_, Family::User) => "It is a formula of the pipeline's own.",
    }
}
