//! Families of gears, belts and axes: what depends on where a joint is.

use super::*;

pub fn axis_tilt(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let tilt = AxisTilt { joint: draw.joint, tilt_deg: draw.signed() };
    let enters = ["axis".to_owned(), "q".to_owned()];
    let made = known_effect(MechanismConfig::AxisTilt(tilt), draw.at_joint("axis_tilt"), enters);
    Ok(made.alike_unless(draw.design.is_wide(), &shape_relatives(draw.joint - 1)))
}

pub fn eccentricity(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let radius_mm = 20.0;
    let wheel = Eccentricity {
        joint: draw.joint,
        offset_mm: radius_mm * draw.size.to_radians(),
        radius_mm,
        phase_deg: draw.phase_deg(),
        on: if draw.draw.chance(0.5) { MountedOn::Gear } else { MountedOn::Encoder },
    };
    let made = known_effect(
        MechanismConfig::Eccentricity(wheel),
        draw.at_joint("eccentricity"),
        driven_by_angle(draw),
    );
    Ok(made.alike_unless(draw.design.is_wide(), &shape_relatives(draw.joint)))
}

pub fn second_harmonic(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let ring = SecondHarmonic { joint: draw.joint, amplitude_deg: draw.size, phase_deg: draw.phase_deg() };
    let made = known_effect(
        MechanismConfig::SecondHarmonic(ring),
        draw.at_joint("second_harmonic"),
        driven_by_angle(draw),
    );
    Ok(made.alike_unless(draw.design.is_wide(), &shape_relatives(draw.joint)))
}

pub fn periodic(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let per_turn = draw.draw.uniform([10.0, 60.0]).round();
    let pinion =
        ToothRunout { joint: draw.joint, amplitude_deg: draw.size, per_turn, phase_deg: draw.phase_deg() };
    let effect = format!("{},frequency={per_turn}", draw.at_joint("periodic"));
    Ok(known_effect(MechanismConfig::ToothRunout(pinion), effect, driven_by_angle(draw)))
}

pub fn gear_ratio(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let gear = GearRatio { joint: draw.joint, error_percent: draw.signed() };
    let made =
        known_effect(MechanismConfig::GearRatio(gear), draw.at_joint("gear_ratio"), driven_by_angle(draw));
    Ok(made.alike_unless(draw.design.is_wide(), &shape_relatives(draw.joint)))
}

pub fn belt_coupling(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let by = draw.joint - 1;
    let belt = BeltCoupling { joint: draw.joint, by, share_percent: draw.signed() };
    let enters = [draw.joint_channel(), format!("q{by}")];
    let made = known_effect(MechanismConfig::BeltCoupling(belt), draw.at_joint("belt_coupling"), enters);
    Ok(made.alike_unless(draw.design.is_wide(), &shape_relatives(by)))
}
