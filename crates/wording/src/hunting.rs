//! Servos that never stand still: what their readings vary by within a dwell moves the tip.

use armcal_core::robust::median;
use armcal_result::Run;

/// Joints that vary by less than this share of what the most restless one does are at rest.
const RESTLESS: f64 = 0.5;

/// What the joints vary by while the arm stands, where that alone moves the tip by as much as remains: from the streams themselves.
pub(crate) fn hunting_sentence(run: &Run, remains_mm: f64) -> Option<String> {
    let names = run.model.chain().joint_names();
    let turning = |j: &usize| run.model.chain().joint_unit(*j) == armcal_core::Unit::Radian;
    let p = run.calibration.fit.values();
    let dwells: Vec<_> = run.recordings.iter().flat_map(|r| &r.dwells).collect();
    let moved_mm = |j: usize| {
        let of = dwells.iter().filter(|d| d.joint_spread_rad.len() == names.len()).map(|d| {
            let at = |by_rad: f64| {
                let mut joint_rad = d.joint_rad.clone();
                joint_rad[j] += by_rad;
                run.model.tip_in_base(&p, &joint_rad).translation.vector
            };
            (at(d.joint_spread_rad[j]) - at(0.0)).norm() * 1e3
        });
        median(&of.collect::<Vec<f64>>())
    };
    let each: Vec<(usize, f64)> = (0..names.len()).filter(turning).map(|j| (j, moved_mm(j))).collect();
    let all_mm = each.iter().map(|(_, mm)| mm * mm).sum::<f64>().sqrt();
    if !(all_mm >= remains_mm && remains_mm > 0.0) {
        return None;
    }
    let most = each.iter().map(|(_, mm)| *mm).fold(0.0, f64::max);
    let told = each.iter().filter(|(_, mm)| *mm >= RESTLESS * most).map(|(j, _)| {
        let spreads: Vec<f64> = dwells.iter().filter_map(|d| d.joint_spread_rad.get(*j)).copied().collect();
        format!("{} by {:.2} deg", names[*j], median(&spreads).to_degrees())
    });
    let told = told.collect::<Vec<String>>();
    Some(format!(
        "While the arm stands its joints do not: {} vary, which moves the tip by {all_mm:.2} mm, more than what remains: servos that \
         hunt leave a scatter that no effect predicts; hold each pose longer.",
        armcal_core::list_names(&told)
    ))
}
