//! How probable the errors of dwells are that a fit did not see: the declared noise, and beside it what no model explains.
//!
//! ```text
//! e ~ t_5(0, f^2 Sigma + s^2 I),   Sigma the declared covariance of a position [m^2]
//! ```
//!
//! The discrepancy s is isotropic and has one size for what is tracked and one for what is seated. Where the errors are smaller than
//! what is declared, f below 1 says so and s is 0: one path of sizes, from noise declared too large to errors far beyond it. A
//! group of dwells is judged with the size that says most of the others. Student's t with five degrees of freedom keeps single
//! accidents from deciding.

use crate::problem::{Part, Problem};
use nalgebra::DVector;

/// Degrees of freedom of Student's t.
const T_DOF: f64 = 5.0;
/// Sizes on the path a doubling.
const A_DOUBLING: f64 = 3.0;
/// Steps of the path below the declared noise, and above it: from a thirtieth of it to a thousand times it.
const BELOW: i32 = 15;
const ABOVE: [i32; 2] = [-9, 30];
/// Of the declared variances of a position, those below this share of the largest are of a direction that was not measured.
const NOT_MEASURED: f64 = 1e-12;

/// Size of the noise that a kind of points has beside, or in place of, what is declared for them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Size {
    /// Times the declared standard deviation.
    pub declared: f64,
    /// Standard deviation beside it, per axis [m].
    pub beside_m: f64,
}

/// ln densities of errors in every group, at every size of the path.
struct Kind {
    sizes: Vec<Size>,
    /// Group by size.
    ln: Vec<Vec<f64>>,
}

/// ln predictive density of every group of dwells, from whitened rows of errors that were predicted without each dwell.
pub(crate) fn ln_by_group(problem: &Problem, left_out: &DVector<f64>, groups: &[Vec<usize>]) -> Vec<f64> {
    let mut all = vec![0.0; groups.len()];
    for tracked in [true, false] {
        if let Some(kind) = Kind::of(problem, left_out, groups, tracked) {
            let at = kind.sizes_by_others();
            all.iter_mut().enumerate().for_each(|(g, ln)| *ln += kind.ln[g][at[g]]);
        }
    }
    all
}

impl Kind {
    /// Of the points that are tracked, or of those that are not; none where there are none.
    fn of(problem: &Problem, left_out: &DVector<f64>, groups: &[Vec<usize>], tracked: bool) -> Option<Kind> {
        let errors: Vec<Vec<Axes>> = groups
            .iter()
            .map(|dwells| {
                let of = |i: &usize| {
                    let d = &problem.dwells[*i];
                    let own = left_out.rows(d.first_row, d.rows).into_owned();
                    let parts = d.parts.iter().filter(|part| part.tracked == tracked);
                    parts.map(|part| principal_axis_errors(part, &own)).collect::<Vec<_>>()
                };
                dwells.iter().flat_map(of).collect()
            })
            .collect();
        let variances: Vec<f64> = errors.iter().flatten().flatten().map(|(_, variance)| *variance).collect();
        if variances.is_empty() {
            return None;
        }
        let usual_m = (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
        let step = |k: i32| 2f64.powf(f64::from(k) / A_DOUBLING);
        let below = (-BELOW..=0).map(|k| Size { declared: step(k), beside_m: 0.0 });
        let above = (ABOVE[0]..=ABOVE[1]).map(|k| Size { declared: 1.0, beside_m: step(k) * usual_m });
        let sizes: Vec<Size> = below.chain(above).collect();
        let of_group = |errors: &Vec<Axes>| sizes.iter().map(|size| ln_density(errors, *size)).collect();
        let ln = errors.iter().map(of_group).collect();
        Some(Kind { sizes, ln })
    }

    /// The size for each group that says most of all other groups.
    fn sizes_by_others(&self) -> Vec<usize> {
        let total: Vec<f64> = (0..self.sizes.len()).map(|k| self.ln.iter().map(|g| g[k]).sum()).collect();
        let best = |own: &Vec<f64>| {
            let others = |k: &usize| total[*k] - own[*k];
            (0..total.len()).max_by(|a, b| others(a).total_cmp(&others(b))).unwrap_or(0)
        };
        self.ln.iter().map(best).collect()
    }
}

/// Error along each axis of the declared covariance [m], and its declared variance [m^2].
type Axes = Vec<(f64, f64)>;

fn principal_axis_errors(part: &Part, rows: &DVector<f64>) -> Axes {
    let error_m = &part.metres * rows;
    let covariance_m2 = &part.metres * part.metres.transpose();
    let decomposed = covariance_m2.symmetric_eigen();
    let largest = decomposed.eigenvalues.max();
    let along = decomposed.eigenvectors.tr_mul(&error_m);
    let measured = |(_, variance): &(f64, f64)| *variance > NOT_MEASURED * largest;
    along.iter().copied().zip(decomposed.eigenvalues.iter().copied()).filter(measured).collect()
}

fn ln_density(errors: &[Axes], size: Size) -> f64 {
    let of = |axes: &Axes| {
        let (mut square, mut ln_det, d) = (0.0, 0.0, axes.len() as f64);
        for (error_m, variance_m2) in axes {
            let variance_m2 = size.declared.powi(2) * variance_m2 + size.beside_m.powi(2);
            square += error_m.powi(2) / variance_m2;
            ln_det += variance_m2.ln();
        }
        ln_t_at_0(axes.len()) - 0.5 * ln_det - 0.5 * (T_DOF + d) * (square / T_DOF).ln_1p()
    };
    errors.iter().map(of).sum()
}

/// ln of the density of Student's t in `d` dimensions at 0 with unit scale: `ln G((5 + d)/2) - ln G(5/2) - d/2 ln(5 pi)`.
fn ln_t_at_0(d: usize) -> f64 {
    const LN: [f64; 4] = [0.0, -0.9686195890547249, -1.8378770664093462, -2.624175098670115];
    LN[d.min(3)]
}

#[cfg(test)]
#[path = "../tests/density.rs"]
mod tests;
