//! What the errors of the nominal model do to offset and drift, and how far both may be off.
//!
//! The residuals of the speeds are not noise: the nominal arm is wrong by millimetres and degrees, and its error comes
//! again wherever a path does. So the last step estimates the model's uncertain parameters along with the clocks, each
//! held by its prior; a fifth of a millisecond hangs on a degree. Two things are then left. What the data cannot tell
//! of the model stays in the offset, as large as the priors allow:
//!
//! ```text
//! theta = A^-1 g,   A = N + phi P,   Cov = Cov_data + phi^2 A^-1 P A^-1
//! ```
//! with the normal equations `N`, `g`, the precision `P` of the priors, and the noise `phi`, which is the one that
//! predicts movements left out best. The noise itself is correlated for as long as a movement lasts and, where stamps
//! wander, for longer: `Cov_data` comes from leaving out one movement at a time, or neighbouring ones together where
//! that shows more (cluster jackknife, CR3; MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023, eq. 10).

use armcal_core::robust::mad_sigma;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector4};

use super::deviated::Deviations;
use super::fine::{MIN_MOVEMENTS, Problem, Row, Start};

/// Largest last step [s]: beyond a peak of the speed the linearisation means nothing.
const LONGEST_STEP_S: f64 = 0.1;

/// Factors on the variance of the residuals that are tried for the noise: those of neighbouring points share the kernel.
const NOISE_FACTORS: [f64; 8] = [3.0, 1e1, 3e1, 1e2, 3e2, 1e3, 3e3, 1e4];

/// Neighbouring movements that are left out together.
const TOGETHER: [usize; 3] = [1, 2, 4];

/// The fine estimate. Offset at the reference time, drift about it.
#[derive(Debug, Clone)]
pub(crate) struct Fine {
    pub offset_s: f64,
    pub drift: f64,
    /// Covariance of (offset [s], drift); of the offset alone where the drift was not estimated.
    pub covariance: Matrix2<f64>,
    /// What each movement alone would add to the offset, in order of time.
    pub movements: Vec<MovementOffset>,
    /// The uncertain parameters, in standard deviations of their priors.
    pub parameters: Vec<f64>,
}

/// What one movement alone would add to the offset.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MovementOffset {
    /// First and last sensor time of it [s].
    pub from_s: f64,
    pub to_s: f64,
    /// Its offset less that of all [s].
    pub offset_s: f64,
    /// How well it determines one, in a unit that all share.
    pub weight: f64,
}

/// Normal equations of one movement, and its weighted squares.
struct Part {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
}

/// One more step from a state, with the uncertain parameters: offset, scaled drift, gain and level, then one column an
/// uncertain parameter.
pub(crate) struct Step {
    /// Where it leads, at the reference time.
    pub to: Start,
    /// The uncertain parameters after it, in standard deviations.
    pub parameters: Vec<f64>,
    step: DVector<f64>,
    inverse: DMatrix<f64>,
    /// Time from the reference to the far end of the recording [s].
    half_s: f64,
    parts: Vec<Part>,
    times_s: Vec<(f64, f64)>,
    whole: DMatrix<f64>,
    gradient: DVector<f64>,
    /// The uncertain parameters before the step, which the priors pull back.
    so_far: DVector<f64>,
    noise: f64,
}

impl Step {
    /// The step from `state`. `None` for too few movements, or where the equations are singular.
    pub(crate) fn of(
        problem: &Problem<'_>,
        state: &Vector4<f64>,
        deviations: Option<&Deviations>,
    ) -> Option<Step> {
        let rows = problem.weighted_rows(state);
        let by_movement: Vec<&[Row]> = rows.chunk_by(|a, b| a.point.movement == b.point.movement).collect();
        if by_movement.len() < MIN_MOVEMENTS {
            return None;
        }
        let parts: Vec<Part> =
            by_movement.iter().map(|rows| normal_equations(state, rows, deviations)).collect();
        let size = parts[0].gradient.len();
        let (mut whole, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for part in &parts {
            whole += &part.normal;
            gradient += &part.gradient;
        }
        if problem.fixed_drift.is_some() {
            whole[(1, 1)] = 1.0;
        }
        let so_far = DVector::from_vec(deviations.map_or_else(Vec::new, |d| d.so_far.clone()));
        let ends = |rows: &[Row]| (rows[0].point.t_s, rows[rows.len() - 1].point.t_s);
        let times_s = by_movement.iter().map(|rows| ends(rows)).collect();
        let moving = rows.iter().filter(|r| r.point.moving);
        let variance = mad_sigma(&moving.map(|r| r.residual).collect::<Vec<_>>()).powi(2);
        let mut all = Step {
            to: Start { offset_s: state.x, drift: state.y / problem.half_s },
            parameters: Vec::new(),
            step: DVector::zeros(size),
            inverse: DMatrix::zeros(size, size),
            half_s: problem.half_s,
            parts,
            times_s,
            whole,
            gradient,
            so_far,
            noise: variance,
        };
        if size > 4 {
            let tried = NOISE_FACTORS.map(|factor| {
                all.noise = factor * variance;
                (all.noise, all.left_out(1).map_or(f64::INFINITY, |each| all.squares_left_out(&each)))
            });
            all.noise = tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?.0;
        }
        all.taken(problem, state)
    }

    fn taken(mut self, problem: &Problem<'_>, state: &Vector4<f64>) -> Option<Step> {
        self.inverse = self.held().try_inverse()?;
        self.step = &self.inverse * self.pull();
        if self.step[0].hypot(self.step[1]) > LONGEST_STEP_S || !self.step.iter().all(|v| v.is_finite()) {
            return None;
        }
        self.to = Start {
            offset_s: state.x + self.step[0],
            drift: problem.fixed_drift.unwrap_or((state.y + self.step[1]) / self.half_s),
        };
        self.parameters =
            self.so_far.iter().zip(self.step.iter().skip(4)).map(|(was, by)| was + by).collect();
        Some(self)
    }

    /// The estimate after the step, with its errors.
    pub(crate) fn fine(self) -> Option<Fine> {
        let scale = Matrix2::new(1.0, 0.0, 0.0, 1.0 / self.half_s);
        Some(Fine {
            offset_s: self.to.offset_s,
            drift: self.to.drift,
            covariance: scale * self.covariance()? * scale,
            movements: self.movements()?,
            parameters: self.parameters,
        })
    }

    /// `N` with the precision of the priors.
    fn held(&self) -> DMatrix<f64> {
        let mut held = self.whole.clone();
        for k in 4..held.nrows() {
            held[(k, k)] += self.noise.max(f64::MIN_POSITIVE);
        }
        held
    }

    /// The pull of data and priors.
    fn pull(&self) -> DVector<f64> {
        let mut pull = self.gradient.clone();
        for (k, so_far) in self.so_far.iter().enumerate() {
            pull[4 + k] -= self.noise * so_far;
        }
        pull
    }

    /// The solution without each `together` neighbouring movements in turn.
    fn left_out(&self, together: usize) -> Option<Vec<DVector<f64>>> {
        let (held, pull) = (self.held(), self.pull());
        let without = |parts: &[Part]| {
            let (mut held, mut pull) = (held.clone(), pull.clone());
            for part in parts {
                held -= &part.normal;
                pull -= &part.gradient;
            }
            Some(held.cholesky()?.solve(&pull))
        };
        self.parts.chunks(together).map(without).collect()
    }

    /// Weighted squares that movements have under the solutions that never saw them.
    fn squares_left_out(&self, solutions: &[DVector<f64>]) -> f64 {
        let one =
            |(p, x): (&Part, &DVector<f64>)| p.squares - 2.0 * p.gradient.dot(x) + (&p.normal * x).dot(x);
        self.parts.iter().zip(solutions).map(one).sum()
    }

    fn covariance(&self) -> Option<Matrix2<f64>> {
        let Step { inverse, step, .. } = self;
        let unknown = inverse.rows(0, 2).columns(4, inverse.ncols() - 4) * self.noise;
        let unknown = &unknown * unknown.transpose();
        let mut data = Matrix2::zeros();
        for together in TOGETHER {
            let groups = self.parts.len().div_ceil(together) as f64;
            if together > 1 && groups < MIN_MOVEMENTS as f64 {
                break;
            }
            let mut seen = Matrix2::zeros();
            for left_out in self.left_out(together)? {
                let change = left_out.fixed_rows::<2>(0) - step.fixed_rows::<2>(0);
                seen += change * change.transpose();
            }
            seen *= (groups - 1.0) / groups * student_widening(groups - 1.0).powi(2);
            // Neighbouring movements share the error of their stamps: then more together show more.
            for k in 0..2 {
                if seen[(k, k)] > data[(k, k)] {
                    data[(k, k)] = seen[(k, k)];
                    (data[(0, 1)], data[(1, 0)]) = (seen[(0, 1)], seen[(1, 0)]);
                }
            }
        }
        // The larger variances of two need not have either covariance.
        let most = 0.95 * (data[(0, 0)] * data[(1, 1)]).sqrt();
        let both = data[(0, 1)].clamp(-most, most);
        (data[(0, 1)], data[(1, 0)]) = (both, both);
        let seen = data + unknown.fixed_view::<2, 2>(0, 0);
        // Paths that repeat hide from the jackknife what they cannot tell of the offset; the noise that predicts best
        // does not.
        let told = inverse[(0, 0)] * self.noise;
        let widened = Matrix2::from_diagonal(&Vector2::new((told / seen[(0, 0)]).max(1.0).sqrt(), 1.0));
        Some(widened * seen * widened)
    }

    /// What each movement alone would add to the offset after the step, all but the clocks being as it says.
    fn movements(&self) -> Option<Vec<MovementOffset>> {
        // How gain, level and model follow a change of the offset of one unit.
        let mut others = self.held();
        for k in 0..others.nrows() {
            for c in 0..2 {
                others[(k, c)] = 0.0;
                others[(c, k)] = 0.0;
            }
        }
        (others[(0, 0)], others[(1, 1)]) = (1.0, 1.0);
        let mut pull = self.whole.column(0).into_owned();
        (pull[0], pull[1]) = (0.0, 0.0);
        let mut along = -others.lu().solve(&pull)?;
        along[0] = 1.0;
        let one = |(part, &(from_s, to_s)): (&Part, &(f64, f64))| {
            let weight = (&part.normal * &along).dot(&along);
            let left = &part.gradient - &part.normal * &self.step;
            MovementOffset { from_s, to_s, offset_s: left.dot(&along) / weight, weight }
        };
        Some(self.parts.iter().zip(&self.times_s).map(one).filter(|m| m.offset_s.is_finite()).collect())
    }
}

fn normal_equations(state: &Vector4<f64>, rows: &[Row], deviations: Option<&Deviations>) -> Part {
    let uncertain = deviations.map_or(0, |d| d.so_far.len());
    let (mut jacobian, mut weighted) = (DMatrix::zeros(rows.len(), 4 + uncertain), Vec::new());
    let (mut rates, mut shares, mut squares) = (vec![0.0; uncertain], Vec::new(), 0.0);
    for (k, r) in rows.iter().enumerate() {
        jacobian.fixed_view_mut::<1, 4>(k, 0).tr_copy_from(&r.jacobian);
        if let Some(d) = deviations {
            d.rates(r.robot_s, &mut shares, &mut rates);
            rates.iter().enumerate().for_each(|(column, rate)| jacobian[(k, 4 + column)] = state.z * rate);
        }
        squares += r.weight * r.residual * r.residual;
        weighted.push(r.weight * r.residual);
    }
    let gradient = jacobian.tr_mul(&DVector::from_vec(weighted));
    for (k, r) in rows.iter().enumerate() {
        jacobian.row_mut(k).scale_mut(r.weight.sqrt());
    }
    // The blocked product: `tr_mul` takes a dot product for each entry.
    Part { normal: jacobian.transpose() * jacobian, gradient, squares }
}

/// Ratio of the 97.5 % points of Student's t and of the normal distribution (Cornish and Fisher's
/// expansion; within 1 % from three degrees of freedom on).
fn student_widening(free: f64) -> f64 {
    let v = free.max(1.0);
    1.0 + 1.2101 / v + 1.4402 / (v * v) + 1.3 / v.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_widening_matches_the_table() {
        // t(0.975): 3 -> 3.1824, 5 -> 2.5706, 10 -> 2.2281, 30 -> 2.0423.
        for (free, t) in [(3.0, 3.1824), (5.0, 2.5706), (10.0, 2.2281), (30.0, 2.0423)] {
            assert!((student_widening(free) * 1.959_964 / t - 1.0).abs() < 0.01, "{free}");
        }
    }
}
