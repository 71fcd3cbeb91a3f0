//! What is said of a calibration of earlier results beside what is said of any: whether it holds on another day, and what to do
//! where it does not. Of any other run nothing.

use armcal_calibrate::{INADEQUATE, PairedDifference};
use armcal_core::printable;
use armcal_core::units::millimetres;
use armcal_result::Run;

/// What the calibration is worth on another day.
pub fn transfer(run: &Run) -> String {
    let Some(transfer) = &run.transfer else { return String::new() };
    let side = &transfer.holdout;
    format!(
        " On recordings that it never saw it is {} mm (nominal {} mm).",
        millimetres(side.fitted.mean_m),
        millimetres(side.nominal.mean_m)
    )
}

/// Where an effect is missing and nobody looked for it: what does.
pub fn effect(run: &Run) -> Option<String> {
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
            printable(&run.recordings[worst].name),
            millimetres(errors[worst].calibrated.mean_m)
        )
    })
}

/// What an unseen day errs more is worth a word from this share of the floor on.
const WORTH_A_WORD: f64 = 0.1;

/// Where a day that the calibration never saw errs more by more than chance.
pub fn days(run: &Run) -> Option<String> {
    let unseen = run.transfer.as_ref()?;
    let more = PairedDifference::between(&run.observations, &run.calibration, unseen)?;
    let [low, high] = more.ci95_m;
    let much = more.difference_m > WORTH_A_WORD * run.calibration.noise_floor_m;
    (low > 0.0 && high.is_finite() && much).then(|| {
        format!(
            "on a day that it never saw it errs {} mm more (95 % {} to {}): look for what changes from day to day, and give that to \
             each recording (`[pool] per_recording`), or pool more days",
            millimetres(more.difference_m),
            millimetres(low),
            millimetres(high)
        )
    })
}
