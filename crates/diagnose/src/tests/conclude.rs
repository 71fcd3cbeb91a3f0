//! What a refit does to what was found, on calibrations with errors of known size: the floor is 1 mm in all of them.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::LinearRefit;
use crate::diagnose_problem;
use crate::diagnosis::{UnknownReport, Verdict::*};
use crate::tests::{planar_arm, planted, quick};
use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_core::{Arrival, DwellId, ErrorStats, Reference, Unit};
use armcal_model::EffectSpec;
use nalgebra::{Matrix3, Vector3};
use std::sync::OnceLock;

const N: usize = 40;
/// What noise alone may give the mean of 40 errors of 1 mm.
const CHANCE_MM: f64 = 1.172;

fn observations() -> Vec<Observation> {
    let model = planar_arm();
    let one = |dwell: usize| {
        let joint_rad = vec![0.05 * dwell as f64, 1.5 - 0.03 * dwell as f64, 0.0];
        let id = DwellId { recording: usize::from(dwell >= N / 2), dwell };
        let bare = Observation {
            time_ns: dwell as i64,
            covariance_m2: Matrix3::identity() * 1e-6,
            arrival: vec![Arrival::Positive; 3],
            ..Observation::bare(id, joint_rad, Reference::position(Vector3::zeros()))
        };
        let tip_m = model.predicted_tip_in_world(&model.nominal(), &bare);
        Observation { reference: Reference::position(tip_m), ..bare }
    };
    (0..N).map(one).collect()
}

/// A calibration that errs by so many millimetres in every held-out dwell, and in every one that was fitted.
fn erring(held_out_mm: f64, fitted_mm: f64) -> Calibration {
    static BASE: OnceLock<Calibration> = OnceLock::new();
    let base = BASE.get_or_init(|| {
        calibrate(&planar_arm(), &observations(), &FitConfig::default(), &HoldoutConfig::None).unwrap()
    });
    let mut c = base.clone();
    c.fit.sigma_scale = 1.0;
    (c.noise_floor_m, c.prediction_factor) = (1e-3, 1.0);
    for r in &mut c.residuals {
        (r.held_out, r.expected_norm_m) = (true, 1e-3);
        r.fitted_m = Vector3::z() * held_out_mm * 1e-3;
    }
    c.holdout.fitted = ErrorStats::of_norms(&[held_out_mm * 1e-3; N]);
    c.train.fitted = ErrorStats::of_norms(&[fitted_mm * 1e-3; N]);
    c
}

fn of_residuals(c: &Calibration) -> ErrorStats {
    ErrorStats::of_norms(&c.residuals.iter().map(|r| r.fitted_m.norm()).collect::<Vec<_>>())
}

/// The same without a hold-out.
fn fitted_only(error_mm: f64) -> Calibration {
    let mut c = erring(error_mm, error_mm);
    c.residuals.iter_mut().for_each(|r| r.held_out = false);
    c.holdout.fitted = ErrorStats::default();
    c
}

/// What the linearised search says of a session with play in joint 1.
fn found(verdict: Verdict) -> Diagnosis {
    static PLAY: OnceLock<Diagnosis> = OnceLock::new();
    let play = PLAY.get_or_init(|| {
        diagnose_problem(&mut LinearRefit::new(planted(&[("backlash:1", 1.0)], 0, 3)), &quick()).unwrap()
    });
    assert_eq!((play.verdict, play.effects.len()), (Identified, 1));
    let mut d = play.clone();
    (d.verdict, d.p_nothing, d.noise.sigma_ratio, d.probability) = (verdict, 0.5, 1.0, Some(0.99));
    d.noise.kinds.clear();
    if matches!(verdict, NothingMissing | Unknown) {
        d.effects.clear();
    }
    d
}

/// Something unlisted over joint 1.
fn shape() -> UnknownReport {
    let places = found(Identified).effects.swap_remove(0).places;
    UnknownReport {
        channel: "joint1".to_owned(),
        driver: "q1".to_owned(),
        probability: 0.9,
        log_evidence: 20.0,
        unit: Unit::Radian,
        shape: Vec::new(),
        ripple: None,
        peak: None,
        series: None,
        expression: None,
        places,
        rivals: Vec::new(),
    }
}

fn concluded(mut d: Diagnosis, before: &Calibration, after: Option<Calibration>) -> Diagnosis {
    let names = ["joint1", "joint2", "wrist"].map(str::to_owned);
    let refitted = after.map(|calibration| Refitted {
        effects: vec![EffectSpec::parse("backlash:1", &names).unwrap()],
        model: planar_arm(),
        calibration,
        warnings: vec![Warning::new(Severity::Notice, Stage::Diagnose, "of-refit", "x", "y".to_owned())],
    });
    let observations = observations();
    let evidence = Evidence { before, observations: &observations, refitted, joint_names: &names };
    d.conclude(evidence, &quick());
    d
}

fn codes(d: &Diagnosis) -> Vec<&str> {
    d.warnings
        .iter()
        .map(|w| w.code)
        .filter(|c| ["unexplained", "judged-by-fit", "of-refit"].contains(c))
        .collect()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn nothing_is_missing_only_of_errors_at_the_floor() {
    let nothing = |error_mm: f64, p: f64, ratio: f64| {
        let mut d = found(NothingMissing);
        (d.p_nothing, d.noise.sigma_ratio) = (p, ratio);
        let d = concluded(d, &erring(error_mm, 1.0), None);
        assert!(
            near(d.holdout_mm.before, error_mm)
                && near(d.holdout_mm.after, error_mm)
                && near(d.floor_mm, 1.0)
        );
        assert_eq!((d.names.len(), d.judged), (0, JudgedOn::HeldOut));
        assert_eq!(d.unexplained.is_some(), d.verdict == Unexplained);
        assert_eq!(codes(&d).len(), usize::from(d.verdict == Unexplained));
        (d.verdict, d.probability)
    };
    assert_eq!(nothing(1.0, 0.9, 1.0), (NothingMissing, Some(0.9)));
    assert_eq!(nothing(1.49, 0.9, 1.0), (NothingMissing, Some(0.9)), "within 1.5 times the floor");
    assert_eq!(nothing(1.51, 0.9, 1.0), (Unexplained, None));
    // Improbable by the search: only what noise alone may give is nothing, and then without a probability.
    assert_eq!(nothing(CHANCE_MM - 0.002, 0.01, 1.0), (NothingMissing, None));
    assert_eq!(nothing(CHANCE_MM + 0.002, 0.01, 1.0), (Unexplained, None));
    assert_eq!(nothing(1.2, 0.03, 1.0), (NothingMissing, Some(0.03)), "not improbable: above 0.02");
    // Noise half as large as declared allows half as much; noise larger than declared does not excuse more.
    assert_eq!(nothing(0.5 * CHANCE_MM - 0.002, 0.01, 0.5), (NothingMissing, None));
    assert_eq!(nothing(0.5 * CHANCE_MM + 0.002, 0.01, 0.5), (Unexplained, None));
    assert_eq!(nothing(CHANCE_MM + 0.002, 0.01, 3.0), (Unexplained, None));
}

#[test]
fn scatter_beyond_what_is_declared_is_not_nothing() {
    for (scale, verdict) in [(1.49, NothingMissing), (1.51, Unexplained)] {
        let mut c = erring(1.0, 1.0);
        c.fit.sigma_scale = scale;
        let d = concluded(found(NothingMissing), &c, None);
        assert_eq!(d.verdict, verdict);
        let severity = d.warnings.iter().find(|w| w.code == "unexplained").map(|w| w.severity);
        // At the floor, a scale is no failure of the calibration.
        assert_eq!(severity, (verdict == Unexplained).then_some(Severity::Notice));
    }
}

#[test]
fn points_that_a_fit_did_not_see_may_err_by_what_it_did_not_learn() {
    for (factor, verdict) in [(1.0, Unexplained), (1.12, NothingMissing)] {
        let mut c = erring(1.3, 1.0);
        c.prediction_factor = factor;
        let mut d = found(NothingMissing);
        d.p_nothing = 0.001;
        assert_eq!(concluded(d, &c, None).verdict, verdict);
    }
}

#[test]
fn a_name_stays_that_a_refit_confirms() {
    let d = concluded(found(Identified), &erring(3.0, 3.0), Some(erring(1.0, 1.0)));
    assert_eq!(
        (d.verdict, d.probability, d.names.as_slice()),
        (Identified, Some(0.99), &["backlash:1".to_owned()][..])
    );
    assert!(near(d.holdout_mm.before, 3.0) && near(d.holdout_mm.after, 1.0) && d.unexplained.is_none());
    assert!(d.refitted.is_some() && d.effects.len() == 1);
    assert_eq!(codes(&d), ["of-refit"]);
}

/// That a refit took everything back, and says what it would have left.
fn assert_taken_back(before: &Calibration, after: Calibration, verdict: Verdict) {
    let mut with_shape = found(Identified);
    with_shape.unlisted = vec![shape()];
    with_shape.unknown = Some(shape());
    with_shape.tentative = with_shape.effects.clone();
    let after_mm = after.judged().fitted.mean_m * 1e3;
    let d = concluded(with_shape, before, Some(after));
    assert_eq!(d.verdict, verdict);
    assert!(d.names.is_empty() && d.effects.is_empty() && d.unlisted.is_empty() && d.tentative.is_empty());
    assert!(d.unknown.is_none() && d.refitted.is_none() && !codes(&d).contains(&"of-refit"));
    assert!(near(d.holdout_mm.after, d.holdout_mm.before));
    if let Some(unexplained) = &d.unexplained {
        let [(name, tried)] = unexplained.tried.refitted.as_slice() else { panic!("one refit was tried") };
        assert!(
            name == "backlash:1" && near(tried.after, after_mm) && near(tried.before, d.holdout_mm.before)
        );
        assert!(
            near(unexplained.error_mm, d.holdout_mm.before)
                && near(unexplained.times_floor, unexplained.error_mm)
        );
    }
    assert_eq!(d.unexplained.is_some(), verdict == Unexplained);
}

#[test]
fn a_name_goes_that_a_refit_does_not_confirm() {
    // A hundredth of the floor is not worth a name; a fiftieth is.
    assert_taken_back(&erring(2.0, 2.0), erring(1.985, 1.985), Unexplained);
    assert_taken_back(&erring(1.0, 1.0), erring(0.985, 0.985), NothingMissing);
    let d = concluded(found(Identified), &erring(1.6, 1.6), Some(erring(1.57, 1.57)));
    assert_eq!(d.verdict, Identified);
    // Larger errors where it was not fitted, however well it fits the rest.
    assert_taken_back(&erring(1.6, 3.0), erring(1.7, 1.0), Unexplained);
    // Too little on either side.
    assert_taken_back(&erring(3.0, 3.0), erring(3.0, 2.86), Unexplained);
    // Less in the mean, not clear of chance.
    let mut uneven = erring(1.4, 1.4);
    uneven.residuals.iter_mut().step_by(2).for_each(|r| r.fitted_m *= 0.3);
    uneven.residuals.iter_mut().skip(1).step_by(2).for_each(|r| r.fitted_m *= 1.6);
    uneven.holdout.fitted = of_residuals(&uneven);
    assert_taken_back(&erring(1.4, 1.4), uneven, NothingMissing);
    // More than ten times the floor, or little of what lies above it where twice the floor is left.
    assert_taken_back(&erring(40.0, 40.0), erring(10.5, 10.5), Unexplained);
    assert_taken_back(&erring(3.0, 3.0), erring(2.5, 2.5), Unexplained);
}

#[test]
fn what_leaves_much_stays_where_it_explains_most() {
    // (16 - 6.25) / (16 - 1) = 0.65 of the squared error above the floor.
    let d = concluded(found(Identified), &erring(4.0, 4.0), Some(erring(2.5, 2.5)));
    assert_eq!((d.verdict, codes(&d)), (Identified, vec!["of-refit", "unexplained"]));
    let beside = d.unexplained.as_ref().unwrap();
    assert!(near(beside.times_floor, 2.5) && near(beside.error_mm, 2.5) && beside.tried.refitted.is_empty());
    let warning = d.warnings.iter().find(|w| w.code == "unexplained").unwrap();
    assert!(
        warning.severity == Severity::Inadequate
            && warning.message.starts_with("beside what is named, the mean")
    );
    // (9 - 5.76) / (9 - 1) = 0.405 of it held out, (9 - 4.41) / 8 = 0.57 fitted: the clearer side tells.
    assert_eq!(concluded(found(Identified), &erring(3.0, 3.0), Some(erring(2.4, 2.1))).verdict, Identified);
    // Up to twice the floor beside a name is told, and no failure.
    let d = concluded(found(Identified), &erring(3.0, 3.0), Some(erring(1.9, 1.9)));
    assert_eq!((d.unexplained.is_some(), codes(&d)), (true, vec!["of-refit"]));
    let d = concluded(found(Identified), &erring(3.0, 3.0), Some(erring(1.45, 1.45)));
    assert!(d.unexplained.is_none(), "within 1.5 times the floor");
    // A hold-out that cannot learn the effect: what is left is what the fitted side leaves.
    let d = concluded(found(Identified), &erring(40.0, 40.0), Some(erring(12.0, 1.0)));
    assert!(d.verdict == Identified && d.unexplained.is_none());
}

#[test]
fn the_fit_decides_where_the_held_out_points_cannot_and_says_so() {
    let d = concluded(found(Identified), &erring(1.2, 1.2), Some(erring(1.2, 1.1)));
    assert_eq!((d.verdict, codes(&d)), (Identified, vec!["judged-by-fit", "of-refit"]));
    assert!(d.warnings.iter().any(|w| w.code == "judged-by-fit" && w.subject == "backlash:1"));
    // Worse where it was not fitted, but by no more than chance and in few dwells: as where a fold leaves out all that shows a
    // flank.
    let changed = |every: usize, [one, other]: [f64; 2]| {
        let mut c = erring(1.2, 1.1);
        c.residuals.iter_mut().step_by(every).for_each(|r| r.fitted_m *= one);
        c.residuals.iter_mut().skip(1).step_by(every).for_each(|r| r.fitted_m *= other);
        c.holdout.fitted = of_residuals(&c);
        assert!(c.judged().fitted.mean_m > 1.2e-3);
        c
    };
    let d = concluded(found(Identified), &erring(1.2, 1.2), Some(changed(20, [1.5, 0.9])));
    assert_eq!((d.verdict, codes(&d)), (Identified, vec!["judged-by-fit", "of-refit"]));
    // Clearly less in few of them, where the mean is not clear of zero for it.
    let mut few = erring(1.2, 1.1);
    few.residuals.iter_mut().step_by(20).for_each(|r| r.fitted_m *= 0.2);
    few.holdout.fitted = of_residuals(&few);
    let d = concluded(found(Identified), &erring(1.2, 1.2), Some(few));
    assert_eq!((d.verdict, codes(&d)), (Identified, vec!["judged-by-fit", "of-refit"]));
    // Many changed, better and worse, so that they may be worse on the whole: refuted, unless a turn of the hold-out knows
    // nothing of what was added.
    for (ratio, verdict) in [(1.5, NothingMissing), (3.1, Identified)] {
        let mut after = changed(2, [0.6, 1.45]);
        after.turn_sigma_ratio = vec![1.0; after.fit.estimates.len()];
        *after.turn_sigma_ratio.last_mut().unwrap() = ratio;
        after.fit.estimates.last_mut().unwrap().parameter.name = "backlash:1.width".to_owned();
        assert_eq!(concluded(found(Identified), &erring(1.2, 1.2), Some(after)).verdict, verdict);
    }
    // Without a hold-out the fitted points are the judged ones.
    let d = concluded(found(Identified), &fitted_only(1.4), Some(fitted_only(1.37)));
    assert_eq!((d.verdict, d.judged, codes(&d)), (Identified, JudgedOn::Fitted, vec!["of-refit"]));
    assert_taken_back(&fitted_only(1.4), fitted_only(1.385), NothingMissing);
}

#[test]
fn an_unlisted_shape_is_told_where_there_is_one_and_noise_does_not_explain_it() {
    let unknown = |error_mm: f64, unlisted: Vec<UnknownReport>| {
        let mut d = found(Unknown);
        d.names = vec!["unknown".to_owned()];
        (d.unlisted, d.p_nothing) = (unlisted, 0.001);
        concluded(d, &erring(error_mm, 1.0), None)
    };
    let d = unknown(1.4, vec![shape()]);
    assert_eq!((d.verdict, d.probability, d.names.len()), (Unknown, Some(0.99), 1));
    assert!(d.unexplained.is_none(), "within 1.5 times the floor");
    let d = unknown(1.0, vec![shape()]);
    assert_eq!(
        (d.verdict, d.unlisted.len(), d.names.len()),
        (NothingMissing, 0, 0),
        "noise alone may give it"
    );
    assert_eq!(unknown(1.4, Vec::new()).verdict, Unexplained);
    // Found in the search, gone when judged.
    assert_eq!(concluded(found(Unexplained), &erring(1.0, 1.0), None).verdict, Unexplained);
}

#[test]
fn single_dwells_that_err_are_told_and_no_scatter_beside_them() {
    let mut c = erring(1.0, 1.0);
    c.residuals.iter_mut().take(2).for_each(|r| r.fitted_m *= 30.0);
    c.holdout.fitted = of_residuals(&c);
    let mut d = found(NothingMissing);
    d.noise.kinds = vec![("repeated at every place".to_owned(), 0.99)];
    let d = concluded(d, &c, None);
    let sentence = d.unexplained.as_ref().unwrap().sentence();
    let told = "largest against their noise in recording 0 dwell 0, recording 0 dwell 1 (2 dwells, 30.000 mm, 30.0 times; elsewhere \
                1.000 mm, 1.0 times); ";
    assert!(sentence.contains(told), "{sentence}");
    assert!(
        d.record_next[0].starts_with("look first at recording 0 dwell 0, recording 0 dwell 1: the errors")
    );
}

#[test]
fn the_place_of_unexplained_errors_is_told_and_looked_at_first() {
    let mut c = erring(2.0, 2.0);
    c.residuals.iter_mut().skip(N / 2).for_each(|r| r.fitted_m *= 3.0);
    c.holdout.fitted = of_residuals(&c);
    let mut d = found(NothingMissing);
    d.noise.kinds = vec![("repeated at every place".to_owned(), 0.99)];
    (d.tried_unlisted, d.candidates) = (77, Vec::new());
    let d = concluded(d, &c, None);
    let unexplained = d.unexplained.as_ref().unwrap();
    let first = &unexplained.places[0];
    assert!(first.dwells == N / 2 && near(first.error_mm, 6.0) && near(first.elsewhere_mm, 2.0));
    assert_eq!(
        unexplained.sentence().split("; elsewhere").next().unwrap(),
        "the mean error of 4.000 mm is 4.0 times the noise floor of 1.000 mm, largest against their noise in recording 1 \
         (20 dwells, 6.000 mm, 6.0 times"
    );
    let tail = "; the scatter is repeated at every place; 0 listed effects and 77 unlisted shapes were tried and do not \
                explain it";
    assert!(unexplained.sentence().ends_with(tail), "{}", unexplained.sentence());
    let warning = d.warnings.iter().find(|w| w.code == "unexplained").unwrap();
    assert_eq!((warning.severity, &warning.message), (Severity::Inadequate, &unexplained.sentence()));
    assert!(
        d.record_next[0]
            .starts_with("look first at recording 1: the errors of these 20 dwells are 6.0 times what")
    );
    assert!(!d.explanations.is_empty());

    let alike = crate::diagnosis::Unexplained {
        places: Vec::new(),
        scatter: None,
        times_floor: f64::INFINITY,
        ..unexplained.clone()
    };
    assert_eq!(
        alike.sentence(),
        "the mean error is 4.000 mm, and no noise is declared, about alike in all recordings, joint ranges and directions; 0 \
         listed effects and 77 unlisted shapes were tried and do not explain it"
    );
}

#[test]
fn what_shows_beside_error_curves_is_added_with_them() {
    let mut d = found(Unknown);
    d.tentative = found(Identified).effects;
    d.unlisted = vec![UnknownReport {
        series: Some(crate::diagnosis::Series { harmonics: 30, typical_rad: 0.00021 }),
        ..shape()
    }];
    let names = ["joint1", "joint2", "wrist"].map(str::to_owned);
    let suggested = |d: &Diagnosis| -> Vec<String> {
        d.suggested(&names).unwrap().iter().map(EffectSpec::to_string).collect()
    };
    assert_eq!(suggested(&d), ["error_curve:1,harmonics=30,typical=0.00021", "backlash:1"]);
    assert_eq!(d.beside_curves().len(), 1);
    // Beside anything else a name is only a hint.
    d.unlisted[0].channel = "joint2".to_owned();
    assert!(suggested(&d).is_empty() && d.beside_curves().is_empty());
    d.verdict = Unexplained;
    d.unlisted.clear();
    assert!(suggested(&d).is_empty() && d.beside_curves().is_empty());
}
