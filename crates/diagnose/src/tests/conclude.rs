//! What a refit does to what was found, on calibrations with errors of known size: the floor is 1 mm in all of them.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::LinearRefit;
use crate::diagnose_problem;
use crate::diagnosis::{UnknownReport, Verdict::*};
use crate::enters::{DependsOn, EntersAt};
use crate::tests::{planar_arm, planted, quick, scatter};
use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_core::{Arrival, Code, DwellId, ErrorStats, Reference, Unit};
use armcal_model::EffectSpec;
use nalgebra::{Matrix3, Vector3};
use std::sync::OnceLock;

const N: usize = 40;

pub(crate) fn observations() -> Vec<Observation> {
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
pub(crate) fn erring(held_out_mm: f64, fitted_mm: f64) -> Calibration {
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
    (d.verdict, d.p_nothing, d.noise, d.probability) = (verdict, 0.5, scatter(1.0, 0.0), Some(0.99));
    if matches!(verdict, NothingMissing | Unknown) {
        d.effects.clear();
        d.names.clear();
    }
    d
}

/// Something unlisted over joint 1.
fn shape() -> UnknownReport {
    let places = found(Identified).effects.swap_remove(0).places;
    UnknownReport {
        channel: EntersAt::Joint(0),
        driver: DependsOn::Angle(0),
        probability: 0.9,
        gain_nats: 20.0,
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

fn concluded(d: Diagnosis, before: &Calibration, after: Option<Calibration>) -> Diagnosis {
    concluded_of(&observations(), d, before, after)
}

fn concluded_of(
    observations: &[Observation],
    mut d: Diagnosis,
    before: &Calibration,
    after: Option<Calibration>,
) -> Diagnosis {
    let names = ["joint1", "joint2", "wrist"].map(str::to_owned);
    let refitted = after.map(|calibration| Refitted {
        effects: vec![EffectSpec::parse("backlash:1", &names).unwrap()],
        model: planar_arm(),
        calibration,
        warnings: vec![Warning::new(
            Severity::Notice,
            Stage::Diagnose,
            Code::NotConverged,
            "x",
            "y".to_owned(),
        )],
    });
    let evidence = Evidence { before, observations, refitted, joint_names: &names };
    d.conclude(evidence, &quick());
    d
}

fn codes(d: &Diagnosis) -> Vec<&str> {
    codes_of(&d.warnings)
}

fn codes_of(warnings: &[Warning]) -> Vec<&str> {
    warnings
        .iter()
        .map(|w| w.code.as_str())
        .filter(|c| ["unexplained", "holdout-errs-more", "not-converged"].contains(c))
        .collect()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn nothing_is_missing_only_of_errors_at_the_floor() {
    let nothing = |error_mm: f64, p: f64| {
        let mut d = found(NothingMissing);
        d.p_nothing = p;
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
    assert_eq!(nothing(1.0, 0.9), (NothingMissing, Some(0.9)));
    assert_eq!(nothing(1.49, 0.01), (NothingMissing, Some(0.01)), "within 1.5 times the floor");
    assert_eq!(nothing(1.51, 0.9), (Unexplained, None));
}

#[test]
fn scatter_beyond_what_is_declared_is_not_nothing() {
    for (scale, verdict) in [(1.49, NothingMissing), (1.51, Unexplained)] {
        let mut c = erring(1.0, 1.0);
        c.fit.sigma_scale = scale;
        let d = concluded(found(NothingMissing), &c, None);
        assert_eq!(d.verdict, verdict);
        let severity = d.warnings.iter().find(|w| w.code == Code::Unexplained).map(|w| w.severity);
        // At the floor, a scale is no failure of the calibration.
        assert_eq!(severity, (verdict == Unexplained).then_some(Severity::Notice));
    }
}

#[test]
fn points_that_a_fit_did_not_see_may_err_by_what_it_did_not_learn() {
    for (factor, verdict) in [(1.0, Unknown), (1.12, NothingMissing)] {
        let mut c = erring(1.3, 1.0);
        c.prediction_factor = factor;
        let mut d = found(Unknown);
        d.unlisted = vec![shape()];
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
    assert_eq!(codes(&d), ["not-converged"]);
}

#[test]
fn a_name_stays_whatever_multiple_of_the_floor_remains() {
    for (before_mm, after_mm) in
        [(1.0, 0.99), (2.0, 1.98), (3.0, 2.5), (40.0, 10.5), (40.0, 39.9), (400.0, 100.0)]
    {
        for verdict in [Identified, Ambiguous] {
            let (before, after) = (erring(before_mm, before_mm), erring(after_mm, after_mm));
            let d = concluded(found(verdict), &before, Some(after));
            assert_eq!((d.verdict, d.probability), (verdict, Some(0.99)));
            assert_eq!((d.names.as_slice(), d.effects.len()), (&["backlash:1".to_owned()][..], 1));
            assert!(d.refitted.is_some() && near(d.holdout_mm.after, after_mm));
            assert_eq!(d.unexplained.is_some(), after_mm > 1.5, "{after_mm}");
        }
    }
}

#[test]
fn how_much_a_name_explains_is_a_figure_beside_it_and_half_of_it_is_enough() {
    // Of 16 - 1 above the floor 16 - 6.25 = 0.65 is explained; of 9 - 1 it is 9 - 5.76, 0.405.
    for (before_mm, after_mm, share) in [(4.0, 2.5, 0.65), (3.0, 2.4, 0.405), (3.0, 2.2, 0.52)] {
        let (before, after) = (erring(before_mm, before_mm), erring(after_mm, after_mm));
        let d = concluded(found(Identified), &before, Some(after));
        let beside = d.unexplained.as_ref().unwrap();
        assert!(near(beside.times_floor, after_mm) && near(beside.error_mm, after_mm));
        assert!(near(beside.explained_share, share) && beside.repeatability_mm.is_none());
        let warning = d.warnings.iter().find(|w| w.code == Code::Unexplained);
        assert_eq!(warning.is_some(), share < 0.5);
        assert!(warning.is_none_or(|w| w.severity == Severity::Inadequate));
        assert!(warning.is_none_or(|w| w.message.starts_with("beside what is named, the mean")));
    }
    let d = concluded(found(Identified), &erring(3.0, 3.0), Some(erring(1.45, 1.45)));
    assert!(d.unexplained.is_none() && codes(&d) == ["not-converged"], "within 1.5 times the floor");
}

#[test]
fn noise_declared_smaller_changes_what_remains_and_no_name() {
    let declared = |factor: f64, mut c: Calibration| {
        c.noise_floor_m *= factor;
        c.residuals.iter_mut().for_each(|r| r.expected_norm_m *= factor);
        c.fit.sigma_scale /= factor;
        c
    };
    let told = |factor: f64| {
        let [before, after] = [4.0, 1.2].map(|mm| declared(factor, erring(mm, mm)));
        concluded(found(Identified), &before, Some(after))
    };
    let (as_it_is, smaller) = (told(1.0), told(0.1));
    assert_eq!((as_it_is.verdict, &as_it_is.names), (smaller.verdict, &smaller.names));
    assert_eq!(as_it_is.probability, smaller.probability);
    assert!(as_it_is.unexplained.is_none());
    let left = smaller.unexplained.unwrap();
    // 1.2 mm of a floor of 0.1; of 16 - 0.01 above it 16 - 1.44 are explained.
    assert!(near(left.times_floor, 12.0) && near(left.explained_share, 14.56 / 15.99), "{left:?}");
    assert_eq!(codes_of(&smaller.warnings), ["not-converged"], "half of it and more is explained");
    let nothing = concluded(found(NothingMissing), &declared(0.1, erring(1.2, 1.2)), None);
    assert_eq!(nothing.verdict, Unexplained, "without a name it is not nothing");
}

/// The joints of each pose turned as often as it is visited, so that the places are known again.
fn revisited() -> Vec<Observation> {
    let mut all = observations();
    let poses: Vec<Vec<f64>> = all.iter().map(|o| o.joint_rad.clone()).collect();
    for (i, o) in all.iter_mut().enumerate() {
        o.joint_rad = poses[i - i % 4].clone();
        o.dwell.recording = 0;
    }
    all
}

/// Errs by so many millimetres, half of which turn over from visit to visit.
fn repeating(error_mm: f64, scatter_mm: f64) -> Calibration {
    let mut c = erring(error_mm, error_mm);
    for (i, r) in c.residuals.iter_mut().enumerate() {
        let side = if i % 2 == 0 { scatter_mm } else { -scatter_mm };
        r.fitted_m = Vector3::new(side, 0.0, (error_mm.powi(2) - scatter_mm.powi(2)).sqrt()) * 1e-3;
    }
    c
}

#[test]
fn how_well_poses_repeat_is_told_beside_what_remains() {
    // Four visits to each place: n = 4, s^2 = 4 d^2 / (3 x 3), E|e| = s sqrt(8 / pi).
    let expected = |scatter_mm: f64| scatter_mm * (4.0f64 / 9.0).sqrt() * (8.0 / std::f64::consts::PI).sqrt();
    for (error_mm, scatter_mm) in [(3.0, 2.9), (3.0, 1.0), (1.4, 0.1), (1.6, 0.1)] {
        let mut c = repeating(error_mm, scatter_mm);
        c.fit.sigma_scale = 1.0;
        let d = concluded_of(&revisited(), found(NothingMissing), &c, None);
        assert!(near(d.repeatability_mm.unwrap(), expected(scatter_mm)), "{:?}", d.repeatability_mm);
        assert_eq!(d.verdict, if error_mm <= 1.5 { NothingMissing } else { Unexplained }, "{error_mm}");
        if let Some(left) = d.unexplained {
            let told = format!("differ by {:.3} mm", expected(scatter_mm));
            assert!(
                near(left.times_floor, error_mm) && left.sentence().contains(&told),
                "{}",
                left.sentence()
            );
        }
    }
}

#[test]
fn a_hold_out_that_errs_more_with_a_name_is_told_and_takes_no_name() {
    let d = concluded(found(Identified), &erring(1.6, 3.0), Some(erring(2.4, 1.0)));
    assert_eq!((d.verdict, d.names.len()), (Identified, 1));
    let told = d.warnings.iter().find(|w| w.code == Code::HoldoutErrsMore).unwrap();
    assert_eq!((told.severity, told.subject.as_str()), (Severity::Notice, "backlash:1"));
    assert!(!told.message.contains("  "), "{}", told.message);
    // Neither what errs less nor what was not held out.
    for (before, after) in [(erring(2.4, 1.0), erring(1.6, 3.0)), (fitted_only(1.6), fitted_only(2.4))] {
        assert!(!codes(&concluded(found(Identified), &before, Some(after))).contains(&"holdout-errs-more"));
    }
}

#[test]
fn an_unlisted_shape_is_told_where_there_is_one_and_noise_does_not_explain_it() {
    let unknown = |error_mm: f64, unlisted: Vec<UnknownReport>| {
        let mut d = found(Unknown);
        (d.unlisted, d.p_nothing) = (unlisted, 0.001);
        concluded(d, &erring(error_mm, 1.0), None)
    };
    let d = unknown(1.4, vec![shape()]);
    assert_eq!((d.verdict, d.probability, d.names.len()), (Unknown, Some(0.99), 0));
    assert!(d.unexplained.is_none(), "within 1.5 times the floor");
    assert_eq!(unknown(9.0, vec![shape()]).verdict, Unknown, "whatever remains");
    let d = unknown(1.0, vec![shape()]);
    assert_eq!(
        (d.verdict, d.unlisted.len(), d.names.len()),
        (NothingMissing, 0, 0),
        "noise alone may give it"
    );
    assert_eq!(unknown(1.4, Vec::new()).verdict, NothingMissing);
    assert_eq!(unknown(1.6, Vec::new()).verdict, Unexplained);
    // Found in the search, gone when judged.
    assert_eq!(concluded(found(Unexplained), &erring(1.0, 1.0), None).verdict, Unexplained);
}

#[test]
fn single_dwells_that_err_are_told_and_no_scatter_beside_them() {
    let mut c = erring(1.0, 1.0);
    c.residuals.iter_mut().take(2).for_each(|r| r.fitted_m *= 30.0);
    c.holdout.fitted = of_residuals(&c);
    let mut d = found(NothingMissing);
    d.noise = scatter(1.0, 0.5);
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
    d.noise = scatter(1.0, 0.5);
    (d.tried_unlisted, d.candidates) = (77, Vec::new());
    let d = concluded(d, &c, None);
    let unexplained = d.unexplained.as_ref().unwrap();
    let first = &unexplained.places[0];
    assert!(first.dwells == N / 2 && near(first.error_mm, 6.0) && near(first.elsewhere_mm, 2.0));
    assert_eq!(
        unexplained.sentence().split("; elsewhere").next().unwrap(),
        "the mean error of 4.000 mm is 4.0 times what the declared noise gives (1.000 mm), largest against their noise in recording 1 \
         (20 dwells, 6.000 mm, 6.0 times"
    );
    let tail = "; visits to a place err alike (correlation 0.50): seats and cavities off their place do that; 0 listed effects and 77 unlisted shapes were tried, and none \
                predicts it clear of chance";
    assert!(unexplained.sentence().ends_with(tail), "{}", unexplained.sentence());
    let warning = d.warnings.iter().find(|w| w.code == Code::Unexplained).unwrap();
    assert_eq!((warning.severity, &warning.message), (Severity::Inadequate, &unexplained.sentence()));
    assert!(
        d.record_next[0]
            .starts_with("look first at recording 1: the errors of these 20 dwells are 6.0 times what")
    );

    let alike = crate::diagnosis::Unexplained {
        places: Vec::new(),
        scatter: None,
        times_floor: f64::INFINITY,
        ..unexplained.clone()
    };
    assert_eq!(
        alike.sentence(),
        "the mean error is 4.000 mm, and no noise is declared, about alike in all recordings, joint ranges and directions; 0 \
         listed effects and 77 unlisted shapes were tried, and none predicts it clear of chance"
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
    d.unlisted[0].channel = EntersAt::Joint(1);
    assert!(suggested(&d).is_empty() && d.beside_curves().is_empty());
    d.verdict = Unexplained;
    d.unlisted.clear();
    assert!(suggested(&d).is_empty() && d.beside_curves().is_empty());
}
