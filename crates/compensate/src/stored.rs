//! What a commanded path leaves behind in the gears.
//!
//! A gap, like any rate-independent hysteresis, remembers of a path only its reduced memory sequence: alternating
//! extrema with shrinking excursions (Mayergoyz, Mathematical Models of Hysteresis, 1991, section 1.2). Each joint has
//! one, and so have the sum and the difference of every two neighbours, for gaps that lie in a belt. Between two
//! set-points every joint moves one way.

use armcal_core::{Arrival, Observation};

/// A joint that is commanded by less than this does not move [rad] (sliding: [m]).
pub(crate) const STILL_RAD: f64 = 1e-6;
/// An approach from this far away has crossed every gap [rad] (sliding: [m]).
const WIDEST_RAD: f64 = 0.25;

/// The commanded path up to now.
#[derive(Debug, Clone, PartialEq)]
pub struct Past {
    joints: Vec<Lane>,
    pairs: Vec<[Lane; 2]>,
    /// How far each joint came in the last move [rad]; `None` where it is not known from where.
    moved_rad: Option<Vec<f64>>,
}

/// One joint, or one pair of joints.
#[derive(Debug, Clone, PartialEq)]
struct Lane {
    /// Extrema that still matter, oldest first, where it stands now last; empty where nothing is known.
    turns: Vec<f64>,
    direction: Arrival,
}

impl Past {
    /// Nothing is known of the past: directions of arrival are unknown too.
    pub fn unknown(joints: usize) -> Past {
        let lane = || Lane { turns: Vec::new(), direction: Arrival::Unknown };
        let pairs = (1..joints).map(|_| [lane(), lane()]).collect();
        Past { joints: (0..joints).map(|_| lane()).collect(), pairs, moved_rad: None }
    }

    /// The arm waits at these readings [rad]; from where it came is not known.
    pub fn at(joint_rad: &[f64]) -> Past {
        Past::unknown(joint_rad.len()).then(joint_rad)
    }

    /// The same after a move to these readings [rad].
    pub fn then(&self, joint_rad: &[f64]) -> Past {
        self.each(joint_rad, |lane, _, q| lane.then(q))
    }

    /// The same had each joint come to these readings from far away in the direction of its sign (+1, -1; 0: as it does
    /// come); so did the sum of two neighbours whose signs agree, and the difference of two whose signs are opposite.
    pub fn coming(&self, joint_rad: &[f64], signs: &[f64]) -> Past {
        let pairs = signs.windows(2).flat_map(|s| [s[1] + s[0], s[1] - s[0]]);
        let both = pairs.map(|twice| if twice.abs() > 1.5 { twice.signum() } else { 0.0 });
        self.arriving(joint_rad, &signs.iter().copied().chain(both).collect::<Vec<f64>>())
    }

    /// The same had every joint, every sum and every difference come to these readings from far away, in the
    /// direction of its sign (+1, -1); with sign 0, as it does come.
    pub(crate) fn arriving(&self, joint_rad: &[f64], signs: &[f64]) -> Past {
        let arriving = |old: &Lane, lane: usize, q: f64| match signs[lane] {
            0.0 => old.then(q),
            sign => Lane::arriving(q, sign),
        };
        self.each(joint_rad, arriving)
    }

    /// Signs of a move to these readings [rad]: joints, then for every pair of neighbours the sum and the difference.
    /// Where nothing moves, the sign of the last move; 0 where that is not known.
    pub(crate) fn signs(&self, joint_rad: &[f64]) -> Vec<f64> {
        self.then(joint_rad).lanes().map(|lane| lane.direction.sign()).collect()
    }

    /// Where the joints stand [rad]; `None` where nothing is known.
    pub fn joint_rad(&self) -> Option<Vec<f64>> {
        self.joints.iter().map(|lane| lane.turns.last().copied()).collect()
    }

    /// Directions of the last move of each joint.
    pub fn arrival(&self) -> Vec<Arrival> {
        self.joints.iter().map(|lane| lane.direction).collect()
    }

    /// Lays the past and where it ends into an observation.
    pub(crate) fn into_observation(self, joint_rad: &[f64], o: &mut Observation) {
        o.joint_rad.clear();
        o.joint_rad.extend_from_slice(joint_rad);
        o.arrival = self.arrival();
        o.moved_rad = self.moved_rad;
        o.path_memory_rad = Some(self.joints.into_iter().map(|lane| lane.turns).collect());
        o.pair_memory_rad = Some(self.pairs.into_iter().map(|pair| pair.map(|lane| lane.turns)).collect());
    }

    fn lanes(&self) -> impl Iterator<Item = &Lane> {
        self.joints.iter().chain(self.pairs.iter().flatten())
    }

    /// A new past from each lane, its number and where it goes.
    fn each(&self, q: &[f64], lane: impl Fn(&Lane, usize, f64) -> Lane) -> Past {
        let joints: Vec<Lane> =
            self.joints.iter().zip(q).enumerate().map(|(j, (old, q))| lane(old, j, *q)).collect();
        let first = joints.len();
        let pair = |(k, ([sum, difference], q)): (usize, (&[Lane; 2], &[f64]))| {
            [lane(sum, first + 2 * k, q[1] + q[0]), lane(difference, first + 2 * k + 1, q[1] - q[0])]
        };
        let pairs = self.pairs.iter().zip(q.windows(2)).enumerate().map(pair).collect();
        let moved = |from: Vec<f64>| q.iter().zip(from).map(|(q, from)| q - from).collect();
        Past { joints, pairs, moved_rad: self.joint_rad().map(moved) }
    }
}

impl Lane {
    fn arriving(q: f64, sign: f64) -> Lane {
        let direction = if sign < 0.0 { Arrival::Negative } else { Arrival::Positive };
        Lane { turns: vec![q - sign * WIDEST_RAD, q], direction }
    }

    fn then(&self, q: f64) -> Lane {
        let Some(&now) = self.turns.last() else {
            return Lane { turns: vec![q], direction: self.direction };
        };
        if (q - now).abs() <= STILL_RAD {
            return self.clone();
        }
        let direction = if q > now { Arrival::Positive } else { Arrival::Negative };
        let mut turns = self.turns.clone();
        if turns.len() > 1 && direction == self.direction {
            turns.pop();
        }
        loop {
            match turns[..] {
                // The first leg began in the middle of a gap, so it weighs twice.
                [start, first] if (q - first).abs() >= 2.0 * (first - start).abs() => turns.truncate(1),
                // A leg as long as the one before it wipes both out, and the leg before them goes on.
                [_, .., a, b] if turns.len() > 2 && (q - b).abs() >= (b - a).abs() => {
                    turns.truncate(turns.len() - 2);
                }
                _ => break,
            }
        }
        turns.push(q);
        Lane { turns, direction }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The play operator by its definition: where the link is behind a gap, after every point of a path.
    fn play(path: &[f64], width: f64) -> f64 {
        path.iter().fold(path[0], |link, q| (q - width / 2.0).max((q + width / 2.0).min(link)))
    }

    proptest! {
        #[test]
        fn what_is_kept_moves_a_gap_like_the_whole_path(
            path in prop::collection::vec(-1.0..1.0f64, 1..60), width in 0.0..1.5f64,
        ) {
            let past = path[1..].iter().fold(Past::at(&path[..1]), |past, q| past.then(&[*q]));
            let kept = &past.joints[0].turns;
            prop_assert!((play(kept, width) - play(&path, width)).abs() < 1e-12, "{kept:?}");
            let legs: Vec<f64> = kept.windows(2).map(|w| w[1] - w[0]).collect();
            prop_assert!(legs.windows(2).all(|l| l[0] * l[1] < 0.0), "not alternating: {kept:?}");
            prop_assert_eq!(past.joint_rad().unwrap(), vec![path[path.len() - 1]]);
        }
    }

    #[test]
    fn directions_are_those_of_the_last_move_of_joints_sums_and_differences() {
        let past = Past::at(&[0.0, 0.0]).then(&[0.1, -0.3]);
        assert_eq!(past.arrival(), [Arrival::Positive, Arrival::Negative]);
        assert_eq!(past.signs(&[0.1, -0.3]), [1.0, -1.0, -1.0, -1.0]);
        assert_eq!(past.signs(&[0.0, 0.0]), [-1.0, 1.0, 1.0, 1.0]);
        assert_eq!(past.then(&[0.1 + 1e-8, -0.3]).arrival(), past.arrival());
        assert_eq!(Past::unknown(1).then(&[0.2]).arrival(), [Arrival::Unknown]);
        assert_eq!(Past::unknown(1).joint_rad(), None);
    }
}
