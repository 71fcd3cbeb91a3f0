//! The loss on the norm of a whitened observation.
//!
//! Huber (1964) on the *norm*, so that a rotation of the measuring frame changes nothing:
//!
//! | | rho(u) | weight rho'(u)/u |
//! |---|---|---|
//! | u <= c | u^2/2 | 1 |
//! | u > c | c u - c^2/2 | c/u |
//!
//! The constant that is 95 % efficient under Gaussian noise depends on the dimension d of the vector: efficiency
//! `(E psi')^2 / (E |psi|^2 / d)` with `psi' = 1` inside and `(d-1)/d c/u` outside (mean over directions); it is 0.95
//! for c = 1.345 (d = 1), 1.62799 (d = 3), 1.86934 (d = 6), by quadrature over the chi distribution.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Group loss for blocks of one dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Loss {
    /// rho = u^2 / 2.
    Square,
    /// Huber with this constant.
    Huber(f64),
}

impl Loss {
    /// Huber's loss for `dimension`-vectors from the constant for one dimension.
    pub fn huber(c_one_dimension: f64, dimension: usize) -> Loss {
        // Positions have 3 rows, poses 6; 1 and 2 serve planar problems.
        let factor = match dimension {
            0 | 1 => 1.0,
            2 => 1.501_141_08 / 1.344_997_51,
            3 => 1.627_987_99 / 1.344_997_51,
            _ => 1.869_337_73 / 1.344_997_51,
        };
        Loss::Huber(c_one_dimension * factor)
    }

    pub fn rho(self, u: f64) -> f64 {
        match self {
            Loss::Huber(c) if u > c => c * u - 0.5 * c * c,
            _ => 0.5 * u * u,
        }
    }

    pub fn weight(self, u: f64) -> f64 {
        match self {
            Loss::Huber(c) if u > c => c / u,
            _ => 1.0,
        }
    }

    /// Mean over directions of the derivative of psi, for a vector of norm `u` in `dimension` dimensions.
    pub fn mean_curvature(self, u: f64, dimension: usize) -> f64 {
        match self {
            Loss::Huber(c) if u > c => (dimension as f64 - 1.0) / dimension as f64 * c / u,
            _ => 1.0,
        }
    }

    /// `E |psi|^2 / d` under standard Gaussian noise in d dimensions.
    pub fn gaussian_psi_square(self, dimension: usize) -> f64 {
        let d = dimension as f64;
        match self {
            Loss::Square => 1.0,
            Loss::Huber(c) => {
                // E[r^2; r <= c] = d P(chi2_{d+2} <= c^2).
                chi_square_cdf(c * c, d + 2.0) + c * c / d * (1.0 - chi_square_cdf(c * c, d))
            }
        }
    }
}

/// Median of the chi distribution: what the norm of a whitened block should be in half of the cases.
pub(crate) fn chi_median(dimension: usize) -> f64 {
    match dimension {
        1 => 0.674_489_750_196_082,
        2 => 1.177_410_022_515_475,
        3 => 1.538_172_254_455_052,
        6 => 2.312_600_403_754_855,
        // Wilson and Hilferty (1931), good to 1e-3 from 4 on.
        d => (d as f64 * (1.0 - 2.0 / (9.0 * d as f64)).powi(3)).sqrt(),
    }
}

fn chi_square_cdf(x: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom).map_or(f64::NAN, |d| d.cdf(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_the_derivative_of_the_loss_over_u() {
        for loss in [Loss::Square, Loss::huber(1.345, 3)] {
            for u in [0.3, 1.0, 1.7, 2.5, 40.0] {
                let h = 1e-6 * u;
                let slope = (loss.rho(u + h) - loss.rho(u - h)) / (2.0 * h);
                assert!((slope / u - loss.weight(u)).abs() < 1e-7, "{loss:?} at {u}");
            }
        }
    }

    #[test]
    fn efficiency_is_95_percent_in_three_dimensions() {
        // Midpoint quadrature over the chi density with 3 degrees of freedom, sqrt(2/pi) r^2 exp(-r^2/2).
        let loss = Loss::huber(1.345, 3);
        let (mut psi_square, mut curvature) = (0.0, 0.0);
        let h = 1e-4;
        for i in 0..100_000 {
            let r = (i as f64 + 0.5) * h;
            let mass = (2.0 / std::f64::consts::PI).sqrt() * r * r * (-0.5 * r * r).exp() * h;
            psi_square += mass * (loss.weight(r) * r).powi(2) / 3.0;
            curvature += mass * loss.mean_curvature(r, 3);
        }
        assert!((psi_square - loss.gaussian_psi_square(3)).abs() < 1e-6);
        let efficiency = curvature * curvature / psi_square;
        assert!((efficiency - 0.95).abs() < 1e-4, "{efficiency}");
    }
}
