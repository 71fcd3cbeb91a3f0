//! Two effects at once: a sum that fits no single candidate looks unlisted to a greedy search (notes 8.6).

use crate::config::DiagnosisConfig;
use crate::crossval::EFFECT_PRECISION;
use crate::evidence::ln_bayes;
use crate::problem::Problem;
use crate::projection::Projection;
use crate::weigh::Weighed;
use nalgebra::{DMatrix, DVector};

/// Candidates tried as the first of a pair.
const FIRST: usize = 10;

/// The stronger member of the pair of entries with the largest joint evidence.
pub(crate) fn best_pair(problem: &Problem, weighed: &Weighed, config: &DiagnosisConfig) -> Option<usize> {
    let order = weighed.ranking();
    let columns: Vec<DMatrix<f64>> =
        weighed.entries.iter().map(|e| weighed.dense(&e.candidate.columns, problem)).collect();
    let mut best: Option<(f64, usize)> = None;
    for &first in order.iter().take(FIRST) {
        let ln_first = weighed.entries[first].ln_evidence;
        if ln_first < config.margin_nats {
            break;
        }
        let projection = with(problem, weighed, &columns[first]);
        for &second in order.iter().filter(|k| **k != first) {
            let gram = projection.gram(&columns[second]);
            let ln = ln_first + ln_bayes(&gram, projection.rss, projection.dof(), config);
            if best.is_none_or(|b| ln > b.0) {
                // Evidence is not additive, so a pair may win with its weaker member first.
                let weaker = weighed.entries[second].ln_evidence > ln_first;
                best = Some((ln, if weaker { second } else { first }));
            }
        }
    }
    best.map(|b| b.1)
}

/// White projection with an effect among the geometry.
fn with(problem: &Problem, weighed: &Weighed, effect: &DMatrix<f64>) -> Projection {
    let (p, m) = (problem.geometry.ncols(), effect.ncols());
    let mut geometry = DMatrix::zeros(problem.rows(), p + m);
    geometry.columns_mut(0, p).copy_from(&(&problem.geometry / weighed.scale));
    geometry.columns_mut(p, m).copy_from(effect);
    let longer = |v: &DVector<f64>, value: f64| {
        DVector::from_iterator(p + m, v.iter().copied().chain(std::iter::repeat_n(value, m)))
    };
    Projection::new(
        geometry,
        &longer(&problem.geometry_precision, EFFECT_PRECISION),
        &longer(&problem.geometry_offset, 0.0),
        &problem.residual / weighed.scale,
    )
}
