//! Formulas against brute force, on a small arm of its own.

#[path = "../tests/arm/mod.rs"]
pub(crate) mod arm;

mod causes;
mod costs;
mod markers;

use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems};
use crate::problem::projection::Projection;
use crate::weigh::cells::Unlisted;
use crate::weigh::{Outside, Weighed, weigh};
use crate::{Correlation, DependsOn, DiagnosisConfig, EntersAt, LinearRefit, Problem, Scatter};
use arm::{design, problem, rng};
use armcal_model::{Chain, Frames, Model};
use nalgebra::{DMatrix, DVector};

fn small(seed: u64) -> Problem {
    let mut r = rng(seed);
    let poses: Vec<_> =
        design(0, &mut r).into_iter().filter(|p| p.dwell % 6 == 0 || p.dwell % 6 == 5).collect();
    problem(&poses, &[], arm::Noise::White, &mut r, false)
}

/// A planar arm of two links and a wrist that turns about its own axis, through the tip.
const PLANAR_ARM: &str = r#"
    name = "planar"
    [[rows]]
    name = "joint1"
    theta_deg = 0.0
    d_mm = 0.0
    a_mm = 400.0
    alpha_deg = 0.0
    [[rows]]
    name = "joint2"
    theta_deg = 0.0
    d_mm = 0.0
    a_mm = 300.0
    alpha_deg = 0.0
    [[rows]]
    name = "wrist"
    theta_deg = 0.0
    d_mm = 0.0
    a_mm = 0.0
    alpha_deg = 0.0
"#;

pub(crate) fn planar_arm() -> Model {
    let chain = Chain::from_dh_toml(PLANAR_ARM, std::path::Path::new("arm.toml")).unwrap();
    Model::new(chain, Frames::of_bare_arm()).unwrap()
}

/// Errors that scatter so many times as declared, visits to a place so much alike.
pub(crate) fn scatter(sigma_ratio: f64, places: f64) -> Scatter {
    let places = Some(Correlation { value: places, p: 1e-9, pairs: 90 });
    let (tracked_ratio, seated_ratio, tracked_neighbours, seated_neighbours) = Default::default();
    Scatter { sigma_ratio, tracked_ratio, seated_ratio, tracked_neighbours, seated_neighbours, places }
}

/// Few resamplings: what the tests ask is far from chance.
pub(crate) fn quick() -> DiagnosisConfig {
    DiagnosisConfig { resamplings: 199, ..Default::default() }
}

pub(crate) use arm::planted;

/// Calls `ask` with the conditioned problems of a problem.
pub(crate) fn with_conditioned<T>(
    p: &Problem,
    config: &DiagnosisConfig,
    ask: impl FnOnce(&mut ConditionedProblems<'_>) -> T,
) -> T {
    let mut refit = LinearRefit::new(p.clone());
    let first = (p.clone(), weigh(p, config));
    ask(&mut ConditionedProblems::new(&mut refit, vec![true; p.dwells.len()], first, config))
}

/// The first of them.
pub(crate) fn conditioned(p: &Problem, config: &DiagnosisConfig) -> std::rc::Rc<ConditionedProblem> {
    with_conditioned(p, config, |conditioned_problems| conditioned_problems.with(&[]).unwrap())
}

/// Where a candidate was weighed.
pub(crate) fn entry(weighed: &Weighed, spec: &str) -> usize {
    weighed.entries.iter().position(|e| e.candidate.spec == spec).unwrap()
}

/// A candidate weighed as if it were not listed: as a cell, or as a shape without a place and a driver.
pub(crate) fn outside(p: &Problem, spec: &str, cell: bool, ln_evidence: f64) -> Outside {
    let what = Unlisted {
        channel: cell.then_some(0),
        driver: cell.then_some(0),
        enters: EntersAt::Part(spec.to_string()),
        depends: DependsOn::Pose,
        columns: own(p, spec).columns,
        unit_si: 1.0,
    };
    Outside { what, ln_evidence }
}

/// The same readings with their noise declared a tenth: every whitened row is ten times as large.
fn declared_a_tenth(p: &Problem) -> Problem {
    let ten_times = |candidate: &mut crate::Candidate| {
        candidate.columns = crate::Columns::Dense(candidate.columns.dense(&p.dwells, 10.0).into());
    };
    let mut q = p.clone();
    q.residual *= 10.0;
    q.geometry *= 10.0;
    q.candidates.iter_mut().for_each(ten_times);
    q.scans.iter_mut().flat_map(|scan| &mut scan.points).for_each(ten_times);
    q.channels.iter_mut().for_each(|channel| channel.columns = (&*channel.columns * 10.0).into());
    q
}

#[test]
fn the_noise_that_is_found_is_the_same_whatever_is_declared() {
    let mut p = planted(&[("backlash:1", 3.0)], 12, 5);
    // Few dwells and errors in every direction, which the geometry would follow if priors did not hold it.
    let mut state = 7u64;
    p.residual.iter_mut().for_each(|r| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        *r += 12.0 * ((state >> 33) as f64 / 2f64.powi(30) - 1.0);
    });
    let q = declared_a_tenth(&p);
    assert!((q.sigma() / p.sigma() - 10.0).abs() < 1e-9, "{} and {}", p.sigma(), q.sigma());
    let (of_p, of_q) = (weigh(&p, &quick()), weigh(&q, &quick()));
    assert!(
        of_p.scale > 3.0 && (of_q.scale / of_p.scale - 10.0).abs() < 1e-6,
        "{} {}",
        of_p.scale,
        of_q.scale
    );
    assert_eq!(of_p.ranking(), of_q.ranking());
}

/// A candidate of a problem.
pub(crate) fn own(p: &Problem, spec: &str) -> crate::Candidate {
    p.candidates.iter().find(|c| c.spec == spec).unwrap().clone()
}

#[test]
fn evidence_equals_the_dense_marginal_likelihood() {
    // With the rows for their number less what the geometry takes, ln B is the ratio of two multivariate t densities whose
    // scale matrices are I + J J' and I + J J' + a^2 G G'.
    let p = small(2);
    let j = &p.geometry;
    let base = DMatrix::identity(p.rows(), p.rows()) + j * j.transpose();
    let projection =
        Projection::new(j.clone(), &p.geometry_precision, &p.geometry_offset, p.residual.clone());
    let rows = projection.dof();
    let solve = |c: &DMatrix<f64>| {
        let factor = c.clone().cholesky().unwrap();
        let ln_det = 2.0 * factor.l().diagonal().iter().map(|v| v.ln()).sum::<f64>();
        (ln_det, p.residual.dot(&factor.solve(&p.residual)))
    };
    let (ln_det0, square0) = solve(&base);
    assert!((projection.rss - square0).abs() < 1e-6 * square0);
    for candidate in p.candidates.iter().step_by(7) {
        let g = candidate.columns.dense(&p.dwells, 1.0);
        for a in [0.3, 3.0] {
            let (ln_det, square) = solve(&(&base + a * a * &g * g.transpose()));
            let config = DiagnosisConfig { amplitude_scales: vec![a], ..Default::default() };
            let dense =
                -0.5 * (ln_det - ln_det0) - 0.5 * (8.0 + rows) * ((8.0 + square) / (8.0 + square0)).ln();
            let found = crate::weigh::evidence::ln_bayes(&projection.gram(&g), &projection, &config);
            assert!(
                (found - dense).abs() < 1e-5 * dense.abs().max(1.0),
                "{} {a}: {found} {dense}",
                candidate.spec
            );
        }
    }
}

#[test]
fn leave_group_out_is_a_refit_without_the_group() {
    let p = small(3);
    let effect = p.candidates[0].columns.dense(&p.dwells, 1.0);
    let stretches = crate::weigh::crossval::by_stretch(&p);
    assert!(stretches.iter().all(|g| g.scored.iter().all(|i| g.unseen.contains(i))));
    assert!(
        stretches.iter().any(|g| g.unseen.len() > g.scored.len()),
        "what is near in time is not seen either"
    );
    let places = crate::weigh::crossval::by_place(&p);
    let found =
        [&places, &stretches].map(|groups| crate::weigh::crossval::left_out(&p, Some(&effect), groups, 1.0));
    let cases = places.iter().map(|g| (g, &found[0])).step_by(4);
    for (group, found) in cases.chain(stretches.iter().map(|g| (g, &found[1])).step_by(5)) {
        let keep: Vec<bool> = (0..p.dwells.len()).map(|i| !group.unseen.contains(&i)).collect();
        let cut = p.without(&keep);
        // Least squares with prior rows, by singular values.
        let (n, m) = (cut.geometry.ncols(), effect.ncols());
        let rows = cut.rows();
        let mut x = DMatrix::zeros(rows + n + m, n + m);
        x.view_mut((0, 0), (rows, n)).copy_from(&cut.geometry);
        x.view_mut((0, n), (rows, m)).copy_from(&cut.candidates[0].columns.dense(&cut.dwells, 1.0));
        (0..n).for_each(|k| x[(rows + k, k)] = 1.0);
        (0..m).for_each(|k| x[(rows + n + k, n + k)] = crate::problem::EFFECT_PRECISION.sqrt());
        let mut y = DVector::zeros(rows + n + m);
        y.rows_mut(0, rows).copy_from(&cut.residual);
        let beta = x.svd(true, true).solve(&y, 1e-12).unwrap();
        for i in &group.scored {
            for row in p.dwells[*i].range() {
                let own = p.residual[row]
                    - (p.geometry.row(row) * beta.rows(0, n))[0]
                    - (effect.row(row) * beta.rows(n, m))[0];
                assert!((found[row] - own).abs() < 1e-6, "{} {own}", found[row]);
            }
        }
    }
}

#[test]
fn bootstrap_p_values_are_uniform_under_noise() {
    // Of 60 data sets of pure noise, about 5 % have an adjusted p-value of at most 5 % somewhere; 13 % would be a
    // one in a hundred accident.
    let config = DiagnosisConfig { resamplings: 99, ..Default::default() };
    let mut below = 0;
    for seed in 0..60 {
        let p = small(200 + seed);
        let projection = Projection::new(
            p.geometry.clone(),
            &p.geometry_precision,
            &p.geometry_offset,
            p.residual.clone(),
        );
        let grams = p.candidates.iter().map(|c| (c, projection.gram(&c.columns.dense(&p.dwells, 1.0))));
        let directions: Vec<_> =
            grams.map(|(c, gram)| crate::judge::bootstrap::Direction::new(&c.columns, 1.0, &gram)).collect();
        let clusters: Vec<Vec<usize>> = (0..p.dwells.len()).map(|i| vec![i]).collect();
        let all =
            crate::judge::bootstrap::wild_cluster(&projection, &directions, (&p.dwells, &clusters), &config);
        below += usize::from(all.iter().any(|s| s.p_adjusted <= 0.05));
    }
    assert!(below <= 8, "{below} of 60");
}

#[test]
fn with_two_sockets_the_poses_are_the_groups() {
    let mut p = small(5);
    for (i, d) in p.dwells.iter_mut().enumerate() {
        d.place = Some(format!("hole_{}", i % 2));
    }
    let groups = crate::weigh::crossval::by_place(&p);
    assert!(groups.len() >= 8, "two sockets are no sample, their poses are: {}", groups.len());
    let of = |i: usize| groups.iter().position(|g| g.scored.contains(&i)).unwrap();
    for i in 0..p.dwells.len() {
        for j in 0..i {
            let apart = p.dwells[i].joint_rad.iter().zip(&p.dwells[j].joint_rad);
            if apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-9 {
                assert_eq!(of(i), of(j), "visits {i} and {j} to one pose tell of one another");
            }
        }
    }
}
