//! Every hypothesis against the inputs as they are: which one change explains the errors?

use super::hypotheses::{Freedom, Hypothesis, Number, hypotheses};
use super::trial::{Inputs, Misfit};
use crate::story::Fitted;
use armcal_calibrate::Calibration;
use armcal_core::{Certainty, Role, SetupFinding, SetupReport};
use armcal_model::{EffectSpec, EffectTable};
use rayon::prelude::*;

/// Errors below this many times the floor give no reason to look.
const WORTH_LOOKING: f64 = 1.5;
/// A change that undoes a mistake divides the errors by at least this.
const LEAST_FACTOR: f64 = 3.0;
/// Changes that fit within this factor of each other are not told apart.
const ALIKE_FACTOR: f64 = 1.3;
/// Mistakes one upon the other.
const MOST_MISTAKES: usize = 3;
/// With this many dwells at the board and in no cavity, and this share of all there, the board is in doubt.
const HOMELESS: usize = 5;
const HOMELESS_SHARE: f64 = 0.1;
/// A change of the board that seats this many times as many dwells, the errors no larger than at the floor, undoes a
/// mistake.
const SEATED_FACTOR: f64 = 1.4;
/// Steps of a search between two neighbours.
const REFINEMENTS: usize = 10;
/// With a change that explains the errors they come within this many times the floor.
const EXPLAINED: f64 = 10.0;
/// A frame that is estimated is a mistake of the setup only if it lies this far from where it was taken to be, beyond
/// what any effect of the catalogue moves it [m], [rad].
const FAR_M: f64 = 0.01;
const FAR_RAD: f64 = 0.05;
/// The same of a parameter that leaves its bounds: this many times its bound.
const FAR_BOUNDS: f64 = 1.1;

/// A hypothesis and how well the inputs fit with it.
struct Tried {
    hypothesis: Hypothesis,
    inputs: Inputs,
    fitted: Fitted,
    misfit: Misfit,
}

/// Searches one mistake after the other while each divides the errors, and adds what it finds to the report.
/// `fitted` is the calibration as it came; none where there was no way to calibrate.
pub fn search(inputs: &Inputs, fitted: Option<&Fitted>, report: &mut SetupReport) {
    let mut now = inputs.for_trials();
    let mut first = now.fit().ok();
    let judged = fitted.map(|f| &f.calibration);
    let mut found: Vec<(Hypothesis, Vec<String>)> = Vec::new();
    let mut before = first.as_ref().map_or(Misfit::NOTHING, |f| now.misfit(f));
    if before.mean_m.is_infinite() {
        before.log = WORST_LOG;
    }
    let begun = before;
    while found.len() < MOST_MISTAKES && in_doubt(&before) {
        let at_bound = first.as_ref().map(at_bound).unwrap_or_default();
        let all = hypotheses(&now, &at_bound);
        report.tried += all.len();
        let mut tried: Vec<Tried> = all.into_par_iter().filter_map(|h| attempt(&now, h)).collect();
        refine_numbers(&now, &before, &mut tried);
        tried.retain(|t| explains(&before, &t.misfit) && beyond_physics(&now, first.as_ref(), t));
        tried.retain(|t| t.misfit.times_floor() < EXPLAINED || t.misfit.log < before.log - EXPLAINED.ln());
        let Some(best) = best(&tried) else { break };
        let alike = |t: &&Tried| {
            t.hypothesis.freedom == tried[best].hypothesis.freedom
                && (t.misfit.log - tried[best].misfit.log).abs() < ALIKE_FACTOR.ln()
        };
        let alternatives: Vec<String> = tried
            .iter()
            .enumerate()
            .filter(|(k, t)| *k != best && alike(t))
            .map(|(_, t)| t.hypothesis.change.clone())
            .collect();
        let Tried { hypothesis, inputs, fitted, misfit } = tried.swap_remove(best);
        found.push((hypothesis, alternatives));
        (now, first, before) = (inputs, Some(fitted), misfit);
    }
    if found.is_empty() {
        return;
    }
    // Everything together on all dwells and the pipeline's own hold-out: the numbers that are reported.
    let mut mended = inputs.clone();
    found.iter().for_each(|(h, _)| mended = h.undone(&mended));
    let after = mended.fit().ok().map(|f| f.calibration);
    let together = found.iter().map(|(h, _)| h.change.as_str()).collect::<Vec<_>>().join(" and ");
    for (h, alternatives) in &found {
        let (before, after) = ((judged, begun), (after.as_ref(), before));
        report.findings.push(finding(h, &together, alternatives, before, after));
    }
}

/// The logarithmic misfit of nothing fitted at all.
const WORST_LOG: f64 = 5.7;

/// Whether the errors, or dwells at the board that no cavity wants, give a reason to look.
fn in_doubt(m: &Misfit) -> bool {
    let at_board = (m.seated + m.homeless) as f64;
    let homeless = m.homeless >= HOMELESS && m.homeless as f64 >= HOMELESS_SHARE * at_board;
    m.mean_m.is_infinite() || m.times_floor() >= WORTH_LOOKING || homeless
}

/// Of each number the value that fits best, refined; the other values are dropped.
fn refine_numbers(now: &Inputs, before: &Misfit, tried: &mut Vec<Tried>) {
    let of_number = |t: &Tried| t.hypothesis.number.is_some();
    let mut codes: Vec<&'static str> =
        tried.iter().filter(|t| of_number(t)).map(|t| t.hypothesis.code).collect();
    codes.dedup();
    for code in codes {
        let own = |t: &Tried| of_number(t) && t.hypothesis.code == code;
        let values = tried.iter().filter(|t| own(t));
        let Some(best) = values.min_by(|a, b| a.misfit.log.total_cmp(&b.misfit.log)) else { continue };
        let refined = (best.misfit.log < before.log).then(|| refined(now, best)).flatten();
        tried.retain(|t| !own(t));
        tried.extend(refined);
    }
}

/// The best value of a number between the neighbours of the one that was tried, by golden section.
fn refined(now: &Inputs, tried: &Tried) -> Option<Tried> {
    let number = tried.hypothesis.number.as_ref()?;
    let ratio = (5f64.sqrt() - 1.0) / 2.0;
    let at = |value: f64| {
        let number = Some(Number { value, ..number.clone() });
        attempt(
            now,
            Hypothesis { number, freedom: Freedom::Number, ..(tried.hypothesis.number.as_ref()?.at)(value) },
        )
    };
    let [mut low, mut high] = number.between;
    let mut best = at(number.value);
    for _ in 0..REFINEMENTS {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        let (at_a, at_b) = (at(a), at(b));
        let mean = |t: &Option<Tried>| t.as_ref().map_or(f64::INFINITY, |t| t.misfit.mean_m);
        let left = mean(&at_a) < mean(&at_b);
        let better = if left { at_a } else { at_b };
        if mean(&better) < mean(&best) {
            best = better;
        }
        (low, high) = if left { (low, b) } else { (a, high) };
    }
    best
}

fn attempt(now: &Inputs, hypothesis: Hypothesis) -> Option<Tried> {
    let inputs = hypothesis.undone(now);
    let fitted = inputs.fit().ok()?;
    let misfit = inputs.misfit(&fitted);
    Some(Tried { hypothesis, inputs, fitted, misfit })
}

/// Whether a change divides the errors as only the right one does; or lets far more dwells be used, no worse.
fn explains(before: &Misfit, after: &Misfit) -> bool {
    let falls = before.log - after.log >= LEAST_FACTOR.ln() && after.mean_m <= before.mean_m / LEAST_FACTOR;
    let seats = after.seated as f64 >= SEATED_FACTOR * before.seated as f64
        && before.seated > 0
        && after.homeless < before.homeless
        && after.times_floor() <= before.times_floor().max(WORTH_LOOKING);
    falls || seats
}

/// The least freedom that comes within reach of the best fit.
fn best(tried: &[Tried]) -> Option<usize> {
    let lowest = tried.iter().map(|t| t.misfit.log).min_by(f64::total_cmp)?;
    let near = (0..tried.len()).filter(|k| tried[*k].misfit.log <= lowest + LEAST_FACTOR.ln() / 2.0);
    let least = near.clone().map(|k| tried[k].hypothesis.freedom).min()?;
    let free: Vec<usize> = near.filter(|k| tried[*k].hypothesis.freedom == least).collect();
    let lowest = free.iter().map(|k| tried[*k].misfit.log).min_by(f64::total_cmp)?;
    // Of what cannot be told apart the first in the list: a joint's sign is wrong more often than a row of the model.
    free.into_iter().find(|k| tried[*k].misfit.log <= lowest + ALIKE_FACTOR.ln())
}

fn at_bound(fitted: &Fitted) -> Vec<String> {
    let estimates = &fitted.calibration.fit.estimates;
    let own = estimates.iter().filter(|e| e.at_bound && e.parameter.role == Role::Robot);
    own.map(|e| e.parameter.name.clone()).collect()
}

/// Whether what was estimated lies further off than any effect of the catalogue could move it; a sign or an order always
/// does.
fn beyond_physics(now: &Inputs, before: Option<&Fitted>, t: &Tried) -> bool {
    let estimates = &t.fitted.calibration.fit.estimates;
    match t.hypothesis.freedom {
        Freedom::Discrete => true,
        Freedom::Number if t.hypothesis.code == "parameter-bound" => {
            estimates.iter().filter(|e| e.parameter.name == t.hypothesis.subject).any(|e| {
                let own = before.iter().flat_map(|f| &f.calibration.fit.estimates);
                let bound = own.filter(|b| b.parameter.name == e.parameter.name);
                let off = (e.value - e.parameter.nominal).abs();
                bound.into_iter().any(|b| off > FAR_BOUNDS * (b.parameter.upper - b.parameter.nominal).abs())
            })
        }
        Freedom::Number => t.hypothesis.number.as_ref().is_none_or(|n| (n.value - n.nothing).abs() >= n.far),
        Freedom::Frame => before.is_none_or(|before| {
            let moved = |from: armcal_core::Pose, to: armcal_core::Pose| {
                let by = from.inverse() * to;
                by.translation.vector.norm() > FAR_M || by.rotation.angle() > FAR_RAD
            };
            let (a, b) = (&before.model, &t.fitted.model);
            let (p, q) = (before.calibration.fit.values(), t.fitted.calibration.fit.values());
            match t.hypothesis.code {
                "base-frame" => moved(a.base_in_world(&p), b.base_in_world(&q)),
                "tool-frame" => moved(a.tip_in_last_link(&p), b.tip_in_last_link(&q)),
                "board-pose" => (0..now.seen.len()).any(|r| {
                    let poses = a.board_in_world(&p, r).zip(b.board_in_world(&q, r));
                    poses.is_some_and(|(from, to)| moved(from, to))
                }),
                "recordings-disagree" => {
                    t.misfit.times_floor() < WORTH_LOOKING && !one_effect_explains(now, &t.hypothesis)
                }
                _ => true,
            }
        }),
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

fn finding(
    h: &Hypothesis,
    together: &str,
    alternatives: &[String],
    (before, begun): (Option<&Calibration>, Misfit),
    (after, ended): (Option<&Calibration>, Misfit),
) -> SetupFinding {
    let judged_mm = |c: &Calibration| c.judged().fitted.mean_m * 1e3;
    let before_mm = before.map(judged_mm);
    let after_mm = after.map_or(ended.mean_m * 1e3, judged_mm);
    let held_out = match before {
        Some(c) if c.held_out() => "held-out ",
        _ => "",
    };
    let falls = match before_mm {
        Some(before_mm) if before_mm <= after_mm => format!(
            "{} instead of {} dwells sit in a cavity, and their mean {held_out}error is {} mm",
            ended.seated,
            begun.seated,
            millimetres(after_mm)
        ),
        Some(before_mm) => {
            format!(
                "the mean {held_out}error falls from {} to {} mm",
                millimetres(before_mm),
                millimetres(after_mm)
            )
        }
        None if begun.used == 0 => {
            format!(
                "{} dwells find their place, with a mean error of {} mm",
                ended.used,
                millimetres(after_mm)
            )
        }
        None => format!("the mean error is {} mm", millimetres(after_mm)),
    };
    let or = match alternatives.is_empty() {
        true => String::new(),
        false => format!(" (these data cannot tell it from: {})", armcal_core::listed(alternatives)),
    };
    let with =
        if together == h.change { format!("with {}{or}", h.change) } else { format!("with {together}{or}") };
    SetupFinding {
        code: h.code,
        subject: h.subject.clone(),
        message: format!("{with} {falls}; {}", h.remedy),
        certainty: Certainty::Mistake,
        before_mm,
        after_mm: Some(after_mm),
        alternatives: alternatives.to_vec(),
    }
}

/// Three digits that count.
fn millimetres(mm: f64) -> String {
    match mm {
        mm if mm >= 100.0 => format!("{mm:.0}"),
        mm if mm >= 1.0 => format!("{mm:.2}"),
        mm => format!("{mm:.3}"),
    }
}
