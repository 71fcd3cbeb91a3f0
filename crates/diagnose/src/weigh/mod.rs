//! One round of weighing: the evidence of nothing, of every candidate, of everything unlisted (notes 4.6 to 4.8). It proposes;
//! scores decide.

pub(crate) mod cells;
pub(crate) mod confusion;
pub(crate) mod crossval;
pub(crate) mod drivers;
pub(crate) mod evidence;
pub(crate) mod scatter;

use crate::config::DiagnosisConfig;
use crate::enters::DependsOn;
use crate::problem::grams::each_gram;
use crate::problem::projection::{Gram, Projection};
use crate::problem::{Candidate, Columns, EFFECT_PRECISION, Problem};
use crate::weigh::cells::{Dependences, Unlisted, cells, discrepancies};
use crate::weigh::confusion::Crossed;
use crate::weigh::crossval::{Group, compare_left_out, left_out};
use crate::weigh::evidence::{best_amplitude, ln_bayes, posterior_coefficients, project_out_geometry};
use crate::weigh::scatter::Scatter;
use armcal_calibrate::HeldOut;
use armcal_calibrate::tails::ln_sum_exp;
use armcal_model::place_and_moment;
use nalgebra::{DMatrix, DVector};
use std::cell::OnceCell;
use std::sync::Arc;

/// Residual variance of the best explanation above which the declared noise is taken to be wrong and everything is
/// weighed again in units of what was found.
const RESCALE_ABOVE: f64 = 4.0;
/// Share of the noise that was assumed above which what was found is the same.
const SETTLED: f64 = 0.9;
/// Most points of a scan whose products are kept: neighbours on a grid are nearly the same column.
const KEPT_POINTS: usize = 80;

/// One entry of the catalogue: a candidate, or a scan at its best point.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// The candidate.
    pub candidate: Candidate,
    /// ln Bayes factor against nothing, averaged over the grid of a scan.
    pub ln_evidence: f64,
    /// Products of its columns.
    pub gram: Gram,
    /// Of so many points of a scan it is the best; one where nothing was searched.
    pub tried: usize,
}

/// One explanation outside the catalogue, weighed.
#[derive(Debug, Clone)]
pub(crate) struct Outside {
    /// The explanation.
    pub what: Unlisted,
    /// ln Bayes factor against nothing.
    pub ln_evidence: f64,
}

/// Everything weighed.
#[derive(Debug, Clone)]
pub(crate) struct Weighed {
    /// Noise found, in units of the declared one, where the declaration is far off; 1 otherwise.
    pub scale: f64,
    /// The problem in those units, its geometry projected out.
    pub base: Projection,
    /// What the unlisted may depend on.
    pub dependences: Arc<Dependences>,
    /// The catalogue in the order given, scans last.
    pub entries: Vec<Entry>,
    /// How many of them were given without a search; the rest are scans.
    pub given: usize,
    /// Of each scan some points, enough for its maximum, with the products of their columns.
    pub points: Vec<Vec<(usize, Gram)>>,
    /// What is not listed.
    pub unlisted: Vec<Outside>,
    /// Posterior probability of nothing.
    pub p_nothing: f64,
    /// Products of all entries with each other, once somebody asked.
    crossed: OnceCell<Crossed>,
}

/// Weighs a problem, with the noise rescaled where the declaration is far off.
pub(crate) fn weigh(problem: &Problem, config: &DiagnosisConfig) -> Weighed {
    weigh_among(problem, Dependences::of(problem).into(), config)
}

/// The same where it is known what the unlisted may depend on. The noise settles from above, from what nothing leaves: then it is
/// the same whatever is declared, and no explanation is weighed as if it could follow every error.
pub(crate) fn weigh_among(
    problem: &Problem,
    dependences: Arc<Dependences>,
    config: &DiagnosisConfig,
) -> Weighed {
    let (mut dependences, mut scale) = (dependences, noise_scale(problem.sigma().powi(2)));
    loop {
        let weighed = weigh_at(problem, dependences, scale, config);
        let found = noise_scale(weighed.best_variance(problem, config));
        if found > SETTLED * scale || scale == 1.0 {
            return weighed;
        }
        (dependences, scale) = (weighed.dependences, found);
    }
}

/// The noise at a residual variance, in units of the declared one: that itself, unless it is far off.
fn noise_scale(variance: f64) -> f64 {
    if variance <= RESCALE_ABOVE { 1.0 } else { variance.sqrt() }
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
    let base = project_out_geometry(problem, scale);
    let listed = problem.candidates.iter().chain(problem.scans.iter().flat_map(|scan| &scan.points));
    let of_listed: Vec<&Columns> = listed.map(|c| &c.columns).collect();
    let of_unlisted = outside.iter().flatten().map(|u| &u.columns);
    let terms: Vec<&Columns> = of_listed.iter().copied().chain(of_unlisted).collect();
    let mut grams = vec![Gram::zeros(0, 0); of_listed.len()];
    let mut ln = vec![0.0; terms.len()];
    each_gram(&terms, problem, 1.0 / scale, &base, &mut |k, gram| {
        ln[k] = ln_bayes(gram, &base, config);
        grams.get_mut(k).into_iter().for_each(|kept| kept.clone_from(gram));
    });
    let (mut ln, mut grams) = (ln.into_iter(), grams.into_iter());

    // ln of prior x Bayes factor, of everything.
    let mut all = vec![config.prior_nothing.ln()];
    let count = (problem.candidates.len() + problem.scans.len()).max(1) as f64;
    let share = (config.prior_catalogue / count).ln();
    let mut entries: Vec<Entry> = problem
        .candidates
        .iter()
        .zip(ln.by_ref().zip(grams.by_ref()))
        .map(|(candidate, (ln_evidence, gram))| Entry {
            candidate: candidate.clone(),
            ln_evidence,
            gram,
            tried: 1,
        })
        .collect();
    let given = entries.len();
    let mut points = Vec::new();
    for scan in &problem.scans {
        let of_points: Vec<f64> = ln.by_ref().take(scan.points.len()).collect();
        let of_columns: Vec<Gram> = grams.by_ref().take(scan.points.len()).collect();
        if let Some(best) = (0..of_points.len()).max_by(|a, b| of_points[*a].total_cmp(&of_points[*b])) {
            let tried = scan.tried.max(of_points.len());
            let ln_evidence = ln_sum_exp(of_points) - (tried as f64).ln();
            let (candidate, gram) = (scan.points[best].clone(), of_columns[best].clone());
            entries.push(Entry { candidate, ln_evidence, gram, tried });
        }
        let every = of_columns.len().div_ceil(KEPT_POINTS).max(1);
        points.push(of_columns.into_iter().enumerate().step_by(every).collect());
    }
    all.extend(entries.iter().map(|e| share + e.ln_evidence));

    let mut unlisted = Vec::new();
    let families = outside.iter().filter(|family| !family.is_empty()).count() as f64;
    for family in outside {
        let share = (config.prior_unknown / families / family.len().max(1) as f64).ln();
        for (what, ln_evidence) in family.into_iter().zip(ln.by_ref()) {
            all.push(share + ln_evidence);
            unlisted.push(Outside { what, ln_evidence });
        }
    }
    let p_nothing = (all[0] - ln_sum_exp(all)).exp();
    let crossed = OnceCell::new();
    Weighed { scale, base, dependences, entries, given, points, unlisted, p_nothing, crossed }
}

/// What explains most.
fn best_explanation<'c>(all: impl Iterator<Item = (&'c Columns, f64)>) -> Option<(&'c Columns, f64)> {
    all.max_by(|a, b| a.1.total_cmp(&b.1))
}

impl Weighed {
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
        best_explanation(listed.chain(self.unlisted.iter().map(|u| (&u.what.columns, u.ln_evidence))))
    }

    /// How a residual in the units of this problem scatters.
    pub fn scatter_of(&self, problem: &Problem, residual: &DVector<f64>) -> Scatter {
        Scatter::of(problem, &self.base, self.scale, residual)
    }

    /// How errors scatter beside what explains most: of nothing, the best listed and the best unlisted explanation that beside
    /// which they are least like those before them. A shape over time would take in what is alike over time.
    pub fn scatter(&self, problem: &Problem, config: &DiagnosisConfig) -> Scatter {
        let listed = self.entries.iter().map(|e| (&e.candidate.columns, e.ln_evidence));
        let of_time = [DependsOn::SessionTime, DependsOn::Time, DependsOn::Recording];
        let timeless = |u: &&Outside| !of_time.contains(&u.what.depends);
        let unlisted = self.unlisted.iter().filter(timeless).map(|u| (&u.what.columns, u.ln_evidence));
        let beside = |columns: &Columns| {
            let dense = self.dense(columns, problem);
            let gram = self.base.gram(&dense);
            let (theta, _) = posterior_coefficients(&gram, best_amplitude(&gram, &self.base, config));
            self.scatter_of(problem, &(self.base.projected_residual() - self.base.project(&dense) * theta))
        };
        let best = [best_explanation(listed), best_explanation(unlisted)]
            .into_iter()
            .flatten()
            .filter(|(_, ln)| *ln > 0.0);
        let nothing = self.scatter_of(problem, &self.base.projected_residual());
        best.map(|(columns, _)| beside(columns))
            .fold(nothing, |a, b| if b.memory() < a.memory() { b } else { a })
    }

    /// Residual variance (declared noise = 1) left by the best explanation of all.
    pub fn best_variance(&self, problem: &Problem, config: &DiagnosisConfig) -> f64 {
        let drop = match self.best() {
            Some((columns, ln)) if ln > 0.0 => {
                let gram = self.base.gram(&self.dense(columns, problem));
                posterior_coefficients(&gram, best_amplitude(&gram, &self.base, config)).0.dot(&gram.g)
            }
            _ => 0.0,
        };
        self.base.variance_without(drop) * self.scale.powi(2)
    }

    /// Columns in the units of the weighing.
    pub fn dense(&self, columns: &Columns, problem: &Problem) -> DMatrix<f64> {
        columns.dense(&problem.dwells, 1.0 / self.scale)
    }

    /// Columns scaled so that the weak prior of an effect's amplitude is the amplitude these data prefer: a flexible shape
    /// must not be fitted freely where nothing was seen. As they join the base of a problem, whose noise is weighed there.
    pub fn sized(&self, columns: &Columns, problem: &Problem, config: &DiagnosisConfig) -> DMatrix<f64> {
        let gram = self.base.gram(&self.dense(columns, problem));
        let a = best_amplitude(&gram, &self.base, config);
        columns.dense(&problem.dwells, a * EFFECT_PRECISION.sqrt())
    }

    /// The same for left-out fits, which are made in units of the declared noise.
    pub fn regularised(
        &self,
        columns: &Columns,
        problem: &Problem,
        config: &DiagnosisConfig,
    ) -> DMatrix<f64> {
        self.sized(columns, problem, config) / self.scale
    }

    /// What effect columns do to errors on groups the fit did not see.
    pub fn gain(
        &self,
        problem: &Problem,
        effect: &DMatrix<f64>,
        groups: &[Group],
        config: &DiagnosisConfig,
    ) -> HeldOut {
        let [before, after] =
            [None, Some(effect)].map(|effect| left_out(problem, effect, groups, self.scale));
        compare_left_out(problem, &before, &after, groups, config)
    }

    /// Products of all entries with each other.
    pub fn crossed(&self, problem: &Problem) -> &Crossed {
        self.crossed.get_or_init(|| {
            let columns: Vec<&Columns> = self.entries.iter().map(|e| &e.candidate.columns).collect();
            Crossed::of(&columns, problem, 1.0 / self.scale, &self.base)
        })
    }
}
