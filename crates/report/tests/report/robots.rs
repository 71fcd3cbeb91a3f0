//! The robots as URDF: what a viewer draws that knows the text and the transforms and nothing else.

use crate::recording::{Full, own, read, write};
use crate::recording::{list, rotation, string, vector};
use crate::synthetic::{Synthetic, synthetic};
use armcal_config::InputMessages;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;

/// The text of a CDR string.
fn text(m: &Full) -> &str {
    let (name, encoding, data) = m.schema.as_ref().unwrap();
    assert_eq!(
        (name.as_str(), encoding.as_str(), data.as_slice()),
        ("std_msgs/msg/String", "ros2msg", &b"string data\n"[..])
    );
    assert_eq!((m.encoding.as_str(), &m.data[..4]), ("cdr", &[0, 1, 0, 0][..]));
    let length = u32::from_le_bytes(m.data[4..8].try_into().unwrap()) as usize;
    assert_eq!((m.data.len(), m.data.last()), (8 + length, Some(&0)));
    std::str::from_utf8(&m.data[8..7 + length]).unwrap()
}

fn numbers(node: Node<'_, '_>, key: &str) -> Vec<f64> {
    node.attribute(key).unwrap().split(' ').map(|n| n.parse().unwrap()).collect()
}

fn origin(of: Node<'_, '_>) -> Isometry3<f64> {
    let origin = child(of, "origin");
    let (xyz, rpy) = (numbers(origin, "xyz"), numbers(origin, "rpy"));
    Isometry3::from_parts(
        Vector3::from_column_slice(&xyz).into(),
        UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]),
    )
}

fn child<'a, 'i>(of: Node<'a, 'i>, name: &str) -> Node<'a, 'i> {
    of.children().find(|c| c.has_tag_name(name)).unwrap_or_else(|| panic!("no {name}"))
}

/// Where every frame of each message of transforms is in the world, in the order of the chain.
fn frames(messages: &[Full], prefix: &str) -> Vec<Vec<(String, Isometry3<f64>)>> {
    let tree = |t: &prost_reflect::DynamicMessage| {
        let mut in_world = BTreeMap::from([("tf#/".to_owned(), Isometry3::identity())]);
        let mut chain = Vec::new();
        for t in list(t, "transforms") {
            let step = Isometry3::from_parts(vector(&t, "translation").into(), rotation(&t, "rotation"));
            let (parent, name) = (string(&t, "parent_frame_id"), string(&t, "child_frame_id"));
            let pose = in_world[&parent] * step;
            in_world.insert(name.clone(), pose);
            if name.starts_with(prefix) {
                chain.push((name, pose));
            }
        }
        chain
    };
    own(messages, "/armcal/tf").iter().map(tree).filter(|chain| !chain.is_empty()).collect()
}

/// Every cylinder reaches from a frame to the one before or behind it, in every pose; how many there are.
fn reaches(s: &Synthetic, prefix: &str) -> usize {
    let messages = read(&write(s, InputMessages::Reference, prefix).join("run.mcap"));
    let topic = format!("/armcal/{prefix}/robot_description");
    let message = messages.iter().find(|m| m.topic == topic).unwrap();
    assert_eq!(message.log_time, messages[0].log_time, "there from the first instant");
    let xml = Document::parse(text(message)).unwrap();
    let links: Vec<Node<'_, '_>> = xml.root_element().children().filter(|c| c.has_tag_name("link")).collect();
    let poses = frames(&messages, &format!("{prefix}/"));
    assert_eq!(poses.len(), 18 + 3, "one a dwell, one at the beginning of each recording");
    let mut shapes = 0;
    for chain in &poses {
        let names: Vec<&str> = chain.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(links.iter().map(|l| l.attribute("name").unwrap()).collect::<Vec<_>>(), names);
        for (k, link) in links.iter().enumerate() {
            for visual in link.children().filter(|c| c.has_tag_name("visual")) {
                let cylinder = child(child(visual, "geometry"), "cylinder");
                let half = numbers(cylinder, "length")[0] / 2.0;
                let [low, high] =
                    [-half, half].map(|z| chain[k].1 * origin(visual) * Point3::new(0.0, 0.0, z));
                let at = |k: usize| Point3::from(chain[k].1.translation.vector);
                assert!((low - at(k)).norm() < 1e-9, "{} begins at its own frame", names[k]);
                let ends = [k.checked_sub(1), Some(k + 1).filter(|k| *k < chain.len())].into_iter().flatten();
                assert!(ends.into_iter().any(|k| (high - at(k)).norm() < 1e-9), "{} ends nowhere", names[k]);
                shapes += 1;
            }
        }
    }
    shapes / poses.len()
}

#[test]
fn cylinders_join_the_frames_that_the_transforms_move() {
    let s = synthetic();
    // The nominal arm's first link has two frames of one origin, the calibrated one's have not.
    assert!(reaches(&s, "nominal") >= 3);
    assert!(reaches(&s, "calibrated") >= 3);
}

#[test]
fn the_board_is_a_plate_with_its_cavities_in_the_frame_of_the_recording_that_is_shown() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let message = messages.iter().find(|m| m.topic == "/armcal/board/robot_description").unwrap();
    let xml = Document::parse(text(message)).unwrap();
    let link = child(xml.root_element(), "link");
    assert_eq!(link.attribute("name"), Some("board"));
    let places = link
        .children()
        .filter(|c| c.has_tag_name("visual"))
        .filter(|v| child(*v, "geometry").children().any(|g| g.has_tag_name("cylinder")));
    let places: Vec<Vector3<f64>> = places.map(|v| origin(v).translation.vector).collect();
    let board = s.run.board.as_ref().unwrap();
    assert_eq!(places, board.cavities.iter().map(|c| c.in_board_m).collect::<Vec<_>>());
    let p = s.run.calibration.fit.values();
    let shown: Vec<Isometry3<f64>> = frames(&messages, "board")
        .iter()
        .filter_map(|chain| chain.iter().find(|(name, _)| name == "board").map(|(_, pose)| *pose))
        .collect();
    for recording in 0..3 {
        let pose = s.run.model.board_in_world(&p, recording).unwrap();
        assert!(shown.iter().any(|seen| (seen.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-12));
    }
}
