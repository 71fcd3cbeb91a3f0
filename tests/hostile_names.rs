use crate::support::{armcal, quick_pipeline, root};
use armcal_recording::ros2::{self, Header};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Names that lead out of a folder, end a text, drive a terminal, or are markup.
const EVIL: [&str; 8] = [
    "../../escaped",
    "/tmp/armcal-escaped",
    "..\\..\\escaped",
    "nul\0byte",
    "line\nfeed",
    "\u{1b}]0;title\u{7}\u{1b}[2J\u{1b}[31m",
    "\u{9b}2J\u{202e}",
    "<img src=x onerror=pwned()>",
];

/// The shipped recording with hostile topics, schemas, encodings, joints, attachments and metadata beside its own.
fn evil_recording() -> Vec<u8> {
    let sound = std::fs::read(root().join("fixtures/paper/normal.mcap")).expect("fixture");
    let mut writer = mcap::WriteOptions::new()
        .profile(EVIL[5])
        .library(EVIL[5])
        .compression_threads(0)
        .create(Cursor::new(Vec::new()))
        .expect("a writer into memory");
    for message in mcap::MessageStream::new(&sound).expect("sound") {
        writer.write(&message.expect("sound")).expect("written to memory");
    }
    let long = "x".repeat(1 << 20);
    for name in EVIL.into_iter().chain([long.as_str()]) {
        let text = ros2::JOINT_STATE.text.as_bytes();
        let good = writer.add_schema(ros2::JOINT_STATE.name, ros2::SCHEMA_ENCODING, text).expect("a schema");
        let bad = writer.add_schema(name, name, name.as_bytes()).expect("a schema");
        let metadata = BTreeMap::from([(name.to_owned(), name.to_owned())]);
        let joints = writer.add_channel(good, name, "cdr", &metadata).expect("a channel");
        writer.add_channel(bad, &format!("{name}?"), name, &metadata).expect("a channel");
        let header = Header { stamp_ns: 1, frame_id: name };
        let state = ros2::joint_state(header, &[name, "joint1"], &[0.0, 0.0], &[], &[]);
        let header =
            mcap::records::MessageHeader { channel_id: joints, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, &state).expect("written to memory");
        let attachment = mcap::Attachment {
            log_time: 1,
            create_time: 1,
            name: name.to_owned(),
            media_type: name.to_owned(),
            data: name.as_bytes().into(),
        };
        writer.attach(&attachment).expect("written to memory");
        writer.write_metadata(&mcap::records::Metadata { name: name.to_owned(), metadata }).expect("written");
    }
    writer.finish().expect("finished in memory");
    writer.into_inner().into_inner()
}

/// Every path below a folder.
fn tree(folder: &Path) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).into_iter().flatten().flatten() {
            if entry.file_type().is_ok_and(|t| t.is_dir()) {
                open.push(entry.path());
            }
            found.insert(entry.path());
        }
    }
    found
}

/// Nothing but text and line ends was printed, and no screens full of it.
fn harmless(what: &str, output: &Output) -> String {
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    let control = said.chars().find(|c| c.is_control() && *c != '\n' || *c == '\u{202e}');
    assert_eq!(control, None, "{what}: {said:?}");
    assert!(!said.contains("panicked") && said.len() < 100_000, "{what}: {} bytes", said.len());
    said
}

#[test]
fn names_out_of_recordings_and_boards_stay_names() {
    let sandbox = tempfile::tempdir().expect("temporary folder");
    let work = sandbox.path().join("a/b/work");
    std::fs::create_dir_all(&work).expect("a folder to work in");
    std::fs::write(work.join("normal.mcap"), evil_recording()).expect("writing the recording");
    let board = std::fs::read_to_string(root().join("pipelines/boards/paper.toml")).expect("board");
    let board: String = board
        .lines()
        .map(|line| match line.strip_prefix("name = \"c") {
            Some(rest) => format!("name = \"../../<b>\\u001b[31m{rest}\n"),
            None => format!("{line}\n"),
        })
        .collect();
    std::fs::write(work.join("board.toml"), board).expect("writing the board");
    let shipped = format!("\"{}/boards/paper.toml\"", root().join("pipelines").display());
    let text = quick_pipeline(&work)
        .replace(&shipped, "\"board.toml\"")
        .replace("name = \"paper-normal\"", "name = \"../../\\u001b[31mpipeline<script>\"")
        .replace("[[recordings]]", "[[recordings]]\nname = \"../../\\u001b]0;x\\u0007<b>recording\"");
    assert!(
        text.contains("board.toml") && text.contains("pipeline<script>") && text.contains("<b>recording")
    );
    let pipeline = work.join("pipeline.toml");
    std::fs::write(&pipeline, text).expect("writing the pipeline");

    let before = tree(sandbox.path());
    let out = work.join("out");
    let output = armcal([Path::new("run"), &pipeline, Path::new("--out"), &out]);
    let said = harmless("run", &output);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{said}");
    let after = tree(sandbox.path());
    let made: Vec<&PathBuf> = after.difference(&before).collect();
    assert!(made.iter().all(|p| p.starts_with(&out)), "{made:?}");
    assert!(
        made.iter().filter(|p| p.parent() == Some(&out)).count() + 1 == made.len(),
        "folders in out: {made:?}"
    );
    assert!(!Path::new("/tmp/armcal-escaped").exists());
    let plain = made.iter().filter_map(|p| p.file_name()?.to_str());
    assert!(
        plain.clone().all(|n| n.chars().all(|c| c.is_ascii_alphanumeric() || "-._".contains(c))),
        "{made:?}"
    );

    // What the recording brought along is inside run.mcap, byte for byte, and only there.
    let bytes = std::fs::read(out.join("run.mcap")).expect("run.mcap");
    let summary = mcap::Summary::read(&bytes).expect("sound").expect("with a summary");
    for name in EVIL {
        assert!(summary.attachment_indexes.iter().any(|a| a.name == name), "attachment {name:?}");
        assert!(summary.channels.values().any(|c| c.topic == name), "channel {name:?}");
    }
    for (what, arguments) in [
        ("inspect", vec![Path::new("inspect"), Path::new("normal.mcap")]),
        ("inspect --json", vec![Path::new("inspect"), Path::new("--json"), Path::new("normal.mcap")]),
        ("inspect of a pipeline", vec![Path::new("inspect"), &pipeline]),
        ("diagnose", vec![Path::new("diagnose"), &out]),
        ("compare", vec![Path::new("compare"), &out, &out]),
    ] {
        let paths =
            arguments.iter().map(|a| if a.ends_with("normal.mcap") { work.join(a) } else { a.to_path_buf() });
        let output = armcal(paths.collect::<Vec<_>>());
        match what {
            // A program reads this: whole, and in JSON.
            "inspect --json" => {
                drop(serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON"))
            }
            _ => drop(harmless(what, &output)),
        }
    }
    assert_eq!(tree(sandbox.path()), after, "reading wrote something");
}

#[test]
fn errors_that_list_names_of_a_recording_are_harmless() {
    let sandbox = tempfile::tempdir().expect("temporary folder");
    std::fs::write(sandbox.path().join("normal.mcap"), evil_recording()).expect("writing the recording");
    let text = quick_pipeline(sandbox.path());
    let pipeline = sandbox.path().join("pipeline.toml");
    let out = sandbox.path().join("out");
    // A topic that is missing (all are listed), a joint that is, and a schema that cannot be read.
    let evil = |name: &str| toml_text(name);
    for (from, to) in [
        ("\"/joint_states\"", "\"/no\"".to_owned()),
        ("\"/joint_states\"", evil(EVIL[5])),
        ("\"/joint_states\"", evil(&format!("{}?", EVIL[5]))),
        ("\"/vicon/tip/tip\"", evil(EVIL[6])),
    ] {
        assert!(text.contains(from));
        std::fs::write(&pipeline, text.replace(from, &to)).expect("writing the pipeline");
        let output = armcal([Path::new("run"), &pipeline, Path::new("--out"), &out]);
        let said = harmless(&to, &output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.starts_with("error: ") && !out.exists(), "{said}");
    }
}

/// A TOML string.
fn toml_text(text: &str) -> String {
    let escaped: String = text.chars().map(|c| format!("\\U{:08x}", u32::from(c))).collect();
    format!("\"{escaped}\"")
}
