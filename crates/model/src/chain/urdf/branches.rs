//! Which joints of a URDF lead from its base to what is measured, and what hangs beside them.

use super::reader::{Reader, child};
use super::{motion_of, read_limits};
use crate::ModelError;
use crate::rigid::Rigid;
use crate::segment::{Body, Mimic, joint_transform};
use roxmltree::Node;
use std::collections::{BTreeMap, BTreeSet};

/// The joints of a robot by the links they join.
pub(super) struct Branches<'a, 'x> {
    reader: &'a Reader<'a, 'x>,
    robot: Node<'a, 'x>,
    /// The joint above each link.
    above: BTreeMap<&'a str, Node<'a, 'x>>,
    /// Links with more than one.
    twice: BTreeSet<&'a str>,
    /// The joints below each link, in the order of the file.
    below: BTreeMap<&'a str, Vec<Node<'a, 'x>>>,
    /// Links and joints by name, the first of each.
    links: BTreeMap<&'a str, Node<'a, 'x>>,
    joints: BTreeMap<&'a str, Node<'a, 'x>>,
}

/// A joint that is part of the model.
pub(super) struct Kept<'a, 'x> {
    pub joint: Node<'a, 'x>,
    /// The link it hangs on, and its own.
    pub parent: &'a str,
    pub link: &'a str,
}

impl<'a, 'x> Branches<'a, 'x> {
    pub fn of(reader: &'a Reader<'a, 'x>, robot: Node<'a, 'x>) -> Branches<'a, 'x> {
        let (mut above, mut below) = (BTreeMap::new(), BTreeMap::<&str, Vec<_>>::new());
        let mut twice = BTreeSet::new();
        let (links, joints) = (by_name(Reader::links(robot)), by_name(Reader::joints(robot)));
        for joint in Reader::joints(robot) {
            let [parent, link] =
                ["parent", "child"].map(|end| child(joint, end).and_then(|e| e.attribute("link")));
            if let Some(parent) = parent {
                below.entry(parent).or_default().push(joint);
            }
            // A joint without a child is an error only if a way needs it, and then it is not found.
            if link.is_some_and(|link| above.insert(link, joint).is_some()) {
                twice.extend(link);
            }
        }
        Branches { reader, robot, above, twice, below, links, joints }
    }

    /// The joints on the ways from `base` to these links, and those whose readings they follow: parents before their
    /// children, branch after branch.
    pub fn to(&self, base: &str, ends: &[&str]) -> Result<Vec<Kept<'a, 'x>>, ModelError> {
        let mut kept: BTreeMap<&str, (Node<'a, 'x>, &'a str)> = BTreeMap::new();
        let mut wanted: Vec<String> = ends.iter().map(|end| (*end).to_owned()).collect();
        while let Some(end) = wanted.pop() {
            for (joint, parent, link) in self.way(base, &end, |link| kept.contains_key(link))? {
                kept.insert(link, (joint, parent));
                if let Some((leader, _)) = self.followed(joint)? {
                    wanted.push(self.link_of(joint, leader)?.to_owned());
                }
            }
        }
        let mut order = Vec::with_capacity(kept.len());
        let mut open: Vec<&str> = vec![base];
        while let Some(link) = open.pop() {
            if let Some((link, (joint, parent))) = kept.remove_entry(link) {
                order.push(Kept { joint, parent, link });
            }
            let joints = self.below.get(link).into_iter().flatten().rev();
            let links = joints.filter_map(|joint| child(*joint, "child")?.attribute("link"));
            open.extend(links.filter(|link| kept.contains_key(link)));
        }
        Ok(order)
    }

    /// The joints from `base`, or from a link whose way is known, to a link, in this order, with the links above and below
    /// each.
    fn way(
        &self,
        base: &str,
        end: &str,
        is_known: impl Fn(&str) -> bool,
    ) -> Result<Vec<(Node<'a, 'x>, &'a str, &'a str)>, ModelError> {
        for link in [base, end].into_iter().filter(|link| !self.links.contains_key(link)) {
            self.reader.check_link(self.robot, link)?;
        }
        let (mut joints, mut ancestors, mut link) = (Vec::new(), Vec::new(), end);
        while link != base && !is_known(link) {
            let Some((&own, &joint)) = self.above.get_key_value(link) else {
                let ancestors = if ancestors.is_empty() { "none".to_owned() } else { ancestors.join(", ") };
                let (base, tip, path) = (base.to_owned(), end.to_owned(), self.reader.path.to_owned());
                return Err(ModelError::NoPath { path, base, tip, ancestors });
            };
            let name = self.reader.required(joint, "joint", "name")?;
            let wrong = |problem: String| self.reader.error(joint, format!("joint \"{name}\""), problem);
            if self.twice.contains(link) {
                return Err(wrong(format!("the link \"{link}\" has more than one parent joint")));
            }
            if joints.len() > self.above.len() {
                return Err(wrong("the joints from base to tip form a loop; a tree is needed".to_owned()));
            }
            let parent =
                child(joint, "parent").ok_or_else(|| wrong("it has no <parent link=\"...\"/>".into()))?;
            let above = self.reader.required(parent, &format!("parent of joint \"{name}\""), "link")?;
            ancestors.push(above);
            joints.push((joint, above, own));
            link = above;
        }
        joints.reverse();
        Ok(joints)
    }

    /// The joint that another follows, and how: `q = multiplier * leader + offset` of `<mimic>`.
    pub fn followed(&self, joint: Node<'a, 'x>) -> Result<Option<(&'a str, Mimic)>, ModelError> {
        let Some(mimic) = child(joint, "mimic").filter(|_| joint.attribute("type") != Some("fixed")) else {
            return Ok(None);
        };
        let subject = joint_subject(joint);
        let leader = self.reader.required(mimic, &format!("mimic of {subject}"), "joint")?;
        let number = |name: &str, default: f64| match mimic.attribute(name) {
            None => Ok(default),
            Some(text) => text.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| {
                self.reader.error(
                    mimic,
                    subject.clone(),
                    format!("{name} = \"{text}\" is not a finite number"),
                )
            }),
        };
        Ok(Some((leader, Mimic { ratio: number("multiplier", 1.0)?, offset: number("offset", 0.0)? })))
    }

    /// The link that the joint of this name moves, which a joint follows.
    fn link_of(&self, follower: Node<'a, 'x>, leader: &str) -> Result<&'a str, ModelError> {
        let wrong = |problem: String| self.reader.error(follower, joint_subject(follower), problem);
        let joint = *self
            .joints
            .get(leader)
            .ok_or_else(|| wrong(format!("it mimics \"{leader}\", and there is no such joint")))?;
        if child(joint, "mimic").is_some() {
            return Err(wrong(format!(
                "it mimics \"{leader}\", which mimics another joint itself; name the joint that has a reading"
            )));
        }
        if joint.attribute("type").and_then(motion_of).is_none() {
            return Err(wrong(format!("it mimics \"{leader}\", which does not move")));
        }
        let link = child(joint, "child").and_then(|c| c.attribute("link"));
        link.ok_or_else(|| wrong(format!("it mimics \"{leader}\", which carries no link")))
    }

    /// What hangs on a link by joints that are not part of the model, in its frame: with each as near to zero as its limits
    /// let it be. A branch that cannot be read weighs nothing, and one that hangs on two joints is none.
    pub fn hanging(&self, link: &str, kept: &BTreeSet<&str>) -> Option<Body> {
        let mut all: Option<Body> = None;
        let mut open = vec![(link, Rigid::identity())];
        let mut seen = BTreeSet::from([link]);
        while let Some((link, at)) = open.pop() {
            for &joint in self.below.get(link).into_iter().flatten() {
                let Some(end) = child(joint, "child").and_then(|c| c.attribute("link")) else { continue };
                if kept.contains(end) || self.twice.contains(end) || !seen.insert(end) {
                    continue;
                }
                let Ok(place) = self.at_rest(joint) else { continue };
                let place = at.then(&place);
                if let Ok(Some(body)) = self.body(end) {
                    let body = Body { centre_m: place.point(&body.centre_m), ..body };
                    all.get_or_insert(Body::NONE).add(&body);
                }
                open.push((end, place));
            }
        }
        all
    }

    /// Mass and centre of a link; none where it has none, or none that weighs.
    pub fn body(&self, link: &str) -> Result<Option<Body>, ModelError> {
        self.links.get(link).map_or(Ok(None), |node| self.reader.body(*node, link))
    }

    /// Where a joint puts its link when it is as near to zero as its limits let it be.
    fn at_rest(&self, joint: Node<'a, 'x>) -> Result<Rigid<f64>, ModelError> {
        let subject = joint_subject(joint);
        let origin = Rigid::from(&self.reader.origin(joint, &subject)?);
        let value = read_limits(joint).map_or(0.0, |[low, high]| 0f64.clamp(low, high));
        let motion = motion_of(joint.attribute("type").unwrap_or_default());
        let Some(motion) = motion else { return Ok(origin) };
        Ok(origin.then(&joint_transform(&self.reader.axis(joint, &subject)?, value, motion)))
    }
}

/// Elements by their names, the first of each.
pub(super) fn by_name<'a, 'x>(
    elements: impl Iterator<Item = Node<'a, 'x>>,
) -> BTreeMap<&'a str, Node<'a, 'x>> {
    let mut named = BTreeMap::new();
    for element in elements {
        if let Some(name) = element.attribute("name") {
            named.entry(name).or_insert(element);
        }
    }
    named
}

/// A joint as errors name it.
fn joint_subject(joint: Node<'_, '_>) -> String {
    format!("joint \"{}\"", joint.attribute("name").unwrap_or_default())
}
