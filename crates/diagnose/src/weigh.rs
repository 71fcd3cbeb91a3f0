//! One round of weighing: the evidence of nothing, of every candidate, of everything unlisted (notes 4.6 to 4.8).

use crate::cells::{Dependences, Unlisted, cells, discrepancies};
use crate::config::DiagnosisConfig;
use crate::confusion::Crossed;
use crate::crossval::{EFFECT_PRECISION, Group, gain};
use crate::evidence::{Metric, best_amplitude, coefficients, over_noise};
use crate::grams::each_gram;
use crate::held_out::HeldOut;
use crate::noise::Noise;
use crate::problem::{Candidate, Columns, Problem};
use crate::projection::Gram;
use crate::sizes;
use crate::special::ln_sum_exp;
use crate::whitener::Whitener;
use armcal_model::place_and_moment;
use nalgebra::DMatrix;
use std::cell::OnceCell;
use std::sync::Arc;

/// Residual variance of the best explanation above which the declared noise is taken to be wrong and everything is
/// weighed again in units of what was found.
const RESCALE_ABOVE: f64 = 4.0;
/// Points of a scan weighed under every kind of noise; and of many dwells.
const SCAN_POINTS: usize = 32;
const FEW_SCAN_POINTS: usize = 8;
/// Most points of a scan whose products are kept: neighbours on a grid are nearly the same column.
const KEPT_POINTS: usize = 80;
/// Entries of the catalogue, the best under white noise, by which the size of every other kind of noise is chosen.
const SCOUTS: usize = 32;
/// Up to so many dwells everything unlisted is weighed under every kind of noise; of more, so many shapes of a family.
const MANY_DWELLS: usize = 400;
const SHAPES: usize = 32;

/// One entry of the catalogue: a candidate, or a scan at its best point.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// The candidate.
    pub candidate: Candidate,
    /// ln Bayes factor against nothing, averaged over noise (and over the grid of a scan).
    pub ln_evidence: f64,
    /// Products of its columns under white noise.
    pub white: Gram,
}

/// One explanation outside the catalogue, weighed.
#[derive(Debug, Clone)]
pub(crate) struct Outside {
    /// The explanation.
    pub what: Unlisted,
    /// ln Bayes factor against nothing, averaged over noise.
    pub ln_evidence: f64,
}

/// Everything weighed.
#[derive(Debug, Clone)]
pub(crate) struct Weighed {
    /// Noise found, in units of the declared one, where the declaration is far off; 1 otherwise.
    pub scale: f64,
    /// The alternatives of the noise.
    pub metrics: Vec<Metric>,
    /// What the unlisted may depend on.
    pub dependences: Arc<Dependences>,
    /// The catalogue in the order given, scans last.
    pub entries: Vec<Entry>,
    /// How many of them were given without a search; the rest are scans.
    pub given: usize,
    /// Of each scan some points, enough for its maximum, with the products of their columns under white noise.
    pub points: Vec<Vec<(usize, Gram)>>,
    /// What is not listed.
    pub unlisted: Vec<Outside>,
    /// Posterior probability of nothing.
    pub p_nothing: f64,
    /// Posterior probability of correlated noise of each kind, over everything.
    pub p_noise: Vec<(Noise, f64)>,
    /// Products of all entries with each other under white noise, once somebody asked.
    crossed: OnceCell<Crossed>,
}

/// Weighs a problem, with the noise rescaled where the declaration is far off.
pub(crate) fn weigh(problem: &Problem, config: &DiagnosisConfig) -> Weighed {
    weigh_among(problem, Dependences::of(problem).into(), config)
}

/// The same where it is known what the unlisted may depend on.
pub(crate) fn weigh_among(
    problem: &Problem,
    dependences: Arc<Dependences>,
    config: &DiagnosisConfig,
) -> Weighed {
    let first = weigh_at(problem, dependences, 1.0, config);
    let variance = first.best_variance(problem, config);
    if variance <= RESCALE_ABOVE {
        return first;
    }
    let Weighed { dependences, .. } = first;
    weigh_at(problem, dependences, variance.sqrt(), config)
}

/// Weighs with the noise `scale` times the declared one.
fn weigh_at(
    problem: &Problem,
    dependences: Arc<Dependences>,
    scale: f64,
    config: &DiagnosisConfig,
) -> Weighed {
    let outside =
        [cells(problem, &dependences.drivers, config), discrepancies(problem, &dependences, config)];
    let many = problem.dwells.len() > MANY_DWELLS;
    let catalogue = Terms::all(problem.candidates.iter().map(|c| &c.columns));
    let scans = problem.scans.iter().map(|scan| Terms {
        most: if many { FEW_SCAN_POINTS } else { SCAN_POINTS },
        silent: |_| 0.0,
        ..Terms::all(scan.points.iter().map(|c| &c.columns))
    });
    let shapes = outside.iter().map(|family| Terms {
        most: if many { SHAPES } else { usize::MAX },
        silent: |ln_bayes| ln_bayes.min(0.0),
        ..Terms::all(family.iter().map(|u| &u.columns))
    });
    let terms: Vec<Terms<'_>> = std::iter::once(catalogue).chain(scans).chain(shapes).collect();
    let (metrics, weighed, white) = over_metrics(&terms, problem, scale, config);
    let (mut weighed, mut white) = (weighed.into_iter(), white.into_iter());

    let null: Vec<f64> = metrics.iter().map(|m| m.ln_weight).collect();
    let ln_null = ln_sum_exp(null.iter().copied());
    // ln of (prior x evidence) by metric, for the noise's own posterior.
    let mut by_metric: Vec<Vec<f64>> = vec![null.iter().map(|v| v + config.prior_nothing.ln()).collect()];
    let plus = |ln: &[f64], prior: f64| ln.iter().map(|v| v + prior).collect::<Vec<f64>>();

    let count = (problem.candidates.len() + problem.scans.len()).max(1) as f64;
    let share = (config.prior_catalogue / count).ln();
    let mut entries = Vec::new();
    let listed = weighed.next().unwrap_or_default().into_iter().zip(white.by_ref());
    for (candidate, (ln, white)) in problem.candidates.iter().zip(listed) {
        let ln_evidence = ln_sum_exp(ln.iter().copied()) - ln_null;
        by_metric.push(plus(&ln, share));
        entries.push(Entry { candidate: candidate.clone(), ln_evidence, white });
    }
    let mut points = Vec::new();
    for (scan, all) in problem.scans.iter().zip(weighed.by_ref().take(problem.scans.len())) {
        let of_points: Vec<Gram> = white.by_ref().take(scan.points.len()).collect();
        let totals: Vec<f64> = all.iter().map(|ln| ln_sum_exp(ln.iter().copied())).collect();
        let Some(best) = (0..totals.len()).max_by(|a, b| totals[*a].total_cmp(&totals[*b])) else {
            points.push(Vec::new());
            continue;
        };
        let ln_points = (scan.tried.max(totals.len()) as f64).ln();
        let ln_evidence = ln_sum_exp(totals.iter().copied()) - ln_points - ln_null;
        let mixed: Vec<f64> =
            (0..metrics.len()).map(|m| ln_sum_exp(all.iter().map(|ln| ln[m])) - ln_points).collect();
        by_metric.push(plus(&mixed, share));
        let (candidate, white) = (scan.points[best].clone(), of_points[best].clone());
        entries.push(Entry { candidate, ln_evidence, white });
        let every = of_points.len().div_ceil(KEPT_POINTS).max(1);
        points.push(of_points.into_iter().enumerate().step_by(every).collect());
    }

    let mut unlisted = Vec::new();
    let families = outside.iter().filter(|family| !family.is_empty()).count() as f64;
    for (family, parts) in outside.into_iter().zip(weighed) {
        let share = (config.prior_unknown / families / family.len().max(1) as f64).ln();
        for (what, ln) in family.into_iter().zip(parts) {
            let ln_evidence = ln_sum_exp(ln.iter().copied()) - ln_null;
            by_metric.push(plus(&ln, share));
            unlisted.push(Outside { what, ln_evidence });
        }
    }

    let ln_total = ln_sum_exp(by_metric.iter().flatten().copied());
    let p_nothing = (ln_sum_exp(by_metric[0].iter().copied()) - ln_total).exp();
    let of_noise = |m: usize| (ln_sum_exp(by_metric.iter().map(|ln| ln[m])) - ln_total).exp();
    let p_noise = (0..metrics.len()).map(|m| (metrics[m].noise, of_noise(m))).collect();
    let given = problem.candidates.len();
    let crossed = OnceCell::new();
    Weighed { scale, metrics, dependences, entries, given, points, unlisted, p_nothing, p_noise, crossed }
}

/// Terms of one kind.
struct Terms<'p> {
    columns: Vec<&'p Columns>,
    /// So many are weighed under every noise, those that white noise likes best.
    most: usize,
    /// What the others are taken to say there, from what they say under white noise (ln Bayes factors).
    silent: fn(f64) -> f64,
}

impl<'p> Terms<'p> {
    /// Weighed in full.
    fn all(columns: impl Iterator<Item = &'p Columns>) -> Terms<'p> {
        Terms { columns: columns.collect(), most: usize::MAX, silent: |ln_bayes| ln_bayes }
    }
}

/// The alternatives of the noise, ln (weight x Bayes factor) of all terms in them: `[kind][term][metric]`, and the products of
/// all that is listed under white noise, kind after kind.
fn over_metrics(
    terms: &[Terms<'_>],
    problem: &Problem,
    scale: f64,
    config: &DiagnosisConfig,
) -> (Vec<Metric>, Vec<Vec<Vec<f64>>>, Vec<Gram>) {
    let ours = sizes::white(problem, scale, config);
    let columns: Vec<&Columns> = terms.iter().flat_map(|t| t.columns.iter().copied()).collect();
    let listed = problem.candidates.len() + problem.scans.iter().map(|scan| scan.points.len()).sum::<usize>();
    let mut grams = vec![Gram::zeros(0, 0); listed];
    let mut of_white = vec![0.0; columns.len()];
    each_gram(&columns, problem, 1.0 / scale, &ours, &mut |k, gram| {
        of_white[k] = ours.ln_weight + ours.ln_bayes(gram, config);
        grams.get_mut(k).into_iter().for_each(|kept| kept.clone_from(gram));
    });
    let mut white = of_white.into_iter();
    let white: Vec<Vec<f64>> = terms.iter().map(|t| white.by_ref().take(t.columns.len()).collect()).collect();
    let (catalogue, ln_catalogue) = (&terms[0].columns, &white[0]);
    let best = promising(ln_catalogue, SCOUTS);
    let scouts: Vec<&Columns> = best.iter().map(|k| catalogue[*k]).collect();
    let ln_scouts = best.iter().map(|k| ln_catalogue[*k]).collect();
    let many = problem.dwells.len() > MANY_DWELLS;
    let metrics = sizes::metrics(ours, (&scouts, ln_scouts), problem, scale, many, config);
    let best: Vec<Vec<usize>> = terms.iter().zip(&white).map(|(t, white)| promising(white, t.most)).collect();
    let of_best = terms.iter().zip(&best).flat_map(|(t, best)| best.iter().map(|k| t.columns[*k]));
    let others = over_noise(&of_best.collect::<Vec<_>>(), problem, scale, &metrics[1..], config);
    let mut others = others.into_iter();
    let ln_white = metrics[0].ln_weight;
    let told = |((t, white), best): ((&Terms<'_>, Vec<f64>), Vec<usize>)| {
        let silent = |ln: &f64| {
            let others = metrics[1..].iter().map(|m| m.ln_weight + (t.silent)(ln - ln_white));
            std::iter::once(*ln).chain(others).collect::<Vec<f64>>()
        };
        let mut all: Vec<Vec<f64>> = white.iter().map(silent).collect();
        for (k, ln) in best.into_iter().zip(others.by_ref()) {
            all[k].truncate(1);
            all[k].extend(ln);
        }
        all
    };
    let told = terms.iter().zip(white).zip(best).map(told).collect();
    (metrics, told, grams)
}

/// The terms with the largest evidence under white noise, at most so many.
fn promising(white: &[f64], most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..white.len()).collect();
    order.sort_by(|a, b| white[*b].total_cmp(&white[*a]));
    order.truncate(most);
    order
}

impl Weighed {
    /// The metric in which a term is explained best.
    pub fn metric_of(&self, columns: &Columns, problem: &Problem, config: &DiagnosisConfig) -> &Metric {
        let parts = over_noise(&[columns], problem, self.scale, &self.metrics, config).concat();
        let best = (0..parts.len()).max_by(|a, b| parts[*a].total_cmp(&parts[*b])).unwrap_or(0);
        &self.metrics[best]
    }

    /// Whitening by the noise in which a term is explained best, where noise remembers.
    fn memory_of(&self, columns: &Columns, problem: &Problem, config: &DiagnosisConfig) -> Option<&Whitener> {
        self.remembers().then(|| &self.metric_of(columns, problem, config).whitener)
    }

    /// Whether two entries are one effect at one target, apart from the value of a searched shape.
    pub fn one_name(&self, k: usize, l: usize) -> bool {
        let placed = |k: usize| {
            let spec = &self.entries[k].candidate.spec;
            spec.split_once(',').map_or(spec.as_str(), |(placed, _)| placed)
        };
        let single = |k: usize| !self.entries[k].candidate.is_group();
        k == l || (k.max(l) >= self.given && single(k) && single(l) && placed(k) == placed(l))
    }

    /// Whether two entries are one effect at one target, apart from a shape, and from the moment of an event: when it happened
    /// is no other cause.
    pub fn one_cause(&self, k: usize, l: usize) -> bool {
        let place = |k: usize| place_and_moment(&self.entries[k].candidate.spec).map(|(place, _)| place);
        self.one_name(k, l) || place(k).is_some_and(|own| place(l).is_some_and(|other| own == other))
    }

    /// Amplitudes of an entry, a shape that was searched for counting as one more.
    pub fn amplitudes(&self, k: usize) -> usize {
        self.entries[k].candidate.amplitudes.len() + usize::from(k >= self.given)
    }

    /// Entries by falling evidence.
    pub fn ranking(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.entries.len()).collect();
        order.sort_by(|a, b| self.entries[*b].ln_evidence.total_cmp(&self.entries[*a].ln_evidence));
        order
    }

    /// The best unlisted explanation.
    pub fn best_unlisted(&self) -> Option<&Outside> {
        self.unlisted.iter().max_by(|a, b| a.ln_evidence.total_cmp(&b.ln_evidence))
    }

    /// The best cell: it names a channel and a driver.
    pub fn best_cell(&self) -> Option<&Outside> {
        let cells = self.unlisted.iter().filter(|u| u.what.channel.is_some());
        cells.max_by(|a, b| a.ln_evidence.total_cmp(&b.ln_evidence))
    }

    /// The best explanation of all, with its ln Bayes factor.
    pub fn best(&self) -> Option<(&Columns, f64)> {
        let listed = self.entries.iter().map(|e| (&e.candidate.columns, e.ln_evidence));
        let all = listed.chain(self.unlisted.iter().map(|u| (&u.what.columns, u.ln_evidence)));
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether the noise probably remembers the dwells before.
    pub fn remembers(&self) -> bool {
        self.probably(&[Noise::Memory, Noise::Sensor, Noise::SensorAndPlace])
    }

    /// Whether the noise is probably of one of these kinds.
    pub fn probably(&self, kinds: &[Noise]) -> bool {
        let p = self.p_noise.iter().filter(|(noise, _)| kinds.contains(noise)).map(|(_, p)| p);
        p.sum::<f64>() > 0.5
    }

    /// Residual variance (declared noise = 1, white) left by the best explanation of all.
    pub fn best_variance(&self, problem: &Problem, config: &DiagnosisConfig) -> f64 {
        let white = &self.metrics[0];
        let drop = match self.best() {
            Some((columns, ln)) if ln > 0.0 => {
                let gram = white.gram(&self.dense(columns, problem));
                let a = best_amplitude(&gram, white.projection.rss, white.projection.dof(), config);
                coefficients(&gram, a).0.dot(&gram.g)
            }
            _ => 0.0,
        };
        white.projection.variance_without(drop) * self.scale.powi(2)
    }

    /// Columns in the units of the weighing.
    pub fn dense(&self, columns: &Columns, problem: &Problem) -> DMatrix<f64> {
        columns.dense(&problem.dwells, 1.0 / self.scale)
    }

    /// Columns scaled so that the weak prior of an effect's amplitude is the amplitude these data prefer: a flexible shape
    /// must not be fitted freely where nothing was seen. As they join the base of a problem, whose noise is weighed there.
    pub fn sized(&self, columns: &Columns, problem: &Problem, config: &DiagnosisConfig) -> DMatrix<f64> {
        let metric = self.metric_of(columns, problem, config);
        let gram = metric.gram(&self.dense(columns, problem));
        let a = best_amplitude(&gram, metric.projection.rss, metric.projection.dof(), config);
        columns.dense(&problem.dwells, a * EFFECT_PRECISION.sqrt())
    }

    /// The same for left-out fits, which are made in units of the declared noise.
    pub fn tamed(&self, columns: &Columns, problem: &Problem, config: &DiagnosisConfig) -> DMatrix<f64> {
        self.sized(columns, problem, config) / self.scale
    }

    /// What `effect`, a scaling of `columns`, does to errors on groups the fit did not see, under the noise in which the
    /// columns are explained best.
    pub fn gain(
        &self,
        problem: &Problem,
        (columns, effect): (&Columns, &DMatrix<f64>),
        groups: &[Group],
        config: &DiagnosisConfig,
    ) -> HeldOut {
        gain(problem, effect, groups, (self.memory_of(columns, problem, config), self.scale), config)
    }

    /// Products of all entries with each other under white noise.
    pub fn crossed(&self, problem: &Problem) -> &Crossed {
        self.crossed.get_or_init(|| {
            let columns: Vec<&Columns> = self.entries.iter().map(|e| &e.candidate.columns).collect();
            Crossed::of(&columns, problem, 1.0 / self.scale, &self.metrics[0])
        })
    }
}
