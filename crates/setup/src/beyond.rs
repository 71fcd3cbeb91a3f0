//! Whether what a change estimates comes out further off than physics moves it.

use super::attempt::Tried;
use super::hypotheses::{Freedom, Hypothesis};
use super::trial::{Misfit, compute_misfit};
use super::weigh::{EXPLAINED, WORTH_LOOKING};
use armcal_core::{Code, Pose};
use armcal_model::{EffectSpec, EffectTable};
use armcal_stages::{Fitted, Inputs};
use rayon::prelude::*;
use std::cell::OnceCell;

/// A frame that is estimated is a mistake of the setup only if it lies this far from where it was taken to be, beyond
/// what any effect of the catalogue moves it [m], [rad].
pub const FAR_M: f64 = 0.01;
pub const FAR_RAD: f64 = 0.05;
/// Dwells of a recording at which an event is tried first.
const COARSE_STEPS: usize = 8;

/// What physics could do to the inputs as they are, beside which changes of them are judged.
pub struct Physics<'a> {
    now: &'a Inputs,
    /// Their fit.
    fitted: Option<&'a Fitted>,
    /// Of each recording whether one effect that begins with it explains the errors, once somebody asked.
    begins: Vec<OnceCell<bool>>,
}

impl<'a> Physics<'a> {
    pub fn of(now: &'a Inputs, fitted: Option<&'a Fitted>) -> Physics<'a> {
        Physics { now, fitted, begins: now.seen.iter().map(|_| OnceCell::new()).collect() }
    }

    /// Whether what was estimated lies further off than any effect of the catalogue could move it; a sign or an order always
    /// does.
    pub fn is_outdone_by(&self, t: &Tried) -> bool {
        let estimates = &t.fitted.calibration.fit.estimates;
        match t.hypothesis.freedom {
            Freedom::Discrete => true,
            Freedom::Number | Freedom::Frame if !t.hypothesis.estimated.is_empty() => {
                t.hypothesis.estimated.iter().any(|own| {
                    let of = estimates.iter().filter(|e| e.parameter.name == own.parameter);
                    of.into_iter().any(|e| (e.value - own.nominal).abs() > own.far)
                })
            }
            Freedom::Number => {
                t.hypothesis.number.as_ref().is_none_or(|n| (n.value - n.nothing).abs() >= n.far)
            }
            Freedom::Frame => self.fitted.is_none_or(|before| match t.hypothesis.code {
                Code::RecordingsDisagree => {
                    t.misfit.times_floor() < WORTH_LOOKING && !self.one_effect_explains(&t.hypothesis)
                }
                Code::TargetOffset => before.calibration.times_floor() > EXPLAINED,
                code => {
                    let by = frame_displacement(self.now, code, before, &t.fitted);
                    by.is_none_or(|(m, rad)| m > FAR_M || rad > FAR_RAD) && !self.one_recording_differs()
                }
            }),
        }
    }

    /// Whether a change lets a frame go that is elsewhere than it was taken to be in every recording, near or far.
    pub fn leaves_standing(&self, t: &Tried) -> bool {
        let moves =
            |before: &Fitted| frame_displacement(self.now, t.hypothesis.code, before, &t.fitted).is_some();
        self.fitted.is_some_and(moves) && !self.one_recording_differs()
    }

    /// Whether one effect that begins with a recording explains the errors of all: a frame that is let go in every recording
    /// takes a share of it in each, and with the arm's own parameters may end anywhere.
    fn one_recording_differs(&self) -> bool {
        self.begins.len() > 1 && (0..self.begins.len()).any(|recording| self.begins_with(recording))
    }

    /// Whether one effect that begins with the recording, or at a dwell of it, explains how it differs. Then it is physics, and
    /// the diagnosis will name it.
    fn one_effect_explains(&self, h: &Hypothesis) -> bool {
        let Some(recording) = h.recording else { return false };
        let dwells = self.now.seen[recording].dwells.len();
        let at =
            |event: &String, dwell: usize| times_floor(self.now, &format!("{event}@{recording}.{dwell}"));
        self.begins_with(recording)
            || event_effects(self.now)
                .iter()
                .any(|event| is_explained(least_at_a_dwell(dwells, |dwell| at(event, dwell))))
    }

    fn begins_with(&self, recording: usize) -> bool {
        let begins = |event: &String| is_explained(times_floor(self.now, &format!("{event}@{recording}")));
        *self.begins[recording].get_or_init(|| event_effects(self.now).iter().any(begins))
    }
}

/// How far one pose lies from another [m], [rad].
pub fn pose_distance(a: &Pose, b: &Pose) -> (f64, f64) {
    let by = a.inverse() * b;
    (by.translation.vector.norm(), by.rotation.angle())
}

/// How far the frame that a hypothesis estimates moves from one fit to the other [m], [rad]; the furthest over the
/// recordings. None where it is not about a frame.
pub fn frame_displacement(now: &Inputs, code: Code, from: &Fitted, to: &Fitted) -> Option<(f64, f64)> {
    let (a, b) = (&from.model, &to.model);
    let (p, q) = (from.calibration.fit.values(), to.calibration.fit.values());
    match code {
        Code::BaseFrame => Some(pose_distance(&a.base_in_world(&p), &b.base_in_world(&q))),
        Code::ToolFrame => Some(pose_distance(&a.tip_in_last_link(&p), &b.tip_in_last_link(&q))),
        Code::BoardPose => {
            let of = |r: usize| Some(pose_distance(&a.board_in_world(&p, r)?, &b.board_in_world(&q, r)?));
            (0..now.seen.len()).filter_map(of).reduce(|x, y| (x.0.max(y.0), x.1.max(y.1)))
        }
        _ => None,
    }
}

/// What happens to an arm at one moment: a tool or frame is shifted, a zero slips.
fn event_effects(now: &Inputs) -> Vec<String> {
    let zeros = (1..=now.chain.joint_names().len()).map(|j| format!("zero_slip:{j}"));
    ["tool_shift", "tip_marker_shift", "frame_shift", "board_shift"]
        .map(str::to_owned)
        .into_iter()
        .chain(zeros)
        .collect()
}

fn times_floor(now: &Inputs, since: &str) -> Option<f64> {
    Some(with_effect(now, since)?.times_floor())
}

fn is_explained(times_floor: Option<f64>) -> bool {
    times_floor.is_some_and(|floors| floors < WORTH_LOOKING)
}

/// The misfit with one more effect.
fn with_effect(now: &Inputs, name: &str) -> Option<Misfit> {
    let spec = EffectSpec::parse(name, now.chain.joint_names()).ok()?;
    let mut inputs = now.clone();
    inputs.pipeline.effects.push(EffectTable::from(&spec));
    let fitted = inputs.fit().ok()?;
    Some(compute_misfit(&inputs, &fitted))
}

/// The least of what an event at one of the dwells leaves, by halving the stride around the best of a coarse grid: what an
/// event at the wrong dwell leaves grows with the distance from the right one.
fn least_at_a_dwell(dwells: usize, leaves: impl Fn(usize) -> Option<f64> + Sync) -> Option<f64> {
    let mut stride = (dwells / COARSE_STEPS).max(1);
    let least = |of: Vec<usize>| {
        let all = of.into_par_iter().filter_map(|dwell| Some((leaves(dwell)?, dwell)));
        all.collect::<Vec<_>>().into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut best = least((1..dwells).step_by(stride).collect())?;
    while stride > 1 {
        stride = stride.div_ceil(2);
        let (low, high) = (best.1.saturating_sub(stride).max(1), best.1 + stride);
        let near = [low, high].into_iter().filter(|dwell| *dwell < dwells && *dwell != best.1).collect();
        best = least(near).filter(|other| other.0 < best.0).unwrap_or(best);
    }
    Some(best.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_dwell_of_an_event_is_found(dwells in 2usize..300, share in 0.0..1.0f64) {
            let event = 1 + (share * (dwells - 1) as f64) as usize;
            let leaves = |dwell: usize| Some(1.0 + dwell.abs_diff(event) as f64);
            prop_assert_eq!(least_at_a_dwell(dwells, leaves), Some(1.0));
        }
    }

    #[test]
    fn a_recording_without_a_second_dwell_has_no_event() {
        assert_eq!(least_at_a_dwell(1, |_| Some(0.0)), None);
        assert_eq!(least_at_a_dwell(20, |_| None), None);
    }
}
