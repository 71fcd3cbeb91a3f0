//! The tree of frames that transforms make, and the pose of one frame in another over several of them.
//!
//! A transform says where its child is in its parent. Along a way from `frame` to `body` the pose is the product
//! `T_1 T_2 .. T_n`, with `T_i` the transform where the way leads to a child and its inverse where it leads to a parent.
//! Transforms that never change are constants; the stamps are those of the one that does.

use crate::streams::edges::{Edge, Edges};
use crate::streams::gather::{can_read, gather_streams};
use crate::streams::request::{Kind, Request};
use crate::{LengthUnit, Recording, RecordingError};
use armcal_core::{Pose, PoseSamples};
use nalgebra::{Translation3, UnitQuaternion};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Where transforms that other streams leave out are.
const USUAL: [&str; 2] = ["/tf", "/tf_static"];
/// More transforms than this are no laboratory's, and looking for ways between them takes for ever.
const MOST: usize = 1000;

/// The transforms of a recording, by parent and child: each with its topic.
#[derive(Debug, Default)]
pub struct Transforms {
    edges: BTreeMap<(String, String), (String, Edge)>,
}

impl Recording {
    /// For each topic the transforms on it, on its `_static` one, and on `/tf` and `/tf_static`, with lengths in `unit`, in one pass; none
    /// where the messages of the topic name no bodies.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub fn transforms(&self, topics: &[&str], unit: LengthUnit) -> Result<Vec<Transforms>, RecordingError> {
        let beside: Vec<String> = topics.iter().map(|topic| format!("{topic}_static")).collect();
        let all: BTreeSet<&str> =
            topics.iter().copied().chain(beside.iter().map(String::as_str)).chain(USUAL).collect();
        let request = |topic| {
            let kind = Kind::Transforms { unit };
            Request { role: "transforms", name: None, topic, kind, fields: Vec::new() }
        };
        let requests: Vec<Request<'_>> = all.into_iter().map(request).filter(|r| can_read(self, r)).collect();
        if !requests.iter().any(|r| topics.contains(&r.topic)) {
            return Ok(topics.iter().map(|_| Transforms::default()).collect());
        }
        let gathered = gather_streams(self, &requests)?;
        let on: BTreeMap<&str, Edges> =
            requests.iter().map(|r| r.topic).zip(gathered.into_iter().map(|g| g.edges)).collect();
        let tree = |(topic, beside): (&&str, &String)| {
            let own = on.get(topic).map(|_| [*topic, beside, USUAL[0], USUAL[1]]);
            let own: BTreeSet<&str> = own.into_iter().flatten().collect();
            Transforms::of(own.into_iter().filter_map(|topic| Some((topic, on.get(topic)?))))
        };
        Ok(topics.iter().zip(&beside).map(tree).collect())
    }
}

/// The pose of a body in a frame over several transforms.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// The frame.
    pub frame: String,
    /// The body.
    pub body: String,
    /// Topic, parent and child of the transform whose stamps the samples have.
    pub(crate) moving: (String, String, String),
    /// Whether the way leads from its child to its parent.
    is_up: bool,
    /// frame_from_parent, or from its child where the way leads up, and from there on to the body.
    before: Pose,
    after: Pose,
    /// The frames along the way.
    pub(crate) way: Vec<String>,
}

impl Transforms {
    /// Those of several topics.
    fn of<'a>(topics: impl Iterator<Item = (&'a str, &'a Edges)>) -> Transforms {
        let mut all = Transforms::default();
        for (topic, edges) in topics {
            for (ends, edge) in edges {
                let known = all.edges.entry(ends.clone()).and_modify(|(_, known)| known.add(edge));
                known.or_insert_with(|| (topic.to_owned(), edge.clone()));
            }
        }
        all
    }

    /// The frames that are in no other.
    pub fn roots(&self) -> BTreeSet<&str> {
        let children: BTreeSet<&str> = self.edges.keys().map(|(_, child)| child.as_str()).collect();
        self.edges.keys().map(|(parent, _)| parent.as_str()).filter(|p| !children.contains(p)).collect()
    }

    /// The frames that a body is a child of.
    pub fn parents(&self, body: &str) -> BTreeSet<&str> {
        self.edges.keys().filter(|(_, child)| child == body).map(|(parent, _)| parent.as_str()).collect()
    }

    /// The child on a topic, where there is one alone.
    pub fn only_child(&self, topic: &str) -> Option<String> {
        let on_topic = self.edges.iter().filter(|(_, (own, _))| own == topic);
        let children: BTreeSet<&str> = on_topic.map(|((_, child), _)| child.as_str()).collect();
        (children.len() == 1).then(|| children.into_iter().map(str::to_owned).next()).flatten()
    }

    /// Whether transforms lead from one frame to another.
    pub fn joins(&self, frame: &str, body: &str) -> bool {
        self.way(frame, body, None).is_some()
    }

    /// The way from a frame to a body; none where one of them is in no transform, or both are the same.
    ///
    /// # Errors
    /// No way, two ways, more than one transform on it that changes, or one that is no rotation: in words that follow the topic.
    pub fn chain(&self, frame: &str, body: &str) -> Result<Option<Chain>, String> {
        let is_known = |name: &str| self.edges.keys().any(|(parent, child)| parent == name || child == name);
        if frame == body || !is_known(frame) || !is_known(body) {
            return Ok(None);
        }
        if self.edges.len() > MOST {
            return Err(format!(
                "has {} transforms, more than {MOST}: name the parent of {body:?} as `frame`",
                self.edges.len()
            ));
        }
        let Some(way) = self.way(frame, body, None) else {
            return Err(format!(
                "has {body:?} and {frame:?}, but no chain of transforms between them: record the one that is missing (/tf_static \
                 too), or name a frame that {body:?} hangs on"
            ));
        };
        for ends in way.windows(2) {
            let (one, other) = (&ends[0], &ends[1]);
            if [(one, other), (other, one)]
                .iter()
                .all(|(a, b)| self.edges.contains_key(&((*a).clone(), (*b).clone())))
            {
                return Err(format!(
                    "has {one:?} in {other:?} and {other:?} in {one:?}: a frame has one parent"
                ));
            }
            if let Some(other) = self.way(frame, body, Some((&ends[0], &ends[1]))) {
                return Err(format!(
                    "has two ways from {frame:?} to {body:?}: {} and {}; name the parent of {body:?} as `frame`",
                    way.join(" - "),
                    other.join(" - ")
                ));
            }
        }
        self.along(way).map(Some)
    }

    /// The frames of the shortest way between two frames that does not go over one transform.
    fn way(&self, from: &str, to: &str, without: Option<(&str, &str)>) -> Option<Vec<String>> {
        if self.edges.len() > MOST {
            return None;
        }
        let mut beside: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (parent, child) in self.edges.keys() {
            if without.is_none_or(|(a, b)| ![(a, b), (b, a)].contains(&(parent, child))) {
                beside.entry(parent).or_default().push(child);
                beside.entry(child).or_default().push(parent);
            }
        }
        let mut came_from: BTreeMap<&str, &str> = BTreeMap::from([(from, from)]);
        let mut next = VecDeque::from([from]);
        while let Some(at) = next.pop_front().filter(|at| *at != to) {
            for other in beside.get(at).into_iter().flatten() {
                if !came_from.contains_key(other) {
                    came_from.insert(other, at);
                    next.push_back(other);
                }
            }
        }
        let mut way = vec![to.to_owned()];
        let mut at = *came_from.get(to)?;
        while way.last().is_some_and(|last| last != from) {
            way.push(at.to_owned());
            at = came_from[at];
        }
        way.reverse();
        Some(way)
    }

    fn along(&self, way: Vec<String>) -> Result<Chain, String> {
        let step = |ends: &[String]| {
            let (a, b) = (ends[0].clone(), ends[1].clone());
            let (down, up) = ((a.clone(), b.clone()), (b, a));
            let (ends, is_up) = if self.edges.contains_key(&down) { (down, false) } else { (up, true) };
            let (topic, edge) = &self.edges[&ends];
            (ends, is_up, topic, edge)
        };
        let steps: Vec<_> = way.windows(2).map(step).collect();
        let moves: Vec<usize> = (0..steps.len()).filter(|i| !steps[*i].3.is_constant).collect();
        if moves.len() > 1 {
            let named = |i: &usize| format!("{} in {}", steps[*i].0.1, steps[*i].0.0);
            return Err(format!(
                "reaches {:?} from {:?} over {} transforms that change ({}): they have stamps of their own, and a pose would have to be \
                 guessed in between; name a frame after the first of them, or record the pose in one transform",
                way[way.len() - 1],
                way[0],
                moves.len(),
                moves.iter().map(named).collect::<Vec<_>>().join(", ")
            ));
        }
        // Where nothing moves, what is published most often has the most stamps.
        let busiest = || (0..steps.len()).max_by_key(|i| steps[*i].3.messages).unwrap_or(0);
        let moving = moves.first().copied().unwrap_or_else(busiest);
        let product = |range: std::ops::Range<usize>| {
            steps[range].iter().try_fold(Pose::identity(), |so_far, ((parent, child), is_up, _, edge)| {
                let pose = edge.pose().ok_or_else(|| {
                    format!(
                        "has no rotation of {child:?} in {parent:?}: its quaternion is not of unit length"
                    )
                })?;
                Ok::<Pose, String>(so_far * if *is_up { pose.inverse() } else { pose })
            })
        };
        let (before, after) = (product(0..moving)?, product(moving + 1..steps.len())?);
        let ((parent, child), is_up, topic, _) = &steps[moving];
        Ok(Chain {
            frame: way[0].clone(),
            body: way[way.len() - 1].clone(),
            moving: ((*topic).clone(), parent.clone(), child.clone()),
            is_up: *is_up,
            before,
            after,
            way,
        })
    }
}

impl Chain {
    /// How it was found.
    pub(crate) fn told(&self) -> String {
        let (topic, parent, child) = &self.moving;
        format!(
            "{:?} in {:?} is composed over {} transforms ({}), with the stamps of {child:?} in {parent:?} on {topic}; the others never \
             change",
            self.body,
            self.frame,
            self.way.len() - 1,
            self.way.join(" - ")
        )
    }

    /// The samples of the body in the frame, of those of the transform that moves; the error is in words that follow the topic.
    pub(crate) fn composed(&self, samples: PoseSamples) -> Result<PoseSamples, String> {
        let (_, parent, child) = &self.moving;
        let turned = samples.orientation.ok_or_else(|| {
            format!(
                "has no usable rotation of {child:?} in {parent:?}, so nothing can be said of {:?} in {:?}",
                self.body, self.frame
            )
        })?;
        let pose = |(position_m, turned): (&nalgebra::Vector3<f64>, UnitQuaternion<f64>)| {
            let pose = Pose::from_parts(Translation3::from(*position_m), turned);
            self.before * if self.is_up { pose.inverse() } else { pose } * self.after
        };
        let poses: Vec<Pose> = samples.position_m.iter().zip(turned).map(pose).collect();
        Ok(PoseSamples {
            frame_id: self.frame.clone(),
            body: self.body.clone(),
            time_ns: samples.time_ns,
            position_m: poses.iter().map(|p| p.translation.vector).collect(),
            orientation: Some(poses.iter().map(|p| p.rotation).collect()),
            ahead_of_log_s: samples.ahead_of_log_s,
        })
    }
}
