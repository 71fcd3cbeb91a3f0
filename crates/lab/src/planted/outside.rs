//! Mechanisms that are in no catalogue: the right answer is where they enter and what they depend on.

use super::families::{Draw, Family, Made, family, stretched_nm};
use crate::LabError;
use crate::config::LabConfig;
use crate::mechanisms::*;

/// Every one.
pub(super) const FAMILIES: &[Family] = &[
    family("outside:axis_wobble", &[1], [0.05, 0.5], "deg", axis_wobble),
    family("outside:cable_drag", &[2], [0.2, 1.0], "deg", cable_drag),
    family("outside:worn_gap", &[1, 2], [0.3, 1.2], "deg", worn_gap),
    family("outside:damaged_teeth", &[1], [0.15, 0.8], "deg", damaged_teeth),
    family("outside:twist", &[1], [0.2, 1.0], "deg", link_twist),
    family("outside:room_temperature", &[], [0.05, 0.2], "%", room_temperature),
    family("outside:soft_stop", &[2], [2.0, 8.0], "%", soft_stop),
    family("outside:sawtooth", &[1, 2, 3], [0.1, 0.5], "deg", sawtooth_error),
];

fn unknown_effect(mechanism: MechanismConfig, channel: String, driver: &str) -> Made {
    let (same, alike) = (Vec::new(), Vec::new());
    Made { mechanism, effect: None, same, alike, enters: [channel, driver.to_owned()] }
}

fn axis_wobble(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let phase_deg = draw.phase_deg();
    let wobble = AxisWobble { joint: draw.joint, tilt_deg: draw.size, per_turn: 3.0, phase_deg };
    Ok(unknown_effect(MechanismConfig::AxisWobble(wobble), "tilt of the base".into(), "q1"))
}

/// Size: how far the joint is pulled 30 deg beyond where the cable gets taut.
fn cable_drag(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let gear_nm_rad = stretched_nm(config)[1] / 0.2f64.to_radians();
    // On the board joint 1 turns by 15 deg to either side only.
    let (slack_deg, anchor_deg) = (8.0, -8.0);
    let cable_nm_rad = gear_nm_rad * draw.size / 30.0;
    let cable = CableDrag { joint: draw.joint, by: 1, cable_nm_rad, slack_deg, anchor_deg, gear_nm_rad };
    Ok(unknown_effect(MechanismConfig::CableDrag(cable), draw.joint_channel(), "q1"))
}

fn worn_gap(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let worn_centre_deg = if draw.joint == 1 { 8.0 } else { -45.0 };
    let gap =
        Gap { joint: draw.joint, worn_deg: draw.size, worn_centre_deg, worn_span_deg: 8.0, ..Gap::default() };
    let driver = format!("s{0}*q{0}", draw.joint);
    let mut made = unknown_effect(MechanismConfig::Gap(gap), draw.joint_channel(), &driver);
    made.alike.push(draw.at_joint("backlash"));
    Ok(made)
}

fn damaged_teeth(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let (height_deg, centre_deg) = (draw.signed(), draw.draw.uniform([-8.0, 8.0]));
    let teeth = DamagedTeeth { joint: draw.joint, height_deg, centre_deg, span_deg: 7.0 };
    Ok(unknown_effect(MechanismConfig::DamagedTeeth(teeth), draw.joint_channel(), "q1"))
}

fn link_twist(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let twist = Twist { link: 2, by: draw.joint, deg_at_45: draw.signed() };
    Ok(unknown_effect(MechanismConfig::Twist(twist), "joint2.alpha".into(), "q1"))
}

fn room_temperature(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    config.temperature.published = false;
    let room = RoomTemperature {
        links: vec![1, 2, 3],
        per_kelvin_ppm: 70.0,
        swing_k: draw.size * 1e4 / 70.0,
        period_s: draw.draw.uniform([240.0, 480.0]),
        time_constant_s: 60.0,
        ..Default::default()
    };
    Ok(unknown_effect(MechanismConfig::RoomTemperature(room), "lengths".into(), "t"))
}

fn soft_stop(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let stop = SoftStop { joint: draw.joint, from_deg: -45.0, give_percent: draw.size };
    Ok(unknown_effect(MechanismConfig::SoftStop(stop), draw.joint_channel(), "q2"))
}

fn sawtooth_error(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let per_turn = draw.draw.uniform([8.0, 24.0]).round();
    let teeth = Sawtooth { joint: draw.joint, amplitude_deg: draw.size, per_turn };
    let driver = format!("q{}", draw.joint);
    let mut made = unknown_effect(MechanismConfig::Sawtooth(teeth), draw.joint_channel(), &driver);
    // Its first harmonic is a periodic error, and most of it.
    made.alike.push(format!("{},frequency={per_turn}", draw.at_joint("periodic")));
    Ok(made)
}
