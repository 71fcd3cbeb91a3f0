//! Before against after, on dwells that neither fit saw.

use crate::errors::held_out::HeldOut;
use crate::errors::paired::grouped_ci95;
use crate::errors::sign_flips::SignFlips;
use crate::outcome::Calibration;
use armcal_core::{DwellId, Observation};
use std::collections::{BTreeMap, BTreeSet};

/// Of fewer places than this no interval can be told: what a change does to an error differs with the posture in which the
/// arm reaches a place, so each pose counts by itself there. With seven the smallest p of a sign flip, 2^-7, is below the 0.01
/// that is asked of a name.
const FEWEST_PLACES: usize = 7;

/// Errors on held-out dwells of two calibrations of the same observations, paired by dwell, in groups of one place
/// (cavity) each where there are enough of them. None where they share no held-out dwell.
pub fn compare_heldout(
    before: &Calibration,
    after: &Calibration,
    observations: &[Observation],
    flips: SignFlips,
) -> Option<HeldOut> {
    compare_errors(&held_out_errors_m(before), &held_out_errors_m(after), observations, flips)
}

/// Errors of a calibration on the dwells that were held out of it, by dwell [m]: the mean over what was measured in it.
pub fn held_out_errors_m(calibration: &Calibration) -> BTreeMap<DwellId, f64> {
    let held_out = calibration.residuals.iter().filter(|r| r.held_out);
    mean_by_dwell(held_out.map(|r| (r.dwell, r.fitted_m.norm())))
}

/// The mean of the errors in each dwell: features of one pose are no sample of poses.
pub fn mean_by_dwell(errors_m: impl Iterator<Item = (DwellId, f64)>) -> BTreeMap<DwellId, f64> {
    let mut sums: BTreeMap<DwellId, (f64, f64)> = BTreeMap::new();
    for (dwell, error_m) in errors_m {
        let (sum, count) = sums.entry(dwell).or_insert((0.0, 0.0));
        (*sum, *count) = (*sum + error_m, *count + 1.0);
    }
    sums.into_iter().map(|(dwell, (sum, count))| (dwell, sum / count)).collect()
}

/// The same of errors by dwell [m], before and after, wherever they come from.
pub fn compare_errors(
    before: &BTreeMap<DwellId, f64>,
    after: &BTreeMap<DwellId, f64>,
    observations: &[Observation],
    flips: SignFlips,
) -> Option<HeldOut> {
    let mut place: BTreeMap<DwellId, String> =
        observations.iter().filter_map(|o| Some((o.dwell, o.cavity()?.to_string()))).collect();
    if place.values().collect::<BTreeSet<_>>().len() < FEWEST_PLACES {
        place.clear();
    }
    let mut groups: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for (dwell, before_m) in before {
        if let Some(after_m) = after.get(dwell) {
            let alone = || format!("\u{1}{dwell}");
            let key = place.get(dwell).cloned().unwrap_or_else(alone);
            groups.entry(key).or_default().push((before_m * 1e3, after_m * 1e3));
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
        p: flips.p(&falls),
        groups: groups.len(),
    })
}
