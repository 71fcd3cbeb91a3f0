//! Which of the names that look the same to the data is told first.

use crate::config::DiagnosisConfig;
use crate::judge::{Grade, Judged};
use crate::rooms::Room;
use armcal_model::Toggle;

/// The family that follows the measured effort of a joint.
const MEASURED: &str = "effort_compliance";

/// Of names that these data cannot tell apart, those that the user knows to act are the answer; with the others.
pub(crate) fn as_known(room: &Room, judged: Judged, config: &DiagnosisConfig) -> (Judged, Vec<String>) {
    let of = |k: &usize| &room.weighed.entries[*k].candidate;
    let Some(known) = judged.set.iter().copied().find(|k| of(k).known.is_some()) else {
        return (judged, Vec::new());
    };
    let mut judged = room.judge(known, config);
    let others: Vec<String> =
        judged.set.iter().map(of).filter(|c| c.known.is_none()).map(|c| c.spec.clone()).collect();
    judged.set.retain(|k| of(k).known.is_some());
    (judged, others)
}

/// Of names that look the same, one that came out as no such mechanism can is told after one that could be.
pub(crate) fn as_possible(room: &Room, judged: Judged, config: &DiagnosisConfig) -> Judged {
    if judged.impossible.is_empty() {
        return judged;
    }
    let possible = judged.set[1..].iter().find_map(|k| led_by(*k, room, &judged, config));
    possible.unwrap_or(judged)
}

/// Of names that look the same, what follows the effort that was measured is told before what reckons with a torque: masses
/// are assumed, and no torque knows friction and contact.
pub(crate) fn as_measured(room: &Room, judged: Judged, config: &DiagnosisConfig) -> Judged {
    let of = |k: usize| &room.weighed.entries[k].candidate;
    let own = of(judged.entry);
    let measured = |k: &usize| {
        let other = of(*k);
        other.family == MEASURED && other.target == own.target
    };
    if own.toggle != Toggle::Load || own.family == MEASURED {
        return judged;
    }
    let first = judged.set.iter().copied().find(measured);
    first.and_then(|k| led_by(k, room, &judged, config)).unwrap_or(judged)
}

/// The judgement with another one of its set told first; none where that came out as no such mechanism can, or cannot be named.
fn led_by(k: usize, room: &Room, judged: &Judged, config: &DiagnosisConfig) -> Option<Judged> {
    let mut other = room.judge(k, config);
    if !other.impossible.is_empty() || other.grade(&room.weighed, config) == Grade::Refused {
        return None;
    }
    other.set = std::iter::once(k).chain(judged.set.iter().copied().filter(|l| *l != k)).collect();
    Some(other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{entry, own, planted, quick, room};
    use crate::{Candidate, Columns};
    use std::sync::Arc;

    /// A session with a spring at joint 2, which follows `toggle`, and a measured effort of it that tells the same but for a
    /// share, times `sign`.
    fn first(share: f64, toggle: Toggle, sign: f64) -> Vec<String> {
        let mut p = planted(&[("compliance:2", 2.0)], 0, 3);
        p.candidates.iter_mut().filter(|c| c.family == "compliance").for_each(|c| c.toggle = toggle);
        let (spring, other) = (own(&p, "compliance:2"), own(&p, "backlash:1"));
        let columns = spring.columns.dense(&p.dwells, 1.0);
        let effort = &columns * (1.0 - share)
            + other.columns.dense(&p.dwells, 1.0).columns(0, columns.ncols()) * share;
        let mut amplitudes = spring.amplitudes.clone();
        amplitudes.iter_mut().for_each(|a| a.never_negative = true);
        p.candidates.push(Candidate {
            spec: "effort_compliance:2".into(),
            family: MEASURED.into(),
            columns: Columns::Dense(Arc::new(effort * sign)),
            amplitudes,
            ..spring
        });
        let r = room(&p, &quick());
        let judged = as_measured(&r, r.judge(entry(&r.weighed, "compliance:2"), &quick()), &quick());
        judged.set.iter().map(|k| r.weighed.entries[*k].candidate.spec.clone()).collect()
    }

    #[test]
    fn effort_that_was_measured_is_told_before_a_torque_that_was_not() {
        let alike = first(0.0, Toggle::Load, 1.0);
        assert_eq!(alike[0], "effort_compliance:2");
        assert!(alike.contains(&"compliance:2".to_owned()), "{alike:?}");
        // Where the data contradict it, measured or not, it is no answer.
        assert_eq!(first(0.7, Toggle::Load, 1.0)[0], "compliance:2");
        // Nor where it came out as no spring can, nor before what reckons with no torque.
        let yields_upwards = first(0.0, Toggle::Load, -1.0);
        assert_eq!(yields_upwards[0], "compliance:2");
        assert!(yields_upwards.contains(&"effort_compliance:2".to_owned()), "{yields_upwards:?}");
        assert_eq!(first(0.0, Toggle::None, 1.0)[0], "compliance:2");
    }
}
