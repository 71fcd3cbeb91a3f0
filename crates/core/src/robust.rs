//! Order statistics used by several crates. Non-finite values are ignored throughout.

/// Scale that makes the median absolute deviation estimate a normal standard deviation.
pub const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// Median of the finite values; NaN when there are none.
pub fn median(values: &[f64]) -> f64 {
    percentile(values, 0.5)
}

/// Median absolute deviation from the median, scaled to estimate a normal standard deviation.
pub fn mad_sigma(values: &[f64]) -> f64 {
    let centre = median(values);
    let deviations: Vec<f64> = values.iter().map(|v| (v - centre).abs()).collect();
    MAD_TO_SIGMA * median(&deviations)
}

/// The `p`-quantile (0 to 1) of the finite values, linearly interpolated between order statistics
/// (Hyndman and Fan 1996, type 7). NaN when there are none.
pub fn percentile(values: &[f64], p: f64) -> f64 {
    let mut finite = Vec::with_capacity(values.len());
    finite.extend(values.iter().copied().filter(|v| v.is_finite()));
    percentile_in(&mut finite, p)
}

/// The same of values that are all finite, without a copy of them: they change places.
pub fn percentile_in(finite: &mut [f64], p: f64) -> f64 {
    if finite.is_empty() {
        return f64::NAN;
    }
    let at = p.clamp(0.0, 1.0) * (finite.len() - 1) as f64;
    let below = at.floor();
    // Selecting is linear where sorting is not: recordings have millions of rows.
    let (_, &mut value, behind) = finite.select_nth_unstable_by(below as usize, f64::total_cmp);
    let next = behind.iter().copied().min_by(f64::total_cmp).unwrap_or(value);
    value + (at - below) * (next - value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate_like_numpy() {
        // numpy.percentile([1, 2, 3, 4], [50, 95]) = 2.5, 3.85
        let v = [4.0, 1.0, f64::NAN, 3.0, 2.0];
        assert!((median(&v) - 2.5).abs() < 1e-12);
        assert!((percentile(&v, 0.95) - 3.85).abs() < 1e-12);
        assert!(median(&[]).is_nan());
        let ends = [0.0, 1.0].map(|p| percentile(&v, p));
        assert_eq!(ends, [1.0, 4.0]);
        let mut finite = [4.0, 1.0, 3.0, 2.0];
        for (p, expected) in [(0.95, 3.85), (0.5, 2.5), (0.95, 3.85)] {
            assert!((percentile_in(&mut finite, p) - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn mad_ignores_a_wild_value() {
        // scipy.stats.median_abs_deviation([1, 2, 3, 4, 1000], scale="normal") = 1.482602...
        assert!((mad_sigma(&[1.0, 2.0, 3.0, 4.0, 1000.0]) - MAD_TO_SIGMA).abs() < 1e-12);
    }
}
