//! Channels whose own definition is missing, cut off, or in a language that is not read.

use super::{Style, Track, mcap_bytes, open};
use crate::ros2::{self, Header};
use crate::{JointStream, PoseStream, Recording, RecordingError, Streams};
use armcal_core::{Code, Samples, Severity};

const N: u64 = 100;

fn time(i: u64) -> u64 {
    1_000_000_000 + i * 10_000_000
}

fn messages(data: impl Fn(u64) -> Vec<u8>) -> Vec<(u64, u64, Vec<u8>)> {
    (0..N).map(|i| (time(i), time(i), data(i))).collect()
}

fn state(i: u64) -> Vec<u8> {
    let header = Header { stamp_ns: time(i) as i64, frame_id: "" };
    ros2::joint_state(header, &["a", "b"], &[0.1, 1e-3 * i as f64], &[], &[])
}

fn recording(schema: (&'static str, &'static str, &'static [u8]), data: fn(u64) -> Vec<u8>) -> Recording {
    let encoding = if schema.1 == "ros1msg" { "ros1" } else { "cdr" };
    open(&mcap_bytes(&[Track { topic: "/q", schema, encoding, messages: messages(data) }], &Style::default()))
}

fn joints() -> Streams {
    let names = vec!["a".into(), "b".into()];
    let joints = JointStream { topic: "/q".into(), names, ..JointStream::default() };
    Streams { joints: vec![joints], ..Streams::default() }
}

fn read(recording: &Recording) -> Result<Samples, RecordingError> {
    recording.read(&joints()).map(|(samples, ..)| samples)
}

fn notices(recording: &Recording, streams: &Streams) -> Vec<String> {
    let (.., warnings) = recording.read(streams).expect("readable");
    let said = warnings.iter().filter(|w| w.code == Code::DefinitionSubstituted);
    said.inspect(|w| assert_eq!(w.severity, Severity::Notice)).map(ToString::to_string).collect()
}

/// Wherever the definition of a known type is cut, its messages are read as with the whole; the whole is read as it is.
#[test]
fn a_known_type_whose_definition_is_cut_off_is_read_by_its_name() {
    let text = ros2::JOINT_STATE.text;
    let whole = recording((ros2::JOINT_STATE.name, "ros2msg", text.as_bytes()), state);
    assert!(notices(&whole, &joints()).is_empty());
    let samples = read(&whole).expect("readable");
    assert_eq!(samples.joints.time_ns.len(), N as usize);
    for end in [0, 10, 23, 60, 100, 200, 230, text.len() - 16] {
        let cut = recording((ros2::JOINT_STATE.name, "ros2msg", &text.as_bytes()[..end]), state);
        assert_eq!(read(&cut).expect("readable").joints, samples.joints, "{}", &text[..end]);
        let said = notices(&cut, &joints());
        assert!(said.len() == 1 && said[0].contains("/q") && said[0].contains("JointState"), "{said:?}");
    }
    let idl = recording((ros2::JOINT_STATE.name, "ros2idl", b"struct JointState {};"), state);
    assert_eq!(read(&idl).expect("readable").joints, samples.joints);
    assert!(notices(&idl, &joints())[0].contains("ros2idl"));
}

#[test]
fn what_is_no_beginning_of_the_known_definition_or_not_known_counts_itself() {
    let own = "string[] name\nfloat64[] position\n";
    let theirs = recording(("sensor_msgs/msg/JointState", "ros2msg", own.as_bytes()), state);
    assert!(theirs.channels()[0].read_by.is_none());
    let unknown = recording(("lab_msgs/msg/State", "ros2msg", b"std_msgs/Header header\n"), state);
    assert!(read(&unknown).expect_err("refused").to_string().contains("does not define"));
    let unknown = recording(("lab_msgs/msg/State", "ros2idl", b"struct State {};"), state);
    assert!(read(&unknown).expect_err("refused").to_string().contains("ros2idl"));
    assert!(unknown.channels()[0].read_by.is_none());
    // Messages of another length than the known definition are none of it.
    let longer = |i: u64| [state(i), vec![0; 8]].concat();
    let other = recording(("sensor_msgs/msg/JointState", "ros2idl", b""), longer);
    assert!(read(&other).is_err());
}

#[test]
fn the_header_of_ros_1_is_another() {
    let message = |i: u64| {
        let (sec, nsec) = ((time(i) / 1_000_000_000) as u32, (time(i) % 1_000_000_000) as u32);
        let mut data = [i as u32, sec, nsec, 0, 2, 1].map(u32::to_le_bytes).concat();
        data.extend(b"a\x01\0\0\0b\x02\0\0\0");
        [0.5, 1e-3 * i as f64].iter().for_each(|q: &f64| data.extend(q.to_le_bytes()));
        data.extend([0; 8]);
        data
    };
    let cut = recording(("sensor_msgs/JointState", "ros1msg", b"Header header\nstring[] name\n"), message);
    let samples = read(&cut).expect("readable");
    assert_eq!((samples.joints.time_ns[7], samples.joints.joint_rad[1][7]), (time(7) as i64, 1e-3 * 7.0));
    assert_eq!(notices(&cut, &joints()).len(), 1);
}

/// Joints and a pose in JSON that no schema describes; the first messages have nothing in them yet.
#[test]
fn json_without_a_schema_is_read_by_the_fields_that_it_has() {
    let joints = |i: u64| match i {
        0..3 => br#"{"q":[],"pose":null}"#.to_vec(),
        _ => format!(
            r#"{{"q":[0.1,{}],"pose":{{"p":{{"x":1,"y":2,"z":{}}},"r":{{"x":0,"y":0,"z":0,"w":1}}}}}}"#,
            1e-3 * i as f64,
            1e-3 * i as f64
        )
        .into_bytes(),
    };
    for schema in
        [("", "", &b""[..]), ("state", "jsonschema", b"{\"type\":\"object\"}"), ("state", "x", b"?")]
    {
        let track = Track { topic: "/state", schema, encoding: "json", messages: messages(joints) };
        let recording = open(&mcap_bytes(&[track], &Style::default()));
        let position = Some("pose.p".into());
        let tip = PoseStream {
            topic: "/state".into(),
            position,
            orientation: Some("pose.r".into()),
            ..PoseStream::default()
        };
        let names = vec!["a".into(), "b".into()];
        let joints = JointStream {
            topic: "/state".into(),
            names,
            position: vec!["q[]".into()],
            ..JointStream::default()
        };
        let streams = Streams { joints: vec![joints], tip: Some(tip), ..Streams::default() };
        let (samples, ..) = recording.read(&streams).expect("readable");
        assert_eq!(samples.joints.joint_rad[1][0], 1e-3 * 3.0);
        assert_eq!(
            (samples.joints.time_ns.len(), samples.tip.expect("a tip").position_m[0].z),
            (N as usize - 3, 1e-3 * 3.0)
        );
        let said = notices(&recording, &streams);
        assert!(said.len() == 2 && said[0].contains("/state are read by the fields"), "{said:?}");
        // What the file has is handed on as it is.
        assert_eq!(recording.channels()[0].schema.is_some(), !schema.0.is_empty());
    }
}

#[test]
fn several_paths_are_one_number_for_each_joint() {
    let state = |i: u64| match i {
        5 => br#"{"b.pos":1}"#.to_vec(),
        _ => format!(r#"{{"b.pos":{},"t":0,"a.pos":0.25}}"#, 1e-3 * i as f64).into_bytes(),
    };
    let track = Track { topic: "/q", schema: ("", "", b""), encoding: "json", messages: messages(state) };
    let recording = open(&mcap_bytes(&[track], &Style::default()));
    let read = |names: &[&str], paths: &[&str]| {
        let [names, position] = [names, paths].map(|all| all.iter().map(|x| (*x).to_owned()).collect());
        let joints = JointStream { topic: "/q".into(), names, position, ..JointStream::default() };
        recording.read(&Streams { joints: vec![joints], ..Streams::default() })
    };
    for paths in [["'a.pos'", "'b.pos'"], ["a.pos", "b.pos"]] {
        let (samples, reports, _) = read(&["a", "b"], &paths).expect("readable");
        assert_eq!((samples.joints.joint_rad[0][7], samples.joints.joint_rad[1][7]), (0.25, 1e-3 * 8.0));
        assert_eq!((reports[0].rows as u64, reports[0].non_finite), (N - 1, 1));
    }
    for (names, paths, words) in [
        (&["a", "b"][..], &["'a.pos'", "'b.pos'", "t"][..], "3 paths for 2 joints"),
        (&["a", "b"], &["'a.pos'", "q[]"], "q[] is a list"),
        (&["a", "b"], &["a.pos"], "a path for each"),
    ] {
        let why = read(names, paths).expect_err("refused").to_string();
        assert!(why.contains(words), "{why}");
    }
}
