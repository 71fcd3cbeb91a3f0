//! What a person would look at on the rig, by the effect that was named.

use armcal_model::{EffectKind, Family};

/// What to look at on the rig where an effect of this kind is named.
pub fn look_at(kind: &EffectKind) -> &'static str {
    if kind.look_at.is_empty() { of_family(kind.family) } else { kind.look_at }
}

fn of_family(family: Family) -> &'static str {
    match family {
        Family::LostMotion => "Look at that gear's preload and at the belt's tension.",
        Family::Elasticity => {
            "Something gives way under load: look at clamps, bearings and the declared load."
        }
        Family::Transmission => "Look at how gear and encoder are mounted, and at the counts a turn.",
        Family::Geometry => "Look for a bent or remounted part.",
        Family::Event => "Look for what was touched at that time.",
        Family::Drift => {
            "Something creeps or warms up: let the rig settle first, and look at clamps and temperature."
        }
        Family::Sensor => "Calibrate the position sensor again.",
        Family::Board => "Measure the board again, and compare it with its file.",
        Family::Timing => "Look at the clocks of robot and sensor.",
        Family::User => "It is a formula of the pipeline's own.",
    }
}
