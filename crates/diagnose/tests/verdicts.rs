//! Planted effects are named, noise is not, and what is not listed is called unknown where it is.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod arm;

use arm::{LinearRefit, Noise, catalogue, design, on_joint, outside, overconfident, problem, rng};
use armcal_diagnose::{
    DependsOn, Diagnosis, DiagnosisConfig, Problem, Scan, UnknownReport, Verdict, diagnose_problem,
};

fn run(p: Problem) -> Diagnosis {
    let config = DiagnosisConfig { resamplings: 199, ..Default::default() };
    diagnose_problem(&mut LinearRefit::new(p), &config).unwrap()
}

/// Plants catalogue entries at typical size.
fn planted(name: &str, free: usize, seed: u64) -> Diagnosis {
    run(arm::planted(&[(name, 1.0)], free, seed))
}

#[test]
fn noise_of_any_kind_is_not_an_effect() {
    for noise in [Noise::White, Noise::StudentT3, Noise::Ar1, Noise::Seat, Noise::Swaps] {
        for seed in 0..2 {
            let mut r = rng(100 + seed);
            let poses = design(0, &mut r);
            let d = run(problem(&poses, &[], noise, &mut r, false));
            assert_eq!(d.verdict, Verdict::NothingMissing, "{noise:?} {seed}: {:?}", d.names);
            assert!(!d.not_testable.is_empty(), "a board alone cannot show compliance");
            if noise == Noise::Swaps {
                assert!(!d.set_aside.is_empty() && d.set_aside.len() < 20, "{:?}", d.set_aside);
            }
        }
    }
}

#[test]
fn one_cause_is_named_and_the_error_falls_to_the_noise() {
    for (name, free) in [("backlash:1", 0), ("zero_drift:1", 0), ("compliance:3", 60), ("coupling:3", 60)] {
        let d = planted(name, free, 7);
        assert!(d.effects.iter().any(|e| e.set.iter().any(|n| n == name)), "{name}: {:?}", d.names);
        assert_eq!(d.effects.len(), 1, "{name}: {:?}", d.names);
        assert!(d.holdout_mm.after < 0.5 && d.holdout_mm.after < d.holdout_mm.before, "{:?}", d.holdout_mm);
        assert!(d.p_adjusted <= 0.01);
    }
}

#[test]
fn the_size_of_a_backlash_lies_in_its_interval() {
    let d = planted("backlash:1", 0, 11);
    let size = &d.effects[0].parameters[0];
    let truth = 0.5f64.to_radians();
    assert!(size.ci95[0] < truth && truth < size.ci95[1], "{size:?}");
    // Forward and backward visits to one pose: free of geometry, and of the same size.
    let pairs = d.effects[0].contrast.as_ref().unwrap();
    assert!(pairs.agrees && pairs.pairs > 20 && pairs.p < 0.01, "{pairs:?}");
}

#[test]
fn two_causes_are_both_found() {
    let d = run(arm::planted(&[("backlash:3", 1.0), ("coupling:3", 1.0)], 60, 3));
    for name in ["backlash:3", "coupling:3"] {
        assert!(d.effects.iter().any(|e| e.set.iter().any(|n| n == name)), "{:?}", d.names);
    }
    assert!(d.unknown.is_none(), "{:?}", d.unknown);
}

#[test]
fn what_is_not_listed_is_unknown_at_the_right_joint_and_driver() {
    for (k, (name, channel, driver, effect)) in outside(1.0).into_iter().enumerate() {
        let mut r = rng(40 + k as u64);
        let poses = design(0, &mut r);
        let d = run(problem(&poses, &[(effect, vec![])], Noise::White, &mut r, false));
        assert_eq!(d.verdict, Verdict::Unknown, "{name}: {:?}", d.names);
        let u = d.unknown.unwrap();
        assert_eq!((u.channel, u.driver), (channel, driver), "{name}");
        assert!(u.expression.is_some() && !u.shape.is_empty(), "{name}");
        assert!(u.places.after < 0.75 * u.places.before, "{name}: {:?}", u.places);
    }
}

#[test]
fn a_wrong_noise_declaration_hides_nothing() {
    // Declared 20 times too small, two effects: everything is significant, and still only the two are named.
    let mut r = rng(5);
    let poses = design(60, &mut r);
    let list = catalogue(&poses);
    let names = ["backlash:3", "eccentricity:1"];
    let hidden: Vec<_> = list
        .iter()
        .filter(|l| names.contains(&l.spec.as_str()))
        .map(|l| (l.effect.clone(), l.typical.clone()))
        .collect();
    let d = run(overconfident(problem(&poses, &hidden, Noise::White, &mut r, false), 20.0));
    assert_eq!(d.effects.len(), 2, "{:?}", d.names);
    assert!(d.warnings.iter().any(|w| w.code == armcal_core::Code::ScatterLarger));
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let text = || serde_json::to_string(&planted("backlash:2", 0, 9)).unwrap();
    assert_eq!(text(), text());
}

#[test]
fn two_values_of_a_shape_are_one_name() {
    let mut r = rng(7);
    let poses = design(0, &mut r);
    let list = catalogue(&poses);
    let own = list.iter().find(|l| l.spec == "backlash:1").unwrap();
    let hidden = [(own.effect.clone(), own.typical.clone())];
    let mut p = problem(&poses, &hidden, Noise::White, &mut r, false);
    let mut shaped = p.candidates.iter().find(|c| c.spec == "backlash:1").unwrap().clone();
    shaped.spec = "backlash:1,shape=2".to_string();
    p.scans.push(Scan::of("backlash:1", vec![shaped]));
    let d = run(p);
    let of_joint = |set: &[String]| set.iter().filter(|n| n.starts_with("backlash:1")).count();
    assert_eq!(d.effects.len(), 1, "{:?}", d.names);
    assert_eq!(of_joint(&d.effects[0].set), 1, "{:?}", d.effects[0].set);
    assert!(d.effects[0].probability > 0.9, "both values together: {}", d.effects[0].probability);
}

#[test]
fn the_error_curves_of_two_joints_are_both_listed() {
    let mut r = rng(8);
    let poses = design(60, &mut r);
    let deg = std::f64::consts::PI / 180.0;
    let bumps = move |q: f64| {
        0.5 * deg * ((-((q - 0.05) / 0.05).powi(2)).exp() - (-((q + 0.1) / 0.04).powi(2)).exp())
    };
    let hidden = [
        (on_joint(0, move |p, _, _| bumps(p.q[0])), vec![]),
        (on_joint(2, move |p, _, _| 0.3 * deg * (25.0 * p.q[2]).sin().powi(3)), vec![]),
    ];
    let d = run(problem(&poses, &hidden, Noise::White, &mut r, false));
    let listed: Vec<_> = d.unlisted.iter().filter_map(UnknownReport::own_angle).collect();
    for own in [0, 2] {
        assert!(listed.contains(&own), "{own} is not among {listed:?}");
    }
    assert_eq!(d.unknown.unwrap().channel, d.unlisted[0].channel, "the strongest comes first");
    assert!(d.holdout_mm.after < 0.7 * d.holdout_mm.before, "{:?}", d.holdout_mm);
}

#[test]
fn a_formula_of_time_is_kept_for_its_own_session_only() {
    let joints = ["joint1", "joint2", "joint3"].map(str::to_owned);
    for (k, (name, _, driver, effect)) in outside(1.0).into_iter().enumerate() {
        if !["cycling", "crossed"].contains(&name) {
            continue;
        }
        let mut r = rng(40 + k as u64);
        let poses = design(0, &mut r);
        let d = run(problem(&poses, &[(effect, vec![])], Noise::White, &mut r, false));
        let suggested = d.suggested(&joints).unwrap();
        assert_eq!(suggested.len(), 1, "{name}");
        let (kept, left_out) = d.lasting(&joints, 3).unwrap();
        assert_eq!(
            (kept.len(), left_out.len()),
            if driver == DependsOn::SessionTime { (0, 1) } else { (1, 0) },
            "{name}"
        );
        assert_eq!(d.lasting(&joints, 1).unwrap(), (suggested, vec![]), "{name}");
    }
}
