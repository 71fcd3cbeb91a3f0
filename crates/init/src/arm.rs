//! The nominal arm: which of its joints are recorded, from which link to which.

use super::channels::{Channels, Unknown};
use super::links::{Link, joint_depths, joints_of, link_path, rigid_with};
use super::missing::no_joints;
use super::telescope::{self, Telescope};
use super::topics::{Field, JointTopic};
use crate::error::InitError;
use armcal_core::Pose;
use armcal_model::{Chain, Model, check_xml};
use armcal_recording::input::Kind;
use armcal_stages::frames::bare_model;
use roxmltree::Document;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Names that REP-105 keeps for what is no part of a robot.
const NO_ROBOT: [&str; 4] = ["world", "map", "odom", "earth"];

/// A gripper has no more joints in a row.
const GRIPPER_JOINTS: usize = 2;

/// What the user says of the arm.
#[derive(Debug, Clone, Default)]
pub struct Told {
    /// DH file.
    pub dh: Option<PathBuf>,
    /// URDF file.
    pub urdf: Option<PathBuf>,
    /// First link.
    pub base_link: Option<String>,
    /// Last link.
    pub tip_link: Option<String>,
    /// Topic of the joint readings.
    pub joints: Option<String>,
}

/// The arm as far as files and names say it.
pub struct Arm {
    /// Its file: that of the user, or where a description from the recording will be written.
    pub file: PathBuf,
    /// The text of that file.
    pub text: String,
    /// Whether the text was found in a recording and is still to be written.
    pub recorded: bool,
    /// First link, of a URDF.
    pub base_link: Option<String>,
    /// Links that the tip may be, all behind the last joint; the first is the likeliest. Of a DH table none.
    pub tips: Vec<String>,
    /// The joint readings.
    pub source: JointTopic,
    /// Joint names as recorded, in the order of the model.
    pub names: Vec<String>,
    /// Every link of the URDF.
    pub links: BTreeSet<String>,
    /// The chain to the first of the tips.
    pub model: Model,
    /// Of each joint, the link or row that it moves.
    pub carried: Vec<String>,
    /// What was taken on trust.
    pub unsure: Vec<String>,
}

impl Arm {
    /// Whether it is a URDF.
    pub fn is_urdf(&self) -> bool {
        self.model.chain().is_urdf()
    }

    /// The same arm with the tip at another link.
    pub fn model_to(&self, tip: &str) -> Result<Model, InitError> {
        let base = self.base_link.as_deref().unwrap_or_default();
        Ok(bare_model(&Chain::from_urdf(&self.text, base, tip, &self.file)?, Vec::new())?)
    }

    /// The links that the tip may be, of a URDF, with their places on the first of them. They are fixed to each other, so all of
    /// them are read at once, and put where they are in any posture.
    pub fn tip_places(&self) -> Result<Vec<(Option<String>, Pose)>, InitError> {
        let Some((first, others)) = self.tips.split_first() else {
            return Ok(vec![(None, Pose::identity())]);
        };
        let base = self.base_link.as_deref().unwrap_or_default();
        let others: Vec<&str> = others.iter().map(String::as_str).collect();
        let chain = Chain::from_urdf_branches(&self.text, base, first, &others, &self.file)?;
        let (model, zeros) = (bare_model(&chain, Vec::new())?, vec![0.0; chain.joint_names().len()]);
        let frames = model.link_frames(&model.nominal(), &zeros);
        let in_base: BTreeMap<&str, Pose> = frames.iter().map(|f| (f.name.as_str(), f.in_base)).collect();
        let first = in_base.get(first.as_str()).map_or(Pose::identity(), Pose::inverse);
        let place = |tip: &String| Some((Some(tip.clone()), first * in_base.get(tip.as_str())?));
        Ok(self.tips.iter().filter_map(place).collect())
    }

    /// The links that the joints carry, then the tip, in the base.
    pub fn poses(&self, joint_rad: &[f64]) -> Vec<Pose> {
        let p = self.model.nominal();
        let frames = self.model.link_frames(&p, joint_rad);
        let of =
            |name: &String| frames.iter().find(|f| f.name == *name).map_or(Pose::identity(), |f| f.in_base);
        self.carried.iter().map(of).chain([self.model.tip_in_base(&p, joint_rad)]).collect()
    }
}

/// Finds the arm: a file that the user names, or the description in the recordings, which goes `beside`, or the only one in
/// their `folders`. Joint readings of a known type come before fields with names, and these before fields without.
pub fn find(
    told: &Told,
    channels: &Channels,
    folders: &BTreeSet<PathBuf>,
    beside: &Path,
) -> Result<Arm, InitError> {
    let found = channels;
    let (own_joints, links) = joints_and_links(told, channels, folders, beside);
    let mut joints = channels.joints.clone();
    let called = |of: &Unknown| of.fields.called(&own_joints, &of.topic, of.messages);
    joints.extend(channels.unknown.iter().flat_map(called));
    joints.sort_by_key(|j| j.field.as_ref().map(|f| Reverse(f.surety)));
    if joints.is_empty() {
        return Err(no_joints(found, &own_joints, &links));
    }
    let channels = &Channels { joints, urdfs: channels.urdfs.clone(), ..Channels::default() };
    if let Some(asked) = &told.joints
        && !channels.joints.iter().any(|j| is_called(j, asked))
    {
        let present: Vec<String> = channels.joints.iter().map(JointTopic::shown).collect();
        let problem = format!(
            "--joints {asked} is no topic of joint readings in all recordings; there are: {}",
            present.join(", ")
        );
        return Err(InitError::Usage { problem });
    }
    let unnamed = |j: &JointTopic| {
        let field = j.field.clone().map(|f| Field { name: None, ..f });
        JointTopic { names: Vec::new(), field, ..j.clone() }
    };
    // Fields that were found by the names of joints have no order of their own.
    let in_order = |j: &JointTopic| j.field.as_ref().is_some_and(|f| f.name.is_some() || j.names.is_empty());
    let all = || channels.joints.iter();
    let ways: [Vec<JointTopic>; 3] = [
        all().filter(|j| j.field.is_none()).cloned().collect(),
        all().filter(|j| j.field.is_some() && !j.names.is_empty()).cloned().collect(),
        all().filter(|j| in_order(j)).map(unnamed).collect(),
    ];
    let mut refused = None;
    for joints in ways.into_iter().filter(|way| !way.is_empty()) {
        let way = Channels { joints, urdfs: channels.urdfs.clone(), ..Channels::default() };
        match resolve_arm(told, &way, folders, beside) {
            Ok(mut arm) => {
                arm.unsure.extend(other_fields_note(&arm.source, channels));
                let is_used = |topic: &String| {
                    *topic == arm.source.topic || found.bodies.iter().any(|b| b.topic == *topic)
                };
                let substituted = found.substituted.iter().filter(|(topic, _)| is_used(topic));
                let said: Vec<String> = substituted.map(|(_, said)| said.clone()).collect();
                arm.unsure.extend(said);
                return Ok(arm);
            }
            Err(error) => _ = refused.get_or_insert(error),
        }
    }
    Err(refused.unwrap_or_else(|| no_joints(found, &own_joints, &links)))
}

/// The other fields that the joints may be in.
fn other_fields_note(own: &JointTopic, channels: &Channels) -> Option<String> {
    let Field { values, why, .. } = own.field.as_ref()?;
    // The same fields in another order are no others.
    let places = |j: &JointTopic| -> BTreeSet<String> {
        j.field.iter().flat_map(|f| &f.positions).map(|path| format!("{}:{path}", j.topic)).collect()
    };
    let as_many =
        |j: &&JointTopic| j.field.as_ref().is_some_and(|f| f.values == *values) && places(j) != places(own);
    let others: Vec<String> = channels.joints.iter().filter(as_many).map(JointTopic::shown).collect();
    let said = format!(
        "the joints are at {}: {why}; --joints chooses another of {}",
        own.shown(),
        others.join(", ")
    );
    (!others.is_empty()).then_some(said)
}

fn is_called(joints: &JointTopic, asked: &str) -> bool {
    joints.topic == asked || joints.shown() == asked
}

/// The URDF files beside the recordings.
fn urdfs_in(folders: &BTreeSet<PathBuf>) -> Vec<PathBuf> {
    let files =
        folders.iter().filter_map(|f| std::fs::read_dir(f).ok()).flatten().flatten().map(|e| e.path());
    let mut found: Vec<PathBuf> = files.filter(|p| p.extension().is_some_and(|e| e == "urdf")).collect();
    found.sort();
    found
}

fn resolve_arm(
    told: &Told,
    channels: &Channels,
    folders: &BTreeSet<PathBuf>,
    beside: &Path,
) -> Result<Arm, InitError> {
    if let Some(path) = &told.dh {
        return from_dh(told, channels, path);
    }
    let (file, text, recorded) = urdf_of(told, channels, folders, beside)?;
    let named = candidate_topics(told, channels).flat_map(|j| &j.names).map(String::as_str).collect();
    match telescope::follow_sum(&text, &named) {
        Some(Telescope { text, said }) => {
            let mut arm = from_urdf(told, channels, beside.to_owned(), text, true)?;
            arm.unsure.push(said);
            Ok(arm)
        }
        None => from_urdf(told, channels, file, text, recorded),
    }
}

/// File and text of the URDF, and whether it was recorded.
fn urdf_of(
    told: &Told,
    channels: &Channels,
    folders: &BTreeSet<PathBuf>,
    beside: &Path,
) -> Result<(PathBuf, String, bool), InitError> {
    let read = |path: &Path| armcal_config::read_text("URDF", Kind::Text, path);
    Ok(match (&told.urdf, channels.urdfs.len()) {
        (Some(path), _) => (path.clone(), read(path)?, false),
        (None, 1) => (beside.to_owned(), channels.urdfs.iter().next().cloned().unwrap_or_default(), true),
        (None, 0) => match urdfs_in(folders).as_slice() {
            [only] => (only.clone(), read(only)?, false),
            several => {
                let said = "no /robot_description (std_msgs/String) is recorded";
                let lie = several.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
                let lie = if lie.is_empty() { lie } else { format!(", and beside the recordings lie {lie}") };
                return Err(no_arm(channels, &format!("{said}{lie}")));
            }
        },
        (None, n) => {
            return Err(no_arm(
                channels,
                &format!("{n} different robot descriptions are recorded; write the right one to a file"),
            ));
        }
    })
}

/// The joints of the model and the links that they move, as far as it can be read.
fn joints_and_links(
    told: &Told,
    channels: &Channels,
    folders: &BTreeSet<PathBuf>,
    beside: &Path,
) -> (Vec<String>, Vec<String>) {
    if let Some(path) = &told.dh {
        let text = armcal_config::read_text("DH model", Kind::Text, path).unwrap_or_default();
        let rows = Chain::from_dh_toml(&text, path).map(|chain| chain.joint_names().to_vec());
        return (rows.unwrap_or_default(), Vec::new());
    }
    let text = urdf_of(told, channels, folders, beside).map(|(_, text, _)| text).unwrap_or_default();
    let document = check_xml(&text).ok().and_then(|()| Document::parse(&text).ok());
    let joints = document.as_ref().map(|document| joints_of(document.root_element())).unwrap_or_default();
    let moving = joints.into_iter().filter(|(_, l)| l.moves);
    moving.map(|(link, l)| (l.joint.to_owned(), link.to_owned())).unzip()
}

fn no_arm(channels: &Channels, why: &str) -> InitError {
    let names = channels.joints.iter().map(|j| format!("{} ({})", j.shown(), describe_joints(j)));
    let problem = format!(
        "nothing says what the arm is: {why}; give --urdf FILE or --dh FILE (docs/guide.md shows one). Recorded joints: {}",
        names.collect::<Vec<_>>().join("; ")
    );
    InitError::Init { problem }
}

/// The joints of a topic in words.
fn describe_joints(joints: &JointTopic) -> String {
    match &joints.field {
        Some(field) if joints.names.is_empty() => format!("{} numbers", field.values),
        _ => joints.names.join(", "),
    }
}

fn from_dh(told: &Told, channels: &Channels, path: &Path) -> Result<Arm, InitError> {
    let text = armcal_config::read_text("DH model", Kind::Text, path)?;
    if text.trim_start().starts_with('<') {
        let problem = format!("{} is XML and no DH table: a URDF is given with --urdf", path.display());
        return Err(InitError::Init { problem });
    }
    let chain = Chain::from_dh_toml(&text, path)?;
    let rows = chain.joint_names().to_vec();
    let mut unsure = Vec::new();
    let (source, names) = match topic_of(told, channels, &rows) {
        Some(found) => found,
        None => {
            // A table may name its rows as it likes: as many joints on one topic are taken in their order.
            let mut alike = candidate_topics(told, channels).filter(|j| j.names.len() == rows.len());
            let Some(only) = alike.next() else { return Err(other_joints(channels, &rows, path)) };
            unsure.push(format!(
                "the rows of {} are called {}, the recorded joints {}: they are taken in this order",
                path.display(),
                rows.join(", "),
                only.names.join(", ")
            ));
            (only.of_joints(&only.names), only.names.clone())
        }
    };
    unsure.extend(other_topic_notes(told, channels, &source.topic, &names));
    let model = bare_model(&chain, Vec::new())?;
    Ok(Arm {
        file: path.to_owned(),
        text,
        recorded: false,
        base_link: None,
        tips: Vec::new(),
        source,
        names,
        links: BTreeSet::new(),
        model,
        carried: rows,
        unsure,
    })
}

fn other_joints(channels: &Channels, model: &[String], path: &Path) -> InitError {
    let topics = channels.joints.iter().map(|j| format!("{} has {}", j.shown(), describe_joints(j)));
    let problem = format!(
        "no topic has the joints of {} ({}): {}",
        path.display(),
        model.join(", "),
        topics.collect::<Vec<_>>().join("; ")
    );
    InitError::Init { problem }
}

/// The topics that may be meant.
fn candidate_topics<'a>(told: &'a Told, channels: &'a Channels) -> impl Iterator<Item = &'a JointTopic> {
    channels.joints.iter().filter(|j| told.joints.as_ref().is_none_or(|asked| is_called(j, asked)))
}

/// Other topics that have the same joints: of another arm, of set-points, or of a driver beside the first.
fn other_topic_notes(told: &Told, channels: &Channels, topic: &str, names: &[String]) -> Vec<String> {
    let has_all = |j: &&JointTopic| j.topic != topic && names.iter().all(|name| j.names.contains(name));
    let others: Vec<&str> =
        candidate_topics(told, channels).filter(has_all).map(|j| j.topic.as_str()).collect();
    let told = format!("{topic} is read; {} has the same joints, and --joints chooses it", others.join(", "));
    if others.is_empty() { Vec::new() } else { vec![told] }
}

/// The topic that has all these joints, and their names in it; of several the one with most messages. Messages without names
/// are read in the order of the model.
fn topic_of(told: &Told, channels: &Channels, joints: &[String]) -> Option<(JointTopic, Vec<String>)> {
    let has_all = |j: &&JointTopic| joints.iter().all(|name| j.names.contains(name));
    let unnamed = |j: &&JointTopic| {
        j.names.is_empty() && j.field.as_ref().is_none_or(|field| field.values == joints.len())
    };
    // Of fields the first: they are in the order of what speaks for them.
    let most = |j: &&JointTopic| j.field.is_none().then(|| (Reverse(j.messages), j.topic.clone()));
    let found = candidate_topics(told, channels).filter(has_all).min_by_key(most);
    let found = found.or_else(|| candidate_topics(told, channels).find(unnamed));
    // A list without names may go on with the gripper, which the model has not.
    let longer = |j: &&JointTopic| {
        let values = j.field.as_ref().filter(|f| f.positions.len() == 1).map_or(0, |f| f.values);
        j.names.is_empty() && (1..=GRIPPER_JOINTS).contains(&values.saturating_sub(joints.len()))
    };
    let found = found.or_else(|| candidate_topics(told, channels).find(longer));
    found.map(|j| (j.of_joints(joints), joints.to_vec()))
}

fn from_urdf(
    told: &Told,
    channels: &Channels,
    file: PathBuf,
    text: String,
    recorded: bool,
) -> Result<Arm, InitError> {
    let at = |problem: String| format!("{}: {problem}", file.display());
    let bad = |problem: String| InitError::Init { problem: at(problem) };
    check_xml(&text).map_err(&bad)?;
    let document =
        Document::parse(&text).map_err(|e| bad(format!("is no XML: {e}; a DH table is given with --dh")))?;
    let joints = joints_of(document.root_element());
    let named: BTreeSet<&str> =
        candidate_topics(told, channels).flat_map(|j| &j.names).map(String::as_str).collect();
    let unnamed = named.is_empty() && candidate_topics(told, channels).next().is_some();
    let is_read = |l: &Link<'_>| l.moves && (unnamed || named.contains(l.joint));
    // Fingers: joints that share a parent link and end there.
    let mut read_on: BTreeMap<&str, usize> = BTreeMap::new();
    joints.values().filter(|l| is_read(l)).for_each(|l| *read_on.entry(l.parent).or_default() += 1);
    let counts = |l: &Link<'_>| is_read(l) && !(l.slides && read_on[l.parent] > 1);
    let depths = joint_depths(&joints, counts);
    let depth = |link: &&str| depths[link];
    let ends: Vec<&str> = joints.iter().filter(|(_, l)| counts(l)).map(|(child, _)| *child).collect();
    let whole = ends.iter().map(&depth).max().unwrap_or(0);
    let deepest = if unnamed { depth_of_numbers(told, channels, whole) } else { whole };
    let end = match &told.tip_link {
        Some(tip) => {
            let known = joints.get_key_value(tip.as_str()).map(|(link, _)| *link);
            let known = known.ok_or_else(|| InitError::Usage {
                problem: at(format!("--tip-link {tip} is no link of it")),
            })?;
            link_path(&joints, known).into_iter().rev().find(|link| counts(&joints[link]))
        }
        None => {
            let all: Vec<&str> = ends.iter().copied().filter(|end| depth(end) == deepest).collect();
            if all.len() > 1 {
                let named = all.join(", ");
                return Err(bad(format!(
                    "{} arms of {deepest} recorded joints end at {named}: say which with --tip-link LINK",
                    all.len()
                )));
            }
            all.first().copied()
        }
    };
    let Some(end) = end else {
        let known: Vec<String> = joints.values().filter(|l| l.moves).map(|l| l.joint.to_owned()).collect();
        return Err(other_joints(channels, &known, &file));
    };
    let way = link_path(&joints, end);
    let behind =
        way.iter().rposition(|link| joints[link].moves && !counts(&joints[link])).map_or(0, |at| at + 1);
    let moving: Vec<&str> = way[behind..].iter().copied().filter(|link| joints[link].moves).collect();
    if moving.is_empty() {
        return Err(bad(format!("no recorded joint leads to {end}")));
    }
    let model_joints: Vec<String> = moving.iter().map(|link| joints[link].joint.to_owned()).collect();
    let first = way[behind];
    let above = joints[first].parent;
    let is_frame_alone = behind == 0 && NO_ROBOT.contains(&above) && !joints[first].moves;
    let base = if is_frame_alone { first } else { above };
    let base_link = told.base_link.clone().unwrap_or_else(|| base.to_owned());
    let tips = match &told.tip_link {
        Some(tip) => vec![tip.clone()],
        None => rigid_with(&joints, end),
    };
    let chain = Chain::from_urdf(&text, &base_link, tips.first().map_or(end, String::as_str), &file)?;
    // What the way's joints follow may be elsewhere in the robot.
    let led_link = |name: &String| way.iter().rev().find(|link| joints[*link].leader == Some(name));
    let own_link =
        |name: &String| moving.iter().find(|link| joints[*link].joint == name).or_else(|| led_link(name));
    let carried: Vec<Option<&&str>> = chain.joint_names().iter().map(own_link).collect();
    if carried.contains(&None) || !model_joints.iter().all(|name| chain.joint_names().contains(name)) {
        let own = chain.joint_names().join(", ");
        return Err(bad(format!(
            "from {base_link} on the way to {end} there are the joints {own}, recorded are {}",
            model_joints.join(", ")
        )));
    }
    // As they lie behind each other, whatever the order of the joints.
    let moved: BTreeSet<&str> = carried.into_iter().flatten().copied().collect();
    let carried: Vec<String> =
        way.iter().filter(|link| moved.contains(*link)).map(|link| (*link).to_owned()).collect();
    let model_joints = chain.joint_names().to_vec();
    let (source, names) = topic_of(told, channels, &model_joints)
        .ok_or_else(|| other_joints(channels, &model_joints, &file))?;
    let model = bare_model(&chain, Vec::new())?;
    let mut links: BTreeSet<String> = joints.keys().map(|link| (*link).to_owned()).collect();
    links.extend(joints.values().map(|l| l.parent.to_owned()));
    let mut unsure = other_topic_notes(told, channels, &source.topic, &names);
    if deepest < whole && told.tip_link.is_none() {
        unsure.push(left_out_note(&source, &joints, end, &model_joints));
    }
    if unnamed {
        let more = source.field.as_ref().map_or(0, |f| f.values.saturating_sub(names.len()));
        let more = match more {
            0 => String::new(),
            more => format!(", and the last {more} of them are taken for a gripper's and left out"),
        };
        let shown = source.shown();
        unsure.push(format!("{shown} names no joints: they are read in the order of the model{more}"));
    }
    let base_link = Some(base_link);
    drop(document);
    Ok(Arm { file, recorded, base_link, tips, source, names, links, model, carried, unsure, text })
}

/// So many joints in a row as there are numbers where these come without names: all of them, or one or two less, of a gripper
/// that is not recorded.
fn depth_of_numbers(told: &Told, channels: &Channels, whole: usize) -> usize {
    let numbers = |j: &JointTopic| j.field.as_ref().map_or(whole, |f| f.values);
    let known: Vec<usize> = candidate_topics(told, channels).map(numbers).collect();
    let fits = |n: &usize| *n > 0 && (1..=GRIPPER_JOINTS).contains(&whole.saturating_sub(*n));
    if known.contains(&whole) { whole } else { known.into_iter().find(fits).unwrap_or(whole) }
}

/// What of the URDF is taken for not recorded, and why.
fn left_out_note(
    source: &JointTopic,
    joints: &BTreeMap<&str, Link<'_>>,
    end: &str,
    read: &[String],
) -> String {
    let behind = joints.iter().filter(|(link, l)| l.moves && link_path(joints, link).contains(&end));
    let behind = behind.map(|(_, l)| l.joint).filter(|joint| !read.iter().any(|read| read == joint));
    let behind = behind.collect::<Vec<_>>().join(", ");
    format!(
        "{} has {} numbers: taken for {}; {behind} behind {end} is left out as not recorded, and --tip-link LINK chooses otherwise",
        source.shown(),
        read.len(),
        read.join(", ")
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may stop")]
mod tests {
    use super::*;

    fn urdf(links: &[(&str, &str, &str, &str)]) -> String {
        let joint = |(name, form, parent, child): &(&str, &str, &str, &str)| {
            format!(
                "<joint name=\"{name}\" type=\"{form}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0 0 0.2\"/>\
                 <axis xyz=\"0 1 0\"/></joint>"
            )
        };
        let names: BTreeSet<&str> = links.iter().flat_map(|l| [l.2, l.3]).collect();
        let names = names.iter().map(|name| format!("<link name=\"{name}\"/>"));
        format!(
            "<robot name=\"r\">{}{}</robot>",
            names.collect::<String>(),
            links.iter().map(joint).collect::<String>()
        )
    }

    /// A list of so many numbers without names.
    fn numbers(values: usize) -> Channels {
        let field =
            Field { positions: vec!["data[]".into()], name: None, values, surety: 2, why: String::new() };
        let topic = JointTopic { topic: "/q".into(), names: Vec::new(), messages: 1, field: Some(field) };
        Channels { joints: vec![topic], ..Channels::default() }
    }

    fn recorded(names: &[&str]) -> Channels {
        let names = names.iter().map(|n| (*n).to_owned()).collect();
        Channels {
            joints: vec![JointTopic { topic: "/j".into(), names, messages: 1, field: None }],
            ..Channels::default()
        }
    }

    const ARM: [(&str, &str, &str, &str); 7] = [
        ("mount", "fixed", "world", "base"),
        ("lift", "prismatic", "base", "column"),
        ("a", "revolute", "column", "l1"),
        ("b", "continuous", "l1", "l2"),
        ("f1", "prismatic", "hand", "finger1"),
        ("f2", "prismatic", "hand", "finger2"),
        ("hold", "fixed", "l2", "hand"),
    ];

    #[test]
    fn the_arm_is_what_moves_and_is_read_without_its_fingers() {
        let found = |names: &[&str]| {
            from_urdf(&Told::default(), &recorded(names), "r.urdf".into(), urdf(&ARM), false).unwrap()
        };
        let whole = found(&["f1", "b", "a", "f2", "lift"]);
        assert_eq!(
            (whole.names.join(" "), whole.base_link.as_deref()),
            ("lift a b".to_owned(), Some("base"))
        );
        assert_eq!(whole.tips, ["hand", "l2"]);
        assert_eq!(whole.carried, ["column", "l1", "l2"]);
        // What is not read stands still: the arm begins above it.
        let above = found(&["a", "b"]);
        assert_eq!((above.names.join(" "), above.base_link.as_deref()), ("a b".to_owned(), Some("column")));
    }

    #[test]
    fn two_arms_in_one_file_are_not_guessed_between() {
        let two = [("a", "revolute", "body", "l1"), ("b", "revolute", "body", "r1")];
        let find = |told: &Told| from_urdf(told, &recorded(&["a", "b"]), "r.urdf".into(), urdf(&two), false);
        let refused = find(&Told::default()).err().unwrap().to_string();
        assert!(refused.contains("l1, r1") && refused.contains("--tip-link"), "{refused}");
        let told = Told { tip_link: Some("r1".into()), ..Told::default() };
        assert_eq!(find(&told).unwrap().names, ["b"]);
    }

    /// Five joints and a gripper on the last link.
    #[test]
    fn fewer_numbers_than_joints_leave_the_gripper_out() {
        let arm = [
            ("a", "revolute", "base", "l1"),
            ("b", "revolute", "l1", "l2"),
            ("c", "revolute", "l2", "l3"),
            ("d", "revolute", "l3", "l4"),
            ("grip", "revolute", "l4", "jaw"),
            ("frame", "fixed", "l4", "tool"),
        ];
        let find = |values, tip: Option<&str>| {
            let told = Told { tip_link: tip.map(str::to_owned), ..Told::default() };
            from_urdf(&told, &numbers(values), "r.urdf".into(), urdf(&arm), false)
        };
        let shorter = find(4, None).unwrap();
        assert_eq!((shorter.names.join(" "), shorter.tips.join(" ")), ("a b c d".into(), "tool l4".into()));
        assert!(shorter.unsure.iter().any(|said| said.contains("grip behind l4 is left out")));
        let whole = find(5, None).unwrap();
        assert_eq!((whole.names.len(), whole.unsure.len()), (5, 1));
        assert_eq!(find(4, Some("tool")).unwrap().unsure.len(), 1);
        let longer = find(7, None).unwrap();
        assert!(longer.names.len() == 5 && longer.unsure[0].contains("the last 2 of them"));
        assert!(find(8, None).is_err());
        // So many are no gripper.
        let refused = find(2, None).err().unwrap().to_string();
        assert!(refused.contains("a, b, c, d, grip") && refused.contains("has 2 numbers"), "{refused}");
    }

    #[test]
    fn fields_that_are_called_as_joints_come_in_the_order_of_the_model() {
        let joints = |names: [&str; 3]| {
            let paths = names.iter().map(|name| format!("{name}.pos")).collect();
            let field = Field { positions: paths, name: None, values: 3, surety: 2, why: String::new() };
            let names = names.iter().map(|n| (*n).to_owned()).collect();
            JointTopic { topic: "/q".into(), names, messages: 1, field: Some(field) }
        };
        let channels = Channels { joints: vec![joints(["b", "lift", "a"])], ..Channels::default() };
        let found = from_urdf(&Told::default(), &channels, "r.urdf".into(), urdf(&ARM), false).unwrap();
        assert_eq!(found.names, ["lift", "a", "b"]);
        assert_eq!(found.source.field.unwrap().positions, ["lift.pos", "a.pos", "b.pos"]);
    }
}
