use crate::support::conformance::corpus;
use armcal_recording::Recording;
use sha2::{Digest as _, Sha256};

/// SHA-256 over the lines `<sha256>  <name>.mcap` of all 416 files in byte order of their names, taken from
/// the Git LFS object ids of foxglove/mcap `tests/conformance/data` at 95d0673 (2026-08-04).
const PUBLISHED: &str = include_str!("support/conformance.sha256");

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[test]
fn corpus_is_the_published_one() {
    let mut files = corpus();
    assert_eq!(files.len(), 416);
    files.sort_by_key(|f| format!("{}.mcap", f.name));
    let lines: String =
        files.iter().map(|f| format!("{}  {}.mcap\n", hex(&Sha256::digest(&f.bytes)), f.name)).collect();
    assert_eq!(hex(&Sha256::digest(lines.as_bytes())), PUBLISHED.trim());
}

#[test]
fn every_conformance_file_gives_the_right_number_of_messages() {
    let folder = tempfile::tempdir().expect("temporary folder");
    for file in corpus() {
        let path = folder.path().join(format!("{}.mcap", file.name));
        std::fs::write(&path, &file.bytes).expect("writing a corpus file");
        let recording = Recording::open(&[path]).unwrap_or_else(|e| panic!("{}: {e}", file.name));
        let mut raw = 0;
        recording
            .for_each_raw(&mut |_| {
                raw += 1;
                Ok(())
            })
            .expect(&file.name);
        let counted: u64 = recording.report().channels.iter().map(|c| c.messages).sum();
        assert_eq!((raw, counted), (file.messages, file.messages), "{}", file.name);
        let damaged: usize = recording.report().files.iter().map(|f| f.damaged.len()).sum();
        assert_eq!(damaged, 0, "{} is sound", file.name);
    }
}

#[test]
fn conformance_files_cut_anywhere_never_panic_and_never_invent_messages() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("cut.mcap");
    for file in corpus().iter().filter(|f| f.name.starts_with("TenMessages")).step_by(7) {
        for length in (0..file.bytes.len()).step_by(11) {
            std::fs::write(&path, &file.bytes[..length]).expect("writing a cut file");
            // An error is a fine answer for a stump; messages that were never written are not.
            if let Ok(recording) = Recording::open(std::slice::from_ref(&path)) {
                let counted: u64 = recording.report().channels.iter().map(|c| c.messages).sum();
                assert!(counted <= file.messages, "{} cut at {length}: {counted}", file.name);
            }
        }
    }
}
