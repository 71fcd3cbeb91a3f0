//! The worked case of `docs/diagnosis.md`: a slide with play, small enough for a pocket calculator. Every number of the
//! verdict is worked out here by plain arithmetic on sixteen residuals, and has to be the program's and the document's.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

mod arm;

use arm::LinearRefit;
use armcal_core::{DwellId, FeatureId, Unit};
use armcal_diagnose::{
    Amplitude, Candidate, Columns, Diagnosis, DiagnosisConfig, DwellRow, Part, Problem, Toggle, Verdict,
    diagnose_problem,
};
use nalgebra::{DMatrix, DVector, Matrix3xX};
use rand_distr::{Distribution, Exp1};
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
            per_turn: None,
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

    let candidate = &d.candidates[0];
    let found = &d.effects[0];

    // The size: least squares, its interval from what is left.
    let (ridge, width_mm) = (0.01, b / (a + 0.01) * PLAY_MM);
    let left = (rss - b * b / a) / dof;
    let half_mm = 1.959964 * (left / (a + ridge)).sqrt() * PLAY_MM;
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

    // The score: ln densities of each stop as the other seven predict it, with the play and without.
    let scores = [false, true].map(|with| score(&left_out(with)));
    let each: Vec<f64> = (0..8).map(|stop| scores[1][stop] - scores[0][stop]).collect();
    let gain: f64 = each.iter().sum();
    let se = (8.0 / 7.0 * each.iter().map(|d| (d - gain / 8.0).powi(2)).sum::<f64>()).sqrt();
    close(found.gain_nats, gain, "gain");
    close(found.gain_se, se, "its standard error");
    documented(&format!("says {gain:.2} +- {se:.2} nats more with the play than without"));
    let unlisted = found.above_unlisted_nats.unwrap();
    assert!(unlisted > 0.0);
    documented(&format!("says {unlisted:.2} nats less than the play"));

    // Shares in copies of the data: with weights w of the stops the play has e^(8 w'd - cost) times what nothing has.
    let cost = 3.0 - 0.4f64.ln() + 0.5f64.ln();
    documented("3 nats for each amplitude, of which the play has one");
    assert!(gain > 3.0 && gain > se, "what it must be");
    let share = share_of_nothing(&each, cost);
    // The program draws 999 times, of which one or two may be of such weights that the play says nothing.
    assert!((share - d.p_nothing).abs() < 2e-3 && share < 5e-3, "{share} {}", d.p_nothing);
    documented(&format!("P(nothing) = {:.3}", d.p_nothing));

    // Of 999 sign-flipped copies none looks as convincing.
    close(candidate.p_adjusted, 1.0 / 1000.0, "p");
    documented("p = 1 / (999 + 1) = 0.001");
    assert_eq!((d.verdict, &d.names[..]), (Verdict::Identified, &["backlash:1".to_owned()][..]));
    let standing = candidate.standing.unwrap();
    assert!(standing.in_answer && standing.behind_nats == 0.0 && standing.probability > 0.99, "{standing:?}");
}

/// Errors along the slide in units of the declared noise, each stop predicted by the other seven, in which forwards and backwards
/// are as many: the zero is their mean and the play half their difference, all but the parts that their priors hold back.
fn left_out(with_play: bool) -> Vec<f64> {
    let all = dwells();
    let (j, half) = (ZERO_MM / SIGMA_MM, 0.5 * PLAY_MM / SIGMA_MM);
    let error = |i: usize| {
        let others = || (0..all.len()).filter(|k| *k % 8 != i % 8).map(|k| (all[k].0 / SIGMA_MM, all[k].1));
        let zero = j * j * others().map(|(e, _)| e).sum::<f64>() / (14.0 * j * j + 1.0);
        let size = -half * others().map(|(e, s)| e * s).sum::<f64>() / (14.0 * half * half + 0.01);
        let play = if with_play { -half * all[i].1 * size } else { 0.0 };
        all[i].0 / SIGMA_MM - zero - play
    };
    (0..all.len()).map(error).collect()
}

/// ln densities of the eight stops, each with the size of the noise that says most of the other seven: Student's t of three axes,
/// of which two are not off. At 0 it is G(4) / G(5/2) / (5 pi)^(3/2) over the cube of the width, where G(4) = 6 and G(5/2) = 3/4 sqrt(pi).
fn score(errors: &[f64]) -> Vec<f64> {
    let path = |k: i32| 2f64.powf(2.0 * f64::from(k) / 3.0);
    let variances: Vec<f64> = (-15..=0).map(path).chain((-9..=30).map(|k| 1.0 + path(k))).collect();
    let student = |e: f64, v: f64| {
        let (pi, width_m) = (std::f64::consts::PI, v.sqrt() * SIGMA_MM * 1e-3);
        let at_0 = (8.0 / (pi.sqrt() * (5.0 * pi).powf(1.5) * width_m.powi(3))).ln();
        at_0 - 4.0 * (1.0 + e * e / (5.0 * v)).ln()
    };
    let stop = |at: usize, v: f64| -> f64 { [at, at + 8].iter().map(|i| student(errors[*i], v)).sum() };
    let best = |at: usize| {
        let others = |v: f64| (0..8).filter(|k| *k != at).map(|k| stop(k, v)).sum::<f64>();
        variances.iter().copied().max_by(|a, b| others(*a).total_cmp(&others(*b))).unwrap()
    };
    (0..8).map(|at| stop(at, best(at))).collect()
}

/// Its share beside the play, over weights of the stops that are drawn at random.
fn share_of_nothing(each: &[f64], cost_nats: f64) -> f64 {
    let mut rng = arm::rng(1);
    let draws = 50_000;
    let one = |rng: &mut rand_chacha::ChaCha8Rng| {
        let weights: Vec<f64> = each.iter().map(|_| Exp1.sample(rng)).collect();
        let mean = weights.iter().zip(each).map(|(w, d)| w * d).sum::<f64>() / weights.iter().sum::<f64>();
        1.0 / (1.0 + (each.len() as f64 * mean - cost_nats).exp())
    };
    (0..draws).map(|_| one(&mut rng)).sum::<f64>() / f64::from(draws)
}
