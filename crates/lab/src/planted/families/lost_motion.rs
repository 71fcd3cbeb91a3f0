//! Families of play and friction: what depends on where a joint came from.

use super::*;

pub fn backlash(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    // A third of the time it is not a gap but dry friction on a springy shaft: the same to the data.
    let mechanism = if draw.draw.chance(1.0 / 3.0) {
        let stiffness_nm_rad = 800.0;
        let friction_nm = stiffness_nm_rad * draw.size.to_radians() / 2.0;
        let wound = FrictionWindup {
            joint: draw.joint,
            stiffness_nm_rad,
            friction_nm,
            balanced: true,
            ..Default::default()
        };
        MechanismConfig::FrictionWindup(wound)
    } else {
        MechanismConfig::Gap(uniform_gap(draw.joint, draw.size))
    };
    Ok(known_effect(mechanism, draw.at_joint("backlash"), driven_by_arrival(draw, draw.joint)))
}

pub fn gravity_backlash(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let gap = Gap { friction_nm: Some(0.05), ..uniform_gap(draw.joint, draw.size) };
    let enters = [draw.joint_channel(), format!("torque{}", draw.joint)];
    Ok(known_effect(MechanismConfig::Gap(gap), draw.at_joint("gravity_backlash"), enters))
}

pub fn belt_backlash(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let gap = Gap { belt_over: Some(draw.joint - 1), ..uniform_gap(draw.joint, draw.size) };
    let enters = [draw.joint_channel(), "dir23".to_owned()];
    let made = known_effect(MechanismConfig::Gap(gap), draw.at_joint("belt_backlash"), enters);
    Ok(made.alike_unless(draw.design.is_wide(), &[draw.at_joint("backlash")]))
}

pub fn crossed_backlash(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let stiffness_nm_rad = 800.0;
    let friction_nm = stiffness_nm_rad * draw.size.to_radians() / 2.0;
    let by = draw.joint + 1;
    let rub = CrossedFriction { joint: draw.joint, by, friction_nm, stiffness_nm_rad, ..Default::default() };
    let effect = format!("crossed_backlash:{},from={by}", draw.joint);
    let made = known_effect(MechanismConfig::CrossedFriction(rub), effect, driven_by_arrival(draw, by));
    // On one path the two joints may always turn against each other.
    let few = matches!(draw.design, Design::OneTiltOnePass | Design::OneTiltBothWays | Design::Plunge);
    Ok(made.alike_unless(!few, &[format!("backlash:{by}"), draw.at_joint("backlash")]))
}

pub fn friction_windup(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let stiffness_nm_rad = 2000.0;
    let load_share = draw.size.to_radians() * stiffness_nm_rad / stretched_nm(config)[draw.joint - 1];
    let wound = FrictionWindup {
        joint: draw.joint,
        stiffness_nm_rad,
        load_share,
        balanced: true,
        ..Default::default()
    };
    let made = known_effect(
        MechanismConfig::FrictionWindup(wound),
        draw.at_joint("friction_windup"),
        driven_by_arrival(draw, draw.joint),
    );
    Ok(made.alike_unless(draw.design.is_wide(), &[draw.at_joint("backlash")]))
}

fn driven_by_arrival(draw: &Draw, joint: usize) -> [String; 2] {
    [draw.joint_channel(), format!("dir{joint}")]
}

fn uniform_gap(joint: usize, width_deg: f64) -> Gap {
    Gap { joint, width_deg, worn_span_deg: 10.0, ..Gap::default() }
}
