//! The joints of a URDF by the links that they carry, and what hangs on what.

use roxmltree::Node;
use std::collections::BTreeMap;

/// A joint of a URDF.
pub struct Link<'a> {
    /// Its name.
    pub joint: &'a str,
    /// Whether a reading of its own moves it.
    pub moves: bool,
    /// Whether it is prismatic.
    pub slides: bool,
    /// The link that it hangs on.
    pub parent: &'a str,
    /// The joint that it follows.
    pub leader: Option<&'a str>,
}

/// Every joint by the link that it carries.
pub fn joints_of<'a>(robot: Node<'a, '_>) -> BTreeMap<&'a str, Link<'a>> {
    let child = |joint: Node<'a, '_>, tag: &str| {
        let found = joint.children().find(|c| c.has_tag_name(tag))?;
        found.attribute("link")
    };
    let joint = |joint: Node<'a, '_>| {
        let form = joint.attribute("type")?;
        let leader = joint.children().find(|c| c.has_tag_name("mimic")).and_then(|c| c.attribute("joint"));
        let moves = ["revolute", "continuous", "prismatic"].contains(&form) && leader.is_none();
        let (parent, link) = (child(joint, "parent")?, child(joint, "child")?);
        let slides = form == "prismatic";
        Some((link, Link { joint: joint.attribute("name")?, moves, slides, parent, leader }))
    };
    robot.children().filter(|c| c.has_tag_name("joint")).filter_map(joint).collect()
}

/// The links from behind the root to this one.
pub fn link_path<'a>(joints: &BTreeMap<&'a str, Link<'a>>, link: &str) -> Vec<&'a str> {
    let mut way: Vec<&str> = Vec::new();
    let mut at = link;
    while let Some((link, joint)) = joints.get_key_value(at).filter(|_| way.len() <= joints.len()) {
        way.push(link);
        at = joint.parent;
    }
    way.reverse();
    way
}

/// How many joints that count lead from the root to each link, itself included: each is asked once, however they hang together.
pub fn joint_depths<'a>(
    joints: &BTreeMap<&'a str, Link<'a>>,
    counts: impl Fn(&Link<'_>) -> bool,
) -> BTreeMap<&'a str, usize> {
    let mut depths: BTreeMap<&str, usize> = BTreeMap::new();
    for link in joints.keys() {
        let (mut way, mut at) = (Vec::new(), *link);
        // Joints that form a loop have no root: each of them begins at zero.
        while let Some((link, joint)) =
            joints.get_key_value(at).filter(|(link, _)| !depths.contains_key(*link))
        {
            depths.insert(link, 0);
            way.push((*link, joint));
            at = joint.parent;
        }
        let mut depth = depths.get(at).copied().unwrap_or(0);
        for (link, joint) in way.into_iter().rev() {
            depth += usize::from(counts(joint));
            depths.insert(link, depth);
        }
    }
    depths
}

/// The links that are fixed to this one, those furthest from it first, itself last.
pub fn rigid_with(joints: &BTreeMap<&str, Link<'_>>, link: &str) -> Vec<String> {
    let mut fixed: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (child, joint) in joints.iter().filter(|(_, joint)| !joint.moves) {
        fixed.entry(joint.parent).or_default().push(child);
    }
    let mut all = vec![(0, link)];
    let mut at = 0;
    // Each link has one joint here: only a loop comes by one again, and by this link.
    while let Some((depth, own)) = all.get(at).copied() {
        all.extend(fixed.remove(own).into_iter().flatten().map(|child| (depth + 1, child)));
        at += 1;
    }
    all.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(b.1)));
    all.into_iter().map(|(_, link)| link.to_owned()).collect()
}
