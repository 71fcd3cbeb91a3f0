//! The error to expect from noise alone.

use nalgebra::Matrix3;

/// Nodes and weights of Gauss-Legendre quadrature with 8 points on [-1, 1], positive half
/// (Abramowitz and Stegun 1964, table 25.4).
const GAUSS_LEGENDRE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

/// `E |e|` for `e ~ N(0, covariance)` [m].
///
/// With e = Sigma^(1/2) r u, r a chi variable of three degrees of freedom and u uniform on the sphere,
/// `E |e| = sqrt(8/pi) mean_u sqrt(u' Sigma u)`; the mean over one octant in the axes of Sigma by the product of two
/// composite Gauss-Legendre rules of 16 points (relative error below 1e-4 even for a covariance of rank one).
/// Negative eigenvalues count as zero; NaN gives NaN.
pub fn expected_norm_m(covariance_m2: &Matrix3<f64>) -> f64 {
    if !covariance_m2.iter().all(|v| v.is_finite()) {
        return f64::NAN;
    }
    let mut variance = covariance_m2.symmetric_eigenvalues().map(|v| v.max(0.0));
    // The polar axis along the largest variance: there the integrand is smoothest.
    variance.as_mut_slice().sort_by(f64::total_cmp);
    let mut mean = 0.0;
    for (height, height_weight) in quadrature_nodes() {
        let across = 1.0 - height * height;
        for (turn, turn_weight) in quadrature_nodes() {
            let cos2 = (turn * std::f64::consts::FRAC_PI_2).cos().powi(2);
            let square =
                variance[2] * height * height + across * (variance[1] * cos2 + variance[0] * (1.0 - cos2));
            mean += height_weight * turn_weight * square.sqrt();
        }
    }
    (8.0 / std::f64::consts::PI).sqrt() * mean
}

/// Sixteen nodes and weights on [0, 1]: the rule of 8 on each half.
fn quadrature_nodes() -> impl Iterator<Item = (f64, f64)> {
    GAUSS_LEGENDRE.into_iter().flat_map(|(x, w)| {
        [-x, x].into_iter().flat_map(move |x| [0.0, 0.5].map(|from| (from + 0.25 * (1.0 + x), 0.25 * w)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms() {
        let pi = std::f64::consts::PI;
        // Isotropic: Maxwell, sqrt(8/pi) s. Two axes: Rayleigh, sqrt(pi/2) s. One axis: half normal, sqrt(2/pi) s.
        for (diagonal, expected) in [
            ([4.0, 4.0, 4.0], 2.0 * (8.0 / pi).sqrt()),
            ([4.0, 0.0, 4.0], 2.0 * (pi / 2.0).sqrt()),
            ([0.0, 4.0, 0.0], 2.0 * (2.0 / pi).sqrt()),
        ] {
            let found = expected_norm_m(&Matrix3::from_diagonal(&diagonal.into()));
            assert!((found / expected - 1.0).abs() < 1e-4, "{diagonal:?}: {found} {expected}");
        }
    }

    #[test]
    fn general_covariance_matches_scipy() {
        // scipy 1.17.1: integrate.dblquad of sqrt(u' Sigma u) over the octant, epsabs 1e-12; 1e7 numpy draws agree.
        let found = expected_norm_m(&Matrix3::from_diagonal(&[1.0, 4.0, 9.0].into()));
        assert!((found - 3.3530808038).abs() < 1e-5, "{found}");
    }
}
