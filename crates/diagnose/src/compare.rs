//! Before against after, on dwells that neither fit saw.

use crate::HeldOut;
use crate::config::DiagnosisConfig;
use crate::crossval::sign_flip;
use armcal_calibrate::{Calibration, grouped_ci95};
use armcal_core::{DwellId, Observation};
use std::collections::BTreeMap;

/// Errors on held-out dwells of two calibrations of the same observations, paired by dwell, in groups of one place
/// (cavity) each. None where they share no held-out dwell.
pub fn compare_heldout(
    before: &Calibration,
    after: &Calibration,
    observations: &[Observation],
    config: &DiagnosisConfig,
) -> Option<HeldOut> {
    let after = after.residuals.iter().filter(|r| r.held_out).map(|r| (r.dwell, r.fitted_m.norm())).collect();
    compare_norms(before, &after, observations, config)
}

/// The same with the errors after by dwell [m].
pub(crate) fn compare_norms(
    before: &Calibration,
    after: &BTreeMap<DwellId, f64>,
    observations: &[Observation],
    config: &DiagnosisConfig,
) -> Option<HeldOut> {
    let place: BTreeMap<DwellId, String> =
        observations.iter().filter_map(|o| Some((o.dwell, o.cavity()?.to_string()))).collect();
    let mut groups: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for r in before.residuals.iter().filter(|r| r.held_out) {
        if let Some(norm) = after.get(&r.dwell) {
            let alone = || format!("\u{1}{}", r.dwell);
            let key = place.get(&r.dwell).cloned().unwrap_or_else(alone);
            groups.entry(key).or_default().push((r.fitted_m.norm() * 1e3, norm * 1e3));
        }
    }
    let pairs: Vec<(f64, f64)> = groups.values().flatten().copied().collect();
    if pairs.is_empty() {
        return None;
    }
    let n = pairs.len() as f64;
    let square = |f: fn(&(f64, f64)) -> f64| pairs.iter().map(|p| f(p).powi(2)).sum::<f64>();
    let changes: Vec<(f64, f64)> =
        groups.values().map(|g| (g.iter().map(|p| p.1 - p.0).sum(), g.len() as f64)).collect();
    let falls: Vec<f64> = groups.values().map(|g| g.iter().map(|p| p.0 - p.1).sum()).collect();
    Some(HeldOut {
        before: pairs.iter().map(|p| p.0).sum::<f64>() / n,
        after: pairs.iter().map(|p| p.1).sum::<f64>() / n,
        change_ci95: grouped_ci95(&changes),
        gain: 1.0 - square(|p| p.1) / square(|p| p.0).max(1e-300),
        p: sign_flip(&falls, config),
        groups: groups.len(),
    })
}
