//! Lists of numbers that may be the positions of joints, and which of them are, by what their numbers do.

use super::topics::{Field, JointTopic};
use armcal_recording::decode::{Plan, Role, Rows};

/// Longer lists are no joints of an arm, and more of them are no state of one.
pub const MOST: usize = 64;
/// The largest reading, in degrees; the least motion, in radians.
const LARGEST: f64 = 720.0;
const MOVES: f64 = 0.05;
/// Correlation of a change with what another list says of it, its ratio, and pairs of messages that are needed.
const TOLD: f64 = 0.9;
const RATIO: std::ops::Range<f64> = 0.8..1.25;
const FEWEST: usize = 20;
/// What is zero in more than this share of the messages rests there, as velocities do.
const RESTS: f64 = 0.1;

/// Number of the recording and of the message in it, time [ns], values.
pub type Row = ((u64, u64), i64, Vec<f64>);

/// Numbers as many as joints.
#[derive(Default)]
pub struct List {
    /// Where they are: in one list, or each in a field of its own.
    pub paths: Vec<String>,
    /// Where their names are.
    pub name: Option<String>,
    /// With names, and without.
    pub plans: [Option<Plan>; 2],
    /// Of the joints.
    pub names: Vec<String>,
    /// What was seen of them.
    pub rows: Vec<Row>,
    /// Whether something is wrong with them as joints.
    pub is_other: bool,
}

/// The lists of a topic that may be joint readings, the likeliest first.
pub fn ranked<'a>(lists: impl IntoIterator<Item = &'a List>, topic: &str, messages: u64) -> Vec<JointTopic> {
    let all: Vec<&List> = lists.into_iter().filter(|l| l.may_be_joints()).collect();
    let mut ranked: Vec<(u8, f64, JointTopic)> = Vec::new();
    for own in &all {
        let alike = || all.iter().filter(|l| l.paths != own.paths && l.values() == own.values());
        let told = alike().find(|l| own.is_told_by(l));
        let (surety, score, why) = match told {
            _ if alike().any(|l| l.is_told_by(own)) => (0, 0.0, "the change of others".to_owned()),
            // What is commanded repeats itself to the last digit, what is measured does not.
            Some(l) => (3, own.repeats(), format!("their change is what {} says", l.paths.join(", "))),
            None if own.rests_at_zero() => (1, own.roughness(), "numbers that rest at zero".to_owned()),
            None if own.name.is_none() && !own.names.is_empty() => {
                (2, own.roughness(), "each joint has a field that is called as it is".to_owned())
            }
            None if alike().next().is_none() => {
                (2, 0.0, "the only list of so many numbers that change".to_owned())
            }
            None => (2, own.roughness(), "the list of so many numbers that changes most smoothly".to_owned()),
        };
        let List { paths, name, names, .. } = own;
        let name = name.clone().filter(|_| !names.is_empty());
        let field = Field { positions: paths.clone(), name, values: own.values(), surety, why };
        let topic = topic.to_owned();
        ranked.push((
            surety,
            score,
            JointTopic { topic, names: names.clone(), messages, field: Some(field) },
        ));
    }
    ranked.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)));
    ranked.into_iter().map(|(.., joint)| joint).collect()
}

impl List {
    /// Looks into a message.
    pub fn add(&mut self, at: (u64, u64), log_ns: i64, data: &[u8]) {
        let mut rows = Rows::new(Role::Joints);
        if let Some(named) = &self.plans[0]
            && named.decode(data, &mut rows).is_err()
        {
            // The texts beside them are not their names.
            self.plans[0] = None;
        }
        if let (None, Some(plain)) = (&self.plans[0], &self.plans[1]) {
            self.is_other |= plain.decode(data, &mut rows).is_err();
        }
        let Rows::Joints(rows) = &rows else { return };
        for row in rows.rows() {
            let values = row.position;
            self.is_other |=
                values.len() > MOST || self.rows.first().is_some_and(|f| f.2.len() != values.len());
            if self.names.is_empty() {
                self.names = row.names.to_vec();
            }
            self.rows.push((at, row.stamp_ns.unwrap_or(log_ns), values.to_vec()));
        }
    }

    /// How many numbers.
    pub fn values(&self) -> usize {
        self.rows.first().map_or(0, |(.., values)| values.len())
    }

    /// Smallest and largest of a column.
    fn range(&self, column: usize) -> (f64, f64) {
        let values = self.rows.iter().map(|(.., values)| values[column]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }

    fn may_be_joints(&self) -> bool {
        !self.is_other && self.values() >= 2 && self.is_possible()
    }

    /// Whether these are numbers that joints can have, and change.
    pub fn is_possible(&self) -> bool {
        let possible = |(.., values): &Row| values.iter().all(|x| x.abs() <= LARGEST);
        self.rows.iter().all(possible)
            && (0..self.values()).map(|k| self.range(k)).any(|(low, high)| high - low > MOVES)
            && !(0..self.values()).any(|k| self.is_clock(k))
    }

    /// Whether a column grows from each message to the next, as no joint does that comes back or pauses.
    fn is_clock(&self, column: usize) -> bool {
        let mut pairs = self.pairs().peekable();
        pairs.peek().is_some() && pairs.all(|i| self.rows[i + 1].2[column] > self.rows[i].2[column])
    }

    /// Messages that follow each other: where the first is.
    fn pairs(&self) -> impl Iterator<Item = usize> {
        let follows = |i: &usize| {
            let ((recording, message), ..) = self.rows[*i];
            self.rows.get(i + 1).is_some_and(|((r, m), ..)| *r == recording && *m == message + 1)
        };
        (0..self.rows.len()).filter(follows)
    }

    /// Whether another list says how fast this one changes.
    fn is_told_by(&self, other: &List) -> bool {
        if other.rows.len() != self.rows.len() {
            return false;
        }
        let (mut n, mut xx, mut yy, mut xy) = (0, 0.0, 0.0, 0.0);
        for i in self.pairs() {
            let dt_s = (self.rows[i + 1].1 - self.rows[i].1) as f64 * 1e-9;
            n += usize::from(self.rows[i].2 != self.rows[i + 1].2);
            for k in 0..self.values() {
                let change = self.rows[i + 1].2[k] - self.rows[i].2[k];
                let said = 0.5 * (other.rows[i].2[k] + other.rows[i + 1].2[k]) * dt_s;
                (xx, yy, xy) = (xx + change * change, yy + said * said, xy + change * said);
            }
        }
        n >= FEWEST && xy / (xx * yy).sqrt() > TOLD && RATIO.contains(&(xy / yy))
    }

    fn rests_at_zero(&self) -> bool {
        let largest: Vec<f64> =
            (0..self.values()).map(|k| self.range(k)).map(|(a, b)| a.abs().max(b.abs())).collect();
        let rests =
            |(.., values): &&(_, _, Vec<f64>)| values.iter().zip(&largest).all(|(x, l)| x.abs() <= 0.01 * l);
        self.rows.iter().filter(rests).count() as f64 > RESTS * self.rows.len() as f64
    }

    /// Share of the messages that say the same as the one before.
    fn repeats(&self) -> f64 {
        let (same, all) = self.pairs().fold((0.0, 0.0), |(same, all), i| {
            (same + f64::from(self.rows[i].2 == self.rows[i + 1].2), all + 1.0)
        });
        same / f64::max(all, 1.0)
    }

    /// How far it jumps from one message to the next, as a share of its range.
    fn roughness(&self) -> f64 {
        let of = |k: usize| {
            let (low, high) = self.range(k);
            let jumps = self.pairs().map(|i| (self.rows[i + 1].2[k] - self.rows[i].2[k]).abs());
            if high > low { jumps.sum::<f64>() / (high - low) } else { 0.0 }
        };
        (0..self.values()).map(of).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_no_joint() {
        let list = |column: fn(f64) -> f64| {
            let row = |i: u64| ((1, i), 0, vec![(0.1 * i as f64).sin(), column(i as f64)]);
            List { paths: vec!["*".into()], rows: (0..50).map(row).collect(), ..List::default() }
        };
        assert_eq!(ranked(&[list(|i| (0.3 * i).cos())], "/q", 50).len(), 1);
        assert!(ranked(&[list(|i| 0.01 * i)], "/q", 50).is_empty());
    }
}
