//! Statistics of a short, correlated, possibly quantised series: robust mean, effective sample count,
//! standard error of the mean.

use armcal_core::robust::{mad_sigma, median};

use crate::creep;

/// Huber's tuning constant: 95 % efficiency on normal data (Huber 1981, section 4.5).
pub(crate) const HUBER_K: f64 = 1.345;

/// Residuals are clipped here, in robust sigmas, before autocorrelation is estimated.
const CLIP_SIGMAS: f64 = 3.5;

/// Longest series whose autocorrelation is summed directly; longer ones are averaged into blocks first.
const MAX_DIRECT: usize = 4096;

/// A robust mean with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mean {
    /// Huber mean.
    pub mean: f64,
    /// Standard deviation of the values.
    pub spread: f64,
    /// Standard error of the mean: autocorrelation and quantisation included.
    pub sigma: f64,
    /// Independent values these are worth; `None` for a constant column, which does not tell.
    pub effective: Option<f64>,
}

impl Mean {
    /// Mean of a column whose values are quantised in steps of `step` (0 when they are not).
    ///
    /// `sigma^2 = s^2 / n_eff + q^2`, where `q = step / sqrt(12) * exp(-2 pi^2 sigma_x^2 / step^2)` is what
    /// the quantiser leaves after the noise `sigma_x` has dithered it (Widrow and Kollar 2008, section 5);
    /// a constant reading keeps the whole `step / sqrt(12)`.
    pub(crate) fn of(values: &[f64], step: f64) -> Option<Mean> {
        let mean = huber_mean(values, step)?;
        let n = values.len() as f64;
        let residuals = clipped_deviations(values, mean, step);
        let square: f64 = residuals.iter().map(|r| r * r).sum::<f64>() / n;
        let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
        let effective = (square > 0.0).then(|| effective_samples(&residuals));
        // The mean is estimated from the same values, which takes 1 / n_eff of the variance away.
        let variance_of_mean = effective.map_or(0.0, |e| square / (e - 1.0).max(0.5));
        let sigma = (variance_of_mean + quantisation_sigma(step, square.sqrt()).powi(2)).sqrt();
        Some(Mean { mean, spread, sigma, effective })
    }
}

impl Mean {
    /// Mean of a column that creeps along a straight line. The rest may have been anywhere on the way: the line from
    /// first to last is a uniform error, and only what is left beside it is noise.
    pub(crate) fn of_creeping(time_ns: &[i64], values: &[f64], step: f64) -> Option<Mean> {
        let Some((left, crept)) = creep::subtract_line(time_ns, values) else {
            return Mean::of(values, step);
        };
        let level = Mean::of(&left, step)?;
        let spread = level.spread.hypot(crept / 12f64.sqrt());
        Some(Mean { spread, sigma: level.sigma.hypot(crept / 12f64.sqrt()), ..level })
    }
}

/// Huber M-estimate of location by reweighting; `None` without values. The scale is the MAD, but at
/// least `step`, so that a reading flickering between two counts is averaged rather than outvoted.
pub(crate) fn huber_mean(values: &[f64], step: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let mut centre = median(values);
    let limit = HUBER_K * robust_scale(values, step);
    if limit > 0.0 {
        for _ in 0..20 {
            let weight = |v: f64| (limit / (v - centre).abs().max(limit)).min(1.0);
            let (sum, total) = values.iter().fold((0.0, 0.0), |(sum, total), &v| {
                let w = weight(v);
                (sum + w * (v - centre), total + w)
            });
            let move_by = sum / total;
            centre += move_by;
            if move_by.abs() <= 1e-6 * limit {
                break;
            }
        }
    }
    centre.is_finite().then_some(centre)
}

/// Independent samples that a correlated series is worth, `n / tau`, between 1 and `n`.
///
/// `tau` is the larger of two estimates of the integrated autocorrelation time: Geyer's initial monotone
/// sequence (Statistical Science 7, 1992, section 3.3) with one correction for the estimated mean, and that
/// of an AR(1) process with Kendall's bias correction (Biometrika 41, 1954). Short dwells need both: on 100
/// values with rho = 0.9 Geyer alone finds twice the true count.
pub(crate) fn effective_samples(values: &[f64]) -> f64 {
    let blocks = values.len().div_ceil(MAX_DIRECT).max(1);
    let means: Vec<f64> = values.chunks(blocks).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
    let n = means.len() as f64;
    if means.len() < 2 {
        return n;
    }
    let centre = means.iter().sum::<f64>() / n;
    let d: Vec<f64> = means.iter().map(|v| v - centre).collect();
    let variance = autocovariance(&d, 0);
    if variance.is_nan() || variance <= 0.0 {
        return 1.0;
    }
    let tau = geyer_time(&d).max(ar1_time(&d, variance)).clamp(1.0, n);
    if blocks == 1 {
        return n / tau;
    }
    // Blocks lose what is inside them: compare the variance of the overall mean with that of one value.
    let all = values.len() as f64;
    let total = values.iter().map(|v| (v - centre).powi(2)).sum::<f64>() / all;
    (total / (variance * tau / n)).clamp(1.0, all)
}

/// Standard deviation of the error a quantiser of the given step leaves in a mean, when the readings
/// themselves spread by `spread`.
pub(crate) fn quantisation_sigma(step: f64, spread: f64) -> f64 {
    if step <= 0.0 {
        return 0.0;
    }
    let dither = (spread * spread - step * step / 12.0).max(0.0) / (step * step);
    step / 12f64.sqrt() * (-2.0 * std::f64::consts::PI.powi(2) * dither).exp()
}

/// Step of a quantised column: the value of which all increments are multiples. `None` when there is none
/// (continuous readings) or the column never changes.
pub(crate) fn quantisation_step(values: &[f64]) -> Option<f64> {
    let magnitude = values.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
    let rounding = 64.0 * f64::EPSILON * magnitude;
    let increments: Vec<f64> =
        values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| d.is_finite() && *d > rounding).collect();
    let least = increments.iter().copied().fold(f64::INFINITY, f64::min);
    if increments.len() < 8 || !least.is_finite() {
        return None;
    }
    // Half and a third of the smallest increment cover a grid whose single step never occurs by itself.
    [least, least / 2.0, least / 3.0].into_iter().find(|step| {
        let off_grid = |d: f64| {
            let counts = d / step;
            (counts - counts.round()).abs() > 0.05 + rounding / step
        };
        // The coarse grids must be told from chance: 99 % of all increments have to sit on it.
        let too_many_off =
            || increments.iter().filter(|d| off_grid(**d)).nth(increments.len() / 100).is_some();
        *step > 20.0 * rounding && !too_many_off()
    })
}

/// Scale of the residuals: MAD, at least `step`; the mean deviation where more than half agree exactly.
fn robust_scale(values: &[f64], step: f64) -> f64 {
    let mad = mad_sigma(values);
    if mad > 0.0 {
        return mad.max(step);
    }
    let centre = median(values);
    step.max(values.iter().map(|v| (v - centre).abs()).sum::<f64>() / values.len().max(1) as f64)
}

fn clipped_deviations(values: &[f64], centre: f64, step: f64) -> Vec<f64> {
    let limit = CLIP_SIGMAS * robust_scale(values, step);
    values.iter().map(|v| (v - centre).clamp(-limit, limit)).collect()
}

fn autocovariance(deviations: &[f64], lag: usize) -> f64 {
    let pairs = deviations.iter().zip(deviations.iter().skip(lag));
    pairs.map(|(a, b)| a * b).sum::<f64>() / deviations.len() as f64
}

fn geyer_time(d: &[f64]) -> f64 {
    let n = d.len() as f64;
    let mut known: Vec<f64> = Vec::new();
    let mut tau: f64 = 1.0;
    let mut lost = 0.0;
    for pass in 0..2 {
        let (mut sum, mut last) = (0.0, f64::INFINITY);
        for pair in 0..d.len() / 2 {
            while known.len() < 2 * pair + 2 {
                known.push(autocovariance(d, known.len()));
            }
            let gamma = known[2 * pair] + known[2 * pair + 1] + 2.0 * lost;
            if gamma.is_nan() || gamma <= 0.0 {
                break;
            }
            last = gamma.min(last);
            sum += last;
        }
        let variance = autocovariance(d, 0) + lost;
        tau = ((2.0 * sum - variance) / variance).clamp(1.0, n);
        // Each autocovariance about the sample mean is too small by the variance of that mean.
        lost = if pass == 0 { variance * tau / n } else { lost };
    }
    tau
}

fn ar1_time(d: &[f64], variance: f64) -> f64 {
    let n = d.len() as f64;
    let rho = autocovariance(d, 1) / variance;
    let rho = (rho + (1.0 + 3.0 * rho) / n).clamp(0.0, 0.999);
    (1.0 + rho) / (1.0 - rho)
}

#[cfg(test)]
#[path = "stats_tests.rs"]
mod tests;
