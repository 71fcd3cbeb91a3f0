//! What is wrong in some recordings and right in the others: another driver, another homing, another export.

use super::Hypothesis;
use armcal_core::Code;
use armcal_stages::Inputs;
use armcal_stages::still::{TURNS_RAD, value_range};
use std::ops::Range;
use std::sync::Arc;

/// Changes that somebody makes between two recordings without noticing.
const PARTLY: [Code; 5] =
    [Code::JointSign, Code::JointOrder, Code::JointUnit, Code::JointZero, Code::PositionUnit];
const APART: &str = "mend it in the driver that recorded this, or give what differs a pipeline of its own (`armcal pool` fits them \
                     together)";

/// Recordings in which something may be otherwise than in the rest: from each on, and each alone; with the words for them.
pub fn recording_ranges(inputs: &Inputs) -> Vec<(Range<usize>, String)> {
    let n = inputs.seen.len();
    let name = |r: usize| &inputs.seen[r].name;
    // From the first on is always, from the last on is the last alone.
    let on = (1..n).map(|r| (r..n, format!("from recording `{}` on", name(r))));
    let alone = (0..n.saturating_sub(1)).map(|r| (r..r + 1, format!("in recording `{}` alone", name(r))));
    on.chain(alone).collect()
}

/// Those of the changes `of_all` recordings that may be right of a part of them.
pub fn hypotheses(inputs: &Inputs, of_all: &[Hypothesis]) -> Vec<Hypothesis> {
    let parts = recording_ranges(inputs);
    let mut all = Vec::new();
    for h in of_all.iter().filter(|h| !parts.is_empty() && PARTLY.contains(&h.code)) {
        let changed = h.undone(inputs);
        let of_readings = ![Code::JointZero, Code::PositionUnit].contains(&h.code);
        let tells = |part: &Range<usize>| {
            !of_readings || more_than_a_zero(&read_rad(inputs, part), &read_rad(&changed, part))
        };
        all.extend(
            parts
                .iter()
                .filter(|(part, _)| tells(part))
                .map(|(part, words)| restrict_to_part(h, part, words)),
        );
    }
    all
}

/// The change made to these recordings alone.
fn restrict_to_part(h: &Hypothesis, part: &Range<usize>, words: &str) -> Hypothesis {
    let (apply, part) = (h.apply.clone(), part.clone());
    Hypothesis {
        subject: format!("{}, {words}", h.subject),
        change: format!("{} {words}", h.change),
        remedy: APART,
        mending: None,
        apply: Arc::new(move |inputs: &mut Inputs| {
            let mut changed = inputs.clone();
            apply(&mut changed);
            inputs.seen[part.clone()].clone_from_slice(&changed.seen[part.clone()]);
        }),
        ..h.clone()
    }
}

fn read_rad<'i>(inputs: &'i Inputs, part: &Range<usize>) -> Vec<&'i [f64]> {
    inputs.seen[part.clone()].iter().flat_map(|s| &s.dwells).map(|d| &d.joint_rad[..]).collect()
}

/// Whether a change does more to readings than to shift them: of a joint that rests, another sign is another zero, which may
/// have slipped.
fn more_than_a_zero(before_rad: &[&[f64]], after_rad: &[&[f64]]) -> bool {
    let joints = before_rad.first().map_or(0, |q| q.len());
    let by_rad = |j: usize| value_range(before_rad.iter().zip(after_rad).map(|(b, a)| a[j] - b[j]));
    (0..joints).any(|j| by_rad(j) > TURNS_RAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_of_a_joint_that_rests_is_no_more_than_its_zero() {
        let read_rad: [[f64; 2]; 3] = [[0.1, 0.5], [0.8, 0.52], [-0.4, 0.5]];
        let reversed = |j: usize| {
            let mut all = read_rad;
            all.iter_mut().for_each(|q| q[j] = -q[j]);
            let (before, after): (Vec<&[f64]>, Vec<&[f64]>) =
                (read_rad.iter().map(|q| &q[..]).collect(), all.iter().map(|q| &q[..]).collect());
            more_than_a_zero(&before, &after)
        };
        assert!(reversed(0) && !reversed(1));
        assert!(!more_than_a_zero(&[], &[]));
    }
}
