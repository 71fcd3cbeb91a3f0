use crate::support::damage::{Damaged, Sound, Style, recording};
use crate::support::{armcal, quick_pipeline, root};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

const MESSAGES: u32 = 600;

/// What `armcal inspect` says of a file: exit code, usable messages, its report as text.
fn inspect(folder: &Path, bytes: &[u8]) -> (Option<i32>, u64, String) {
    let path = folder.join("rec.mcap");
    std::fs::write(&path, bytes).expect("writing a recording");
    let output = armcal([Path::new("inspect"), Path::new("--json"), &path]);
    assert_no_panic(&output);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let channels = report[0]["report"]["channels"].as_array().cloned().unwrap_or_default();
    let messages = channels.iter().filter_map(|c| c["messages"].as_u64()).sum();
    let said = report[0]["report"]["warnings"].to_string() + &String::from_utf8_lossy(&output.stderr);
    (output.status.code(), messages, said)
}

fn assert_no_panic(output: &Output) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains("panicked") && output.status.code().is_some(), "{said}");
}

fn judge(folder: &Path, damaged: &Damaged) {
    let Damaged { name, bytes, usable, says, lost } = damaged;
    let (code, messages, said) = inspect(folder, bytes);
    println!("{name}: {messages} messages, exit {code:?}, {said}");
    assert_eq!((messages, code), (*usable, Some(if *lost { 3 } else { 0 })), "{name}: {said}");
    if says.is_empty() {
        assert!(!said.contains("data-lost") && !said.contains("recording-damaged"), "{name}: {said}");
    } else {
        assert!(said.contains(says), "{name}: {said}");
    }
}

#[test]
fn every_kind_of_damage_costs_exactly_what_it_must() {
    let folder = tempfile::tempdir().expect("temporary folder");
    for compression in [Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
        let sound = Sound::new(recording(MESSAGES, Style { compression, ..Style::PLAIN }, true));
        assert_eq!(sound.messages(), u64::from(MESSAGES));
        sound.damaged().iter().for_each(|damaged| judge(folder.path(), damaged));
    }
}

#[test]
fn unusual_layouts_lose_nothing() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let layouts = [
        ("unchunked, with a summary", Style { chunks: false, ..Style::PLAIN }, true),
        ("unchunked, without a summary", Style { chunks: false, summary: false, ..Style::PLAIN }, true),
        ("without message indexes", Style { message_indexes: false, ..Style::PLAIN }, true),
        ("without a summary", Style { summary: false, ..Style::PLAIN }, true),
        ("not compressed", Style { compression: None, ..Style::PLAIN }, true),
        ("schema id 0", Style::PLAIN, false),
    ];
    for (name, style, schema) in layouts {
        let bytes = recording(MESSAGES, style, schema);
        judge(folder.path(), &Damaged { name, bytes, usable: u64::from(MESSAGES), says: "", lost: false });
    }
}

#[test]
fn definitions_that_are_lost_take_their_messages_with_them() {
    // Without a summary, only the first chunk defines the channel.
    let folder = tempfile::tempdir().expect("temporary folder");
    let sound = Sound::new(recording(MESSAGES, Style::PLAIN, true));
    let mut bytes = recording(MESSAGES, Style { summary: false, ..Style::PLAIN }, true);
    let first = sound.chunks[0].chunk_start_offset as usize;
    bytes[first + 9 + 24] ^= 1;
    let (code, messages, said) = inspect(folder.path(), &bytes);
    assert_eq!((code, messages), (Some(3), 0), "{said}");
    let orphans = u64::from(MESSAGES) - sound.counts[0];
    assert!(said.contains(&format!("{orphans} messages of channel 1, whose definition is lost")), "{said}");
}

/// Forty definitions of 1 MiB each: eight too many, unless somebody says that they may.
#[test]
fn more_definitions_than_usual_are_kept_where_that_is_stated() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("rec.mcap");
    let file = std::fs::File::create(&path).expect("a file");
    let mut writer = mcap::WriteOptions::new().compression(None).create(file).expect("a writer");
    for k in 0..40_u16 {
        let schema =
            writer.add_schema(&format!("a/T{k}"), "ros2msg", &vec![b'#'; 1 << 20]).expect("a schema");
        let channel = writer.add_channel(schema, &format!("/t{k}"), "cdr", &[].into()).expect("a channel");
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &[0; 8]).expect("a message");
    }
    writer.finish().expect("the end");
    drop(writer);
    let inspected = |mib: Option<&str>| {
        let mut inspect = std::process::Command::new(env!("CARGO_BIN_EXE_armcal"));
        inspect.args([Path::new("inspect"), Path::new("--json"), &path]);
        mib.map(|mib| inspect.env("ARMCAL_INFLATE_MIB", mib));
        let output = inspect.output().expect("armcal starts");
        assert_no_panic(&output);
        (output.status.code(), String::from_utf8_lossy(&output.stdout).contains("more than they may"))
    };
    assert_eq!(inspected(None), (Some(3), true));
    assert_eq!(inspected(Some("300")), (Some(0), false));
}

#[test]
fn what_is_no_recording_is_refused() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let garbage: Vec<u8> = (0..5000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let magic = b"\x89MCAP0\r\n";
    for (bytes, says) in [(&b""[..], "empty"), (&garbage, "magic"), (&magic[..5], "magic")] {
        let (code, messages, said) = inspect(folder.path(), bytes);
        assert_eq!((code, messages), (Some(1), 0), "{said}");
        assert!(said.contains(says) && said.contains("rec.mcap"), "{said}");
    }
    let (code, messages, said) = inspect(folder.path(), magic);
    assert_eq!((code, messages), (Some(3), 0), "a recording that was cut off at once: {said}");
}

/// The main job on the shipped recording, damaged: 3 where data were lost, 1 where nothing usable is left, and what
/// it says of a sound one where nothing was lost.
#[test]
fn the_main_job_says_by_its_exit_code_what_was_lost() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let sound = Sound::new(std::fs::read(root().join("fixtures/paper/normal.mcap")).expect("fixture"));
    let pipeline = folder.path().join("pipeline.toml");
    std::fs::write(&pipeline, quick_pipeline(folder.path())).expect("writing the pipeline");
    let run = |bytes: &[u8]| {
        std::fs::write(folder.path().join("normal.mcap"), bytes).expect("writing a recording");
        let out = folder.path().join("out");
        let output = armcal([Path::new("run"), &pipeline, Path::new("--out"), &out]);
        assert_no_panic(&output);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let undisturbed = run(&sound.bytes).0;
    assert!(matches!(undisturbed, Some(0 | 3)));
    let chosen = [
        "cut in mid chunk",
        "bit flip in a zstd chunk",
        "zero-filled tail",
        "no footer",
        "huge record length",
    ];
    for damaged in sound.damaged().iter().filter(|d| chosen.contains(&d.name)) {
        let (code, said) = run(&damaged.bytes);
        let expected = if damaged.lost { Some(3) } else { undisturbed };
        assert_eq!(code, expected, "{}: {said}", damaged.name);
    }
    // The first seconds only: joints, but no dwell.
    let stump = &sound.bytes[..sound.chunks[0].chunk_start_offset as usize + 4000];
    let zeros = vec![0; sound.bytes.len()];
    for (name, bytes) in
        [("stump", stump), ("magic only", &sound.bytes[..8]), ("zeros", &zeros), ("empty", b"")]
    {
        let (code, said) = run(bytes);
        assert_eq!(code, Some(1), "{name}: {said}");
        assert!(said.starts_with("error: ") && said.contains("normal"), "{name}: {said}");
    }
}
