//! Columns of numbers, short enough for a page and exact enough for the eye.

use serde::Serialize;

/// Digits kept of the typical size of a column: less than a pixel of any plot.
const DIGITS: i32 = 4;

/// A column; `null` where there is no number.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
#[serde(transparent)]
pub struct Column(pub Vec<Option<f64>>);

impl Column {
    /// Rounds a column so that its root mean square keeps [`DIGITS`] digits.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Column {
        let values: Vec<Option<f64>> =
            values.into_iter().map(|v| v.filter(|number| number.is_finite())).collect();
        let known: Vec<f64> = values.iter().flatten().copied().collect();
        let rms = (known.iter().map(|v| v * v).sum::<f64>() / known.len().max(1) as f64).sqrt();
        let decimals = if rms > 0.0 { DIGITS - 1 - rms.log10().floor() as i32 } else { 0 };
        Column(values.into_iter().map(|v| v.map(|number| round_to(number, decimals))).collect())
    }

    /// The same of numbers that are all there.
    pub fn of_all(values: impl IntoIterator<Item = f64>) -> Column {
        Column::of(values.into_iter().map(Some))
    }
}

fn round_to(value: f64, decimals: i32) -> f64 {
    // Dividing by a whole power of ten gives the number nearest to the short decimal; multiplying by 0.001 does not.
    let factor = 10f64.powi(decimals.abs().min(300));
    let rounded = match decimals {
        d if d >= 0 => (value * factor).round() / factor,
        _ => (value / factor).round() * factor,
    };
    // No minus zero on the page.
    if rounded == 0.0 { 0.0 } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits_of_the_typical_size_are_kept() {
        let column = Column::of([Some(0.123_456), Some(-1.0), None, Some(f64::NAN), Some(-1e-9)]);
        assert_eq!(column.0, [Some(0.1235), Some(-1.0), None, None, Some(0.0)]);
        assert_eq!(Column::of_all([123_456.0, 0.0]).0, [Some(123_460.0), Some(0.0)]);
        assert_eq!(Column::of_all([0.0; 2]).0, [Some(0.0), Some(0.0)]);
        assert_eq!(serde_json::to_string(&Column::of_all([1.0 / 3.0, 0.1])).expect("json"), "[0.3333,0.1]");
    }
}
