//! Paired contrasts: two visits to one pose that differ in a driver carry no geometry (notes 4.9).

use crate::config::DiagnosisConfig;
use crate::events::event_since;
use crate::problem::{Candidate, DwellRow, Problem};
use armcal_model::Toggle;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Fewest pairs that mean anything.
const MIN_PAIRS: usize = 5;

/// What pairs of visits to the same pose say about an effect, free of geometry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contrast {
    /// What differs within a pair.
    pub differs: String,
    /// Number of pairs.
    pub pairs: usize,
    /// Size of the effect from the pairs alone, in units of the size from the whole fit.
    pub ratio: f64,
    /// Standard error of that ratio.
    pub ratio_sigma: f64,
    /// P-value that the pairs show nothing (swapping within pairs).
    pub p: f64,
    /// Same sign and within three standard errors of the whole fit.
    pub agrees: bool,
}

/// Contrast for a candidate fitted at `theta` (typical sizes); none where the design has no pairs or the effect does
/// not depend on anything that can be switched. `residual`: whitened, at the fitted base.
pub(crate) fn contrast(
    problem: &Problem,
    residual: &DVector<f64>,
    candidate: &Candidate,
    columns: &DMatrix<f64>,
    theta: &DVector<f64>,
    theta_sigma: f64,
    config: &DiagnosisConfig,
) -> Option<Contrast> {
    if candidate.toggle == Toggle::None || candidate.toggle == Toggle::Recording {
        return None;
    }
    let pairs = pairs(problem, candidate, config);
    if pairs.len() < MIN_PAIRS {
        return None;
    }
    let signature = columns * theta;
    let mut parts = Vec::new();
    for (a, b) in &pairs {
        let (a, b) = (&problem.dwells[*a], &problem.dwells[*b]);
        let d = |v: &DVector<f64>| v.rows(a.first_row, a.rows) - v.rows(b.first_row, b.rows);
        let (x, y) = (d(&signature), d(residual));
        parts.push((x.norm_squared(), x.dot(&y), y.norm_squared()));
    }
    let xx: f64 = parts.iter().map(|p| p.0).sum();
    let xy: f64 = parts.iter().map(|p| p.1).sum();
    let yy: f64 = parts.iter().map(|p| p.2).sum();
    // Below this no pair sees the effect.
    if xx < 1.0 {
        return None;
    }
    let ratio = xy / xx;
    let rows = pairs.iter().map(|(a, _)| problem.dwells[*a].rows).sum::<usize>() as f64;
    let ratio_sigma = ((yy - xy * xy / xx).max(0.0) / (rows - 1.0).max(1.0) / xx).sqrt();
    let p = config.flips().p(&parts.iter().map(|p| p.1).collect::<Vec<_>>());
    // Three, not two: a name is not given up for what one true effect in twenty does by chance.
    let tolerance = 3.0 * (ratio_sigma.powi(2) + theta_sigma.powi(2)).sqrt();
    // A tenth of the size is the curvature and gap a linear pair cannot show.
    let agrees = ratio > 0.0 && (ratio - 1.0).abs() < tolerance.max(0.1);
    Some(Contrast {
        differs: candidate.toggle.word().to_string(),
        pairs: pairs.len(),
        ratio,
        ratio_sigma,
        p,
        agrees,
    })
}

/// Disjoint pairs of dwells of one recording at the same place that differ in the driver; of an event, of which it acts in one
/// alone.
fn pairs(problem: &Problem, candidate: &Candidate, config: &DiagnosisConfig) -> Vec<(usize, usize)> {
    let limit = config.same_pose_deg.to_radians();
    let moment = event_since(&candidate.spec);
    let differs = |a: &DwellRow, b: &DwellRow| {
        toggle_differs(a, b, candidate.toggle)
            && moment.is_none_or(|since| since.holds(a.id) != since.holds(b.id))
    };
    let mut used = vec![false; problem.dwells.len()];
    let mut found = Vec::new();
    for i in 0..used.len() {
        if used[i] {
            continue;
        }
        let partner = (i + 1..used.len()).find(|&j| {
            let (a, b) = (&problem.dwells[i], &problem.dwells[j]);
            !used[j] && a.measured_as(b) && same_place(a, b, limit) && differs(a, b)
        });
        if let Some(j) = partner {
            (used[i], used[j]) = (true, true);
            found.push((i, j));
        }
    }
    found
}

/// The same cavity or revisited pose; its readings may differ, that may be the effect. Places without a name are the same
/// where the readings are.
fn same_place(a: &DwellRow, b: &DwellRow, limit: f64) -> bool {
    a.id.recording == b.id.recording
        && match (&a.place, &b.place) {
            (Some(a), Some(b)) => a == b,
            (None, None) => a.joint_rad.iter().zip(&b.joint_rad).all(|(a, b)| (a - b).abs() < limit),
            _ => false,
        }
}

fn toggle_differs(a: &DwellRow, b: &DwellRow, toggle: Toggle) -> bool {
    match toggle {
        Toggle::Direction | Toggle::Approach => a.arrival.iter().zip(&b.arrival).any(|(a, b)| a * b < 0.0),
        Toggle::Load => (a.load_kg - b.load_kg).abs() > 1e-6,
        Toggle::Time => true,
        Toggle::Temperature => match (a.temperature_c, b.temperature_c) {
            (Some(a), Some(b)) => (a - b).abs() > 0.5,
            _ => false,
        },
        Toggle::Recording | Toggle::None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{own, planted};

    /// Three recordings of 33 cavities, each visited in dwells 0 to 32 and again in 33 to 65.
    #[test]
    fn pairs_of_an_event_lie_on_both_sides_of_it() {
        let p = planted(&[], 0, 1);
        let pairs_of = |spec: &str| {
            let candidate = Candidate { spec: spec.into(), toggle: Toggle::Time, ..own(&p, "backlash:1") };
            pairs(&p, &candidate, &DiagnosisConfig::default()).len()
        };
        assert_eq!(pairs_of("zero_drift:1"), 99);
        // Between two recordings no pair of one recording sees it.
        assert_eq!((pairs_of("zero_slip:1@1.0"), pairs_of("zero_slip:1@1.33")), (0, 33));
        // Of dwells 33 to 40 alone the first visits lie outside.
        assert_eq!(pairs_of("zero_slip:1@1.33-40"), 8);
    }
}
