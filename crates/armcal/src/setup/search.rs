//! Every hypothesis against the inputs as they are: which one change explains the errors?

use super::hypotheses::{Estimated, Freedom, Hypothesis, Number, hypotheses};
use super::trial::{Inputs, Misfit};
use crate::pipeline::FramePose;
use crate::story::Fitted;
use armcal_calibrate::Calibration;
use armcal_core::{Certainty, Parameter, Pose, Role, SetupFinding, SetupReport};
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
/// The same of a change that estimates something.
const ESTIMATED_EXPLAINED: f64 = 3.0;
/// A frame that is estimated is a mistake of the setup only if it lies this far from where it was taken to be, beyond
/// what any effect of the catalogue moves it [m], [rad].
const FAR_M: f64 = 0.01;
const FAR_RAD: f64 = 0.05;

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
        let mut tried = Vec::new();
        for some in hypotheses(&now, &at_bound) {
            // A frame that is let go takes a share of anything: what is rarer may still fit better.
            if tried.iter().all(|t: &Tried| t.hypothesis.freedom == Freedom::Frame) {
                report.tried += some.len();
                tried.extend(explaining(&now, first.as_ref(), &before, some));
            }
        }
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
        report.findings.extend(fitted.and_then(|fitted| each_alone(inputs, fitted, &begun)));
        return;
    }
    if let [(only, _)] = &found[..]
        && only.recording.is_some()
        && let Some(finding) = fitted.and_then(|fitted| each_alone(inputs, fitted, &begun))
    {
        report.findings.push(finding);
        return;
    }
    // Everything together on all dwells and the pipeline's own hold-out: the numbers that are reported.
    let mut mended = inputs.clone();
    found.iter().for_each(|(h, _)| mended = h.undone(&mended));
    let after_fit = mended.fit().ok();
    let after = after_fit.as_ref().map(|f| f.calibration.clone());
    let together = found.iter().map(|(h, _)| h.change.as_str()).collect::<Vec<_>>().join(" and ");
    for (h, alternatives) in &found {
        let (before, after) = ((judged, begun), (after.as_ref(), before));
        let ends = match (fitted, &after_fit) {
            (Some(from), Some(to)) => moved_frame(&mended, h, from, to),
            _ => None,
        };
        report.findings.push(finding(h, &together, alternatives, ends, before, after));
    }
}

/// Whether each recording fits by itself with a base of its own, where all together do not: something moved between them,
/// further than any effect of the catalogue moves it.
fn each_alone(inputs: &Inputs, together: &Fitted, before: &Misfit) -> Option<SetupFinding> {
    if inputs.seen.len() < 2 || before.times_floor() < EXPLAINED {
        return None;
    }
    let alone = |r: usize| {
        let mut own = inputs.for_trials();
        own.pipeline.frames.base.pose = FramePose::Estimated;
        own.seen.iter_mut().enumerate().filter(|(k, _)| *k != r).for_each(|(_, s)| s.dwells.clear());
        let fitted = own.fit().ok()?;
        let misfit = own.misfit(&fitted);
        let base = fitted.model.base_in_world(&fitted.calibration.fit.values());
        (misfit.times_floor() < WORTH_LOOKING).then_some((misfit, base))
    };
    let alone: Vec<(Misfit, Pose)> =
        (0..inputs.seen.len()).into_par_iter().map(alone).collect::<Option<_>>()?;
    let by = |a: &Pose, b: &Pose| {
        let by = a.inverse() * b;
        (by.translation.vector.norm(), by.rotation.angle())
    };
    let apart: Vec<(f64, f64)> = alone.windows(2).map(|w| by(&w[0].1, &w[1].1)).collect();
    let k = (0..apart.len()).max_by(|a, b| apart[*a].0.total_cmp(&apart[*b].0))?;
    let (m, rad) = apart[k];
    if m < FAR_M && rad < FAR_RAD {
        return None;
    }
    let n = alone.iter().map(|a| a.0.used).sum::<usize>().max(1) as f64;
    let after_mm = alone.iter().map(|a| a.0.mean_m * a.0.used as f64).sum::<f64>() / n * 1e3;
    let before_mm = together.calibration.judged().fitted.mean_m * 1e3;
    let names = [&inputs.seen[k].name, &inputs.seen[k + 1].name];
    Some(SetupFinding {
        code: "frame-moved",
        subject: format!("recordings `{}` and `{}`", names[0], names[1]),
        message: format!(
            "each recording fits by itself (mean error {} mm), all together leave {} mm: between `{}` and `{}` the arm's base moved \
             by {} mm and turned by {:.2} deg as the sensor or the board sees it; the arm, the sensor or the board was moved, or \
             it is another arm or tool: give \
             what was recorded after that a pipeline of its own (`armcal pool` fits them together)",
            millimetres(after_mm),
            millimetres(before_mm),
            names[0],
            names[1],
            millimetres(m * 1e3),
            rad.to_degrees()
        ),
        certainty: Certainty::Mistake,
        before_mm: Some(before_mm),
        after_mm: Some(after_mm),
        alternatives: Vec::new(),
    })
}

/// The logarithmic misfit of nothing fitted at all.
const WORST_LOG: f64 = 5.7;

/// Whether the errors, or dwells at the board that no cavity wants, give a reason to look.
fn in_doubt(m: &Misfit) -> bool {
    let at_board = (m.seated + m.homeless) as f64;
    let homeless = m.homeless >= HOMELESS && m.homeless as f64 >= HOMELESS_SHARE * at_board;
    m.mean_m.is_infinite() || m.times_floor() >= WORTH_LOOKING || homeless
}

/// Those of the hypotheses that explain the errors, fitted.
fn explaining(now: &Inputs, first: Option<&Fitted>, before: &Misfit, all: Vec<Hypothesis>) -> Vec<Tried> {
    let mut tried: Vec<Tried> = all.into_par_iter().filter_map(|h| attempt(now, h)).collect();
    refine_numbers(now, before, &mut tried);
    tried.retain(|t| explains(before, &t.misfit) && beyond_physics(now, first, t) && far_enough(before, t));
    tried
}

/// Whether a change comes near the floor, or divides the errors so much that the rest is another mistake. What estimates
/// a number always takes a share of an error that is not its own.
fn far_enough(before: &Misfit, t: &Tried) -> bool {
    let near = match t.hypothesis.freedom {
        Freedom::Discrete => EXPLAINED,
        Freedom::Number | Freedom::Frame => ESTIMATED_EXPLAINED,
    };
    t.misfit.times_floor() < near || t.misfit.log < before.log - EXPLAINED.ln()
}

/// Of each number the value that fits best, refined; the other values are dropped.
fn refine_numbers(now: &Inputs, before: &Misfit, tried: &mut Vec<Tried>) {
    let of_number = |t: &Tried| t.hypothesis.number.is_some();
    let name = |t: &Tried| (t.hypothesis.code, t.hypothesis.subject.clone());
    let mut numbers: Vec<(&'static str, String)> = tried.iter().filter(|t| of_number(t)).map(name).collect();
    numbers.dedup();
    for number in numbers {
        let own = |t: &Tried| of_number(t) && name(t) == number;
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
    // Dwells that fit as they are, and dwells that no change can place, hide in a mean of logarithms what happens to the
    // rest: then no dwell may be lost for it.
    let keeps = after.used >= before.used && after.homeless <= before.homeless && after.log < before.log;
    let all = before.log - after.log >= LEAST_FACTOR.ln();
    let falls = after.mean_m <= before.mean_m / LEAST_FACTOR && (all || keeps);
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

fn at_bound(fitted: &Fitted) -> Vec<Parameter> {
    let estimates = &fitted.calibration.fit.estimates;
    let own = estimates.iter().filter(|e| e.at_bound && e.parameter.role == Role::Robot);
    own.map(|e| e.parameter.clone()).collect()
}

/// Whether what was estimated lies further off than any effect of the catalogue could move it; a sign or an order always
/// does.
fn beyond_physics(now: &Inputs, before: Option<&Fitted>, t: &Tried) -> bool {
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

/// How far the frame that a hypothesis estimates moves from one fit to the other [m], [rad]; the furthest over the
/// recordings. None where it is not about a frame.
fn moved(now: &Inputs, code: &str, from: &Fitted, to: &Fitted) -> Option<(f64, f64)> {
    let by = |from: Pose, to: Pose| {
        let by = from.inverse() * to;
        (by.translation.vector.norm(), by.rotation.angle())
    };
    let (a, b) = (&from.model, &to.model);
    let (p, q) = (from.calibration.fit.values(), to.calibration.fit.values());
    match code {
        "base-frame" => Some(by(a.base_in_world(&p), b.base_in_world(&q))),
        "tool-frame" => Some(by(a.tip_in_last_link(&p), b.tip_in_last_link(&q))),
        "board-pose" => {
            let of = |r: usize| Some(by(a.board_in_world(&p, r)?, b.board_in_world(&q, r)?));
            (0..now.seen.len()).filter_map(of).reduce(|x, y| (x.0.max(y.0), x.1.max(y.1)))
        }
        _ => None,
    }
}

/// The same in words.
fn moved_frame(now: &Inputs, h: &Hypothesis, from: &Fitted, to: &Fitted) -> Option<String> {
    let (m, rad) = moved(now, h.code, from, to)?;
    Some(format!(
        " ({} moved by {} mm and turned by {:.2} deg from where it was taken to be)",
        h.subject,
        millimetres(m * 1e3),
        rad.to_degrees()
    ))
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
    moved: Option<String>,
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
    let ends = moved.unwrap_or_else(|| after.map_or(String::new(), |c| estimated(h, c)));
    SetupFinding {
        code: h.code,
        subject: h.subject.clone(),
        message: format!("{with} {falls}{ends}; {}", h.remedy),
        certainty: Certainty::Mistake,
        before_mm,
        after_mm: Some(after_mm),
        alternatives: alternatives.to_vec(),
    }
}

/// Parameters of a change that are told, at most.
const TOLD: usize = 3;

/// Where the parameters of a change come out, the furthest first.
fn estimated(h: &Hypothesis, c: &Calibration) -> String {
    let of = |own: &Estimated| {
        let e = c.fit.estimates.iter().find(|e| e.parameter.name == own.parameter)?;
        let (unit, off) = (e.parameter.unit, e.value - own.nominal);
        let symbol = unit.display_symbol();
        let gap = if symbol.is_empty() { "" } else { " " };
        let words = format!("{} is off by {:+.3}{gap}{symbol}", own.parameter, unit.to_display(off));
        (off.abs() > own.far).then_some((off.abs() / own.far, words))
    };
    let mut words: Vec<(f64, String)> = h.estimated.iter().filter_map(of).collect();
    words.sort_by(|a, b| b.0.total_cmp(&a.0));
    let words: Vec<String> = words.into_iter().take(TOLD).map(|w| w.1).collect();
    if words.is_empty() { String::new() } else { format!(" ({})", words.join(", ")) }
}

/// Three digits that count.
fn millimetres(mm: f64) -> String {
    match mm {
        mm if mm >= 100.0 => format!("{mm:.0}"),
        mm if mm >= 1.0 => format!("{mm:.2}"),
        mm => format!("{mm:.3}"),
    }
}
