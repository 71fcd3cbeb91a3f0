//! Joint readings and poses inside messages that armcal does not know: which of their fields they are, by what their numbers do.
//!
//! Names decide nothing. Of lists of numbers, positions are what another list of the message tells the change of (their
//! velocities) and what itself tells the change of none.

use super::lists::{List, MOST, ranked};
use super::singles::Singles;
use super::topics::{BodyTopic, JointTopic};
use armcal_recording::RawSchema;
use armcal_recording::decode::{Place, Plan, Role, Rows, fields_for, has_list, parent_of};
use std::collections::BTreeSet;

/// A point that keeps within this tells nothing unless it is part of a pose [m].
const STANDS_M: f64 = 0.01;

/// The fields of one topic that may matter.
pub struct Fields {
    lists: Vec<List>,
    singles: Singles,
    points: Vec<Point>,
    /// Paths of numbers that are called temperatures.
    pub thermometers: Vec<String>,
    /// Recordings so far.
    recordings: u64,
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
            let name = texts.iter().find(|t| parent_of(t) == parent_of(&path)).cloned();
            let named = name.as_ref().and_then(|name| {
                plan(Role::Joints, &[(Place::Positions, path.as_str()), (Place::Names, name.as_str())])
            });
            let plans = [named, plan(Role::Joints, &[(Place::Positions, path.as_str())])];
            List { paths: vec![path], name, plans, ..List::default() }
        };
        let turned = at(Place::Orientation);
        let point = |position: String| {
            let orientation = turned.iter().find(|q| parent_of(q) == parent_of(&position)).cloned();
            let both = [(Place::Position, Some(&position)), (Place::Orientation, orientation.as_ref())];
            let both: Vec<(Place, &str)> =
                both.into_iter().filter_map(|(place, path)| Some((place, path?.as_str()))).collect();
            let plan = plan(Role::Pose, &both)?;
            let (low, high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            Some(Point { position, orientation, plan, bodies: BTreeSet::new(), low, high })
        };
        let paths = at(Place::Positions);
        let singles: Vec<String> =
            paths.iter().filter(|path| !has_list(path) && !is_geometric(path)).cloned().collect();
        let called = |path: &String| path.to_lowercase().contains("temperature");
        Fields {
            singles: Singles::of(singles, |fields| plan(Role::Joints, fields)),
            lists: number_lists(paths).into_iter().take(MOST).map(list).collect(),
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
        self.lists.is_empty() && self.points.is_empty() && self.singles.is_empty()
    }

    /// Messages of another recording follow.
    pub fn next_recording(&mut self) {
        self.recordings += 1;
    }

    /// Looks into one message.
    pub fn add(&mut self, message: u64, log_ns: i64, data: &[u8]) {
        let at = (self.recordings, message);
        self.lists.iter_mut().filter(|l| !l.is_other).for_each(|l| l.add(at, log_ns, data));
        self.singles.add(at, log_ns, data);
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
        // Where nothing but these is in a message, they are a list of it already.
        let is_whole = |own: &List| {
            let whole = self.lists.iter().filter(|l| l.paths[0].ends_with('*') && l.values() == own.values());
            whole.map(|l| parent_of(&l.paths[0])).any(|inside| inside == parent_of(&own.paths[0]))
        };
        let mut numbered = self.singles.numbered();
        numbered.retain(|own| !is_whole(own));
        ranked(self.lists.iter().chain(&numbered), topic, messages)
    }

    /// The fields that are called as these joints are, the likeliest first.
    pub fn called(&self, joints: &[String], topic: &str, messages: u64) -> Vec<JointTopic> {
        ranked(&self.singles.called(joints), topic, messages)
    }

    /// Paths of numbers that change, each in a field of its own.
    pub fn moving(&self) -> Vec<String> {
        let each = |column: usize| self.singles.list(&[column]);
        let moving = (0..self.singles.len()).map(each).filter(|l| l.values() == 1 && l.is_possible());
        moving.flat_map(|l| l.paths).collect()
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

/// Lists of numbers, and messages of three and more that have nothing but numbers in a row.
fn number_lists(paths: Vec<String>) -> Vec<String> {
    let mut alone: Vec<(String, Vec<String>)> = Vec::new();
    let mut lists = Vec::new();
    for path in paths {
        if has_list(&path) {
            lists.push(path);
            continue;
        }
        let inside = parent_of(&path).to_owned();
        match alone.iter_mut().find(|(known, _)| *known == inside) {
            Some((_, fields)) => fields.push(path),
            None => alone.push((inside, vec![path])),
        }
    }
    let geometric = |path: &String| is_geometric(path);
    let all = alone.into_iter().filter(|(_, fields)| fields.len() > 2 && !fields.iter().any(geometric));
    lists.extend(
        all.map(|(inside, _)| if inside.is_empty() { "*".to_owned() } else { format!("{inside}.*") }),
    );
    lists
}

/// What spans space and turns.
fn is_geometric(path: &str) -> bool {
    ["x", "y", "z", "w"].contains(&path.rsplit('.').next().unwrap_or(path))
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
