use crate::synthetic::{HOSTILE, NAMES, Synthetic, synthetic};
use armcal_config::{InputMessages, OutputConfig};
use armcal_report::write_all;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use prost_reflect::{DescriptorPool, DynamicMessage, Value};
use std::collections::BTreeMap;
use std::path::Path;

/// A message with everything that belongs to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Full {
    pub topic: String,
    pub schema: Option<(String, String, Vec<u8>)>,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
    pub data: Vec<u8>,
}

pub fn read(path: &Path) -> Vec<Full> {
    let bytes = std::fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(|m| {
        let m = m.unwrap();
        Full {
            topic: m.channel.topic.clone(),
            schema: m.channel.schema.as_ref().map(|s| (s.name.clone(), s.encoding.clone(), s.data.to_vec())),
            encoding: m.channel.message_encoding.clone(),
            metadata: m.channel.metadata.clone(),
            sequence: m.sequence,
            log_time: m.log_time,
            publish_time: m.publish_time,
            data: m.data.to_vec(),
        }
    });
    messages.collect()
}

pub fn write(s: &Synthetic, input: InputMessages, folder: &str) -> std::path::PathBuf {
    let out = s.folder.path().join(folder);
    write_all(&s.run, &s.recordings, &out, &OutputConfig { input }).unwrap();
    out
}

/// Decodes a message with nothing but the schema its own channel carries.
fn decode(m: &Full) -> DynamicMessage {
    let (name, encoding, data) = m.schema.as_ref().unwrap();
    assert_eq!((encoding.as_str(), m.encoding.as_str()), ("protobuf", "protobuf"), "{}", m.topic);
    let pool = DescriptorPool::decode(data.as_slice()).unwrap();
    let descriptor = pool.get_message_by_name(name).unwrap_or_else(|| panic!("{name} is not in its schema"));
    let message = DynamicMessage::decode(descriptor, m.data.as_slice()).unwrap();
    assert_eq!(message.unknown_fields().count(), 0, "{}: fields the schema does not have", m.topic);
    message
}

pub fn own(messages: &[Full], topic: &str) -> Vec<DynamicMessage> {
    messages.iter().filter(|m| m.topic == topic).map(decode).collect()
}

pub fn get(message: &DynamicMessage, path: &str) -> Value {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    let value = message.get_field_by_name(first).unwrap_or_else(|| panic!("no field {first}")).into_owned();
    if rest.is_empty() { value } else { get(value.as_message().unwrap(), rest) }
}

pub fn number(message: &DynamicMessage, path: &str) -> f64 {
    get(message, path).as_f64().unwrap()
}

pub fn string(message: &DynamicMessage, path: &str) -> String {
    get(message, path).as_str().unwrap().to_owned()
}

pub fn vector(message: &DynamicMessage, path: &str) -> Vector3<f64> {
    Vector3::from_iterator(["x", "y", "z"].iter().map(|axis| number(message, &format!("{path}.{axis}"))))
}

pub fn rotation(message: &DynamicMessage, path: &str) -> UnitQuaternion<f64> {
    let q = ["w", "x", "y", "z"].map(|c| number(message, &format!("{path}.{c}")));
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

pub fn list(message: &DynamicMessage, path: &str) -> Vec<DynamicMessage> {
    get(message, path).as_list().unwrap().iter().map(|v| v.as_message().unwrap().clone()).collect()
}

#[test]
fn every_result_message_decodes_with_the_schema_it_carries() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for m in &messages {
        if !m.topic.ends_with("/robot_description") {
            decode(m);
        }
        *counts.entry(m.topic.as_str()).or_default() += 1;
    }
    let expected = [
        ("/armcal/arms", 21),
        ("/armcal/arrows_calibrated", 3),
        ("/armcal/arrows_nominal", 3),
        ("/armcal/assignments", 18),
        ("/armcal/board/0", 1),
        ("/armcal/board/1", 1),
        ("/armcal/board/2", 1),
        ("/armcal/board/robot_description", 1),
        ("/armcal/board_map", 1),
        ("/armcal/calibrated/robot_description", 1),
        ("/armcal/clock", 1),
        ("/armcal/course", 1),
        ("/armcal/dwells", 18),
        ("/armcal/errors", 3),
        ("/armcal/implied/joint1", 1),
        ("/armcal/implied/joint2", 1),
        ("/armcal/implied/joint3", 1),
        // 1 opening, 3 recordings, 5 rejections, 3 warnings (association, gap, earlier results), 1 conclusion.
        ("/armcal/log", 13),
        ("/armcal/nominal/robot_description", 1),
        ("/armcal/parameter_table", 1),
        ("/armcal/parameters", 1),
        ("/armcal/path_calibrated", 3),
        ("/armcal/path_measured", 3),
        ("/armcal/path_nominal", 3),
        ("/armcal/quality", 1),
        ("/armcal/report", 1),
        ("/armcal/residuals", 13),
        ("/armcal/scene", 3),
        ("/armcal/steps", 1),
        // One a dwell, and one before them all.
        ("/armcal/story", 1),
        ("/armcal/tf", 22),
        ("/armcal/tip_measured", 13),
    ];
    assert_eq!(counts.into_iter().collect::<Vec<_>>(), expected);
}

#[test]
fn input_messages_pass_through_byte_for_byte() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Copy, "out").join("run.mcap"));
    let passed: Vec<&Full> = messages.iter().filter(|m| !m.topic.starts_with("/armcal/")).collect();
    let given: Vec<Full> = s.paths.iter().flat_map(|p| read(p)).collect();
    let given: Vec<&Full> = given.iter().filter(|m| m.topic != "/armcal/dwells").collect();
    assert_eq!(given.len(), 3 * 40 * 3);
    assert_eq!(passed, given);
    assert!(given.iter().any(|m| m.topic == HOSTILE) && given.iter().any(|m| m.schema.is_none()));
    // Equal channels of several recordings are one channel; an earlier run's results are not mixed with the new.
    let bytes = std::fs::read(s.folder.path().join("out/run.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let of_topic = |topic: &str| summary.channels.values().filter(|c| c.topic == topic).count();
    assert_eq!((of_topic("/joint_states"), of_topic(HOSTILE), of_topic("/armcal/dwells")), (1, 1, 1));
}

#[test]
fn attachments_and_metadata_are_the_inputs_and_ours() {
    let s = synthetic();
    let out = write(&s, InputMessages::Copy, "out");
    let bytes = std::fs::read(out.join("run.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let attachments: Vec<(String, Vec<u8>)> = summary
        .attachment_indexes
        .iter()
        .map(|i| mcap::read::attachment(&bytes, i).unwrap())
        .map(|a| (a.name.clone(), a.data.to_vec()))
        .collect();
    let file = |name: &str| std::fs::read(out.join(name)).unwrap();
    let expected = [
        ("notes/\"a\".txt", b"attached to 0".to_vec()),
        ("notes/\"a\".txt", b"attached to 1".to_vec()),
        ("notes/\"a\".txt", b"attached to 2".to_vec()),
        ("armcal/pipeline.toml", crate::synthetic::PIPELINE.into()),
        ("armcal/report.html", file("report.html")),
        ("armcal/summary.json", file("summary.json")),
        ("armcal/parameters.toml", file("parameters.toml")),
        ("armcal/calibrated.toml", file("calibrated.toml")),
        ("armcal/model.json", file("model.json")),
        ("armcal/foxglove-layout.json", file("foxglove-layout.json")),
        ("armcal/foxglove-layout-legacy.json", file("foxglove-layout-legacy.json")),
    ];
    assert_eq!(attachments, expected.map(|(name, data)| (name.to_owned(), data)));

    let metadata: Vec<mcap::records::Metadata> =
        summary.metadata_indexes.iter().map(|i| mcap::read::metadata(&bytes, i).unwrap()).collect();
    let names: Vec<&str> = metadata.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["lab", "lab", "lab", "armcal/run", "armcal/input"]);
    assert_eq!(metadata[1].metadata["operator"], "ü1");
    assert_eq!(metadata[3].metadata["holdout.seed"], "7");
    assert_eq!(metadata[4].metadata["recording2.name"], HOSTILE);
    assert_eq!(
        metadata[4].metadata["recording1.file0.identity"],
        s.run.recordings[1].report.files[0].identity
    );
}

#[test]
fn arrows_begin_at_the_tip_and_point_from_where_the_model_puts_it() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let model = &s.run.model;
    let sets = [
        ("/armcal/arrows_nominal", s.run.calibration.nominal_values.clone()),
        ("/armcal/arrows_calibrated", s.run.calibration.fit.values()),
    ];
    for (recording, scene) in own(&messages, "/armcal/scene").iter().enumerate() {
        let entities = list(scene, "entities");
        let scale = entities.iter().find(|e| string(e, "id") == "scale").unwrap();
        let legend = string(&list(scale, "texts")[0], "text");
        for (id, p) in &sets {
            let entity = &list(&own(&messages, id)[recording], "entities")[0];
            let factor: f64 = string(&list(entity, "metadata")[0], "value").parse().unwrap();
            let model_told = id.trim_start_matches("/armcal/arrows_");
            assert!(factor > 1.0 && legend.contains(&format!("{model_told} x {factor}")), "{legend}");
            let own = s.run.observations.iter().filter(|o| o.dwell.recording == recording);
            let arrows = list(entity, "arrows");
            assert_eq!(arrows.len(), own.clone().count());
            for (arrow, o) in arrows.iter().zip(own) {
                let measured = model.measured_tip_in_world(p, o);
                assert!((vector(arrow, "pose.position") - measured).norm() < 1e-12);
                let length = number(arrow, "shaft_length") + number(arrow, "head_length");
                let along = rotation(arrow, "pose.orientation") * Vector3::x() * length / factor;
                let predicted = model.predicted_tip_in_world(p, o);
                assert!((predicted + along - measured).norm() < 1e-10, "{id}: {along} does not reach");
            }
        }
    }
}

#[test]
fn residuals_and_paths_agree_with_the_model() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let residuals = own(&messages, "/armcal/residuals");
    let p = s.run.calibration.fit.values();
    for o in &s.run.observations {
        let of_dwell = residuals.iter().find(|r| {
            (number_of(r, "recording_index"), number_of(r, "dwell")) == (o.dwell.recording, o.dwell.dwell)
        });
        let r = of_dwell.unwrap();
        let predicted = s.run.model.predicted_tip_in_world(&p, o);
        assert!((vector(r, "predicted_m") - predicted).norm() < 1e-12);
        assert!((number(r, "fitted_norm_mm") * 1e-3 - vector(r, "fitted_mm").norm() * 1e-3).abs() < 1e-12);
        assert_eq!(get(r, "held_out").as_bool().unwrap(), o.dwell.recording == 2);
    }
    let calibrated = own(&messages, "/armcal/path_calibrated");
    assert_eq!(list(&calibrated[0], "poses").len(), 5);
    let first = vector(&list(&calibrated[1], "poses")[0], "position");
    let o = s.run.observations.iter().find(|o| o.dwell.recording == 1).unwrap();
    assert!((first - s.run.model.predicted_tip_in_world(&p, o)).norm() < 1e-12);
}

fn number_of(message: &DynamicMessage, path: &str) -> usize {
    get(message, path).as_u32().unwrap() as usize
}

#[test]
fn the_transform_tree_leads_to_both_tips_and_the_board() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let p = s.run.calibration.fit.values();
    let dwell = &s.run.recordings[2].dwells[1];
    let log_time = dwell.mid_ns() as u64;
    let tree =
        messages.iter().find(|m| m.topic == "/armcal/tf" && m.log_time == log_time).map(decode).unwrap();
    let transforms: BTreeMap<String, (String, nalgebra::Isometry3<f64>)> = list(&tree, "transforms")
        .iter()
        .map(|t| {
            let pose =
                nalgebra::Isometry3::from_parts(vector(t, "translation").into(), rotation(t, "rotation"));
            (string(t, "child_frame_id"), (string(t, "parent_frame_id"), pose))
        })
        .collect();
    let in_world = |leaf: &str| {
        let (mut frame, mut pose) = (leaf.to_owned(), nalgebra::Isometry3::identity());
        while frame != "world" {
            let (parent, step) = &transforms[&frame];
            (frame, pose) = (parent.clone(), step * pose);
        }
        pose
    };
    for (prefix, p) in [("nominal", &s.run.calibration.nominal_values), ("calibrated", &p)] {
        let tip = s.run.model.base_in_world(p) * s.run.model.tip_in_base(p, &dwell.joint_rad);
        assert!((in_world(&format!("{prefix}/tip")).to_homogeneous() - tip.to_homogeneous()).norm() < 1e-12);
    }
    let board = s.run.model.board_in_world(&p, 2).unwrap();
    let seen = in_world(&format!("board/{HOSTILE}"));
    assert!((seen.to_homogeneous() - board.to_homogeneous()).norm() < 1e-12);
}

#[test]
fn times_are_those_of_the_dwells_and_the_sensor() {
    let s = synthetic();
    let messages = read(&write(&s, InputMessages::Reference, "out").join("run.mcap"));
    let tracked = s.run.observations.last().unwrap();
    let clock = s.run.recordings[0].clock.as_ref().unwrap();
    for topic in ["/armcal/tip_measured", "/armcal/dwells"] {
        let at = messages.iter().find(|m| m.topic == topic && m.log_time == tracked.time_ns as u64).unwrap();
        let back_ns = clock.to_robot_ns(at.publish_time as i64);
        assert!((back_ns - tracked.time_ns).abs() <= 1 && at.publish_time != at.log_time);
    }
    let logged: Vec<u64> = messages.iter().map(|m| m.log_time).collect();
    assert!(logged.is_sorted());
    let dwells: Vec<&Full> = messages.iter().filter(|m| m.topic == "/armcal/dwells").collect();
    assert_eq!(dwells[6].log_time, s.run.recordings[1].dwells[0].mid_ns() as u64);
    assert_eq!(dwells.iter().map(|m| m.sequence).collect::<Vec<_>>(), (0..18).collect::<Vec<_>>());
    assert_eq!(dwells.iter().map(|m| string(&decode(m), "recording")).nth(12).unwrap(), NAMES[2]);
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let s = synthetic();
    for input in [InputMessages::Copy, InputMessages::Reference] {
        let (a, b) = (write(&s, input, "a"), write(&s, input, "b"));
        let mut names: Vec<_> = std::fs::read_dir(&a).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names.len(), 12);
        for name in names {
            let same = std::fs::read(a.join(&name)).unwrap() == std::fs::read(b.join(&name)).unwrap();
            assert!(same, "{} differs", name.display());
        }
    }
}
