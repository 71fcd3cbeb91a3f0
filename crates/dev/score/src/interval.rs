//! Shares with their intervals.

use statrs::distribution::{Beta, ContinuousCDF as _};

/// A share `k` of `n` with its exact 95 % interval (Clopper and Pearson, Biometrika 26, 1934): never narrower than it
/// should be, also where `k` is 0 or `n`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Share {
    pub k: usize,
    pub n: usize,
}

impl Share {
    /// The interval, both ends within 0 to 1; all of it where nothing was tried.
    pub fn interval(self) -> [f64; 2] {
        let (k, n) = (self.k as f64, self.n as f64);
        let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p));
        let low = quantile(k, n - k + 1.0, 0.025).unwrap_or(0.0);
        let high = quantile(k + 1.0, n - k, 0.975).unwrap_or(1.0);
        [low, high]
    }

    /// `49 of 50, 98.0 % (89.4 to 99.9)`.
    pub fn words(self) -> String {
        format!("{} of {}, {}", self.k, self.n, self.percent())
    }

    /// `98.0 % (89.4 to 99.9)`.
    pub fn percent(self) -> String {
        if self.n == 0 {
            return "-".to_owned();
        }
        let [low, high] = self.interval().map(|share| 100.0 * share);
        format!("{:.1} % ({low:.1} to {high:.1})", 100.0 * self.k as f64 / self.n as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::Share;

    /// None or all of n: the other end is where that has a probability of 2.5 %. Between: the ends of the binomial sums.
    #[test]
    fn ends_are_where_the_binomial_tails_have_their_probability() {
        for n in [1, 7, 50, 1400] {
            let [low, high] = Share { k: 0, n }.interval();
            assert!(low == 0.0 && (high - (1.0 - 0.025_f64.powf(1.0 / n as f64))).abs() < 1e-9);
            let [low, high] = Share { k: n, n }.interval();
            assert!(high == 1.0 && (low - 0.025_f64.powf(1.0 / n as f64)).abs() < 1e-9);
        }
        let binomial = |k: usize, n: usize, p: f64| {
            let choose: f64 = (0..k).map(|i| (n - i) as f64 / (k - i) as f64).product();
            choose * p.powi(k as i32) * (1.0 - p).powi((n - k) as i32)
        };
        for (k, n) in [(5, 10), (1, 20), (49, 50), (3, 300)] {
            let [low, high] = Share { k, n }.interval();
            let at_least: f64 = 1.0 - (0..k).map(|i| binomial(i, n, low)).sum::<f64>();
            let at_most: f64 = (0..=k).map(|i| binomial(i, n, high)).sum();
            assert!((at_least - 0.025).abs() < 1e-7 && (at_most - 0.025).abs() < 1e-7, "{k} of {n}");
        }
        assert_eq!(Share { k: 0, n: 0 }.interval(), [0.0, 1.0]);
    }

    #[test]
    fn shares_are_written_with_their_interval() {
        assert_eq!(Share { k: 5, n: 10 }.words(), "5 of 10, 50.0 % (18.7 to 81.3)");
        assert_eq!(Share { k: 0, n: 0 }.percent(), "-");
    }
}
