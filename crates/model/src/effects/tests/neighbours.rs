//! Whether the entries of the catalogue can be told apart where the arm moves widely.

use super::super::{EffectSpec, Session, find};
use super::rig::{observations, paper, ur10};
use crate::Model;
use armcal_core::{Observation, Role};
use nalgebra::{DMatrix, DVector};

/// Noise of the position sensor [m].
const SIGMA_M: f64 = 0.28e-3;
/// A planted effect is worth a verdict from this sum of squares on (notes of the diagnosis, 4.12).
const DETECTABLE: f64 = 14.0;
/// What another entry must leave of the planted one, as a share of its sum of squares: cosine 0.98.
const LEFT: f64 = 0.04;

/// Whitened columns of the geometry with its prior rows, and of each candidate at its typical size.
struct Columns {
    geometry: DMatrix<f64>,
    candidates: Vec<(EffectSpec, DMatrix<f64>)>,
}

impl Columns {
    fn of(model: &Model, observations: &[Observation]) -> Columns {
        let session = Session::of(observations);
        let all = model.with_effects(&model.candidates(&session), &session).expect("all candidates together");
        let p = all.nominal();
        let columns: Vec<usize> = (0..p.len())
            .filter(|k| all.parameters()[*k].free && all.parameters()[*k].role != Role::Effect)
            .collect();
        let data = 3 * observations.len();
        let mut jacobian = DMatrix::zeros(data + columns.len(), p.len());
        for (i, o) in observations.iter().enumerate() {
            let rows = all.residual_with_jacobian(&p, o).1;
            jacobian.view_mut((3 * i, 0), (3, p.len())).copy_from(&rows.rows(0, 3));
        }
        for (k, parameter) in all.parameters().iter().enumerate() {
            jacobian.column_mut(k).scale_mut(parameter.prior_sigma.unwrap_or(0.02) / SIGMA_M);
        }
        let mut geometry = jacobian.select_columns(&columns);
        for k in 0..columns.len() {
            geometry[(data + k, k)] = 1.0;
        }
        let candidates = all
            .effects()
            .iter()
            .map(|effect| {
                let first = effect.parameters.start;
                (effect.spec.clone(), jacobian.columns(first, effect.amplitudes).into_owned())
            })
            .collect();
        Columns { geometry, candidates }
    }
}

/// What columns leave of a vector. They may depend on each other: a ridge far below the noise keeps them solvable.
fn left(columns: &DMatrix<f64>, y: &DVector<f64>) -> DVector<f64> {
    let mut normal = columns.tr_mul(columns);
    for k in 0..normal.nrows() {
        normal[(k, k)] += 1e-9 * normal[(k, k)] + 1e-12;
    }
    let coefficients = normal.cholesky().expect("a ridge makes it definite").solve(&columns.tr_mul(y));
    y - columns * coefficients
}

fn project(geometry: &DMatrix<f64>, columns: &DMatrix<f64>) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> =
        columns.column_iter().map(|column| left(geometry, &column.into_owned())).collect();
    DMatrix::from_columns(&columns)
}

fn declared(a: &str, b: &str) -> bool {
    let says = |a: &str, b: &str| find(a).is_some_and(|kind| kind.confused_with.contains(&b));
    a == b || says(a, b) || says(b, a)
}

#[test]
fn no_wrong_neighbour_explains_a_planted_effect() {
    let mut wrong = Vec::new();
    for (model, count) in [(paper(), 150), (ur10(), 200)] {
        let columns = Columns::of(&model, &observations(&model, count, false));
        let seen: Vec<(EffectSpec, DMatrix<f64>)> = columns
            .candidates
            .iter()
            .map(|(spec, own)| (spec.clone(), project(&columns.geometry, own)))
            .collect();
        for (planted, own) in &seen {
            // Every amplitude at its typical size.
            let y = own.column_sum();
            let whole = y.norm_squared();
            if whole < DETECTABLE {
                continue;
            }
            assert!(left(own, &y).norm_squared() < 1e-6 * whole, "{planted} does not explain itself");
            for (other, columns) in &seen {
                let share = left(columns, &y).norm_squared() / whole;
                if share < LEFT && !declared(&planted.kind, &other.kind) {
                    wrong.push(format!("{planted} by {other}: {share:.4}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
