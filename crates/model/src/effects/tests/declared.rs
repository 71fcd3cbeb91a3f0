//! What a user declares of the parameters of effects.

use super::super::{EffectSpec, Override};
use super::rig::{observations, paper};
use crate::{Model, Session};
use armcal_core::Parameter;

fn rig() -> (Model, Session) {
    let model = paper();
    let session = Session::of(&observations(&model, 60, false));
    (model, session)
}

fn width(model: &Model, session: &Session, spec: EffectSpec) -> Parameter {
    let name = format!("{spec}.width");
    let with = model.with_effects(&[spec], session).expect("placed");
    with.parameters()[with.index(&name).expect("its width")].clone()
}

fn prior_deg(deg: f64) -> Override {
    Override { prior: Some(deg), ..Override::default() }
}

#[test]
fn the_narrowest_words_come_last_and_the_specs_own_win() {
    let (mut model, session) = rig();
    let before = width(&model, &session, EffectSpec::new("backlash").at(2));
    model.declare("backlash.width", prior_deg(0.2)).expect("a width");
    model.declare("backlash:2.*", Override { bound: Some(0.5), ..prior_deg(0.1) }).expect("a width");
    let [first, second, third] =
        [0, 1, 2].map(|joint| width(&model, &session, EffectSpec::new("backlash").at(joint)));
    assert_eq!(first.prior_sigma, Some(0.2_f64.to_radians()));
    assert_eq!(second.prior_sigma, Some(0.1_f64.to_radians()));
    assert!((second.upper - 0.5_f64.to_radians()).abs() < 1e-15);
    assert_eq!((third.prior_sigma, third.upper), (Some(0.2_f64.to_radians()), before.upper));
    let mut own = EffectSpec::new("backlash").at(1);
    own.overrides.insert("width".to_owned(), prior_deg(0.4));
    assert_eq!(width(&model, &session, own).prior_sigma, Some(0.4_f64.to_radians()));
    // Other effects have a width too.
    let other = width(&model, &session, EffectSpec::new("gravity_backlash").at(1));
    assert_eq!(
        other.prior_sigma,
        width(&rig().0, &session, EffectSpec::new("gravity_backlash").at(1)).prior_sigma
    );
    // What is declared of the arm's model stays with the part of it that one recording needs.
    let day = crate::RecordingStart { name: "day".into(), base_in_world: None };
    let pool = model.with_own(&[day], &[]).expect("a pool");
    let part = pool.in_recording(0, &pool.nominal()).0.clone();
    assert_eq!(width(&part, &session, EffectSpec::new("backlash").at(1)), second);
}

#[test]
fn what_is_held_is_not_tried() {
    let (mut model, session) = rig();
    let held = Override { free: Some(false), ..Override::default() };
    let has = |model: &Model, kind: &str| model.candidates(&session).iter().any(|spec| spec.kind == kind);
    assert!(has(&model, "eccentricity") && has(&model, "backlash"));
    model.declare("eccentricity.*", held.clone()).expect("all of it");
    model.declare("backlash:1.width", held).expect("one joint");
    assert!(!has(&model, "eccentricity") && has(&model, "backlash"));
    assert!(!model.candidates(&session).contains(&EffectSpec::new("backlash").at(0)));
}

#[test]
fn a_misspelt_quantity_is_named_with_what_there_is() {
    let (mut model, session) = rig();
    for name in
        ["backlash:2.width", "periodic.sin", "periodic:1,frequency=30.cos", "tool_shift@1.*", "backlash"]
    {
        model.declare(name, prior_deg(0.1)).expect(name);
        model.check_declared(&session).expect(name);
    }
    for (name, word) in [("backlash:9.width", "joint"), ("backlahs.width", "backlash"), ("backlash.w[", "w[")]
    {
        let error = model.clone().declare(name, prior_deg(0.1)).expect_err(name).to_string();
        assert!(error.contains(word), "{error}");
    }
    let negative = Override { bound: Some(-1.0), ..Override::default() };
    assert!(model.declare("backlash.width", negative).is_err());
    model.declare("periodic:2.sine", prior_deg(0.1)).expect("known once there are observations");
    let error = model.check_declared(&session).expect_err("no such quantity").to_string();
    assert!(error.contains("periodic:2.sine") && error.contains("did you mean \"sin\"?"), "{error}");
}
