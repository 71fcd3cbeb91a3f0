//! The conformance corpus of the MCAP project, when it is at hand.
//!
//! `ARMCAL_MCAP_CONFORMANCE=<folder>` with pairs of `x.mcap` and `x.json`, as in
//! `github.com/foxglove/mcap/tests/conformance/data`.

use crate::Recording;
use serde_json::Value;
use skipped_tests::skip;
use std::path::{Path, PathBuf};

#[test]
fn conformance_files_give_the_declared_messages() {
    let Some(folder) = std::env::var_os("ARMCAL_MCAP_CONFORMANCE").map(PathBuf::from) else {
        skip("ARMCAL_MCAP_CONFORMANCE names no folder of conformance files (*.mcap with *.json)");
        return;
    };
    let mut files = Vec::new();
    collect(&folder, &mut files);
    files.sort();
    assert!(!files.is_empty(), "no .mcap files under {}", folder.display());
    for path in &files {
        let expected = declared(path);
        let recording = Recording::open(std::slice::from_ref(path)).expect("a conformance file opens");
        let messages = super::raw_count(&recording);
        let (attachments, metadata) = (
            super::attachments(&recording).len() as u64,
            recording.metadata().expect("readable").len() as u64,
        );
        assert_eq!((messages, attachments, metadata), expected, "{}", path.display());
        assert!(recording.report().files[0].damaged.is_empty(), "{:?}", recording.report().files[0]);
    }
}

/// Messages, attachments and metadata records that the JSON beside the file lists.
fn declared(path: &Path) -> (u64, u64, u64) {
    let text = std::fs::read_to_string(path.with_extension("json")).expect("a .json beside the .mcap");
    let value: Value = serde_json::from_str(&text).expect("valid JSON");
    let records = value["records"].as_array().expect("a list of records");
    let count = |kind: &str| records.iter().filter(|r| r["type"] == kind).count() as u64;
    (count("Message"), count("Attachment"), count("Metadata"))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a readable folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|e| e == "mcap") {
            files.push(path);
        }
    }
}
