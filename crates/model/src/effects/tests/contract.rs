//! What every entry of the catalogue promises; a new entry is tested without a new line here.

use super::super::{EffectSpec, Session, catalogue};
use super::rig::{displaced, observations, observe, panda, paper, scara, specs, ur10};
use crate::Model;
use armcal_core::{Observation, Role};
use nalgebra::{DMatrix, DVector};

const HEADINGS: [&str; 6] = [
    "# What moves",
    "# Equation",
    "# Parameters and units",
    "# Signature in the data",
    "# Not to be confused with",
    "# Source",
];

fn with(model: &Model, spec: &EffectSpec, session: &Session) -> Model {
    model.with_effects(std::slice::from_ref(spec), session).expect("a spec that can be placed")
}

#[test]
fn the_documentation_has_the_fixed_headings_in_order() {
    for kind in catalogue() {
        let docs = kind.docs();
        let places: Vec<Option<usize>> = HEADINGS.iter().map(|heading| docs.find(heading)).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{}: {places:?}", kind.name);
        assert!(!kind.summary.is_empty() && catalogue().iter().filter(|k| k.name == kind.name).count() == 1);
        for other in kind.confused_with {
            assert!(super::super::find(other).is_some(), "{}: there is no {other}", kind.name);
        }
    }
}

#[test]
fn parameters_have_units_bounds_priors_and_meaning() {
    for model in [paper(), ur10(), scara(), panda()] {
        let observations = observations(&model, 60, false);
        let session = Session::of(&observations);
        for spec in specs(&model, &observations) {
            let extended = with(&model, &spec, &session);
            let effect = &extended.effects()[0];
            for (k, p) in extended.parameters()[effect.parameters.clone()].iter().enumerate() {
                assert!(p.name.starts_with(&format!("{spec}.")) && !p.meaning.is_empty(), "{}", p.name);
                assert!(
                    p.role == Role::Effect
                        && p.lower < p.nominal.max(p.lower + 1e-300)
                        && p.nominal <= p.upper
                );
                if k < effect.amplitudes {
                    assert!(p.free && p.nominal == 0.0 && p.upper.is_finite(), "{}", p.name);
                    let sigma = p.prior_sigma.expect("an amplitude has a prior");
                    assert!(sigma > 0.0 && 3.0 * sigma < p.upper && p.lower == -p.upper, "{}", p.name);
                } else {
                    assert!(!p.free, "{}", p.name);
                }
            }
        }
    }
}

#[test]
fn zero_amplitude_is_exactly_rigid() {
    for model in [paper(), ur10(), scara(), panda()] {
        let observations = observations(&model, 40, false);
        let session = Session::of(&observations);
        let all = model.with_effects(&specs(&model, &observations), &session).expect("specs together");
        let p = displaced(&model, 3, 1.0);
        let mut extended = p.clone();
        extended.extend(&all.nominal()[p.len()..]);
        for o in &observations {
            let (rigid, columns) = model.residual_with_jacobian(&p, o);
            let (residual, all_columns) = all.residual_with_jacobian(&extended, o);
            assert_eq!(residual, rigid);
            assert_eq!(all.residual(&extended, o), rigid);
            assert_eq!(all_columns.columns(0, p.len()), columns.columns(0, p.len()));
            assert_eq!(all.joint_jacobian(&extended, o), model.joint_jacobian(&p, o));
        }
    }
}

#[test]
fn the_jacobian_is_the_slope_at_amplitudes_that_are_not_zero() {
    for model in [paper(), ur10(), scara(), panda()] {
        let observations = observations(&model, 12, false);
        let session = Session::of(&observations);
        for spec in specs(&model, &observations) {
            let extended = with(&model, &spec, &session);
            let p = displaced(&extended, 5, 1.0);
            for o in &observations {
                let (_, jacobian) = extended.residual_with_jacobian(&p, o);
                for (k, parameter) in extended.parameters().iter().enumerate() {
                    // Units range from m to 1/K and turns: the step follows the size of the parameter, of a shape its value.
                    let shape = Some(parameter.nominal.abs()).filter(|value| *value > 0.0);
                    let h = 1e-3 * parameter.prior_sigma.or(shape).unwrap_or(0.1).min(0.1);
                    let moved = |step: f64| {
                        let mut p = p.clone();
                        p[k] += step;
                        DVector::from_iterator(jacobian.nrows(), extended.residual(&p, o).rows())
                    };
                    let slope = (moved(h) - moved(-h)) / (2.0 * h);
                    let column = jacobian.column(k);
                    let error = (slope - column).norm();
                    let scale = column.norm().max(1e-3 / parameter.prior_sigma.unwrap_or(0.1));
                    assert!(error < 1e-5 * scale, "{spec}: {}: {error:e} of {scale:e}", parameter.name);
                }
            }
        }
    }
}

/// Linear least squares with priors at one point: residual rows, then one row for each prior.
fn rows(
    model: &Model,
    p: &[f64],
    observations: &[Observation],
    sigma_m: f64,
) -> (DMatrix<f64>, DVector<f64>) {
    let free: Vec<usize> = (0..p.len()).filter(|k| model.parameters()[*k].free).collect();
    let data = 3 * observations.len();
    let mut a = DMatrix::zeros(data + free.len(), free.len());
    let mut b = DVector::zeros(data + free.len());
    for (i, o) in observations.iter().enumerate() {
        let (residual, jacobian) = model.residual_with_jacobian(p, o);
        b.fixed_rows_mut::<3>(3 * i).copy_from(&(residual.position_m / sigma_m));
        for (column, k) in free.iter().enumerate() {
            a.fixed_view_mut::<3, 1>(3 * i, column)
                .copy_from(&(jacobian.fixed_view::<3, 1>(0, *k) / -sigma_m));
        }
    }
    for (column, k) in free.iter().enumerate() {
        let parameter = &model.parameters()[*k];
        let weight = 1.0 / parameter.prior_sigma.unwrap_or(1.0);
        a[(data + column, column)] = weight;
        b[data + column] = weight * (parameter.nominal - p[*k]);
    }
    (a, b)
}

#[test]
fn a_planted_value_is_recovered() {
    for (model, count) in [(paper(), 60), (ur10(), 90)] {
        let template = observations(&model, count, false);
        let session = Session::of(&template);
        for spec in specs(&model, &template) {
            let extended = with(&model, &spec, &session);
            let effect = extended.effects()[0].parameters.clone();
            let mut truth = extended.nominal();
            truth[effect.clone()].copy_from_slice(&displaced(&extended, 11, 1.0)[effect.clone()]);
            let mut data = template.clone();
            observe(&extended, &truth, &mut data);
            let mut p = extended.nominal();
            let sigma_m = 1e-6;
            let mut spread = DVector::zeros(0);
            for _ in 0..6 {
                let (a, b) = rows(&extended, &p, &data, sigma_m);
                let normal = (a.tr_mul(&a)).cholesky().expect("priors make it definite");
                let step = normal.solve(&a.tr_mul(&b));
                spread = normal.inverse().diagonal();
                let free: Vec<usize> = (0..p.len()).filter(|k| extended.parameters()[*k].free).collect();
                free.iter().zip(step.iter()).for_each(|(k, step)| p[*k] += step);
            }
            let free: Vec<usize> = (0..p.len()).filter(|k| extended.parameters()[*k].free).collect();
            for (k, variance) in free.iter().zip(spread.iter()).filter(|(k, _)| effect.contains(k)) {
                let parameter = &extended.parameters()[*k];
                let prior = parameter.prior_sigma.expect("an amplitude has a prior");
                let error = (p[*k] - truth[*k]).abs();
                // What the data do not determine stays within its posterior; what they do is found.
                assert!(error < 1e-3 * prior + 4.0 * variance.sqrt(), "{}: {error:e}", parameter.name);
            }
        }
    }
}
