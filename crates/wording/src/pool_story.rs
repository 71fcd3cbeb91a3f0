//! What is said of a calibration of earlier results beside what is said of any: whether it holds on another day, and what to do
//! where it does not. Of any other run nothing.

use armcal_calibrate::{INADEQUATE, PairedDifference};
use armcal_core::printable_name;
use armcal_core::units::format_mm;
use armcal_result::Run;

/// What the calibration is worth on another day.
pub fn transfer_sentence(run: &Run) -> String {
    let Some(transfer) = &run.transfer else { return String::new() };
    let side = &transfer.holdout;
    format!(
        " On recordings that it never saw it is {} mm (nominal {} mm).",
        format_mm(side.fitted.mean_m),
        format_mm(side.nominal.mean_m)
    )
}

/// Where an effect is missing and nobody looked for it: what does.
pub fn missing_effect_step(run: &Run) -> Option<String> {
    if !run.is_pool() {
        return None;
    }
    let times = run.calibration.left_over();
    let errors = run.errors_by_recording();
    let mean_m = |at: &usize| errors[*at].calibrated.mean_m;
    let worst = (0..errors.len()).max_by(|a, b| mean_m(a).total_cmp(&mean_m(b)))?;
    (times.is_finite() && times > INADEQUATE).then(|| {
        format!(
            "errors are {times:.1} times what the declared noise gives, most in `{}` ({} mm): pool again with `[diagnosis] enabled = true`, which \
             looks for what is missing and for what moved between the recordings",
            printable_name(&run.recordings[worst].name),
            format_mm(errors[worst].calibrated.mean_m)
        )
    })
}

/// What an unseen day errs more is worth a word from this share of the floor on.
const WORTH_A_WORD: f64 = 0.1;

/// Where a day that the calibration never saw errs more by more than chance.
pub fn unseen_day_step(run: &Run) -> Option<String> {
    let unseen = run.transfer.as_ref()?;
    let more = PairedDifference::between(&run.observations, &run.calibration, unseen)?;
    let [low, high] = more.ci95_m;
    let much = more.difference_m > WORTH_A_WORD * run.calibration.noise_floor_m;
    (low > 0.0 && high.is_finite() && much).then(|| {
        format!(
            "on a day that it never saw it errs {} mm more (95 % {} to {}): look for what changes from day to day, and give that to \
             each recording (`[pool] per_recording`), or pool more days",
            format_mm(more.difference_m),
            format_mm(low),
            format_mm(high)
        )
    })
}
