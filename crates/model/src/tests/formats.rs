//! DH tables and URDFs: what is read, what is refused and how, what is written back.

use super::*;
use crate::{Deviation, ModelError};
use armcal_core::Unit;
use proptest::prelude::*;

fn dh_error(text: &str) -> String {
    Chain::from_dh_toml(text, Path::new("arm.toml")).expect_err("refused").to_string()
}

fn urdf_error(xml: &str) -> String {
    Chain::from_urdf(xml, "base", "hand", Path::new("arm.urdf")).expect_err("refused").to_string()
}

#[test]
fn entries_carry_their_own_deviation() {
    let chain = dh(
        "name = \"a\"\n[deviation]\nbound_mm = 1.0\nprior_sigma_deg = inf\n[[rows]]\nname = \"j\"\ntheta_deg = 3\n\
         d_mm = { nominal = 76.0, bound = 2.0, prior_sigma = 0.5 }\na_mm = { nominal = 0, free = false }\nalpha_deg = 90\n",
    );
    let [theta, d, a, _] = chain.parameters() else { panic!("four entries") };
    assert_eq!((theta.unit, theta.prior_sigma, theta.free), (Unit::Radian, None, true));
    assert!((theta.upper - 5f64.to_radians()).abs() < 1e-15);
    assert!((d.upper - 0.078).abs() < 1e-15 && d.prior_sigma == Some(5e-4));
    assert!(!a.free && (a.upper - 1e-3).abs() < 1e-15);
}

#[test]
fn calibrated_tables_read_back() {
    for text in [RIGHT_ARM, LEFT_ARM, UR10] {
        let chain = dh(text);
        let calibrated: Vec<f64> =
            chain.parameters().iter().enumerate().map(|(i, p)| p.nominal + 1e-3 * (i as f64 - 3.3)).collect();
        let again = dh(&chain.to_dh_toml(&calibrated).expect("a DH chain"));
        assert_eq!(again.joint_names(), chain.joint_names());
        for ((before, after), value) in chain.parameters().iter().zip(again.parameters()).zip(&calibrated) {
            assert!((after.nominal - value).abs() < 1e-15, "{}", after.name);
            assert_eq!(
                (&after.name, after.free, after.prior_sigma),
                (&before.name, before.free, before.prior_sigma)
            );
            assert!((after.upper - after.nominal - (before.upper - before.nominal)).abs() < 1e-15);
        }
        // Unchanged numbers keep every digit: the nominal chain comes back exactly.
        let nominal: Vec<f64> = chain.parameters().iter().map(|p| p.nominal).collect();
        assert_eq!(dh(&chain.to_dh_toml(&nominal).expect("a DH chain")), chain);
        assert!(matches!(chain.to_dh_toml(&[0.0]), Err(ModelError::ParameterCount { actual: 1, .. })));
    }
}

const SLIDE: &str = "name = \"a\"\n[[rows]]\nname = \"j\"\njoint = \"prismatic\"\ntheta_deg = 0\nd_mm = 0\na_mm = 0\nalpha_deg = 0\n";

#[test]
fn limits_of_joints_come_from_either_file_and_what_was_recorded_is_within_them() {
    let ur10 = dh(UR10);
    assert_eq!(ur10.joint_limits(5, [-1.0, 1.0]), [-std::f64::consts::TAU, std::f64::consts::TAU]);
    assert_eq!(ur10.joint_limits(5, [-1.0, 7.0]), [-std::f64::consts::TAU, 7.0]);
    let slide = dh(&format!("{SLIDE}limits_mm = [-5, 250]\n"));
    assert_eq!(slide.joint_limits(0, [0.0, 0.1]), [-0.005, 0.25]);
    assert_eq!(dh(SLIDE).joint_limits(0, [0.0, 0.1]), [f64::NEG_INFINITY, f64::INFINITY]);
    for (wrong, said) in [
        ("limits_mm = [250, -5]", "j.limits_mm = -5"),
        ("limits_deg = [-5, 5]", "j.limits_deg = -5"),
        ("limits_mm = [0, inf]", "two finite numbers"),
    ] {
        let error = dh_error(&format!("{SLIDE}{wrong}\n"));
        assert!(error.contains(said), "{error}");
    }
    let urdf = |limit: &str| {
        let xml = format!(
            "<robot name=\"a\"><link name=\"base\"/><link name=\"hand\"/><joint name=\"j\" type=\"revolute\"><parent link=\"base\"/>\
             <child link=\"hand\"/><axis xyz=\"0 0 1\"/>{limit}</joint></robot>"
        );
        let chain = Chain::from_urdf(&xml, "base", "hand", Path::new("arm.urdf")).expect("a chain");
        chain.joint_limits(0, [0.0, 0.0])
    };
    assert_eq!(urdf("<limit lower=\"-2.9\" upper=\"1.5\" effort=\"1\" velocity=\"1\"/>"), [-2.9, 1.5]);
    // The placeholder of many generated files is no interval of readings.
    assert_eq!(urdf("<limit lower=\"0\" upper=\"0\"/>"), [f64::NEG_INFINITY, f64::INFINITY]);
}

#[test]
fn faulty_tables_are_refused_with_line_or_key() {
    let row = |entry: &str| {
        format!("name = \"a\"\n[[rows]]\nname = \"j\"\ntheta_deg = 0\nd_mm = 0\na_mm = 0\n{entry}\n")
    };
    for (text, says) in [
        ("name = \"a\"\nrows = []", "no moving joint"),
        ("name = ", "line 1"),
        ("name = \"a\"", "missing field `rows`"),
        (&row("alpha_deg = 0\njoint = \"fixed\""), "no moving joint"),
        (&row(""), "missing field `alpha_deg`"),
        (&row("alpha_deg = nan"), "j.alpha_deg = NaN"),
        (&row("alpha_deg = inf"), "expected a finite number"),
        (&row("alpha = 0"), "unknown field `alpha`"),
        (&row("alpha_deg = \"90\""), "a number or a table { nominal, free, bound, prior_sigma }"),
        (&row("alpha_deg = { nominal = 0, fre = false }"), "unknown field `fre`"),
        (&row("alpha_deg = { free = false }"), "missing field `nominal`"),
        (&row("alpha_deg = { nominal = 0, bound = -1 }"), "j.alpha_deg.bound = -1"),
        (&row("alpha_deg = 99999999999"), "out of range"),
        (&row("alpha_deg = 0\njoint = \"rotary\""), "unknown variant `rotary`"),
        (
            &(row("alpha_deg = 0")
                + "[[rows]]\nname = \"j\"\ntheta_deg = 0\nd_mm = 0\na_mm = 0\nalpha_deg = 0"),
            "two rows named \"j\"",
        ),
        (&row("alpha_deg = 0").replace("\"j\"", "\"\""), "row 1 (from 1) has an empty name"),
        (&(row("alpha_deg = 0") + "[deviation]\nbound_mm = 0"), "deviation.bound_mm = 0"),
        (&(row("alpha_deg = 0") + "[deviation]\nprior_sigma_deg = nan"), "deviation.prior_sigma_deg = NaN"),
    ] {
        let error = dh_error(text);
        assert!(error.contains(says) && error.contains("arm.toml"), "{says:?} not in: {error}");
    }
}

#[test]
fn faulty_urdfs_are_refused_with_their_line() {
    let mixed = oracles::MIXED;
    let follows = |leader: &str| {
        mixed.replace("child link=\"slide\"/>", &format!("child link=\"slide\"/><mimic joint=\"{leader}\"/>"))
    };
    for (xml, says) in [
        (mixed.replace("</robot>", ""), "not well-formed"),
        ("<sdf/>".to_owned(), "arm.urdf:1: <sdf>: a URDF begins with <robot>"),
        (mixed.replace("\"hand\"", "\"hands\""), "there is no link \"hand\"; did you mean \"hands\"?"),
        (mixed.replace("<link name=\"base\"/>", ""), "there is no link \"base\""),
        (mixed.replace("parent link=\"base\"", "parent link=\"slide\""), "form a loop"),
        (mixed.replace("parent link=\"base\"", "parent link=\"attic\""), "its ancestors are: bracket, slide, carriage, attic"),
        (mixed.replace("continuous", "floating"), "arm.urdf:3: joint \"turn\": type \"floating\""),
        (mixed.replace(" type=\"prismatic\"", ""), "arm.urdf:5: joint \"slide\": the attribute type is missing"),
        (mixed.replace("name=\"wrist\" ", ""), "arm.urdf:9: joint: the attribute name is missing"),
        (mixed.replace("xyz=\"0 0 0.5\"", "xyz=\"0 0\""), "arm.urdf:6: joint \"slide\": xyz = \"0 0\" is not three finite numbers"),
        (mixed.replace("xyz=\"0 0 0.5\"", "xyz=\"0 0 inf\""), "not three finite numbers"),
        (mixed.replace("xyz=\"0 0 0.5\"", "xyz=\"0 0 0 x\""), "not three finite numbers"),
        (mixed.replace("xyz=\"0 0.6 0.8\"", "xyz=\"0 0 0\""), "its axis has no direction"),
        (mixed.replace("<parent link=\"bracket\"/>", ""), "it has no <parent link="),
        (mixed.replace("<child link=\"hand\"/>", ""), "does not descend from \"base\""),
        (follows("toe"), "it mimics \"toe\", and there is no such joint"),
        (follows("mount"), "it mimics \"mount\", which does not move"),
        (follows("slide"), "which mimics another joint itself"),
        (follows("turn").replace("<mimic joint", "<mimic multiplier=\"x\" joint"), "multiplier = \"x\" is not a finite number"),
        (mixed.replace("child link=\"bracket\"", "child link=\"slide\""), "does not descend"),
        (mixed.replace("</robot>", "<joint name=\"two\" type=\"fixed\"><parent link=\"base\"/><child link=\"hand\"/></joint></robot>"), "more than one parent"),
        (mixed.replace("continuous", "fixed").replace("prismatic", "fixed").replace("revolute", "fixed"), "no moving joint"),
    ] {
        let error = urdf_error(&xml);
        assert!(error.contains(says) && error.contains("arm.urdf"), "{says:?} not in: {error}");
    }
    let error = Chain::from_urdf(mixed, "base", "base", Path::new("arm.urdf")).expect_err("nothing between");
    assert!(matches!(error, ModelError::NoJoint { .. }), "{error}");
}

#[test]
fn a_urdf_takes_other_deviations() {
    let wide = Deviation { bound_mm: f64::INFINITY, prior_sigma_mm: 1.0, ..Deviation::default() };
    let chain =
        urdf(oracles::MIXED, "base", "hand").with_deviation(&wide, Path::new("p.toml")).expect("positive");
    let x = &chain.parameters()[0];
    assert_eq!(
        (x.name.as_str(), x.nominal, x.upper, x.prior_sigma),
        ("turn.x", 0.1, f64::INFINITY, Some(1e-3))
    );
    let none = Deviation { bound_deg: 0.0, ..Deviation::default() };
    let error = chain.with_deviation(&none, Path::new("p.toml")).expect_err("no room at all");
    assert!(error.to_string().contains("deviation.bound_deg = 0"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Any byte of a good file may be replaced: it is read or refused, never a panic.
    #[test]
    fn mutated_files_never_panic(at in 0usize..2000, byte in any::<u8>(), cut in any::<bool>()) {
        let mutate = |text: &str| {
            let mut bytes = text.as_bytes().to_vec();
            let at = at % bytes.len();
            if cut { bytes.truncate(at) } else { bytes[at] = byte }
            String::from_utf8_lossy(&bytes).into_owned()
        };
        let _ = Chain::from_dh_toml(&mutate(UR10), Path::new("arm.toml"));
        let mutated = mutate(oracles::MIXED);
        let _ = Chain::from_urdf(&mutated, "base", "hand", Path::new("arm.urdf"));
        let model = bare(urdf(oracles::MIXED, "base", "hand"));
        let p: Vec<f64> = model.nominal().iter().map(|x| x + 1e-3).collect();
        let _ = model.to_urdf(0, &mutated, Path::new("arm.urdf"), &p);
    }
}
