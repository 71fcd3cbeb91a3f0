//! Joint readings and poses inside messages that armcal does not know: which of their fields they are, by what their numbers do.
//!
//! Names decide nothing. Of lists of numbers, positions are what another list of the message tells the change of (their
//! velocities) and what itself tells the change of none.

use super::topics::{BodyTopic, Field, JointTopic};
use armcal_recording::RawSchema;
use armcal_recording::decode::{Place, Plan, Role, Rows, fields_for};
use std::collections::BTreeSet;

/// Longer lists are no joints of an arm, and more of them are no state of one.
const MOST: usize = 64;
/// The largest reading, in degrees; the least motion, in radians.
const LARGEST: f64 = 720.0;
const MOVES: f64 = 0.05;
/// A point that keeps within this tells nothing unless it is part of a pose [m].
const STANDS_M: f64 = 0.01;
/// Correlation of a change with what another list says of it, its ratio, and pairs of messages that are needed.
const TOLD: f64 = 0.9;
const RATIO: std::ops::Range<f64> = 0.8..1.25;
const FEWEST: usize = 20;
/// What is zero in more than this share of the messages rests there, as velocities do.
const RESTS: f64 = 0.1;

/// The fields of one topic that may matter.
pub struct Fields {
    lists: Vec<List>,
    points: Vec<Point>,
    /// Paths of numbers that are called temperatures.
    pub thermometers: Vec<String>,
    /// Recordings so far.
    recordings: u64,
}

/// Numbers as many as joints.
struct List {
    path: String,
    name: Option<String>,
    /// With names, and without.
    plans: [Option<Plan>; 2],
    names: Vec<String>,
    /// Number of the message, time [ns], values.
    rows: Vec<((u64, u64), i64, Vec<f64>)>,
    is_other: bool,
}

/// A point, perhaps a pose.
struct Point {
    position: String,
    orientation: Option<String>,
    plan: Plan,
    bodies: BTreeSet<String>,
    low: [f64; 3],
    high: [f64; 3],
}

impl Fields {
    /// Of a message of this definition.
    pub fn of(schema: &RawSchema, encoding: &str) -> Fields {
        let RawSchema { name, encoding: language, data, .. } = schema;
        let at = |place| fields_for(place, name, language, data, encoding);
        let plan = |role, fields: &[(Place, &str)]| {
            Plan::at(role, name, language, data, encoding, (None, fields)).ok()
        };
        let texts: Vec<String> = at(Place::Names).into_iter().filter(|t| t.contains("[]")).collect();
        let list = |path: String| {
            let name = texts.iter().find(|t| parent(t) == parent(&path)).cloned();
            let named = name.as_ref().and_then(|name| {
                plan(Role::Joints, &[(Place::Positions, path.as_str()), (Place::Names, name.as_str())])
            });
            let plans = [named, plan(Role::Joints, &[(Place::Positions, path.as_str())])];
            List { path, name, plans, names: Vec::new(), rows: Vec::new(), is_other: false }
        };
        let turned = at(Place::Orientation);
        let point = |position: String| {
            let orientation = turned.iter().find(|q| parent(q) == parent(&position)).cloned();
            let both = [(Place::Position, Some(&position)), (Place::Orientation, orientation.as_ref())];
            let both: Vec<(Place, &str)> =
                both.into_iter().filter_map(|(place, path)| Some((place, path?.as_str()))).collect();
            let plan = plan(Role::Pose, &both)?;
            let (low, high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            Some(Point { position, orientation, plan, bodies: BTreeSet::new(), low, high })
        };
        let called = |path: &String| path.to_lowercase().contains("temperature");
        Fields {
            lists: number_lists(at(Place::Positions)).into_iter().take(MOST).map(list).collect(),
            points: at(Place::Position)
                .into_iter()
                .filter(|p| !turned.contains(p))
                .take(MOST)
                .filter_map(point)
                .collect(),
            thermometers: at(Place::Value).into_iter().filter(called).collect(),
            recordings: 0,
        }
    }

    /// Whether there is nothing to look into.
    pub fn is_empty(&self) -> bool {
        self.lists.is_empty() && self.points.is_empty()
    }

    /// Messages of another recording follow.
    pub fn next_recording(&mut self) {
        self.recordings += 1;
    }

    /// Looks into one message.
    pub fn add(&mut self, message: u64, log_ns: i64, data: &[u8]) {
        let at = (self.recordings, message);
        self.lists.iter_mut().filter(|l| !l.is_other).for_each(|l| l.add(at, log_ns, data));
        for point in &mut self.points {
            let mut rows = Rows::new(Role::Pose);
            match point.plan.decode(data, &mut rows) {
                Ok(()) => {}
                Err(_) => point.bodies.extend(point.plan.bodies(data).unwrap_or_default()),
            }
            let Rows::Pose(rows) = &rows else { continue };
            for p in &rows.position {
                for ((low, high), x) in point.low.iter_mut().zip(&mut point.high).zip(p) {
                    (*low, *high) = (low.min(*x), high.max(*x));
                }
            }
        }
    }

    /// The lists that may be joint readings, the likeliest first.
    pub fn joints(&self, topic: &str, messages: u64) -> Vec<JointTopic> {
        let all: Vec<&List> = self.lists.iter().filter(|l| l.may_be_joints()).collect();
        let mut ranked: Vec<(u8, f64, JointTopic)> = Vec::new();
        for own in &all {
            let alike = || all.iter().filter(|l| l.path != own.path && l.values() == own.values());
            let told = alike().find(|l| own.is_told_by(l));
            let (surety, score, why) = match told {
                _ if alike().any(|l| l.is_told_by(own)) => (0, 0.0, "the change of others".to_owned()),
                // What is commanded repeats itself to the last digit, what is measured does not.
                Some(l) => (3, own.repeats(), format!("their change is what {} says", l.path)),
                None if own.rests_at_zero() => (1, own.roughness(), "numbers that rest at zero".to_owned()),
                None if alike().next().is_none() => {
                    (2, 0.0, "the only list of so many numbers that change".to_owned())
                }
                None => {
                    (2, own.roughness(), "the list of so many numbers that changes most smoothly".to_owned())
                }
            };
            let List { path, name, names, .. } = own;
            let name = name.clone().filter(|_| !names.is_empty());
            let field = Field { position: path.clone(), name, values: own.values(), surety, why };
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

    /// The poses, and the points that move.
    pub fn bodies(&self, topic: &str) -> Vec<BodyTopic> {
        let moves = |p: &&Point| p.orientation.is_some() || (0..3).any(|k| p.high[k] - p.low[k] > STANDS_M);
        let of = |p: &Point| {
            let all = BodyTopic {
                topic: topic.to_owned(),
                frame: None,
                body: None,
                position: Some(p.position.clone()),
                orientation: p.orientation.clone(),
            };
            match p.bodies.len() {
                0 | 1 => vec![all],
                _ => p.bodies.iter().map(|b| BodyTopic { body: Some(b.clone()), ..all.clone() }).collect(),
            }
        };
        self.points.iter().filter(moves).flat_map(of).collect()
    }
}

impl List {
    fn add(&mut self, at: (u64, u64), log_ns: i64, data: &[u8]) {
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

    fn values(&self) -> usize {
        self.rows.first().map_or(0, |(.., values)| values.len())
    }

    /// Smallest and largest of a column.
    fn range(&self, column: usize) -> (f64, f64) {
        let values = self.rows.iter().map(|(.., values)| values[column]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    }

    fn may_be_joints(&self) -> bool {
        let possible = |(.., values): &(_, _, Vec<f64>)| values.iter().all(|x| x.abs() <= LARGEST);
        !self.is_other
            && self.values() >= 2
            && self.rows.iter().all(possible)
            && (0..self.values()).map(|k| self.range(k)).any(|(low, high)| high - low > MOVES)
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

/// The message that a field is in.
fn parent(path: &str) -> &str {
    path.rsplit_once('.').map_or("", |(parent, _)| parent)
}

/// Lists of numbers, and messages of three and more that have nothing but numbers in a row.
fn number_lists(paths: Vec<String>) -> Vec<String> {
    let mut alone: Vec<(String, Vec<String>)> = Vec::new();
    let mut lists = Vec::new();
    for path in paths {
        if path.contains("[]") {
            lists.push(path);
            continue;
        }
        let inside = parent(&path).to_owned();
        match alone.iter_mut().find(|(known, _)| *known == inside) {
            Some((_, fields)) => fields.push(path),
            None => alone.push((inside, vec![path])),
        }
    }
    let geometric = |path: &String| ["x", "y", "z", "w"].contains(&path.rsplit('.').next().unwrap_or(path));
    let all = alone.into_iter().filter(|(_, fields)| fields.len() > 2 && !fields.iter().any(geometric));
    lists.extend(
        all.map(|(inside, _)| if inside.is_empty() { "*".to_owned() } else { format!("{inside}.*") }),
    );
    lists
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_a_row_are_a_list_and_what_spans_space_is_none() {
        let paths =
            ["header.t", "position.a1", "position.a2", "position.a3", "pose.x", "pose.y", "pose.z", "q[]"];
        let found = number_lists(paths.map(str::to_owned).to_vec());
        assert_eq!(found, ["q[]", "position.*"]);
    }
}
