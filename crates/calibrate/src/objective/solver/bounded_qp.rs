//! A small strictly convex quadratic programme with bounds, solved exactly.

use super::Curvature;
use nalgebra::DVector;

/// Minimises `d'Hd/2 + g'd` over `lower <= d <= upper`, where `lower <= 0 <= upper`.
///
/// Primal active-set method (Nocedal and Wright, *Numerical Optimization*, 2nd ed., algorithm 16.3, specialised to
/// bounds): solve on the free variables, stop at the first bound met, release the bound with the most wrong
/// multiplier; finite because the objective falls between releases. `None` when H is not positive definite.
pub(crate) fn minimise(
    hessian: &Curvature,
    gradient: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let mut d = DVector::zeros(n);
    let mut held: Vec<bool> = (0..n)
        .map(|i| (lower[i] == 0.0 && gradient[i] > 0.0) || (upper[i] == 0.0 && gradient[i] < 0.0))
        .collect();
    for _ in 0..20 * n + 20 {
        let target = solve_free(hessian, gradient, &d, &held)?;
        match first_bound(&d, &target, lower, upper, &held) {
            Some((i, fraction)) => {
                d += (target - &d) * fraction;
                d[i] = if (d[i] - lower[i]).abs() < (d[i] - upper[i]).abs() { lower[i] } else { upper[i] };
                held[i] = true;
            }
            None => {
                d = target;
                match most_wrong(&(hessian.times(&d) + gradient), &d, lower, &held) {
                    Some(i) => held[i] = false,
                    None => return Some(d),
                }
            }
        }
    }
    Some(d)
}

/// The minimiser over the variables not held, the others where they are.
fn solve_free(
    hessian: &Curvature,
    gradient: &DVector<f64>,
    d: &DVector<f64>,
    held: &[bool],
) -> Option<DVector<f64>> {
    if held.iter().all(|held| *held) {
        return Some(d.clone());
    }
    let fixed = DVector::from_fn(d.len(), |i, _| if held[i] { d[i] } else { 0.0 });
    let right = -(gradient + hessian.times(&fixed));
    let solution = hessian.solve_free(&right, held)?;
    Some(DVector::from_fn(d.len(), |i, _| if held[i] { d[i] } else { solution[i] }))
}

/// The first bound met on the way to the target, and the share of the way that leads to it.
fn first_bound(
    d: &DVector<f64>,
    target: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    held: &[bool],
) -> Option<(usize, f64)> {
    let mut first: Option<(usize, f64)> = None;
    for i in (0..d.len()).filter(|&i| !held[i]) {
        let bound = if target[i] < lower[i] {
            lower[i]
        } else if target[i] > upper[i] {
            upper[i]
        } else {
            continue;
        };
        let fraction = ((bound - d[i]) / (target[i] - d[i])).clamp(0.0, 1.0);
        if first.is_none_or(|(_, best)| fraction < best) {
            first = Some((i, fraction));
        }
    }
    first
}

/// The held variable whose bound the cost would most like to leave.
fn most_wrong(slope: &DVector<f64>, d: &DVector<f64>, lower: &DVector<f64>, held: &[bool]) -> Option<usize> {
    let scale = slope.amax().max(f64::MIN_POSITIVE);
    let mut worst: Option<(usize, f64)> = None;
    for i in (0..d.len()).filter(|&i| held[i]) {
        let outward = if d[i] == lower[i] { slope[i] } else { -slope[i] };
        if outward < -1e-12 * scale && worst.is_none_or(|(_, w)| outward < w) {
            worst = Some((i, outward));
        }
    }
    worst.map(|(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_answer_meets_the_kkt_conditions(
            entries in prop::collection::vec(-1.0..1.0_f64, 36),
            gradient in prop::collection::vec(-3.0..3.0_f64, 6),
            room in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, any::<bool>()), 6),
        ) {
            let root = DMatrix::from_row_slice(6, 6, &entries);
            let hessian = &root * root.transpose() + DMatrix::identity(6, 6) * 1e-3;
            let gradient = DVector::from_vec(gradient);
            let lower = DVector::from_iterator(6, room.iter().map(|r| if r.2 { -r.0 } else { f64::NEG_INFINITY }));
            let upper = DVector::from_iterator(6, room.iter().map(|r| if r.2 { r.1 } else { f64::INFINITY }));
            let curvature = Curvature::Dense(hessian.clone());
            let d = minimise(&curvature, &gradient, &lower, &upper).expect("H is positive definite");
            let slope = &hessian * &d + &gradient;
            let tolerance = 1e-8 * (1.0 + hessian.amax() * d.amax());
            for i in 0..6 {
                prop_assert!(lower[i] <= d[i] && d[i] <= upper[i]);
                prop_assert!(d[i] == lower[i] || slope[i] <= tolerance);
                prop_assert!(d[i] == upper[i] || slope[i] >= -tolerance);
            }
        }
    }
}
