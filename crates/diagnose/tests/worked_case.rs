//! The worked case of `docs/diagnosis.md`: a slide with play, small enough for a pocket calculator. Every number of the
//! verdict is worked out here by plain arithmetic on sixteen residuals, and has to be the program's and the document's.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use armcal_core::{DwellId, FeatureId, Unit};
use armcal_diagnose::{
    Amplitude, Candidate, Columns, Diagnosis, DiagnosisConfig, DwellRow, LinearRefit, Part, Problem, Toggle,
    Verdict, diagnose_problem,
};
use nalgebra::{DMatrix, DVector, Matrix3xX};
use std::sync::Arc;

/// Measured minus predicted along the slide, arriving forwards and backwards at the same eight stops [mm].
const FORWARD_MM: [f64; 8] = [-0.24, -0.05, -0.21, -0.10, -0.32, -0.12, -0.18, -0.14];
const BACKWARD_MM: [f64; 8] = [0.29, 0.10, 0.16, 0.31, 0.19, 0.04, 0.25, 0.18];
/// Declared noise, prior of the slide's zero, typical play [mm].
const SIGMA_MM: f64 = 0.1;
const ZERO_MM: f64 = 4.0;
const PLAY_MM: f64 = 0.5;

/// Residual [mm], direction of arrival and position [m] of each dwell.
fn dwells() -> Vec<(f64, f64, f64)> {
    let both = FORWARD_MM.iter().map(|e| (*e, 1.0)).chain(BACKWARD_MM.iter().map(|e| (*e, -1.0)));
    both.enumerate().map(|(i, (e, s))| (e, s, 0.1 * (i % 8) as f64)).collect()
}

fn problem() -> Problem {
    let all = dwells();
    let row = |i: usize, (_, s, q): (f64, f64, f64)| DwellRow {
        id: DwellId { recording: 0, dwell: i },
        first_row: 3 * i,
        rows: 3,
        parts: vec![Part {
            what: (FeatureId::TIP, None),
            rows: 3,
            tracked: true,
            metres: Matrix3xX::identity(3) * (SIGMA_MM * 1e-3),
        }],
        time_s: 10.0 * i as f64,
        joint_rad: vec![q],
        arrival: vec![s],
        torque_nm: vec![0.0],
        load_kg: 0.0,
        temperature_c: None,
        place: None,
        displaced: DMatrix::identity(3, 3) / (SIGMA_MM * 1e-3),
        seat: DMatrix::identity(3, 3),
    };
    // Along the slide only, in units of the declared noise.
    let along = |of: &dyn Fn((f64, f64, f64)) -> f64| {
        DVector::from_fn(3 * all.len(), |r, _| if r % 3 == 0 { of(all[r / 3]) / SIGMA_MM } else { 0.0 })
    };
    let column = |v: DVector<f64>| DMatrix::from_column_slice(v.len(), 1, v.as_slice());
    let play = column(along(&|(_, s, _)| -0.5 * PLAY_MM * s));
    Problem {
        dwells: all.iter().enumerate().map(|(i, d)| row(i, *d)).collect(),
        residual: along(&|(e, _, _)| e),
        geometry: column(along(&|_| ZERO_MM)),
        geometry_offset: DVector::zeros(1),
        geometry_precision: DVector::from_element(1, 1.0),
        candidates: vec![Candidate {
            spec: "backlash:1".into(),
            family: "backlash".into(),
            target: "joint1".into(),
            aliases: Vec::new(),
            known: None,
            amplitudes: vec![Amplitude {
                name: "width".into(),
                unit: Unit::Metre,
                typical: PLAY_MM * 1e-3,
                never_negative: false,
            }],
            toggle: Toggle::Direction,
            columns: Columns::Dense(Arc::new(play)),
        }],
        scans: Vec::new(),
        channels: Vec::new(),
    }
}

fn close(found: f64, by_hand: f64, what: &str) {
    assert!((found - by_hand).abs() < 2e-6 * by_hand.abs().max(1e-9), "{what}: {found}, by hand {by_hand}");
}

/// Fails where the document does not say this.
fn documented(line: &str) {
    let document = include_str!("../../../docs/diagnosis.md");
    let flat = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(flat(document).contains(&flat(line)), "docs/diagnosis.md does not say: {line}");
}

#[test]
fn every_number_of_the_worked_case_follows_from_its_residuals() {
    let config = DiagnosisConfig::default();
    let d: Diagnosis = diagnose_problem(&mut LinearRefit::new(problem()), &config).unwrap();
    let all = dwells();
    let n = all.len() as f64;
    for (direction, errors_mm) in [("forwards", FORWARD_MM), ("backwards", BACKWARD_MM)] {
        let row: Vec<String> = errors_mm.iter().map(|e| format!("{e:.2}")).collect();
        documented(&format!("| {direction} | {} |", row.join(" | ")));
    }
    let e: Vec<f64> = all.iter().map(|(e, _, _)| e / SIGMA_MM).collect();
    let g: Vec<f64> = all.iter().map(|(_, s, _)| -0.5 * PLAY_MM * s / SIGMA_MM).collect();

    // The zero of the slide takes the mean, all but the part that its prior holds back.
    let j = ZERO_MM / SIGMA_MM;
    let taken = |v: &[f64], w: &[f64]| {
        let (sv, sw): (f64, f64) = (v.iter().sum(), w.iter().sum());
        j * j * sv * sw / (1.0 + n * j * j)
    };
    let product = |v: &[f64], w: &[f64]| v.iter().zip(w).map(|(a, b)| a * b).sum::<f64>() - taken(v, w);
    let (rss, a, b) = (product(&e, &e), product(&g, &g), product(&g, &e));
    let dof = 3.0 * n - n * j * j / (1.0 + n * j * j);
    documented(&format!("e'e = {rss:.2}, g'g = {a:.2}, g'e = {b:.2}, {dof:.2} degrees of freedom"));

    // The evidence: formula 8 at each amplitude.
    let nu0 = config.noise_prior_dof;
    let bayes = |s: f64| {
        let left = rss - b * b / (a + 1.0 / (s * s));
        (-0.5 * (1.0 + s * s * a).ln() - 0.5 * (nu0 + dof) * ((nu0 + left) / (nu0 + rss)).ln()).exp()
    };
    let parts: Vec<f64> = config.amplitude_scales.iter().map(|s| bayes(*s).ln()).collect();
    let ln_b = (config.amplitude_scales.iter().map(|s| bayes(*s)).sum::<f64>() / 4.0).ln();
    let candidate = &d.candidates[0];
    close(candidate.log_evidence, ln_b, "ln B");
    let parts: Vec<String> = parts.iter().map(|p| format!("{p:.2}")).collect();
    documented(&format!(
        "ln B = {} for 0.3, 1, 3 and 10 times the typical play, {ln_b:.2} on average",
        parts.join(", ")
    ));

    // The size: least squares, its interval from what is left.
    let (ridge, width_mm) = (0.01, b / (a + 0.01) * PLAY_MM);
    let left = (rss - b * b / a) / dof;
    let half_mm = 1.959964 * (left / (a + ridge)).sqrt() * PLAY_MM;
    let found = &d.effects[0];
    let width = &found.parameters[0];
    assert!((width.value * 1e3 - width_mm).abs() < 2e-5, "{} {width_mm}", width.value * 1e3);
    assert!((width.ci95[1] * 1e3 - width_mm - half_mm).abs() < 2e-4, "{:?} {half_mm}", width.ci95);
    documented(&format!("width = {width_mm:.3} +- {half_mm:.3} mm"));

    // Each stop predicted by the other seven: the two fits are means over all their dwells and over one direction.
    let left_out_mm = |with: bool| {
        let error = |i: usize| {
            let alike = |k: &usize| *k % 8 != i % 8 && (!with || all[*k].1 == all[i].1);
            let others: Vec<f64> = (0..all.len()).filter(alike).map(|k| all[k].0).collect();
            (all[i].0 - others.iter().sum::<f64>() / others.len() as f64).abs()
        };
        (0..all.len()).map(error).sum::<f64>() / n
    };
    let (before, after) = (left_out_mm(false), left_out_mm(true));
    assert!((found.places.before - before).abs() < 1e-3, "{} {before}", found.places.before);
    assert!((found.places.after - after).abs() < 1e-3, "{} {after}", found.places.after);
    documented(&format!("from {before:.3} to {after:.3} mm"));

    // Of 999 sign-flipped copies none looks as convincing.
    close(candidate.p_adjusted, 1.0 / 1000.0, "p");
    documented("p = 1 / (999 + 1) = 0.001");
    assert_eq!((d.verdict, &d.names[..]), (Verdict::Identified, &["backlash:1".to_owned()][..]));

    // The posterior: prior times evidence, of nothing, of the play, and of what is not listed.
    let nothing = config.prior_nothing;
    let listed = config.prior_catalogue * ln_b.exp();
    let unlisted = nothing / d.p_nothing - nothing - listed;
    assert!(unlisted > 0.0);
    documented(&format!("P(nothing) = {:.1e}", d.p_nothing));
    documented(&format!("0.5 : {:.2e} : {:.2e}", listed, unlisted));
}
