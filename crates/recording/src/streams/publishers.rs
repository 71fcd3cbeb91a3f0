//! A topic on which two publishers speak: its rows jump to and fro between two tracks.

use crate::streams::clean::Kept;

/// Of the rows, at least this share and so many are of the second publisher ..
const LEAST_SHARE: f64 = 0.02;
const LEAST: usize = 10;
/// .. and the stream changes between the two so often, as a share of those: what leaps once is a reset.
const CHANGES: f64 = 0.5;
/// Each goes on from where it was: leaps that end on neither are so few, as a share of the rows.
const LEAPS: f64 = 0.01;
/// A track of which no number changes by more than this holds still.
const STILL: f64 = 1e-6;

/// What is not of the publisher that is read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OtherPublisher {
    /// By row, in the order of time.
    pub rows: Vec<bool>,
    /// Its values, where it holds still.
    pub still_at: Option<Vec<f64>>,
}

impl OtherPublisher {
    /// For people.
    pub fn told(&self) -> String {
        let (others, all) = (self.rows.iter().filter(|other| **other).count(), self.rows.len());
        match &self.still_at {
            Some(at) if at.iter().all(|x| *x == 0.0) => format!(
                "{others} of {all} messages are of a second publisher that sends zeros on the same topic (a gripper, a driver without \
                 its robot): they are left out"
            ),
            Some(_) => format!(
                "{others} of {all} messages are of a second publisher on the same topic that always sends the same: they are left out"
            ),
            None => format!(
                "two publishers speak in turn on this topic, and both move: {} messages of the one are read and {others} of the other \
                 left out; record the robot's alone, or rename the other's topic (a simulation beside the robot, a second robot)",
                all - others
            ),
        }
    }

    /// Takes its rows out.
    pub fn leave_out(&self, rows: &mut Kept) {
        let mut place = 0..;
        rows.drop_where(|_, _| place.next().is_some_and(|place: usize| self.rows[place]));
    }
}

/// The rows of a second publisher, if two tracks at least `apart` alternate; `row` puts down the numbers of one of `count` rows in
/// the order of time. Of two, one that holds still is the other; else the one with fewer rows.
pub(crate) fn find_other_publisher(
    count: usize,
    row: impl Fn(usize, &mut Vec<f64>),
    apart: f64,
) -> Option<OtherPublisher> {
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let mut tracks: [Option<Track>; 2] = [None, None];
    let (mut of_second, mut changes, mut leaps) = (Vec::with_capacity(count), 0, 0);
    let mut here = Vec::new();
    for k in 0..count {
        here.clear();
        row(k, &mut here);
        let far = |track: &Option<Track>| track.as_ref().map(|t| distance(&t.last, &here));
        let (first, second) = (far(&tracks[0]), far(&tracks[1]));
        leaps += usize::from(first.into_iter().chain(second).fold(f64::INFINITY, f64::min) > apart);
        let furthest = first.into_iter().chain(second).fold(0.0, f64::max);
        let second = match (first, second) {
            (Some(first), None) => first > apart,
            (Some(first), Some(second)) => second < first,
            (None, _) => false,
        };
        // Where the tracks meet, either may go on.
        let apart_here = furthest > apart;
        changes += usize::from(apart_here && of_second.last().is_some_and(|before| *before != second));
        of_second.push(second);
        match &mut tracks[usize::from(second)] {
            Some(track) => track.take(&here),
            none => *none = Some(Track::new(&here)),
        }
    }
    let [Some(first), Some(second)] = tracks else { return None };
    if leaps as f64 > LEAPS * count as f64 {
        return None;
    }
    let fewer = first.rows.min(second.rows);
    if fewer < LEAST
        || (fewer as f64) < LEAST_SHARE * count as f64
        || (changes as f64) < CHANGES * fewer as f64
    {
        return None;
    }
    let second_is_other = match (first.is_still(), second.is_still()) {
        (true, false) => false,
        (false, true) => true,
        _ => second.rows <= first.rows,
    };
    let other = if second_is_other { &second } else { &first };
    let still_at = other.is_still().then(|| other.last.clone());
    Some(OtherPublisher {
        rows: of_second.iter().map(|second| *second == second_is_other).collect(),
        still_at,
    })
}

/// What one publisher sent so far.
struct Track {
    rows: usize,
    last: Vec<f64>,
    least: Vec<f64>,
    most: Vec<f64>,
}

impl Track {
    fn new(row: &[f64]) -> Track {
        Track { rows: 1, last: row.to_vec(), least: row.to_vec(), most: row.to_vec() }
    }

    fn take(&mut self, row: &[f64]) {
        self.rows += 1;
        self.last.copy_from_slice(row);
        for (k, x) in row.iter().enumerate() {
            (self.least[k], self.most[k]) = (self.least[k].min(*x), self.most[k].max(*x));
        }
    }

    fn is_still(&self) -> bool {
        self.least.iter().zip(&self.most).all(|(least, most)| most - least <= STILL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arm(t: f64) -> [f64; 2] {
        [0.8 + 0.5 * (0.3 * t).sin(), -1.2 + 0.9 * (0.2 * t).cos()]
    }

    fn found(rows: &[[f64; 2]]) -> Option<OtherPublisher> {
        find_other_publisher(rows.len(), |k, row| row.extend(rows[k]), 0.3)
    }

    #[test]
    fn zeros_between_the_readings_are_of_another() {
        let rows: Vec<[f64; 2]> =
            (0..5000).map(|i| if i % 11 == 3 { [0.0; 2] } else { arm(f64::from(i) * 0.01) }).collect();
        let other = found(&rows).expect("two");
        assert!(other.rows.iter().zip(&rows).all(|(other, row)| *other == (*row == [0.0; 2])));
        assert!(other.told().contains("sends zeros"), "{}", other.told());
    }

    #[test]
    fn of_two_that_move_the_one_with_more_rows_is_read() {
        let other_arm = |t: f64| [-0.9 + 0.4 * (0.5 * t).cos(), 1.4];
        let rows: Vec<[f64; 2]> = (0..6000)
            .map(|i| (i, f64::from(i) * 0.01))
            .map(|(i, t)| if i % 3 == 0 { other_arm(t) } else { arm(t) })
            .collect();
        let other = found(&rows).expect("two");
        assert!(other.rows.iter().enumerate().all(|(i, other)| *other == (i % 3 == 0)));
        assert!(other.still_at.is_none() && other.told().contains("both move"));
    }

    #[test]
    fn resets_leaps_and_one_publisher_are_none() {
        let one: Vec<[f64; 2]> = (0..5000).map(|i| arm(f64::from(i) * 0.01)).collect();
        assert_eq!(found(&one), None);
        let reset: Vec<[f64; 2]> = one
            .iter()
            .enumerate()
            .map(|(i, [a, b])| if i < 2500 { [*a, *b] } else { [a - 1.0, *b] })
            .collect();
        assert_eq!(found(&reset), None);
        // An encoder that wraps at every turn.
        let wraps: Vec<[f64; 2]> = (0..5000).map(|i| [(f64::from(i) * 0.01).rem_euclid(1.0), 0.2]).collect();
        assert_eq!(found(&wraps), None);
        // One row a stop.
        let stops: Vec<[f64; 2]> =
            (0..60).map(|i| [(f64::from(i) * 1.9).sin() * 2.0, (f64::from(i) * 0.7).cos()]).collect();
        assert_eq!(found(&stops), None);
        // Single readings that are wild.
        let wild: Vec<[f64; 2]> =
            one.iter().enumerate().map(|(i, row)| if i % 900 == 7 { [2.9, 2.9] } else { *row }).collect();
        assert_eq!(found(&wild), None);
    }
}
