//! What a file that becomes shorter while it is read is to its reader.

use crate::bytes::map::Map;
use crate::{Access, Recording, RecordingError};
use std::io::Write as _;

/// A file of zeros is read to its old end, and it is said that the end is gone.
#[test]
fn a_map_whose_file_was_shortened_is_read_on_and_says_so() {
    let mut files: Vec<(std::fs::File, Map)> = Vec::new();
    for _ in 0..40 {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(&[7; 1 << 16]).expect("written");
        let map = Map::of(&file).expect("mapped");
        files.push((file, map));
    }
    files.truncate(30);
    for (at, (file, map)) in files.iter().enumerate() {
        if at % 2 == 0 {
            file.set_len(5000).expect("shortened");
        }
        let sum: usize = map.iter().map(|byte| usize::from(*byte)).sum();
        assert_eq!(map.is_shortened(), at % 2 == 0, "file {at}");
        // Behind the new end up to its page are zeros too, and no signal.
        assert_eq!(sum, 7 * if at % 2 == 0 { 5000 } else { 1 << 16 }, "file {at}");
    }
    assert!(!Map::of(&files[1].0).expect("mapped").is_shortened(), "a place is used again, and begins anew");
}

#[test]
fn a_recording_that_was_shortened_is_an_error_and_not_what_is_left_of_it() {
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/paper/normal.mcap");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    std::fs::copy(shipped, &path).expect("copied");
    let open = || Recording::open_with(std::slice::from_ref(&path), Access::Mapped).expect("opened");
    let (read, reported) = (open(), open());
    let file = std::fs::File::options().write(true).open(&path).expect("opened");
    file.set_len(100_000).expect("shortened");
    let streams = crate::Streams {
        joints: vec![crate::JointStream {
            topic: "/joint_states".into(),
            names: ["joint1", "joint2", "joint3"].map(str::to_owned).to_vec(),
            ..Default::default()
        }],
        ..Default::default()
    };
    let error = read.read(&streams).expect_err("shortened");
    assert!(matches!(&error, RecordingError::Read { path: named, .. } if *named == path), "{error}");
    let report = reported.report();
    let said = format!("{:?}", report.files[0].damaged);
    assert!(said.contains("cannot be read any more"), "{said}");
    assert!(report.warnings.iter().any(|w| w.severity == armcal_core::Severity::DataLost), "{said}");
}
