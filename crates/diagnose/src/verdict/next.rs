//! What to record next, in words.

use crate::diagnosis::{Diagnosis, FoundEffect, UnknownReport, Verdict};
use crate::problem::Problem;
use armcal_core::{Observation, Unit};
use armcal_model::EffectSpec;
use std::collections::BTreeSet;

/// What shows effects that the geometry takes over, where no other finding comes first.
const WITH_A_LOAD: &str =
    "repeat a dozen dwells with a known load, and add free poses over a wider range of every joint";
/// Readings of a joint nearer to each other than this are one angle [rad].
const ONE_ANGLE_RAD: f64 = 1e-4;
/// A gap between angles is worth a pose when it is so many times as wide as the usual one, and at least this [rad].
const WIDE: f64 = 3.0;
const WIDE_RAD: f64 = 0.02;
/// Poses that each period of an error needs at least.
const A_PERIOD: f64 = 4.0;
/// Gaps that one sentence names.
const GAPS: usize = 3;

/// Puts what the finding itself asks for before all else: the angles where a curve over a joint was not seen, the dwells in
/// which unexplained errors are largest.
pub(crate) fn prepend_findings(d: &mut Diagnosis, observations: &[Observation], joint_names: &[String]) {
    let over_its_angle = |joint: usize, frequency: Option<f64>| {
        let gaps =
            describe_gaps(observations.iter().filter_map(|o| o.joint_rad.get(joint).copied()), frequency)?;
        Some(format!("turn joint {} ({}) {gaps}", joint + 1, joint_names.get(joint)?))
    };
    let curves = d.unlisted.iter().filter(|u| u.unit == Unit::Radian).filter_map(UnknownReport::own_angle);
    let mut first: Vec<String> = curves.filter_map(|joint| over_its_angle(joint, None)).collect();
    let turning = |e: &&FoundEffect| e.parameters.iter().all(|p| p.unit == Unit::Radian);
    let named = d.effects.iter().filter(turning).filter_map(|e| EffectSpec::parse(&e.name, joint_names).ok());
    for e in named.filter(|e| e.kind == "periodic") {
        let frequency = e.shape.iter().find(|(name, _)| name == "frequency").map(|(_, n)| *n);
        first.extend(e.target.and_then(|joint| over_its_angle(joint, frequency)));
    }
    let beside = if d.refitted.is_some() { "with what was found in the model " } else { "" };
    if let Some(unexplained) = &d.unexplained {
        first.extend(unexplained.places.iter().map(|p| {
            let errors = match p.dwells {
                1 => "its error is".to_owned(),
                more => format!("the errors of these {more} dwells are"),
            };
            format!(
                "look first at {}: {beside}{errors} {:.1} times what the declared noise gives, those of the others {:.1} times",
                p.place, p.times_noise, p.elsewhere_times_noise
            )
        }));
    }
    // A load between two arms is shared in a way that nobody knows.
    let joined = observations.iter().any(Observation::is_joined);
    if joined || matches!(d.verdict, Verdict::Unknown | Verdict::Unexplained) {
        d.record_next.retain(|next| next != WITH_A_LOAD);
    }
    d.record_next.splice(0..0, first);
}

/// Where a joint was not read finely enough for an error over its own angle: of `frequency` periods a turn, or of a shape
/// that no formula follows. None where it was.
fn describe_gaps(angles_rad: impl Iterator<Item = f64>, frequency: Option<f64>) -> Option<String> {
    let mut angles: Vec<f64> = angles_rad.collect();
    angles.sort_by(f64::total_cmp);
    angles.dedup_by(|b, a| *b - *a < ONE_ANGLE_RAD);
    let mut gaps: Vec<[f64; 2]> = angles.windows(2).map(|w| [w[0], w[1]]).collect();
    let width = |gap: &[f64; 2]| gap[1] - gap[0];
    gaps.sort_by(|a, b| width(b).total_cmp(&width(a)));
    let usual_rad = width(gaps.get(gaps.len() / 2)?);
    let needed_rad = frequency
        .map_or((WIDE * usual_rad).max(WIDE_RAD), |n| std::f64::consts::TAU / (A_PERIOD * n.max(1.0)));
    let wide = gaps.iter().filter(|gap| width(gap) > needed_rad).count();
    let named: Vec<String> = (gaps[..wide.min(GAPS)].iter())
        .map(|[low, high]| format!("{:.1} to {:.1}", low.to_degrees(), high.to_degrees()))
        .collect();
    let more = if wide > GAPS { format!(" and {} more", wide - GAPS) } else { String::new() };
    (wide > 0).then(|| {
        format!(
            "in steps of at most {:.1} deg through {} deg{more}: its error over its own angle is not known where no pose was",
            needed_rad.to_degrees(),
            named.join(", ")
        )
    })
}

/// Recommendations that follow from what could not be told or not be tested.
pub(crate) fn record_next(problem: &Problem, diagnosis: &Diagnosis) -> Vec<String> {
    let mut all = Vec::new();
    if diagnosis.verdict == Verdict::Ambiguous {
        for e in diagnosis.effects.iter().filter(|e| e.set.len() > 1) {
            all.push(format!(
                "to tell {} apart: `armcal plan` proposes the dwells that separate them most, or says that only another \
                 sensor can",
                e.set.join(" and ")
            ));
        }
    }
    let untested = |word: &str| diagnosis.not_testable.iter().any(|n| n.why.contains(word));
    if untested("same side") || untested("arrival directions") {
        all.push(
            "enter some cavities (or poses) a second time from the other side in every joint".to_string(),
        );
    }
    if untested("load never changes") || (untested("takes over") && diagnosis.verdict != Verdict::Identified)
    {
        all.push(WITH_A_LOAD.to_owned());
    }
    if untested("takes over") {
        all.push(format!(
            "{} effects of realistic size could hide in these motions: `armcal plan` proposes the dwells in which they would show",
            diagnosis.not_testable.len()
        ));
    }
    let recordings: BTreeSet<usize> = problem.dwells.iter().map(|d| d.id.recording).collect();
    if recordings.len() == 1 {
        all.push("record the first part again at the end: with one recording, what changes between recordings cannot be seen".to_string());
    }
    let directions_known = problem.dwells.iter().any(|d| d.arrival.iter().any(|s| *s != 0.0));
    if !directions_known {
        all.push(
            "record the motion before each dwell: without arrival directions no lost motion can be tested"
                .to_string(),
        );
    }
    all
}

#[cfg(test)]
mod tests {
    use super::describe_gaps;

    #[test]
    fn gaps_are_told_by_the_period_or_by_the_usual_step() {
        // Every 5 deg from 0 to 100, none between 40 and 70; each angle twice.
        let degrees = (0..=20).map(|i| 5.0 * f64::from(i)).filter(|a| !(42.0..68.0).contains(a));
        let angles: Vec<f64> = degrees.flat_map(|a| [a, a + 1e-5]).map(f64::to_radians).collect();
        let told = |frequency| describe_gaps(angles.iter().copied(), frequency);
        assert!(
            told(None)
                .is_some_and(|g| g.starts_with("in steps of at most 15.0 deg through 40.0 to 70.0 deg:"))
        );
        // Ten periods a turn: a quarter of one is 9 deg. Thirty: 3 deg, which no step is below.
        assert!(told(Some(10.0)).is_some_and(|g| g.contains("at most 9.0 deg through 40.0 to 70.0 deg:")));
        assert!(told(Some(30.0)).is_some_and(|g| g.contains("and 12 more")));
        assert_eq!(told(Some(2.0)), None, "a quarter of a period is 45 deg");
        assert_eq!(describe_gaps([0.3; 9].into_iter(), None), None, "it never turned");
    }
}
