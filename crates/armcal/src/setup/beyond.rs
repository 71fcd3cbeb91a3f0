//! Whether what a change estimates comes out further off than physics moves it.

use super::attempt::Tried;
use super::hypotheses::{Freedom, Hypothesis};
use super::trial::Inputs;
use super::weigh::{EXPLAINED, WORTH_LOOKING};
use crate::story::Fitted;
use armcal_core::Pose;
use armcal_model::{EffectSpec, EffectTable};

/// A frame that is estimated is a mistake of the setup only if it lies this far from where it was taken to be, beyond
/// what any effect of the catalogue moves it [m], [rad].
pub const FAR_M: f64 = 0.01;
pub const FAR_RAD: f64 = 0.05;

/// Whether what was estimated lies further off than any effect of the catalogue could move it; a sign or an order always
/// does.
pub fn beyond_physics(now: &Inputs, before: Option<&Fitted>, t: &Tried) -> bool {
    let estimates = &t.fitted.calibration.fit.estimates;
    match t.hypothesis.freedom {
        Freedom::Discrete => true,
        Freedom::Number | Freedom::Frame if !t.hypothesis.estimated.is_empty() => {
            t.hypothesis.estimated.iter().any(|own| {
                let of = estimates.iter().filter(|e| e.parameter.name == own.parameter);
                of.into_iter().any(|e| (e.value - own.nominal).abs() > own.far)
            })
        }
        Freedom::Number => t.hypothesis.number.as_ref().is_none_or(|n| (n.value - n.nothing).abs() >= n.far),
        Freedom::Frame => before.is_none_or(|before| match t.hypothesis.code {
            "recordings-disagree" => {
                t.misfit.times_floor() < WORTH_LOOKING && !one_effect_explains(now, &t.hypothesis)
            }
            "target-offset" => before.calibration.times_floor() > EXPLAINED,
            code => moved(now, code, before, &t.fitted).is_none_or(|(m, rad)| m > FAR_M || rad > FAR_RAD),
        }),
    }
}

/// How far one pose lies from another [m], [rad].
pub fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let by = a.inverse() * b;
    (by.translation.vector.norm(), by.rotation.angle())
}

/// How far the frame that a hypothesis estimates moves from one fit to the other [m], [rad]; the furthest over the
/// recordings. None where it is not about a frame.
pub fn moved(now: &Inputs, code: &str, from: &Fitted, to: &Fitted) -> Option<(f64, f64)> {
    let (a, b) = (&from.model, &to.model);
    let (p, q) = (from.calibration.fit.values(), to.calibration.fit.values());
    match code {
        "base-frame" => Some(apart(&a.base_in_world(&p), &b.base_in_world(&q))),
        "tool-frame" => Some(apart(&a.tip_in_last_link(&p), &b.tip_in_last_link(&q))),
        "board-pose" => {
            let of = |r: usize| Some(apart(&a.board_in_world(&p, r)?, &b.board_in_world(&q, r)?));
            (0..now.seen.len()).filter_map(of).reduce(|x, y| (x.0.max(y.0), x.1.max(y.1)))
        }
        _ => None,
    }
}

/// Whether one effect that begins with the recording explains how it differs: a tool or frame that was shifted, a zero that
/// slipped. Then it is physics, and the diagnosis will name it.
fn one_effect_explains(now: &Inputs, h: &Hypothesis) -> bool {
    let Some(recording) = h.recording else { return false };
    let joints = now.chain.joint_names();
    let zeros = (1..=joints.len()).map(|j| format!("zero_slip:{j}@{recording}"));
    let shifts = ["tool_shift", "frame_shift"].map(|kind| format!("{kind}@{recording}"));
    shifts.into_iter().chain(zeros).any(|name| {
        let mut inputs = now.clone();
        let Ok(spec) = EffectSpec::parse(&name, joints) else { return false };
        inputs.pipeline.effects.push(EffectTable::from(&spec));
        inputs.fit().is_ok_and(|fitted| inputs.misfit(&fitted).times_floor() < WORTH_LOOKING)
    })
}
