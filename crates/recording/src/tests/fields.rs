//! Streams whose frame or fields the pipeline chooses.

use super::{Style, Track, mcap_bytes, open};
use crate::foreign::definition_of;
use crate::ros2::{self, Header};
use crate::{GaugeStream, JointStream, PoseStream, Recording, RecordingError, ScalarStream, Streams};
use std::collections::BTreeMap;

const N: u64 = 200;

fn time(i: u64) -> u64 {
    1_000_000_000 + i * 10_000_000
}

fn array(i: u64) -> (u64, u64, Vec<u8>) {
    // No dimension, offset 0, two numbers.
    let mut data = [&[0, 1, 0, 0][..], &[0; 8], &2_u32.to_le_bytes(), &[0; 4]].concat();
    [1e-3 * i as f64, 0.5].iter().for_each(|q| data.extend(q.to_le_bytes()));
    (time(i), time(i), data)
}

/// Joints without names or stamps in a list of numbers; a tip that comes in two frames by turns, 1 m apart.
fn recording() -> Recording {
    let tip = |i: u64| {
        let frame_id = if i.is_multiple_of(2) { "map" } else { "base" };
        let header = Header { stamp_ns: time(i) as i64, frame_id };
        let x_m = if i.is_multiple_of(2) { 1.0 } else { 2.0 };
        (
            time(i),
            time(i),
            ros2::transform_stamped(header, "tip", [x_m, 1e-3 * i as f64, 0.0], [0.0, 0.0, 0.0, 1.0]),
        )
    };
    let text = definition_of("std_msgs/Float64MultiArray").expect("known").leak();
    let schema = ros2::TRANSFORM_STAMPED;
    let tracks = [
        Track {
            topic: "/q",
            schema: ("std_msgs/msg/Float64MultiArray", "ros2msg", text.as_bytes()),
            encoding: "cdr",
            messages: (0..N).map(array).collect(),
        },
        Track {
            topic: "/tip",
            schema: (schema.name, "ros2msg", schema.text.as_bytes()),
            encoding: "cdr",
            messages: (0..N).map(tip).collect(),
        },
    ];
    open(&mcap_bytes(&tracks, &Style::default()))
}

fn streams(position: &str, frame: Option<&str>) -> Streams {
    let joints = JointStream {
        topic: "/q".into(),
        names: vec!["a".into(), "b".into()],
        position: vec![position.into()],
        ..JointStream::default()
    };
    let tip = PoseStream { topic: "/tip".into(), frame: frame.map(str::to_owned), ..PoseStream::default() };
    Streams { joints: vec![joints], tip: Some(tip), ..Streams::default() }
}

#[test]
fn the_chosen_frame_alone_is_read_and_missing_stamps_are_said() {
    let (samples, _, warnings) = recording().read(&streams("data[]", Some("base"))).expect("readable");
    assert_eq!(samples.joints.joint_rad[0].len(), N as usize);
    let tip = samples.tip.expect("a tip");
    assert_eq!((tip.frame_id.as_str(), tip.position_m.len()), ("base", N as usize / 2));
    assert!(tip.position_m.iter().all(|p| p.x == 2.0));
    let said: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    assert!(
        said.iter().any(|text| text.contains("/q") && text.contains("no stamp of their own")),
        "{said:?}"
    );
    assert!(!said.iter().any(|text| text.contains("/tip") && text.contains("stamp")), "{said:?}");

    let (.., warnings) = recording().read(&streams("data[]", None)).expect("readable");
    assert!(warnings.iter().any(|w| w.to_string().contains("set `frame`")));
}

#[test]
fn wrong_fields_and_frames_name_what_there_is() {
    let why = |streams: &Streams| recording().read(streams).expect_err("refused").to_string();
    let frame = why(&streams("data[]", Some("bases")));
    assert!(frame.contains("frame \"bases\"") && frame.contains("did you mean \"base\"?"), "{frame}");
    let path = why(&streams("dat[]", None));
    assert!(path.contains("/q") && path.contains("did you mean \"data[]\"?"), "{path}");
    let mut no_position = streams("data[]", None);
    no_position.joints[0].position.clear();
    no_position.joints[0].effort = Some("effort[]".into());
    assert!(why(&no_position).contains("`position`"));
    let mut no_position = streams("data[]", None);
    no_position.tip = no_position.tip.map(|tip| PoseStream { orientation: Some("q".into()), ..tip });
    assert!(matches!(recording().read(&no_position), Err(RecordingError::Config { role: "tip", .. })));
}

/// A thermometer and a gauge inside a message that armcal does not know: by their paths; a list is not one number.
#[test]
fn one_number_is_read_by_its_path() {
    let text = definition_of("sensor_msgs/Temperature").expect("known");
    let nested = format!("float64 load\nsensor_msgs/Temperature motor\nfloat64[2] cells\n{}", "=".repeat(80))
        + &format!("\nMSG: sensor_msgs/Temperature\n{text}")
        + &format!(
            "{}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
            "=".repeat(80)
        )
        + &format!("{}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n", "=".repeat(80));
    let state = |i: u64| {
        let time = 1_000_000_000 + i * 1_000_000_000;
        let mut data = vec![0, 1, 0, 0];
        data.extend(9.5_f64.to_le_bytes());
        // Stamp, frame "" and what brings the next number to a multiple of eight.
        data.extend((i as i32 + 1).to_le_bytes());
        data.extend([0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
        [20.0 + 0.1 * i as f64, 0.0, 51.0, 52.0].iter().for_each(|x: &f64| data.extend(x.to_le_bytes()));
        (time + 7, time + 7, data)
    };
    let joints = Track {
        topic: "/q",
        schema: (
            "std_msgs/msg/Float64MultiArray",
            "ros2msg",
            definition_of("std_msgs/Float64MultiArray").expect("known").leak().as_bytes(),
        ),
        encoding: "cdr",
        messages: (0..N).map(array).collect(),
    };
    let state = Track {
        topic: "/state",
        schema: ("vendor/msg/State", "ros2msg", nested.leak().as_bytes()),
        encoding: "cdr",
        messages: (0..30).map(state).collect(),
    };
    let recording = open(&mcap_bytes(&[joints, state], &Style::default()));
    let read = |path: &str| {
        let temperature = ScalarStream { topic: "/state".into(), value: Some(path.into()), clock: None };
        recording.read(&Streams { tip: None, temperature: Some(temperature), ..streams("data[]", None) })
    };
    let (samples, ..) = read("motor.temperature").expect("readable");
    let temperature = samples.temperature.expect("a thermometer");
    assert_eq!((temperature.time_ns[3], temperature.value[3]), (4_000_000_000, 20.0 + 0.1 * 3.0));
    let gauge = |path: &str| {
        let text = format!("topic = \"/state\"\nvalue = {path:?}\nunit = \"mm\"\ndirection = -1\n");
        let gauge: GaugeStream = toml::from_str(&text).expect("a gauge");
        let gauges = BTreeMap::from([("dial".to_owned(), gauge)]);
        recording.read(&Streams { tip: None, gauges, ..streams("data[]", None) })
    };
    let (samples, ..) = gauge("load").expect("readable");
    let dial = &samples.gauges["dial"];
    // The message has no stamp of its own, the thermometer in it has.
    assert_eq!((dial.time_ns[3], dial.value[3], dial.value.len()), (4_000_000_007, -9.5e-3, 30));
    assert!(gauge("lode").expect_err("refused").to_string().contains("did you mean \"load\""));
    for wrong in ["cells[]", "motor.temperatur"] {
        let why = read(wrong).expect_err("refused").to_string();
        assert!(
            why.contains("no number at") && why.contains("motor.temperature") && !why.contains("cells[],"),
            "{why}"
        );
    }
}
