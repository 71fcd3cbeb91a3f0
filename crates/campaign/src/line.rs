//! Weighted means and lines through a stretch of a series, and how sure they are.

use crate::SeriesPoint;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Finest difference that means anything [SI units]: rounding of quantities whose standard error nobody knows.
const FINEST: f64 = 1e-9;
const NS_PER_DAY: f64 = 86_400e9;

/// A value with its weight, 1 / variance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighed {
    pub at: SeriesPoint,
    /// Days since the start of the series.
    pub day: f64,
    /// What is left of the value after what was found before is taken out.
    pub value: f64,
    pub weight: f64,
    /// Whether the finest difference that weights know is rounding, rather than the values' own standard errors.
    pub finest_is_rounding: bool,
}

/// The values of a series, weighed against each other by their own standard errors and what they scatter beyond these.
///
/// The scatter is taken from differences of successive recordings (von Neumann 1941), by their median: a step or an
/// outlier touches one or two of them, a trend none by much. Only the relation of the weights counts. How sure anything
/// is comes from the residuals: most of a standard error may be the same in every recording (how well markers represent
/// a base, say) and says nothing about changes.
///
/// Where most recordings agree to the last digit (values at a bound, say), they do not scatter like measurements; then a
/// difference is held against their own standard errors, where these are known.
pub(crate) fn weigh_points(points: &[SeriesPoint]) -> Vec<Weighed> {
    let start_ns = points.first().map_or(0, |p| p.time_ns);
    // Median of a chi-square variable with one degree of freedom.
    const CHI2_MEDIAN: f64 = 0.454_936;
    let squares = points.windows(2).map(|w| (w[1].value - w[0].value).powi(2)).collect();
    let total = median(squares) / (2.0 * CHI2_MEDIAN);
    let own = |p: &SeriesPoint| p.sigma.unwrap_or(0.0).powi(2);
    let typical = median(points.iter().map(own).collect());
    let extra = (total - typical).max(0.0);
    let variance = |p: &SeriesPoint| (own(p) + extra).max(FINEST * FINEST);
    let finest_is_rounding = total > FINEST * FINEST || typical <= FINEST * FINEST;
    let finest_square = if finest_is_rounding { FINEST * FINEST } else { typical };
    let least = points.iter().map(variance).fold(f64::INFINITY, f64::min);
    let weigh = |p: &SeriesPoint| Weighed {
        at: *p,
        day: p.time_ns.saturating_sub(start_ns) as f64 / NS_PER_DAY,
        value: p.value,
        weight: least / variance(p) / finest_square,
        finest_is_rounding,
    };
    points.iter().map(weigh).collect()
}

/// A weighted mean.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mean {
    pub weight: f64,
    pub value: f64,
    /// Weighted sum of squares about it.
    pub squares: f64,
}

impl Mean {
    pub fn of(points: &[Weighed]) -> Mean {
        points
            .iter()
            .map(|p| Mean { weight: p.weight, value: p.value, squares: 0.0 })
            .fold(Mean::default(), Mean::with)
    }

    /// The mean of both together (Chan, Golub, LeVeque 1979).
    pub fn with(self, other: Mean) -> Mean {
        let weight = self.weight + other.weight;
        if weight <= 0.0 {
            return Mean::default();
        }
        let apart = other.value - self.value;
        Mean {
            weight,
            value: self.value + apart * other.weight / weight,
            squares: self.squares + other.squares + apart * apart * self.weight * other.weight / weight,
        }
    }

    /// How far `other` lies above this one in standard errors, both scattering about their own means alike.
    pub fn t_of(&self, other: &Mean, freedom: usize) -> f64 {
        let scatter = residual_scale(self.squares + other.squares, freedom);
        (other.value - self.value) / ((1.0 / self.weight + 1.0 / other.weight).sqrt() * scatter)
    }
}

/// A weighted line through a stretch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    pub per_day: f64,
    /// Its standard error for unit weights.
    pub sigma_per_day: f64,
    pub squares: f64,
    mean_day: f64,
    mean: f64,
}

impl Line {
    /// None where all points are of one moment.
    pub fn through(points: &[Weighed]) -> Option<Line> {
        let mean = Mean::of(points);
        let mean_day = points.iter().map(|p| p.weight * p.day).sum::<f64>() / mean.weight;
        let spread: f64 = points.iter().map(|p| p.weight * (p.day - mean_day).powi(2)).sum();
        if spread.is_nan() || spread <= 0.0 {
            return None;
        }
        let common: f64 = points.iter().map(|p| p.weight * (p.day - mean_day) * p.value).sum();
        let per_day = common / spread;
        let line =
            Line { per_day, sigma_per_day: spread.sqrt().recip(), squares: 0.0, mean_day, mean: mean.value };
        let squares = points.iter().map(|p| p.weight * (p.value - line.at(p.day)).powi(2)).sum();
        Some(Line { squares, ..line })
    }

    pub fn at(&self, day: f64) -> f64 {
        self.mean + self.per_day * (day - self.mean_day)
    }
}

/// Factor by which residuals exceed what the weights promise, which is the finest difference that means anything.
pub(crate) fn residual_scale(squares: f64, freedom: usize) -> f64 {
    (squares / freedom.max(1) as f64).max(1.0).sqrt()
}

/// Two-sided probability of a t value by chance.
pub(crate) fn p_value(t: f64, freedom: usize) -> f64 {
    if t.is_infinite() {
        return 0.0;
    }
    StudentsT::new(0.0, 1.0, freedom.max(1) as f64).map_or(1.0, |d| 2.0 * d.sf(t.abs()))
}

/// Whether residuals say how much the recordings scatter: equal values do not.
pub(crate) fn has_scatter(squares: f64, freedom: usize) -> bool {
    freedom > 0 && squares > freedom as f64
}

/// Half width in standard errors of 95 % intervals that hold for all of `tries` at once (Bonferroni): what was chosen from
/// many because it stood out has its scatter underestimated more often than one in twenty times.
pub(crate) fn bonferroni_t95(freedom: usize, tries: f64) -> f64 {
    let upper = 1.0 - 0.025 / tries.max(1.0);
    StudentsT::new(0.0, 1.0, freedom.max(1) as f64).map_or(f64::INFINITY, |d| d.inverse_cdf(upper))
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}
