//! Summary of position errors, the way every output states them.

use crate::robust::percentile;

/// Statistics of the norms of position errors [m].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ErrorStats {
    /// Number of observations.
    pub n: usize,
    /// Arithmetic mean of the norms [m].
    pub mean_m: f64,
    /// Root of the mean squared norm [m].
    pub rms_m: f64,
    /// 95th percentile of the norms [m].
    pub p95_m: f64,
    /// Largest norm [m].
    pub max_m: f64,
}

impl ErrorStats {
    /// Summarises error norms [m]. All zero when there are none.
    pub fn of_norms(norms_m: &[f64]) -> ErrorStats {
        if norms_m.is_empty() {
            return ErrorStats::default();
        }
        let n = norms_m.len() as f64;
        ErrorStats {
            n: norms_m.len(),
            mean_m: norms_m.iter().sum::<f64>() / n,
            rms_m: (norms_m.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            p95_m: percentile(norms_m, 0.95),
            max_m: norms_m.iter().fold(0.0, |a: f64, &b| a.max(b)),
        }
    }
}
