//! Poses over several transforms, against numbers that scipy gave (`Rotation.from_rotvec`, 4 x 4 matrices in numpy).

use super::{Style, Track, mcap_bytes, open};
use crate::ros2::{self, Header};
use crate::{JointStream, PoseStream, RecordingError, Streams};
use armcal_core::{Code, PoseSamples, Warning};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

const START_NS: i64 = 1_700_000_000_000_000_000;
const STEP_NS: i64 = 10_000_000;

type Transform<'a> = (&'a str, &'a str, [f64; 3], [f64; 4]);

/// Parent, child, position [m], quaternion x, y, z, w.
const FIXED: [Transform<'static>; 5] = [
    (
        "world",
        "room",
        [1.0, 2.0, 0.5],
        [0.049708843324859475, -0.09941768664971895, 0.14912652997457843, 0.9825509821552589],
    ),
    (
        "room",
        "tracker",
        [-3.0, 0.4, 1.1],
        [0.5507599001837508, 0.1376899750459377, -0.32127660844052125, 0.7579487739883151],
    ),
    ("ball", "tip", [0.01, -0.02, 0.15], [0.0, 0.43423098170204383, 0.0964957737115653, 0.8956182335045919]),
    ("world", "cell", [0.3, -0.6, 0.0], [0.0, 0.0, 0.6816387600233341, 0.7316888688738209]),
    (
        "cell",
        "robot",
        [0.2, 0.1, 0.8],
        [0.9950205632187554, 0.06633470421458369, 0.033167352107291846, 0.06658612875656204],
    ),
];

/// At rows 0, 100, 250: `tip` in `robot`, `tracker` in `tip`.
type Expected = (usize, [([f64; 3], [f64; 4]); 2]);
const SCIPY: [Expected; 3] = [
    (
        0,
        [
            (
                [1.3288791357378082, -0.7143302483744258, 1.0694895252234173],
                [-0.533750679419431, -0.19153772854018197, 0.02844770574348408, 0.8231732738633437],
            ),
            (
                [-0.21165937216842995, 0.738160427499447, -2.0026647077651005],
                [-0.019170750787828334, -0.6035071473275769, -0.09457228271763665, 0.791497118617836],
            ),
        ],
    ),
    (
        100,
        [
            (
                [1.3523396357597033, -0.42610176412062156, 1.0694521627751719],
                [-0.384675749471978, -0.19765954529200802, 0.09412421249002773, 0.8967139480047474],
            ),
            (
                [-0.43659504420597056, -0.1789641436504851, -2.298396693203391],
                [-0.1719007864366381, -0.5860186483680402, -0.0031938843086377336, 0.7918472469424791],
            ),
        ],
    ),
    (
        250,
        [
            (
                [1.455444047352665, -0.3828711511304863, 0.8127334139946805],
                [-0.13898067296139255, -0.1881515182150738, 0.18293273658710052, 0.9548921366423098],
            ),
            (
                [-0.6685860062834574, -1.3673471978613072, -1.6008961759657983],
                [-0.38978609269109066, -0.5313005144510735, 0.13319881224366945, 0.7403003726228379],
            ),
        ],
    ),
];

type Message = (u64, u64, Vec<u8>);

fn message(i: i64, (parent, child, position, quaternion): Transform<'_>) -> Message {
    let stamp_ns = START_NS + i * STEP_NS;
    let data = ros2::transform_stamped(Header { stamp_ns, frame_id: parent }, child, position, quaternion);
    (stamp_ns as u64, stamp_ns as u64, data)
}

/// `ball` in `tracker`, as it was told to scipy.
fn ball(i: i64) -> Transform<'static> {
    let s = 0.01 * i as f64;
    let q = UnitQuaternion::from_scaled_axis(Vector3::new(0.2 * s, 0.4, -0.3 * s));
    ("tracker", "ball", [2.0 + 0.3 * s.sin(), -0.5 + 0.2 * s, 0.1], [q.i, q.j, q.k, q.w])
}

fn track(topic: &'static str, messages: Vec<Message>) -> Track {
    let schema = ros2::TRANSFORM_STAMPED;
    let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
    Track { topic, schema, encoding: ros2::MESSAGE_ENCODING, messages }
}

/// The stream `body` in `frame` of 300 rows and `more` messages.
fn read(
    frame: &str,
    body: &str,
    more: &[Transform<'_>],
) -> Result<(PoseSamples, Vec<Warning>), RecordingError> {
    let moving = (0..300).map(|i| message(i, ball(i)));
    let more = more.iter().enumerate().map(|(i, transform)| message(i as i64, *transform));
    let joints = |i: i64| {
        let stamp_ns = START_NS + i * STEP_NS;
        let data = ros2::joint_state(Header { stamp_ns, frame_id: "" }, &["a"], &[0.01 * i as f64], &[], &[]);
        (stamp_ns as u64, stamp_ns as u64, data)
    };
    let schema = ros2::JOINT_STATE;
    let joints = Track {
        topic: "/joint_states",
        schema: (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes()),
        encoding: ros2::MESSAGE_ENCODING,
        messages: (0..300).map(joints).collect(),
    };
    let fixed = FIXED.iter().map(|transform| message(0, *transform)).chain(more).collect();
    let tracks = [joints, track("/tf", moving.collect()), track("/tf_static", fixed)];
    let (frame, body) = (Some(frame.to_owned()), Some(body.to_owned()));
    let streams = Streams {
        joints: vec![JointStream {
            topic: "/joint_states".into(),
            names: vec!["a".into()],
            ..JointStream::default()
        }],
        tip: Some(PoseStream { topic: "/tf".into(), body, frame, ..PoseStream::default() }),
        ..Streams::default()
    };
    let (samples, _, warnings) = open(&mcap_bytes(&tracks, &Style::default())).read(&streams)?;
    Ok((samples.tip.expect("a tip"), warnings))
}

#[test]
fn poses_over_several_transforms_are_what_scipy_makes_of_them() {
    for (which, (frame, body)) in [("robot", "tip"), ("tip", "tracker")].into_iter().enumerate() {
        let (poses, warnings) = read(frame, body, &[]).expect("readable");
        assert_eq!((poses.frame_id.as_str(), poses.body.as_str(), poses.len()), (frame, body, 300));
        let turned = poses.orientation.expect("oriented");
        for (i, expected) in SCIPY {
            let (position, [x, y, z, w]) = expected[which];
            assert_eq!(poses.time_ns[i], START_NS + i as i64 * STEP_NS);
            assert!((poses.position_m[i] - Vector3::from(position)).norm() < 1e-13, "{frame} {i}");
            let wanted = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            assert!(turned[i].angle_to(&wanted) < 1e-7, "{frame} {i}");
        }
        let said = warnings.iter().find(|w| w.code == Code::TransformChain).expect("told");
        assert!(said.message.contains("with the stamps of \"ball\" in \"tracker\" on /tf"), "{said}");
    }
    // One transform, the other way round, is a chain of one; one that is there is read as it was.
    let (poses, _) = read("ball", "tracker", &[]).expect("readable");
    let back = poses.orientation.expect("oriented")[100] * Vector3::new(2.252441295442369, -0.3, 0.1);
    assert!((poses.position_m[100] + back).norm() < 1e-12);
    let (poses, warnings) = read("tracker", "ball", &[]).expect("readable");
    assert!(poses.position_m[100].x == 2.252441295442369 && warnings.is_empty(), "{warnings:?}");
    // Only constants: where the robot stands in the room.
    let (poses, _) = read("room", "robot", &[]).expect("readable");
    assert_eq!(poses.len(), 1);
}

#[test]
fn chains_that_say_nothing_are_refused_with_what_to_do() {
    let identity = [0.0, 0.0, 0.0, 1.0];
    let refused = |frame: &str, body: &str, more: &[Transform<'_>]| {
        read(frame, body, more).expect_err("refused").to_string()
    };
    let shaken = [("tip", "stylus", [0.1, 0.0, 0.0], identity), ("tip", "stylus", [0.2, 0.0, 0.0], identity)];
    let said = refused("world", "stylus", &shaken);
    assert!(
        said.contains("over 2 transforms that change (ball in tracker, stylus in tip)")
            && said.contains("name a frame after the first"),
        "{said}"
    );
    let said = refused("world", "tip", &[("cell", "ball", [0.1, 0.0, 0.0], identity)]);
    assert!(said.contains("has two ways from \"world\" to \"tip\""), "{said}");
    let said = refused("world", "tip", &[("tip", "ball", [0.1, 0.0, 0.0], identity)]);
    assert!(said.contains("has \"ball\" in \"tip\" and \"tip\" in \"ball\""), "{said}");
    let many: Vec<String> = (0..1000).map(|i| format!("f{i}")).collect();
    let many: Vec<Transform<'_>> =
        many.iter().map(|f| ("world", f.as_str(), [0.1, 0.0, 0.0], identity)).collect();
    assert!(refused("world", "tip", &many).contains("has 1006 transforms, more than 1000"));
    let said = refused("robot", "lamp", &[("ceiling", "lamp", [0.1, 0.0, 0.0], identity)]);
    assert!(said.contains("no chain of transforms between them"), "{said}");
    let said = refused("stand", "tip", &[("stand", "world", [0.1, 0.0, 0.0], [0.0; 4])]);
    assert!(said.contains("no rotation of \"world\" in \"stand\""), "{said}");
    let said = refused("wrold", "tip", &[]);
    assert!(said.contains("topic \"/tf\" never shows body \"tip\"") && said.contains("ball"), "{said}");
    let said = refused("wrold", "ball", &[]);
    assert!(said.contains("never has that body in frame \"wrold\""), "{said}");
}
