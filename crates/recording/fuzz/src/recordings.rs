//! Bytes of a recording, and bytes of a schema with a message: both untrusted.

use armcal_recording::decode::{Plan, Role, Rows, readable_as};
use armcal_recording::{JointStream, PoseStream, Recording, RecordingReport, ScalarStream, Streams};
use std::cell::RefCell;
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Opens the bytes as a recording, reports on it, reads every message, and the streams that it seems to have.
pub fn recording(bytes: &[u8]) {
    on_disk(bytes, |path| {
        let Ok(recording) = Recording::open(&[path.to_owned()]) else { return };
        let report = recording.report();
        let mut messages = 0;
        recording
            .for_each_raw(&mut |_| {
                messages += 1;
                Ok(())
            })
            .expect("nothing stops the pass");
        assert_eq!(report.channels.iter().map(|c| c.messages).sum::<u64>(), messages);
        recording.for_each_attachment(&mut |_| Ok(())).expect("a mapped file is there");
        recording.metadata().expect("a mapped file is there");
        if let Some(streams) = streams(report)
            && let Ok((samples, ..)) = recording.read(&streams)
        {
            let increasing = |time: &[i64]| time.windows(2).all(|w| w[0] < w[1]);
            assert!(increasing(&samples.joints.time_ns) && !samples.joints.time_ns.is_empty());
            assert!(samples.joints.joint_rad.iter().flatten().all(|q| q.is_finite()));
            for poses in samples.tip.iter() {
                assert!(increasing(&poses.time_ns));
                assert!(poses.position_m.iter().flatten().all(|x| x.is_finite()));
            }
        }
    });
}

/// The first topic that can be read in each role. Seeds name their joints `joint1` and `joint2`.
fn streams(report: &RecordingReport) -> Option<Streams> {
    let topic = |role: Role| {
        let found = report.channels.iter().find(|c| c.decodable.as_deref() == Ok(role.name()));
        found.map(|c| c.topic.clone())
    };
    let names = ["joint1", "joint2"].map(str::to_owned).to_vec();
    Some(Streams {
        joints: vec![JointStream { topic: topic(Role::Joints)?, names, ..JointStream::default() }],
        tip: topic(Role::Pose).map(|topic| PoseStream { topic, ..PoseStream::default() }),
        temperature: topic(Role::Scalar).map(|topic| ScalarStream { topic, ..ScalarStream::default() }),
        ..Streams::default()
    })
}

/// A recording made of records by the bytes, most of them sound: see [`structured`](super::structured).
pub fn records(bytes: &[u8]) {
    recording(&super::structured::mcap(bytes));
}

/// `[encoding][length of name][name][length of schema, u16][schema][message]`.
pub fn message(bytes: &[u8]) {
    let Some(case) = Case::split(bytes) else { return };
    let (name, schema) = (case.name, case.schema);
    let Ok(role) = readable_as(name, case.schema_encoding, schema, case.message_encoding) else { return };
    for body in [None, Some("tip")] {
        let plan = Plan::compile(role, name, case.schema_encoding, schema, case.message_encoding, body);
        let Ok(plan) = plan else { continue };
        let mut rows = Rows::new(role);
        let first = plan.decode(case.message, &mut rows);
        assert!(first.is_ok() || rows.is_empty());
        assert!(rows.len() <= case.message.len());
        let once = rows.len();
        assert_eq!(plan.decode(case.message, &mut rows), first, "the same message again");
        assert_eq!(rows.len(), 2 * once);
        let _ = plan.bodies(case.message);
    }
}

struct Case<'a> {
    schema_encoding: &'static str,
    message_encoding: &'static str,
    name: &'a str,
    schema: &'a [u8],
    message: &'a [u8],
}

impl<'a> Case<'a> {
    fn split(bytes: &'a [u8]) -> Option<Case<'a>> {
        const ENCODINGS: [(&str, &str); 4] =
            [("ros2msg", "cdr"), ("ros1msg", "ros1"), ("protobuf", "protobuf"), ("jsonschema", "json")];
        let (&[encoding, length], rest) = bytes.split_first_chunk()?;
        let (name, rest) = rest.split_at_checked(usize::from(length))?;
        let (length, rest) = rest.split_first_chunk()?;
        let (schema, message) = rest.split_at_checked(usize::from(u16::from_le_bytes(*length)))?;
        let (schema_encoding, message_encoding) = ENCODINGS[usize::from(encoding) % ENCODINGS.len()];
        Some(Case {
            schema_encoding,
            message_encoding,
            name: std::str::from_utf8(name).ok()?,
            schema,
            message,
        })
    }
}

/// The most that any of these may have allocated at once for an input of `bytes`. A buffer to inflate into is 16 MiB
/// before anything has inflated; rows, texts and descriptors take a few hundred bytes for each of a message's.
pub fn bound(bytes: usize) -> usize {
    (40 << 20) + 512 * bytes
}

/// Puts bytes into a file of this thread's own, in memory where the machine has a place for that.
pub fn on_disk<R>(bytes: &[u8], f: impl FnOnce(&Path) -> R) -> R {
    thread_local!(static FILE: RefCell<Option<NamedTempFile>> = const { RefCell::new(None) });
    FILE.with_borrow_mut(|file| {
        let file = file.get_or_insert_with(|| {
            let folder =
                Some(PathBuf::from("/dev/shm")).filter(|f| f.is_dir()).unwrap_or_else(std::env::temp_dir);
            NamedTempFile::new_in(folder).expect("a temporary file")
        });
        file.as_file().set_len(0).and_then(|()| file.rewind()).expect("a temporary file");
        file.write_all(bytes).expect("a temporary file");
        f(file.path())
    })
}
