//! The noises that everything is weighed under: of every kind the size that explains nothing, or one of a few scouts, best.
//!
//! Sizes are tried by [products alone](crate::trials); only those that are kept are projected in full.

use crate::config::DiagnosisConfig;
use crate::evidence::Metric;
use crate::noise::Noise;
use crate::problem::{Columns, Problem};
use crate::trials::{OfKind, Trials};

/// Of many dwells, a kind of noise that puts nothing, and no scout, less than this behind another kind is not asked further
/// [nats]: of all probability it has less than one part in a thousand million.
const OUT_OF_THE_QUESTION: f64 = 21.0;

/// A kind and size of noise, tried.
struct Trial {
    noise: Noise,
    amplitude: f64,
    prior: f64,
    /// ln (weight x evidence) of nothing, then of every scout.
    parts: Vec<f64>,
}

impl Trial {
    fn nothing(&self) -> f64 {
        self.parts[0]
    }

    fn best(&self) -> f64 {
        self.parts.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The problem under white noise.
pub(crate) fn white(problem: &Problem, scale: f64, config: &DiagnosisConfig) -> Metric {
    let prior = 1.0 - config.prior_correlated_noise;
    Metric::new(Noise::White, 0.0, problem, scale).weighed(prior, None, config)
}

/// The alternatives of the noise, white first, for a problem whose residual noise is `scale` times the declared one.
/// `ln_scouts` are what white noise says of the scouts. Of `many` dwells those out of the question are left out.
pub(crate) fn metrics(
    white: Metric,
    (scouts, ln_scouts): (&[&Columns], Vec<f64>),
    problem: &Problem,
    scale: f64,
    many: bool,
    config: &DiagnosisConfig,
) -> Vec<Metric> {
    let kinds = Noise::available(problem);
    let share = config.prior_correlated_noise / kinds.len().saturating_sub(1).max(1) as f64;
    let stacked = Trials::new(scouts, problem, scale, config);
    let tried = |kind: &OfKind<'_>, amplitude, prior| {
        let parts = kind.tried(amplitude, prior, &white)?;
        Some(Trial { noise: kind.noise, amplitude, prior, parts })
    };
    let parts = std::iter::once(white.ln_weight).chain(ln_scouts).collect();
    let prior = 1.0 - config.prior_correlated_noise;
    let mut trials = vec![Trial { noise: Noise::White, amplitude: 0.0, prior, parts }];
    let sizes = &config.amplitude_scales;
    for noise in kinds.iter().copied().filter(|noise| *noise != Noise::White) {
        let (kind, share) = (stacked.of(noise), share / sizes.len() as f64);
        trials.extend(sizes.iter().filter_map(|size| tried(&kind, *size, share)));
    }
    let by_nothing = |a: &&Trial, b: &&Trial| a.nothing().total_cmp(&b.nothing());
    let leading = trials.iter().max_by(by_nothing).map_or(Noise::White, |trial| trial.noise);
    let both = |trial: &Trial| Some((trial.noise.and_place(leading, &kinds)?, trial.amplitude));
    let with_places = trials.iter().filter(|trial| both(trial).is_some()).max_by(by_nothing).and_then(both);
    trials.extend(with_places.and_then(|(noise, size)| tried(&stacked.of(noise), size, share)));

    let of = |trial: &Trial| {
        Metric::new(trial.noise, trial.amplitude, problem, scale).weighed(trial.prior, Some(&white), config)
    };
    let others: Vec<Metric> = kept(&trials, many)[1..].iter().map(|trial| of(trial)).collect();
    std::iter::once(white).chain(others).collect()
}

/// Of each kind the best size, in the order of the kinds: of `many` dwells the first, and those not out of the question.
fn kept(trials: &[Trial], many: bool) -> Vec<&Trial> {
    let mut kept: Vec<&Trial> = Vec::new();
    for trial in trials {
        match kept.iter_mut().find(|kept| kept.noise == trial.noise) {
            Some(kept) if trial.best() > kept.best() => *kept = trial,
            Some(_) => {}
            None => kept.push(trial),
        }
    }
    let most = |k: usize| trials.iter().map(|trial| trial.parts[k]).fold(f64::NEG_INFINITY, f64::max);
    let in_question = |trial: &&Trial| {
        let near = |(k, part): (usize, &f64)| *part > most(k) - OUT_OF_THE_QUESTION;
        !many || trial.noise == Noise::White || trial.parts.iter().enumerate().any(near)
    };
    kept.retain(in_question);
    kept
}
