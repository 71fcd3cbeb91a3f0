//! Streams whose frame or fields the pipeline chooses.

use super::{Style, Track, mcap_bytes, open};
use crate::foreign::definition_of;
use crate::ros2::{self, Header};
use crate::{JointStream, PoseStream, Recording, RecordingError, Streams};

const N: u64 = 200;

/// Joints without names or stamps in a list of numbers; a tip that comes in two frames by turns, 1 m apart.
fn recording() -> Recording {
    let time = |i: u64| 1_000_000_000 + i * 10_000_000;
    let array = |i: u64| {
        // No dimension, offset 0, two numbers.
        let mut data = [&[0, 1, 0, 0][..], &[0; 8], &2_u32.to_le_bytes(), &[0; 4]].concat();
        [1e-3 * i as f64, 0.5].iter().for_each(|q| data.extend(q.to_le_bytes()));
        (time(i), time(i), data)
    };
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
        position: Some(position.into()),
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
    no_position.joints[0].position = None;
    no_position.joints[0].effort = Some("effort[]".into());
    assert!(why(&no_position).contains("`position`"));
    let mut no_position = streams("data[]", None);
    no_position.tip = no_position.tip.map(|tip| PoseStream { orientation: Some("q".into()), ..tip });
    assert!(matches!(recording().read(&no_position), Err(RecordingError::Config { role: "tip", .. })));
}
