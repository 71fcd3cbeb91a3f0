//! From messages to columns: selection, clocks, cleaning, units, occlusion.

use super::{OnDisk, Style, Track, mcap_bytes, open};
use crate::ros2::{self, Header};
use crate::structure::records::{ENVELOPE, Records};
use crate::{
    Clock, Encoder, JointStream, JointUnit, LengthUnit, PoseStream, Recording, RecordingError, ScalarStream,
};
use crate::{Occlusion, StreamReport, Streams};
use armcal_core::{Code, Samples, Severity, Warning};
use mcap::Compression;
use proptest::prelude::*;

const START_NS: i64 = 1_700_000_000_000_000_000;
const STEP_NS: i64 = 10_000_000;

/// A joint state of two joints at time `i`, logged 3 ms and a jitter later.
fn joints_at(i: i64, names: &[&str], position: &[f64]) -> (u64, u64, Vec<u8>) {
    let stamp_ns = START_NS + i * STEP_NS;
    let header = Header { stamp_ns, frame_id: "" };
    let log = stamp_ns as u64 + 3_000_000 + (i as u64 * 7919) % 1_000_000;
    (log, log, ros2::joint_state(header, names, position, &[], &[]))
}

fn track(topic: &'static str, schema: ros2::Schema, messages: Vec<(u64, u64, Vec<u8>)>) -> Track {
    let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
    Track { topic, schema, encoding: ros2::MESSAGE_ENCODING, messages }
}

fn joint_track(messages: Vec<(u64, u64, Vec<u8>)>) -> Track {
    track("/joint_states", ros2::JOINT_STATE, messages)
}

/// Two joints that move smoothly, 500 rows.
fn moving() -> Vec<(u64, u64, Vec<u8>)> {
    let at = |i: i64| [(i as f64 * 0.01).sin(), (i as f64 * 0.013).cos()];
    (0..500).map(|i| joints_at(i, &["shoulder", "elbow"], &at(i))).collect()
}

fn noise(i: i64, axis: i64) -> f64 {
    let mixed = ((i * 3 + axis) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed >> 40) as f64 / (1_u64 << 24) as f64 - 0.5) * 2e-4
}

/// A jittering tip at rest at (0.4, 0.1, 0.3).
fn pose_at(i: i64) -> [f64; 3] {
    [0.4 + noise(i, 0), 0.1 + noise(i, 1), 0.3 + noise(i, 2)]
}

fn pose_message(i: i64, position: [f64; 3], quaternion: [f64; 4]) -> (u64, u64, Vec<u8>) {
    let stamp_ns = START_NS + i * STEP_NS;
    let data = ros2::pose_stamped(Header { stamp_ns, frame_id: "vicon" }, position, quaternion);
    (stamp_ns as u64 + 1_000_000, stamp_ns as u64 + 1_000_000, data)
}

fn pose_track(messages: Vec<(u64, u64, Vec<u8>)>) -> Track {
    track("/vicon/tip/tip", ros2::POSE_STAMPED, messages)
}

fn two_joints() -> Streams {
    let names = vec!["shoulder".to_owned(), "elbow".to_owned()];
    let joints = JointStream { topic: "/joint_states".into(), names, ..JointStream::default() };
    Streams { joints: vec![joints], ..Streams::default() }
}

fn with_tip() -> Streams {
    Streams {
        tip: Some(PoseStream { topic: "/vicon/tip/tip".into(), ..PoseStream::default() }),
        ..two_joints()
    }
}

type Outcome = (Samples, Vec<StreamReport>, Vec<Warning>);

fn read(tracks: &[Track], streams: &Streams) -> Result<Outcome, RecordingError> {
    open(&mcap_bytes(tracks, &Style::default())).read(streams)
}

fn ok(tracks: &[Track], streams: &Streams) -> Outcome {
    read(tracks, streams).expect("readable streams")
}

fn refusal(tracks: &[Track], streams: &Streams) -> String {
    read(tracks, streams).expect_err("must be refused").to_string()
}

#[test]
fn columns_hold_what_was_written_in_the_order_asked_for() {
    let mut streams = two_joints();
    streams.joints[0].names.reverse();
    let (samples, reports, warnings) = ok(&[joint_track(moving())], &streams);
    assert_eq!(samples.joints.names, ["elbow", "shoulder"]);
    assert_eq!(samples.joints.len(), 500);
    for (i, time) in samples.joints.time_ns.iter().enumerate() {
        assert_eq!(*time, START_NS + i as i64 * STEP_NS);
        assert_eq!(samples.joints.row_rad(i), [(i as f64 * 0.013).cos(), (i as f64 * 0.01).sin()]);
    }
    assert_eq!(samples.joints.effort_nm, None);
    let r = &reports[0];
    assert_eq!((r.messages, r.rows, r.clock), (500, 500, Clock::Header));
    assert!((r.rate_hz - 100.0).abs() < 1e-9 && (r.largest_gap_s - 0.01).abs() < 1e-12);
    assert_eq!(r.quantisation_rad, [None, None]);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_gripper_on_the_same_topic_and_changing_orders_do_not_matter() {
    let mut messages = moving();
    for i in 0..500 {
        let gripper = joints_at(i, &["finger"], &[9.0]);
        messages.push((gripper.0 + 1, gripper.1, gripper.2));
    }
    // The same joints in the other order, with a third among them.
    messages.extend((500..600).map(|i| joints_at(i, &["elbow", "finger", "shoulder"], &[2.0, 9.0, 1.0])));
    let (samples, reports, warnings) = ok(&[joint_track(messages)], &two_joints());
    assert_eq!(samples.joints.len(), 600);
    assert_eq!(samples.joints.row_rad(599), [1.0, 2.0]);
    assert_eq!((reports[0].messages, reports[0].other_joints), (1100, 500));
    assert!(warnings.iter().all(|w| w.severity == Severity::Notice));
}

#[test]
fn joints_without_names_are_read_by_index() {
    let messages =
        (0..100).map(|i| joints_at(i, &[] as &[&str], &[0.1 * i as f64 % 3.0, 0.5, 7.0])).collect();
    let (samples, ..) = ok(&[joint_track(messages)], &two_joints());
    assert_eq!(samples.joints.row_rad(5), [0.5, 0.5]);
    let short = (0..100).map(|i| joints_at(i, &[] as &[&str], &[0.1])).collect();
    assert!(refusal(&[joint_track(short)], &two_joints()).contains("hold 1 values, 2 joints"));
}

#[test]
fn efforts_are_read_joint_by_joint() {
    let with = |i: i64, effort: &[f64]| {
        let header = Header { stamp_ns: START_NS + i * STEP_NS, frame_id: "" };
        let log = (START_NS + i * STEP_NS) as u64;
        (log, log, ros2::joint_state(header, &["elbow", "shoulder"], &[0.5, 0.1], &[], effort))
    };
    let mut messages: Vec<_> = (0..50).map(|i| with(i, &[i as f64, -1.0])).collect();
    let (samples, ..) = ok(&[joint_track(messages.clone())], &two_joints());
    let effort = samples.joints.effort_nm.expect("every row has efforts");
    assert_eq!((effort[0][7], effort[1][7]), (-1.0, 7.0));
    // A list that ends early is of the joints that come first: here of the elbow, which is wanted last.
    messages[3] = with(3, &[]);
    messages[4] = with(4, &[4.0]);
    messages[5] = with(5, &[f64::NAN, -1.0]);
    let (samples, reports, _) = ok(&[joint_track(messages)], &two_joints());
    assert_eq!((samples.joints.len(), reports[0].undecodable), (50, 0));
    let effort = samples.joints.effort_nm.expect("most rows have efforts");
    let without = |j: usize| (0..50).filter(|i| effort[j][*i].is_nan()).collect::<Vec<_>>();
    assert_eq!([without(0), without(1)], [vec![3, 4], vec![3, 5]]);
    assert_eq!((effort[1][4], effort[0][5]), (4.0, -1.0));
    let none = (0..50).map(|i| with(i, &[f64::NAN; 2])).collect();
    assert!(ok(&[joint_track(none)], &two_joints()).0.joints.effort_nm.is_none());
    // More efforts than joints belong to nobody.
    let long = (0..50).map(|i| with(i, &[1.0, 2.0, 3.0])).collect();
    let said = refusal(&[joint_track(long)], &two_joints());
    assert!(said.contains("2 positions but 3 efforts"), "{said}");
}

#[test]
fn misspelt_names_are_met_with_the_nearest() {
    let mut streams = two_joints();
    streams.joints[0].topic = "/joint_state".into();
    let error = refusal(&[joint_track(moving()), pose_track(vec![])], &streams);
    assert!(error.contains("did you mean \"/joint_states\"") && error.contains("/vicon/tip/tip"), "{error}");
    let mut streams = two_joints();
    streams.joints[0].names[1] = "elbw".into();
    let error = refusal(&[joint_track(moving())], &streams);
    assert!(
        error.contains("no joint \"elbw\" (did you mean \"elbow\"?)") && error.contains("shoulder"),
        "{error}"
    );
    // Present, but never together in one message.
    let apart = (0..50).map(|i| joints_at(i, &[["shoulder", "elbow"][i as usize % 2]], &[0.0])).collect();
    assert!(refusal(&[joint_track(apart)], &two_joints()).contains("never come together"));
}

#[test]
fn a_topic_of_another_kind_is_refused_with_the_reason() {
    let mut streams = two_joints();
    streams.joints[0].topic = "/vicon/tip/tip".into();
    let poses = (0..9).map(|i| pose_message(i, pose_at(i), [0.0, 0.0, 0.0, 1.0])).collect();
    let error = refusal(&[pose_track(poses)], &streams);
    assert!(error.contains("cannot be read") && error.contains("PoseStamped"), "{error}");
}

#[test]
fn two_schemas_on_a_topic_leave_the_readable_one() {
    let opaque = Track { topic: "/joint_states", ..super::opaque("", 50) };
    let (samples, reports, warnings) = ok(&[opaque, joint_track(moving())], &two_joints());
    assert_eq!((samples.joints.len(), reports[0].messages), (500, 500));
    assert!(warnings.iter().any(|w| w.code == Code::ChannelUnreadable), "{warnings:?}");
}

#[test]
fn bad_rows_are_counted_and_time_comes_out_increasing() {
    let mut messages = moving();
    let names = ["shoulder", "elbow"];
    let on_log = |at: i64, m: (u64, u64, Vec<u8>)| ((START_NS + at * STEP_NS) as u64 + 5_000_000, 0, m.2);
    messages[10] = joints_at(10, &names, &[f64::NAN, 0.0]);
    messages[20].2.truncate(30);
    // Logged late by five rows: its stamp goes backwards.
    messages[200] = on_log(205, joints_at(200, &names, &[0.125, 0.125]));
    // The stamp of row 100 once more.
    messages.push(on_log(100, joints_at(100, &names, &[0.25, 0.25])));
    let (samples, reports, warnings) = ok(&[joint_track(messages)], &two_joints());
    let r = &reports[0];
    assert_eq!((r.messages, r.undecodable, r.non_finite), (501, 1, 1));
    assert_eq!((r.duplicate_stamps, r.backward_stamps, r.rows), (1, 1, 498));
    assert!(samples.joints.time_ns.windows(2).all(|w| w[0] < w[1]));
    let lost: Vec<&str> =
        warnings.iter().filter(|w| w.severity == Severity::DataLost).map(|w| w.code.as_str()).collect();
    assert_eq!(lost, ["undecodable", "non-finite"]);
}

#[test]
fn clocks_are_chosen_or_obeyed_and_the_reason_recorded() {
    let (_, reports, _) = ok(&[joint_track(moving())], &two_joints());
    assert!(reports[0].clock_reason.contains("follow log time"), "{}", reports[0].clock_reason);
    let mut streams = two_joints();
    streams.joints[0].clock = Some(Clock::Log);
    let (samples, reports, _) = ok(&[joint_track(moving())], &streams);
    assert_eq!(samples.joints.time_ns[1], START_NS + STEP_NS + 3_000_000 + 7919);
    assert_eq!(reports[0].clock_reason, "set in the pipeline");
    // Stamps never filled in.
    let unstamped = |i: i64| {
        let data = ros2::joint_state(
            Header { stamp_ns: 0, frame_id: "" },
            &["shoulder", "elbow"],
            &[0.0, 1.0],
            &[],
            &[],
        );
        ((START_NS + i * STEP_NS) as u64, (START_NS + i * STEP_NS) as u64 - 2_000_000, data)
    };
    let tracks = [joint_track((0..100).map(unstamped).collect())];
    let (samples, reports, _) = ok(&tracks, &two_joints());
    assert_eq!((reports[0].clock, samples.joints.time_ns[0]), (Clock::Publish, START_NS - 2_000_000));
    streams.joints[0].clock = Some(Clock::Header);
    let error = refusal(&tracks, &streams);
    assert!(error.contains("all zero") && error.contains("\"publish\""), "{error}");
}

#[test]
fn wrong_units_are_recognised_and_the_right_ones_convert() {
    let sweep = |scale: f64| {
        let at = move |i: i64| [scale * (i as f64 * 0.01).sin(), scale * 1.2];
        [joint_track((0..500).map(|i| joints_at(i, &["shoulder", "elbow"], &at(i))).collect())]
    };
    let degrees = sweep(57.295_779_513_082_32);
    let error = refusal(&degrees, &two_joints());
    assert!(error.contains("looks like degrees") && error.contains("unit = \"deg\""), "{error}");
    let mut streams = two_joints();
    streams.joints[0].unit = JointUnit::Deg;
    let (samples, ..) = ok(&degrees, &streams);
    assert!((samples.joints.row_rad(7)[1] - 1.2).abs() < 1e-12);
    let (.., warnings) = ok(&sweep(1.0), &streams);
    assert!(warnings.iter().any(|w| w.message.contains("unit = \"rad\"")), "{warnings:?}");
    assert!(refusal(&sweep(20_000.0), &two_joints()).contains("encoder counts"));
    streams.joints[0].unit = JointUnit::Counts;
    assert!(refusal(&degrees, &streams).contains("one entry of `encoders` a joint"));
    let encoder = Encoder { counts_per_turn: 4096.0, direction: -1, zero_counts: 100.0 };
    streams.joints[0].encoders = vec![encoder; 2];
    let counts =
        (0..200).map(|i| joints_at(i, &["shoulder", "elbow"], &[100.0 + i as f64, 1124.0])).collect();
    let (samples, reports, _) = ok(&[joint_track(counts)], &streams);
    assert!((samples.joints.row_rad(0)[1] + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let step = reports[0].quantisation_rad[0].expect("counts are a grid");
    assert!((step - std::f64::consts::TAU / 4096.0).abs() < 1e-9);
    assert_eq!(reports[0].quantisation_rad[1], None, "a constant says nothing about its grid");
}

#[test]
fn millimetres_are_recognised_and_converted() {
    let mm = |i: i64| pose_message(i, pose_at(i).map(|x| x * 1e3), [0.0, 0.0, 0.0, 1.0]);
    let tracks = [joint_track(moving()), pose_track((0..100).map(mm).collect())];
    let error = refusal(&tracks, &with_tip());
    assert!(error.contains("looks like millimetres") && error.contains("unit = \"mm\""), "{error}");
    let mut streams = with_tip();
    streams.tip = streams.tip.map(|tip| PoseStream { unit: LengthUnit::Mm, ..tip });
    let tip = ok(&tracks, &streams).0.tip.expect("a tip");
    assert!((tip.position_m[4].x - pose_at(4)[0]).abs() < 1e-12);
    assert_eq!(tip.frame_id, "vicon");
}

#[test]
fn occluded_frames_are_rejected_and_counted() {
    let unit = [0.0, 0.0, 0.6, 0.8];
    let mut messages: Vec<_> = (0..400).map(|i| pose_message(i, pose_at(i), unit)).collect();
    for i in 50..60 {
        messages[i as usize] = pose_message(i, [0.0; 3], [0.0; 4]);
    }
    for i in 100..130 {
        messages[i as usize] = pose_message(i, pose_at(99), unit);
    }
    messages[300] = pose_message(300, pose_at(300), [0.0; 4]);
    let (samples, reports, warnings) = ok(&[joint_track(moving()), pose_track(messages)], &with_tip());
    let tip = samples.tip.expect("a tip");
    assert_eq!(reports[1].occluded, Occlusion { zero: 10, frozen: 30, non_unit_quaternion: 1, flagged: 0 });
    assert_eq!((tip.len(), reports[1].rows), (359, 359));
    assert!((tip.orientation.expect("oriented")[0].angle() - 2.0 * 0.6_f64.asin()).abs() < 1e-12);
    assert!(warnings.iter().all(|w| w.severity == Severity::Notice), "{warnings:?}");
}

#[test]
fn bodies_are_chosen_by_name() {
    let at = |i: i64, body: &str, x: f64| {
        let stamp_ns = START_NS + i * STEP_NS;
        let header = Header { stamp_ns, frame_id: "world" };
        (
            stamp_ns as u64,
            stamp_ns as u64,
            ros2::transform_stamped(header, body, [x, 0.1, 0.2], [0.0, 0.0, 0.0, 1.0]),
        )
    };
    let messages =
        (0..100).flat_map(|i| [at(i, "tip", 1.0 + noise(i, 0)), at(i, "base", 2.0 + noise(i, 1))]).collect();
    let tracks = [joint_track(moving()), track("/tracked", ros2::TRANSFORM_STAMPED, messages)];
    let ask = |body: Option<&str>| {
        let stream =
            PoseStream { topic: "/tracked".into(), body: body.map(str::to_owned), ..PoseStream::default() };
        let base = PoseStream { body: Some("base".into()), ..stream.clone() };
        Streams { tip: Some(stream), base: Some(base), ..two_joints() }
    };
    let (samples, ..) = ok(&tracks, &ask(Some("tip")));
    let (tip, base) = (samples.tip.expect("a tip"), samples.base.expect("a base"));
    assert_eq!((tip.len(), base.len(), tip.body.as_str()), (100, 100, "tip"));
    assert!(tip.position_m.iter().all(|p| p.x < 1.5) && base.position_m.iter().all(|p| p.x > 1.5));
    let error = refusal(&tracks, &ask(None));
    assert!(error.contains("several bodies") && error.contains("\"base\", \"tip\""), "{error}");
    let error = refusal(&tracks, &ask(Some("tpi")));
    assert!(error.contains("did you mean \"tip\""), "{error}");
}

#[test]
fn markers_are_read_each_under_its_name_and_one_that_is_never_seen_costs_itself() {
    let poses = |x: f64| {
        let at = |i: i64| {
            let stamp_ns = START_NS + i * STEP_NS;
            let header = Header { stamp_ns, frame_id: "world" };
            let hidden = x == 0.0;
            let position = if hidden { [f64::NAN; 3] } else { [x + noise(i, 0), 0.1, 0.2] };
            let turned = [0.0, 0.0, 0.0, if hidden { 0.0 } else { 1.0 }];
            (stamp_ns as u64, stamp_ns as u64, ros2::pose_stamped(header, position, turned))
        };
        (0..100).map(at).collect()
    };
    let topics = [("/elbow", 1.0), ("/hand", 2.0), ("/lost", 0.0)];
    let mut tracks = vec![joint_track(moving())];
    tracks.extend(topics.map(|(topic, x)| track(topic, ros2::POSE_STAMPED, poses(x))));
    let stream = |topic: &str| PoseStream { topic: topic.into(), ..PoseStream::default() };
    let bodies = topics.map(|(topic, _)| (topic.trim_start_matches('/').to_owned(), stream(topic)));
    let streams = Streams { bodies: bodies.into(), ..two_joints() };
    let (samples, reports, warnings) = ok(&tracks, &streams);
    assert_eq!(samples.bodies.keys().collect::<Vec<_>>(), ["elbow", "hand"]);
    assert!(samples.bodies["hand"].len() == 100 && samples.bodies["hand"].position_m[7].x > 1.5);
    assert!(samples.bodies["elbow"].position_m[7].x < 1.5 && samples.tip.is_none());
    let roles: Vec<&str> = reports.iter().map(|r| r.role.as_str()).collect();
    assert_eq!(roles, ["joints", "bodies.elbow", "bodies.hand", "bodies.lost"]);
    let lost = warnings.iter().find(|w| w.code == Code::MarkerUnseen).expect("said");
    assert!(lost.subject.contains("/lost") && lost.message.contains("100 with NaN"), "{lost:?}");
    assert_eq!(streams.topics(), ["/elbow", "/hand", "/joint_states", "/lost"]);
    let bodies = [("hand".to_owned(), stream("/hands"))];
    let error = refusal(&tracks, &Streams { bodies: bodies.into(), ..two_joints() });
    assert!(error.contains("/hands") && error.contains("/hand"), "{error}");
}

/// Two joints, and what `cell_c` reads in the cell.
fn with_thermometer(cell_c: impl Fn(i64) -> f64) -> (Samples, Vec<StreamReport>, Vec<Warning>) {
    let at = |i: i64| {
        let stamp_ns = START_NS + i * STEP_NS;
        let data = ros2::temperature(Header { stamp_ns, frame_id: "" }, cell_c(i), 0.0);
        (stamp_ns as u64, stamp_ns as u64, data)
    };
    let tracks = [joint_track(moving()), track("/cell", ros2::TEMPERATURE, (0..10).map(at).collect())];
    let temperature = Some(ScalarStream { topic: "/cell".into(), ..ScalarStream::default() });
    ok(&tracks, &Streams { temperature, ..two_joints() })
}

#[test]
fn temperature_is_a_column() {
    let (samples, reports, _) = with_thermometer(|i| 20.0 + i as f64);
    assert_eq!(samples.temperature.expect("a column").value[9], 29.0);
    assert_eq!(reports[1].role, "temperature");
}

#[test]
fn what_no_laboratory_has_is_no_temperature() {
    let code = |warnings: &[Warning], code: Code| -> Option<Warning> {
        warnings.iter().find(|w| w.code == code && w.subject.contains("/cell")).cloned()
    };
    let (samples, reports, warnings) =
        with_thermometer(|i| if i % 3 == 0 { -999.0 } else { 20.0 + i as f64 });
    assert_eq!(samples.temperature.expect("a column").value, [21.0, 22.0, 24.0, 25.0, 27.0, 28.0]);
    assert_eq!((reports[1].rows, reports[1].impossible), (6, 4));
    assert_eq!(code(&warnings, Code::Impossible).expect("reported").severity, Severity::DataLost);
    let (samples, _, warnings) = with_thermometer(|i| 293.15 + i as f64);
    assert!((samples.temperature.expect("a column").value[9] - 29.0).abs() < 1e-9);
    assert!(code(&warnings, Code::TemperatureKelvin).expect("reported").message.contains("converted"));
    // Nothing usable costs the temperature, not the recording.
    for nothing in [|_| f64::NAN, |_| -999.0, |i| if i < 2 { 0.0 } else { 293.0 }] {
        let (samples, _, warnings) = with_thermometer(nothing);
        assert!(samples.temperature.is_none() && samples.joints.len() == 500);
        assert_eq!(
            code(&warnings, Code::TemperatureUnusable).expect("reported").severity,
            Severity::DataLost
        );
    }
    let (samples, _, warnings) = with_thermometer(|i| 68.0 + i as f64);
    assert_eq!(samples.temperature.expect("a column").value[0], 68.0);
    assert!(code(&warnings, Code::TemperatureFahrenheit).is_some());
}

#[test]
fn rows_are_those_that_are_there_whatever_the_statistics_declare() {
    let mut file = mcap_bytes(&[joint_track(moving())], &Style::default());
    let sound = open(&file).read(&two_joints()).expect("a sound file");
    // Without a CRC nothing contradicts the summary.
    let crc = file.len() - mcap::MAGIC.len() - 4;
    file[crc..][..4].fill(0);
    let mut records = Records::new(&file, mcap::MAGIC.len(), file.len()).flatten();
    let statistics = records.find(|r| r.op == mcap::records::op::STATISTICS).expect("there are some");
    // What they say of the only channel comes last.
    let count = statistics.offset + ENVELOPE + statistics.body.len() - 8;
    assert_eq!(file[count..][..8], 500_u64.to_le_bytes());
    for declared in [0, 7, 501, u64::MAX] {
        file[count..][..8].copy_from_slice(&declared.to_le_bytes());
        let read = open(&file).read(&two_joints()).expect("the same rows");
        assert_eq!((read.0, read.1), (sound.0.clone(), sound.1.clone()), "{declared}");
    }
}

#[test]
fn split_files_with_other_ids_and_a_damaged_chunk_make_one_stream() {
    let messages = moving();
    let whole = ok(&[joint_track(messages.clone())], &two_joints()).0;
    let first = mcap_bytes(&[joint_track(messages[..250].to_vec())], &Style::default());
    let style = Style { fillers: 3, compression: Some(Compression::Lz4), summary: false, ..Style::default() };
    let second = mcap_bytes(&[joint_track(messages[250..].to_vec())], &style);
    let disk = OnDisk::new(&[second.clone(), first.clone()]);
    let split = disk.open().and_then(|r| r.read(&two_joints())).expect("two files").0;
    assert_eq!(split, whole);
    let mut damaged = first;
    let at = damaged.len() / 3;
    damaged[at] ^= 1;
    let disk = OnDisk::new(&[second, damaged]);
    let recording = disk.open().expect("damaged, not unreadable");
    let rows = recording.read(&two_joints()).expect("the rest is sound").0.joints;
    assert!(rows.len() < 500 && rows.len() >= 250);
    let sound = |time: &i64| whole.joints.time_ns.binary_search(time).expect("a stamp that was written");
    for (i, time) in rows.time_ns.iter().enumerate() {
        assert_eq!(rows.row_rad(i), whole.joints.row_rad(sound(time)));
    }
    assert!(recording.report().warnings.iter().any(|w| w.severity == Severity::DataLost));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    #[test]
    fn any_layout_gives_the_same_samples(
        chunk_bytes in prop::option::of(200_u64..100_000),
        compression in prop_oneof![Just(None), Just(Some(Compression::Zstd)), Just(Some(Compression::Lz4))],
        summary in any::<bool>(),
        crc in any::<bool>(),
        fillers in 0_usize..4,
        threads in 1_usize..4,
    ) {
        let poses = || pose_track((0..300).map(|i| pose_message(i, pose_at(i), [0.0, 0.0, 0.0, 1.0])).collect());
        let tracks = [joint_track(moving()), poses()];
        let reference = open(&mcap_bytes(&tracks, &Style::default())).read(&with_tip()).expect("readable").0;
        let style = Style { chunk_bytes, compression, summary, crc, fillers };
        let recording = open(&mcap_bytes(&tracks, &style));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let samples = pool.install(|| Recording::read(&recording, &with_tip())).expect("readable").0;
        prop_assert_eq!(samples, reference);
    }

    #[test]
    fn mutated_streams_never_panic_and_never_add_rows(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
        chunk_bytes in prop_oneof![Just(None), Just(Some(4000))],
    ) {
        // Without CRCs, so that damaged messages reach the decoders.
        let style = Style { chunk_bytes, compression: None, crc: false, ..Style::default() };
        let mut bytes = mcap_bytes(&[joint_track(moving())], &style);
        for (at, mask) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= mask;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok((samples, reports, _)) = OnDisk::new(&[bytes]).open().and_then(|r| r.read(&two_joints())) {
            prop_assert!(samples.joints.len() <= 500 && reports[0].messages <= 500);
            prop_assert!(samples.joints.time_ns.windows(2).all(|w| w[0] < w[1]));
            prop_assert!(samples.joints.joint_rad.iter().flatten().all(|q| q.is_finite()));
        }
    }
}
