//! Mistakes that leave no trace: with them undone the data fit as well as they are.

use super::hypotheses::sign_reversal;
use super::trial::{Misfit, compute_misfit};
use super::weigh::SAME_FACTOR;
use armcal_core::Unseen;
use armcal_core::units::format_mm;
use armcal_stages::Inputs;

/// The sign of the last joint, where it only turns the tool about its own axis. Of `inputs`, which fit like `now`.
pub fn untestable_sign(inputs: &Inputs, now: &Misfit) -> Option<Unseen> {
    let names = inputs.chain.joint_names();
    let hypothesis = sign_reversal(names, vec![names.len().checked_sub(1)?]);
    let undone = hypothesis.undone(inputs);
    let misfit = compute_misfit(&undone, &undone.fit().ok()?);
    let same = misfit.used == now.used && (misfit.log - now.log).abs() < SAME_FACTOR.ln();
    same.then(|| Unseen {
        code: hypothesis.code,
        message: format!(
            "with {} the mean error would be {} mm instead of {}: these data cannot show whether its sign is right, nor calibrate \
             what it turns; turn it by hand and compare",
            hypothesis.change,
            format_mm(misfit.mean_m),
            format_mm(now.mean_m)
        ),
        subject: hypothesis.subject,
    })
}
