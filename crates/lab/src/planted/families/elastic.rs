//! Families of what gives way under the arm's weight.

use super::*;

pub fn compliance(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let spring = Compliance {
        joint: draw.joint,
        stiffness_nm_rad: joint_stiffness_nm_rad(draw, config),
        hardening_nm_rad3: 0.0,
    };
    let enters = [draw.joint_channel(), format!("torque{}", draw.joint)];
    let made = known_effect(MechanismConfig::Compliance(spring), draw.at_joint("compliance"), enters);
    let same: &[String] = if draw.joint == 3 { &["link_bending:3".to_owned()] } else { &[] };
    Ok(made.same(same).alike(&gravity_relatives(draw.joint)))
}

pub fn hardening_compliance(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let linear = joint_stiffness_nm_rad(draw, config);
    // A third softer than the linear spring of this size at first, a third of the torque from the cubic at the end.
    let stiffness_nm_rad = linear * 2.0 / 3.0;
    let hardening_nm_rad3 = linear / 3.0 / draw.size.to_radians().powi(2);
    let spring = Compliance { joint: draw.joint, stiffness_nm_rad, hardening_nm_rad3 };
    let enters = [draw.joint_channel(), format!("torque{}", draw.joint)];
    let made =
        known_effect(MechanismConfig::Compliance(spring), draw.at_joint("hardening_compliance"), enters);
    Ok(made.alike(&gravity_relatives(draw.joint)))
}

pub fn belt_compliance(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let [_, upper_nm, fore_nm] = stretched_nm(config);
    let stiffness_nm_rad = (upper_nm - fore_nm) / draw.size.to_radians();
    let joint = draw.joint - 1;
    let springs = BeltCompliance { joint, stiffness_nm_rad, belt_stiffness_nm_rad: None };
    let enters = [format!("joint{joint} with the forearm's direction kept"), format!("torque{joint}")];
    let made =
        known_effect(MechanismConfig::BeltCompliance(springs), draw.at_joint("belt_compliance"), enters);
    Ok(made.alike(&gravity_relatives(joint)))
}

pub fn link_bending(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let arm = crate::arm::AxisArm::from_rows(&config.arm.rows);
    let link = draw.joint - 1;
    let length_m = arm.link_m(link).norm();
    let kg = |j: usize| config.arm.drives.get(j).map_or(0.0, |drive| drive.link_kg);
    let beyond_kg: f64 = (link + 1..arm.joint_count()).map(kg).sum::<f64>() + config.arm.tip_kg;
    let force_n = 9.81 * (beyond_kg + 3.0 / 8.0 * kg(link));
    let moment_nm = stretched_nm(config).get(link + 1).copied().unwrap_or(0.0);
    let work = force_n * length_m.powi(3) / 3.0 + moment_nm * length_m * length_m / 2.0;
    let beam = LinkBending { link: draw.joint, stiffness_nm2: work / (draw.size * 1e-3) };
    let enters = [draw.joint_channel(), format!("torque{}", draw.joint)];
    let made = known_effect(MechanismConfig::LinkBending(beam), draw.at_joint("link_bending"), enters);
    Ok(made.alike(&gravity_relatives(draw.joint)))
}

pub fn base_compliance(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let plate = BaseCompliance { stiffness_nm_rad: stretched_nm(config)[1] / draw.size.to_radians() };
    let enters = ["base".to_owned(), "torque2".to_owned()];
    let made = known_effect(MechanismConfig::BaseCompliance(plate), "base_compliance".into(), enters);
    Ok(made.alike(&gravity_relatives(2)))
}

fn joint_stiffness_nm_rad(draw: &Draw, config: &LabConfig) -> f64 {
    stretched_nm(config)[draw.joint - 1] / draw.size.to_radians()
}

fn gravity_relatives(joint: usize) -> Vec<String> {
    let of = |name: &str| format!("{name}:{joint}");
    let mut all = vec![of("compliance"), of("link_bending"), of("hardening_compliance")];
    if joint == 2 {
        all.extend(["base_compliance".to_owned(), "belt_compliance:3".to_owned()]);
    }
    all
}
