//! Recordings of which each fits by itself and all together do not: what moved between them?

use super::beyond::{FAR_M, FAR_RAD, pose_distance};
use super::trial::{Misfit, compute_misfit, for_trials};
use super::weigh::{EXPLAINED, WORTH_LOOKING};
use armcal_config::FramePose;
use armcal_core::units::format_mm;
use armcal_core::{Certainty, Code, Pose, SetupFinding};
use armcal_stages::{Fitted, Inputs};
use rayon::prelude::*;

/// Whether each recording fits by itself with a base of its own, where all together do not: something moved between them,
/// further than any effect of the catalogue moves it.
pub fn each_alone(inputs: &Inputs, together: &Fitted, before: &Misfit) -> Option<SetupFinding> {
    if inputs.seen.len() < 2 || before.times_floor() < EXPLAINED {
        return None;
    }
    let alone = |r: usize| {
        let mut own = for_trials(inputs, Some(together));
        own.pipeline.frames.base.pose = FramePose::Estimated;
        own.seen.iter_mut().enumerate().filter(|(k, _)| *k != r).for_each(|(_, s)| s.dwells.clear());
        let fitted = own.fit().ok()?;
        let misfit = compute_misfit(&own, &fitted);
        let base = fitted.model.base_in_world(&fitted.calibration.fit.values());
        (misfit.times_floor() < WORTH_LOOKING).then_some((misfit, base))
    };
    let alone: Vec<(Misfit, Pose)> =
        (0..inputs.seen.len()).into_par_iter().map(alone).collect::<Option<_>>()?;
    let moves: Vec<(f64, f64)> = alone.windows(2).map(|w| pose_distance(&w[0].1, &w[1].1)).collect();
    let k = (0..moves.len()).max_by(|a, b| moves[*a].0.total_cmp(&moves[*b].0))?;
    let (m, rad) = moves[k];
    if m < FAR_M && rad < FAR_RAD {
        return None;
    }
    let n = alone.iter().map(|a| a.0.used).sum::<usize>().max(1) as f64;
    let after_m = alone.iter().map(|a| a.0.mean_m * a.0.used as f64).sum::<f64>() / n;
    let before_m = together.calibration.judged().fitted.mean_m;
    let names = [&inputs.seen[k].name, &inputs.seen[k + 1].name];
    Some(SetupFinding {
        code: Code::FrameMoved,
        subject: format!("recordings `{}` and `{}`", names[0], names[1]),
        message: format!(
            "each recording fits by itself (mean error {} mm), all together leave {} mm: between `{}` and `{}` the \
             arm's base moved by {} mm and turned by {:.2} deg as the sensor or the board sees it; the arm, the sensor or the board was moved, or \
             it is another arm or tool: give what was recorded after that a pipeline of its own (`armcal pool` fits them \
             together)",
            format_mm(after_m),
            format_mm(before_m),
            names[0],
            names[1],
            format_mm(m),
            rad.to_degrees()
        ),
        certainty: Certainty::Mistake,
        before_mm: Some(before_m * 1e3),
        after_mm: Some(after_m * 1e3),
        alternatives: Vec::new(),
        gives_way: false,
        mend: None,
    })
}
