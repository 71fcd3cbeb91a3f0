//! Mistakes that leave no trace: with them undone the data fit as well as they are.

use super::hypotheses::reversed;
use super::trial::{Misfit, misfit};
use super::weigh::SAME_FACTOR;
use armcal_core::Unseen;
use armcal_core::units::millimetres;
use armcal_stages::Inputs;

/// The sign of the last joint, where it only turns the tool about its own axis. Of `inputs`, which fit like `now`.
pub fn unseen(inputs: &Inputs, now: &Misfit) -> Option<Unseen> {
    let names = inputs.chain.joint_names();
    let hypothesis = reversed(names, vec![names.len().checked_sub(1)?]);
    let undone = hypothesis.undone(inputs);
    let misfit = misfit(&undone, &undone.fit().ok()?);
    let same = misfit.used == now.used && (misfit.log - now.log).abs() < SAME_FACTOR.ln();
    same.then(|| Unseen {
        code: hypothesis.code.into(),
        message: format!(
            "with {} the mean error would be {} mm instead of {}: these data cannot show whether its sign is right, nor calibrate \
             what it turns; turn it by hand and compare",
            hypothesis.change,
            millimetres(misfit.mean_m),
            millimetres(now.mean_m)
        ),
        subject: hypothesis.subject,
    })
}
