//! Forward kinematics of known robots against numpy.
//!
//! The expected rows (3x4, row-major) were computed in Python from elementary 4x4 matrices (rotations about
//! x, y, z by their definition, translations, Rodrigues about oblique axes) multiplied with numpy 64-bit
//! floats, from the same DH tables and URDF files; no code is shared.

use super::*;

const UR10_JOINTS: [f64; 6] = [0.3, -1.1, 1.4, -0.7, 0.9, 2.2];
const SEVEN_JOINTS: [f64; 7] = [0.4, -0.6, 0.3, -1.9, 0.5, 1.7, -0.8];

/// The Panda of MUKCa with its ball, meshes left out; the gripper is a side branch with a mimic joint.
pub(crate) const PANDA: &str = include_str!("panda.urdf");

/// Every kind of joint: continuous about an oblique axis, prismatic along one, fixed, no origin at all.
pub(crate) const MIXED: &str = r#"<robot name="mixed">
  <link name="base"/><link name="carriage"/><link name="slide"/><link name="bracket"/><link name="hand"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="carriage"/>
    <origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0.6 0.8"/></joint>
  <joint name="slide" type="prismatic"><parent link="carriage"/><child link="slide"/>
    <origin xyz="0 0 0.5"/><axis xyz="0.6 0 0.8"/></joint>
  <joint name="mount" type="fixed"><parent link="slide"/><child link="bracket"/>
    <origin rpy="1.5707963267948966 0 -0.7"/><axis xyz="0 0 0"/></joint>
  <joint name="wrist" type="revolute"><parent link="bracket"/><child link="hand"/></joint>
</robot>"#;

#[test]
fn ur10_by_standard_dh() {
    let model = bare(dh(UR10));
    #[rustfmt::skip]
    let expected = [
        -0.1573420512042677, -0.8483179043717829, -0.5055691960999009, -0.8287309430339745,
        0.4338691243573451, 0.4005100939718875, -0.8070621088590519, -0.4879539135506759,
        0.8871308031244458, -0.3463356720710362, 0.3050418666328928, 0.4251507931827327,
    ];
    assert_pose(&nominal_tip(&model, &UR10_JOINTS), expected, "UR10");
}

#[test]
fn ur10_with_hayati_tilts() {
    let model = bare(dh(UR10));
    let mut p = model.nominal();
    p[model.index("shoulder_lift_joint.beta").expect("row 2 has a beta")] = 0.01;
    p[model.index("elbow_joint.beta").expect("row 3 has a beta")] = -0.02;
    #[rustfmt::skip]
    let expected = [
        -0.1471109890090729, -0.8438852725471488, -0.5159612424308597, -0.8323472197886643,
        0.4235031753187301, 0.4176654812639073, -0.803866037505965, -0.4871221562184742,
        0.8938699107855266, -0.3367687523191734, 0.2959449105047457, 0.4218990748327094,
    ];
    assert_pose(&model.tip_in_base(&p, &UR10_JOINTS).to_homogeneous(), expected, "UR10 with beta");
}

#[test]
fn panda_by_urdf() {
    #[rustfmt::skip]
    let expected = [
        -0.6756428034168215, 0.7340071195888695, 0.06885020394965476, 0.2303498634352841,
        0.6705777604043155, 0.5730694354704976, 0.4710805550865556, 0.3772665647494212,
        0.3063205338239513, 0.3644516024417727, -0.8793990903085093, 0.630847758701267,
    ];
    let model = bare(urdf(PANDA, "panda_link0", "ball_link"));
    assert_eq!(model.joint_count(), 7);
    assert_pose(&nominal_tip(&model, &SEVEN_JOINTS), expected, "Panda");
}

/// The table of Franka's documentation (Craig's convention) and the URDF are one robot.
#[test]
fn panda_by_modified_dh() {
    let rows = [
        (0.0, 0.0, 333.0),
        (0.0, -90.0, 0.0),
        (0.0, 90.0, 316.0),
        (82.5, 90.0, 0.0),
        (-82.5, -90.0, 384.0),
        (0.0, 90.0, 0.0),
        (88.0, 90.0, 0.0),
    ];
    let mut text = String::from("name = \"panda\"\nconvention = \"modified\"\n");
    for (i, (a, alpha, d)) in rows.iter().enumerate() {
        text += &format!(
            "[[rows]]\nname = \"j{i}\"\ntheta_deg = 0\nd_mm = {d:?}\na_mm = {a:?}\nalpha_deg = {alpha:?}\n"
        );
    }
    text += "[[rows]]\nname = \"flange\"\njoint = \"fixed\"\ntheta_deg = 0\nd_mm = 107\na_mm = 0\nalpha_deg = 0\n";
    #[rustfmt::skip]
    let expected = [
        0.0412698037445707, 0.9967730196564188, 0.06885020394965477, 0.2212398667775609,
        0.8793913656067148, -0.06894879778284405, 0.4710805550865556, 0.3143360004078092,
        0.4743075261844804, 0.04110487281728208, -0.8793990903085093, 0.7482639679475487,
    ];
    assert_pose(&nominal_tip(&bare(dh(&text)), &SEVEN_JOINTS), expected, "Panda, Craig");
    let by_urdf = bare(urdf(PANDA, "panda_link0", "panda_link8"));
    assert_pose(&nominal_tip(&by_urdf, &SEVEN_JOINTS), expected, "Panda to link 8");
}

/// The same arm in both conventions: modified row i+1 takes a and alpha of standard row i.
#[test]
fn ur10_by_modified_dh() {
    let standard = [
        (127.3, 0.0, 90.0),
        (0.0, -612.0, 0.0),
        (0.0, -572.3, 0.0),
        (163.941, 0.0, 90.0),
        (115.7, 0.0, -90.0),
        (92.2, 0.0, 0.0),
    ];
    let mut text = String::from("name = \"ur10\"\nconvention = \"modified\"\n");
    let (mut a, mut alpha) = (0.0, 0.0);
    for (i, (d, next_a, next_alpha)) in standard.iter().enumerate() {
        text += &format!(
            "[[rows]]\nname = \"j{i}\"\ntheta_deg = 0\nd_mm = {d:?}\na_mm = {a:?}\nalpha_deg = {alpha:?}\n"
        );
        (a, alpha) = (*next_a, *next_alpha);
    }
    let modified = nominal_tip(&bare(dh(&text)), &UR10_JOINTS);
    let standard = nominal_tip(&bare(dh(UR10)), &UR10_JOINTS);
    assert!((modified - standard).abs().max() < 1e-14);
}

#[test]
fn a_urdf_with_every_kind_of_joint() {
    #[rustfmt::skip]
    let expected = [
        0.8202604789839912, -0.06358689361404492, 0.5684447673938686, 0.5449951563440928,
        0.1327906126909576, 0.9878191554272135, -0.08111701025202181, 0.03956404928956891,
        -0.5563626513328455, 0.1420212066262734, 0.8187127561424116, 0.8070388319628798,
    ];
    let model = bare(urdf(MIXED, "base", "hand"));
    assert_eq!(model.chain().joint_names(), ["turn", "slide", "wrist"]);
    assert_pose(&nominal_tip(&model, &[0.7, 0.25, -1.3]), expected, "mixed");
    // The link of the fixed joint keeps its frame; the fixed joint has no parameters.
    let frames = model.link_frames(&model.nominal(), &[0.0; 3]);
    assert!(frames.iter().any(|frame| frame.name == "bracket"));
    assert!(model.index("mount.x").is_none() && model.index("slide.rz").is_some());
}

#[test]
fn a_joint_without_an_encoder_follows_its_leader_on_another_branch() {
    let xml = r#"<robot name="grip"><link name="base"/><link name="thumb"/><link name="wrist"/><link name="finger"/>
      <joint name="wrist" type="revolute"><parent link="base"/><child link="wrist"/><axis xyz="0 0 1"/></joint>
      <joint name="thumb" type="prismatic"><parent link="wrist"/><child link="thumb"/><axis xyz="0 1 0"/></joint>
      <joint name="finger" type="prismatic"><parent link="wrist"/><child link="finger"/><axis xyz="0 1 0"/>
        <mimic joint="thumb" multiplier="-2" offset="0.1"/></joint></robot>"#;
    let model = bare(urdf(xml, "base", "finger"));
    // The leader is read although the tip does not hang on it.
    assert_eq!(model.chain().joint_names(), ["wrist", "thumb"]);
    let at = model.tip_in_base(&model.nominal(), &[std::f64::consts::FRAC_PI_2, 0.03]).translation.vector;
    assert!((at - Vector3::new(-0.04, 0.0, 0.0)).norm() < 1e-15, "{at}");
    let o = observation(&[0.0, 0.03], Reference::position(Vector3::zeros()));
    let by_reading = model.joint_jacobian(&model.nominal(), &o);
    assert!((by_reading.column(1) - Vector3::new(0.0, -2.0, 0.0)).norm() < 1e-15);
}
