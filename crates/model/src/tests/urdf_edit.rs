//! Writing a calibrated URDF: the right numbers change, and nothing else does.

use super::*;
use crate::{Frame, Knowledge, ModelError};
use proptest::prelude::*;

fn with_tip(chain: Chain, knowledge: Knowledge) -> Model {
    let tip = Frame { knowledge, ..Frame::given("tip", Pose::identity()) };
    Model::new(chain, Frames { tip, ..Frames::of_bare_arm() }).expect("valid")
}

fn written(model: &Model, xml: &str, p: &[f64]) -> String {
    model.to_urdf(0, xml, Path::new("arm.urdf"), p).expect("the same URDF").0
}

/// The lines that differ, as (before, after).
fn changed<'a>(before: &'a str, after: &'a str) -> Vec<(&'a str, &'a str)> {
    assert_eq!(before.lines().count(), after.lines().count());
    before.lines().zip(after.lines()).filter(|(b, a)| b != a).collect()
}

#[test]
fn nothing_calibrated_changes_no_byte() {
    let panda = with_tip(urdf(oracles::PANDA, "panda_link0", "ball_link"), Knowledge::Estimated);
    assert_eq!(written(&panda, oracles::PANDA, &panda.nominal()), oracles::PANDA);
    // Line ends and odd spacing are bytes too.
    let odd = oracles::MIXED.replace('\n', "\r\n").replace("xyz=\"0 0 0.5\"", "xyz = '0  0\t0.5'");
    let mixed = bare(urdf(&odd, "base", "hand"));
    assert_eq!(written(&mixed, &odd, &mixed.nominal()), odd);
}

#[test]
fn only_the_calibrated_attribute_changes() {
    let model = bare(urdf(oracles::MIXED, "base", "hand"));
    let set = |name: &str, value: f64| {
        let mut p = model.nominal();
        p[model.index(name).expect("exists")] = value;
        written(&model, oracles::MIXED, &p)
    };
    let edited = set("turn.y", -0.1875);
    let [(before, after)] = changed(oracles::MIXED, &edited)[..] else { panic!("one line") };
    assert_eq!(after, before.replace("0.1 -0.2 0.3\"", "0.1 -0.1875 0.3\"").as_str());
    // An attribute that was not there, and an origin that was not there.
    let edited = set("slide.rz", 0.25);
    let [(before, after)] = changed(oracles::MIXED, &edited)[..] else { panic!("one line") };
    assert_eq!(after, before.replace("<origin xyz", "<origin rpy=\"0.0 0.0 0.25\" xyz"));
    let edited = set("wrist.x", 0.5);
    let [(before, after)] = changed(oracles::MIXED, &edited)[..] else { panic!("one line") };
    assert_eq!(
        after,
        before.replace("type=\"revolute\">", "type=\"revolute\"><origin xyz=\"0.5 0.0 0.0\"/>")
    );
}

#[test]
fn the_tip_goes_into_the_joint_that_carries_it() {
    let chain = urdf(oracles::PANDA, "panda_link0", "ball_link");
    let model = with_tip(chain.clone(), Knowledge::Estimated);
    let mut p = model.nominal();
    p[model.index("tip.z").expect("exists")] = 0.002;
    let edited = written(&model, oracles::PANDA, &p);
    let [(before, after)] = changed(oracles::PANDA, &edited)[..] else { panic!("one line") };
    assert!(before.contains("0.030128297908475325") && after.contains("0.03212829790847532"), "{after}");
    // A tip that is only given is the pipeline's, not the robot's.
    let given = with_tip(chain, Knowledge::Given);
    assert_eq!(written(&given, oracles::PANDA, &p), oracles::PANDA);
}

#[test]
fn a_tip_without_a_place_is_said() {
    let model = with_tip(urdf(oracles::MIXED, "base", "hand"), Knowledge::Estimated);
    let (_, warnings) =
        model.to_urdf(0, oracles::MIXED, Path::new("arm.urdf"), &model.nominal()).expect("same URDF");
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].message.contains("moving joint \"wrist\""));
}

#[test]
fn the_wrong_file_is_refused() {
    let model = bare(urdf(oracles::MIXED, "base", "hand"));
    let p = model.nominal();
    let to = |xml: &str, p: &[f64]| model.to_urdf(0, xml, Path::new("arm.urdf"), p).expect_err("refused");
    assert!(matches!(to(oracles::PANDA, &p), ModelError::ForeignUrdf { joint, .. } if joint == "turn"));
    assert!(matches!(to(oracles::MIXED, &p[1..]), ModelError::ParameterCount { .. }));
    assert!(matches!(model.chain().to_dh_toml(&p), Err(ModelError::WrongFormat { .. })));
    let rig = bare(dh(RIGHT_ARM));
    assert!(matches!(
        rig.to_urdf(0, oracles::MIXED, Path::new("a"), &rig.nominal()),
        Err(ModelError::WrongFormat { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// The calibrated robot and the robot of the written file are one, also next to a pitch of 90 deg.
    #[test]
    fn the_written_urdf_is_the_calibrated_robot(
        off in prop::collection::vec(-0.05..0.05f64, 60),
        q in prop::collection::vec(-2.0..2.0f64, 7),
        pitch in prop_oneof![Just(std::f64::consts::FRAC_PI_2), Just(1e-7 - std::f64::consts::FRAC_PI_2), -1.5..1.5f64],
    ) {
        let steep = oracles::PANDA.replacen("rpy=\"0 0 0\"", &format!("rpy=\"0.3 {pitch} -0.2\""), 1);
        let model = with_tip(urdf(&steep, "panda_link0", "ball_link"), Knowledge::Estimated);
        let mut p: Vec<f64> = model.nominal().iter().zip(&off).map(|(value, off)| value + off).collect();
        let base = model.index("base.x").expect("exists");
        p[base..base + 6].fill(0.0);
        let again = bare(urdf(&written(&model, &steep, &p), "panda_link0", "ball_link"));
        let difference = model.tip_in_base(&p, &q).to_homogeneous() - nominal_tip(&again, &q);
        prop_assert!(difference.abs().max() < 1e-14);
    }
}
