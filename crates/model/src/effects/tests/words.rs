//! Specs as people write them.

use super::super::{EffectSpec, EffectTable, Since};
use super::rig::{observations, paper, specs, table};
use crate::Session;
use armcal_core::DwellId;

#[test]
fn every_spec_reads_back_as_itself() {
    let model = paper();
    for spec in specs(&model, &observations(&model, 60, false)) {
        if spec.expression.is_none() {
            assert_eq!(model.effect(&spec.to_string()).expect("its own words"), spec);
        }
        let text = toml::to_string(&EffectTable::from(&spec)).expect("a table");
        let table: EffectTable = toml::from_str(&text).expect("its own table");
        let mut sorted = spec.clone();
        sorted.shape.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(table.spec(model.chain().joint_names()).expect("a spec"), sorted, "{text}");
    }
}

#[test]
fn the_grammar_means_what_it_says() {
    let model = paper();
    let spec = model.effect("zero_slip:joint2@1").expect("a spec");
    assert_eq!(spec, EffectSpec::new("zero_slip").at(1).since(Since::Recording(1)));
    let step = model.effect("zero_slip:2@1.17").expect("a spec").since.expect("a dwell");
    let dwell = |recording, dwell| DwellId { recording, dwell };
    assert!(!step.holds(dwell(1, 16)) && step.holds(dwell(1, 17)) && step.holds(dwell(2, 0)));
    let passing = model.effect("tool_shift@1.17-25").expect("a spec");
    assert_eq!(passing.to_string(), "tool_shift@1.17-25");
    let passing = passing.since.expect("dwells");
    assert!(passing.holds(dwell(1, 17)) && passing.holds(dwell(1, 25)));
    assert!(!passing.holds(dwell(1, 16)) && !passing.holds(dwell(1, 26)) && !passing.holds(dwell(2, 20)));
    let wrong = |text: &str| model.effect(text).expect_err("no such dwells").to_string();
    assert!(wrong("tool_shift@1.25-17").contains("before the first"));
    assert!(wrong("tool_shift@1.17-x").contains("FIRST-LAST"));
}

#[test]
fn candidates_and_scans_say_everything_once() {
    let model = paper();
    let observations = observations(&model, 60, false);
    let session = Session::of(&observations);
    let mut texts: Vec<String> = model.candidates(&session).iter().map(EffectSpec::to_string).collect();
    let scans = model.scans(&session, &observations);
    texts.extend(scans.iter().flat_map(|(_, members)| members).map(EffectSpec::to_string));
    let all = texts.len();
    texts.sort();
    texts.dedup();
    assert_eq!(texts.len(), all);
    let has = |text: &str| texts.iter().any(|t| t == text);
    assert!(
        has("backlash:1") && has("crossed_backlash:3,from=2") && has("zero_slip:2@1") && has("axis_tilt:3")
    );
    // 20 dwells a recording: a shift of three amplitudes needs two of them on each side, of six it needs four.
    assert!(has("tool_shift@0.2") && !has("frame_shift@0.3") && has("frame_shift@0.4"));
    assert!(
        has("tool_shift@1.17") && !has("tool_shift@1.0") && !has("tool_shift@2.0") && !has("tool_shift@0.1")
    );
    // Of one kind, shapes are searched one at a time and by twos; who holds the arm by itself.
    assert!(has("gravity_backlash:2,outer=1.25") && has("gravity_backlash:2,smoothing=0.01"));
    assert!(has("gravity_backlash:2,smoothing=0.01,outer=1.25") && has("gravity_backlash:2,seated=0"));
    assert!(!has("gravity_backlash:2,outer=1.25,seated=0"));
    assert!(!has("gravity_backlash:2,friction=0.1,smoothing=0.01,outer=1.25"));
    assert!(
        has("periodic:1,frequency=30") && !has("periodic:1") && !has("axis_tilt:2") && !has("seat_offset")
    );
}

#[test]
fn what_is_wrong_is_named() {
    let model = paper();
    let session = Session::of(&observations(&model, 12, false));
    let error = |text: &str| {
        let spec = match model.effect(text) {
            Ok(spec) => spec,
            Err(error) => return error.to_string(),
        };
        model.with_effects(&[spec], &session).expect_err("something is wrong").to_string()
    };
    assert!(error("backlsh:1").contains("did you mean \"backlash\"?"));
    assert!(error("backlash:4").contains("joints 1 to 3"));
    assert!(error("backlash:jont2").contains("did you mean \"joint2\"?"));
    assert!(error("backlash").contains("such as backlash:1"));
    assert!(error("zero_slip:1").contains("say when"));
    assert!(error("zero_slip:1@x").contains("RECORDING.DWELL"));
    assert!(error("backlash:1,width=0.1").contains("no shape \"width\""));
    assert!(error("backlash:1,width").contains("shape=number"));
    assert!(error("frame_shift:1@1").contains("leave the joint out"));
}

#[test]
fn a_table_changes_parameters_in_display_units() {
    let model = paper();
    let text =
        "kind = 'backlash'\ntarget = 'joint1'\nparameters.width = { prior = 0.2, start = 0.5, bound = 1 }";
    let table: EffectTable = toml::from_str(text).expect("a table");
    let spec = table.spec(model.chain().joint_names()).expect("a spec");
    let session = Session::of(&observations(&model, 12, false));
    let extended = model.with_effects(std::slice::from_ref(&spec), &session).expect("a model");
    let p = &extended.parameters()[extended.index("backlash:1.width").expect("the parameter")];
    let deg = 1f64.to_radians();
    assert!((p.prior_sigma.expect("a prior") - 0.2 * deg).abs() < 1e-15);
    assert!((p.nominal - 0.5 * deg).abs() < 1e-15 && (p.upper - 1.5 * deg).abs() < 1e-15);
    let again = model.with_effects(&[spec.clone(), spec], &session).expect_err("twice").to_string();
    assert!(again.contains("backlash:1.width"), "{again}");
    let wrong: EffectTable =
        toml::from_str("kind = 'backlash'\ntarget = 1\nparameters.widht = { prior = 0.2 }").expect("a table");
    let wrong = wrong.spec(model.chain().joint_names()).expect("a spec");
    let error = model.with_effects(&[wrong], &session).expect_err("no such parameter").to_string();
    assert!(error.contains("did you mean \"width\"?"), "{error}");
}

#[test]
fn an_unknown_key_of_a_table_is_named() {
    let model = paper();
    let error = |text: &str| {
        let table: EffectTable = toml::from_str(text).expect("a table");
        table.spec(model.chain().joint_names()).expect_err("something is wrong").to_string()
    };
    let formula = error("kind = 'expression'\nname = 'f'\nformla = 'q1'\nacts_on = 'q1'");
    assert!(formula.contains("\"formla\"; did you mean \"formula\"?"), "{formula}");
    assert!(error("kind = 'expression'\nname = 'f'\nformula = 'q1'").contains("acts_on"));
    assert!(error("kind = 'backlash'\ntarget = 'joint9'").contains("joint9"));
    assert!(error("kind = 'zero_slip'\ntarget = 1\nsince = 'later'").contains("since"));
}

/// What is said about an expression with this formula, target and parameters.
fn said(formula: &str, acts_on: &str, parameters: &str) -> String {
    let model = paper();
    let mut still = observations(&model, 12, false);
    still.iter_mut().for_each(|o| (o.temperature_c, o.effort_nm) = (None, None));
    let text = format!(
        "kind = 'expression'\nname = 'f'\nformula = '{formula}'\nacts_on = '{acts_on}'\n{parameters}"
    );
    match model.with_effects(&[table(&text, &model)], &Session::of(&still)) {
        Ok(_) => "fine".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn what_is_wrong_with_a_formula_is_named() {
    let k = "parameters.k = { unit = 'rad', prior = 0.01 }";
    let compliance = "parameters.k = { unit = 'deg/(N*m)', prior = 0.01 }";
    assert_eq!(said("k * sin(q1)", "joint3", k), "fine");
    assert_eq!(said("k * tau2", "joint2", compliance), "fine");
    assert_eq!(
        said("k * tau2 + 0.3", "joint3.d", "parameters.k = { unit = 'm/(N*m)', prior = 1e-4 }"),
        "fine"
    );
    for (error, parts) in [
        (said("k * sin(q4)", "joint3", k), ["\"q4\"", "q1.. s1.."]),
        (said("k * laod", "joint3", k), ["\"laod\"", "did you mean \"load\"?"]),
        (said("k * sine(q1)", "joint3", k), ["\"sine\"", "did you mean \"sin\"?"]),
        (said("k * sin(q1", "joint3", k), ["cannot be read", "k * sin(q1"]),
        (said("k * sin(q1)", "jiont3", k), ["\"jiont3\"", "did you mean \"joint3\"?"]),
        (said("k * temperature", "joint3", k), ["temperature", "observations have no"]),
        (said("k * effort1", "joint3", k), ["effort1", "not all dwells have a measured effort of `joint1`"]),
        (said("k * tau2", "joint3", k), ["units", "N*m"]),
        (said("k + tau2", "joint3", k), ["units", "adds N*m"]),
        (said("k * sin(tau2)", "joint3", k), ["units", "sin of N*m"]),
        (said("k * q1", "joint3.d", k), ["units", "joint3.d takes m"]),
        (said("k * q1", "joint3", "parameters.k = { unit = 'rad' }"), ["\"k\"", "typical size"]),
        (
            said("k * q1", "joint3", "parameters.k = { unit = 'rda', prior = 1 }"),
            ["\"rda\"", "The units are m, rad"],
        ),
        (said("sin(q1)", "joint3", k), ["has no", "\"k\""]),
        (said("-k^2", "joint3", k), ["minus before a power", "-(x^n)"]),
    ] {
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
}

#[test]
fn a_formula_is_the_entry_of_the_catalogue_it_spells_out() {
    let model = paper();
    // A formula knows neither who holds the tip nor the path, only the direction of arrival.
    let mut observations = observations(&model, 24, true);
    observations.iter_mut().for_each(|o| o.path_memory_rad = None);
    let session = Session::of(&observations);
    for (kind, formula, acts_on, unit) in [
        ("backlash:2", "-(k/2) * s2", "joint2", "deg"),
        ("gear_ratio:2", "k * q2", "joint2", "1"),
        ("zero_drift:2", "k * t / 460", "joint2", "rad"),
        ("warm_up,time_constant=200", "k * (1 - exp(-t / 200))", "lengths", "1"),
    ] {
        let text = format!(
            "kind = 'expression'\nname = 'f'\nformula = '{formula}'\nacts_on = '{acts_on}'\n\
             parameters.k = {{ unit = '{unit}', prior = 0.1 }}"
        );
        let listed = model.with_effects(&[model.effect(kind).expect("a spec")], &session).expect("a model");
        let spelled = model.with_effects(&[table(&text, &model)], &session).expect("a model");
        let mut p = listed.nominal();
        let amplitude = listed.effects()[0].parameters.start;
        p[amplitude] = 0.01;
        let mut q = spelled.nominal();
        q[spelled.effects()[0].parameters.start] = 0.01;
        for o in &observations {
            let (a, da) = listed.residual_with_jacobian(&p, o);
            let (b, db) = spelled.residual_with_jacobian(&q, o);
            let columns = da.columns(0, amplitude + 1) - db.columns(0, amplitude + 1);
            assert!((a.position_m - b.position_m).norm() < 1e-14 && columns.norm() < 1e-12, "{kind}");
        }
    }
}

#[test]
fn a_spec_covers_what_it_does_not_say() {
    let joints = ["a".to_owned(), "b".to_owned()];
    let spec = |text: &str| EffectSpec::parse(text, &joints).expect("a spec");
    for (wide, own, covered) in [
        ("backlash", "backlash:2", true),
        ("backlash:b", "backlash:2", true),
        ("backlash:1", "backlash:2", false),
        ("zero_slip:2", "zero_slip:2@1.17", true),
        ("zero_slip:2@1", "zero_slip:2@1.17", false),
        ("frame_shift", "zero_slip:2@1", false),
        ("periodic:1", "periodic:1,frequency=30", true),
        ("periodic,frequency=30", "periodic:1,frequency=30", true),
        ("periodic:1,frequency=17", "periodic:1,frequency=30", false),
    ] {
        assert_eq!(spec(wide).covers(&spec(own)), covered, "{wide} and {own}");
    }
}
