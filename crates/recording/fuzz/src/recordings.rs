//! Bytes of a recording, which are untrusted.

use armcal_recording::decode::Role;
use armcal_recording::{JointStream, PoseStream, Recording, RecordingReport, ScalarStream, Streams};
use std::cell::RefCell;
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Opens the bytes as a recording, reports on it, reads every message, and the streams that it seems to have.
pub fn recording(bytes: &[u8]) {
    on_disk(bytes, recording_at);
}

/// The same of a file.
pub fn recording_at(path: &Path) {
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

/// Puts bytes into a file of this thread's own, in memory where the machine has a place for that.
pub fn on_disk<R>(bytes: &[u8], f: impl FnOnce(&Path) -> R) -> R {
    thread_local!(static FILE: RefCell<Option<NamedTempFile>> = const { RefCell::new(None) });
    FILE.with_borrow_mut(|file| {
        let file =
            file.get_or_insert_with(|| NamedTempFile::new_in(memory_folder()).expect("a temporary file"));
        file.as_file().set_len(0).and_then(|()| file.rewind()).expect("a temporary file");
        file.write_all(bytes).expect("a temporary file");
        f(file.path())
    })
}

/// A folder in memory where the machine has one.
pub fn memory_folder() -> PathBuf {
    Some(PathBuf::from("/dev/shm")).filter(|f| f.is_dir()).unwrap_or_else(std::env::temp_dir)
}
