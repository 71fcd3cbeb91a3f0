use crate::support::{armcal, in_one_line, number, quick_pipeline, read_json, root, run_pipeline, shipped};
use armcal_recording::Recording;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A message: topic, sequence, log and publish time, data.
type Message = (String, u32, u64, u64, Vec<u8>);

/// Writes part of a recording (shares of its time) as another program would: topic after topic, in small chunks.
fn rewritten(source: &Path, part: Range<f64>, path: &Path, compression: Option<Compression>) -> PathBuf {
    let recording = Recording::open(&[source.to_owned()]).expect("a recording");
    let mut messages: Vec<Message> = Vec::new();
    let mut channels = BTreeMap::new();
    recording
        .for_each_raw(&mut |m| {
            channels.entry(m.channel.topic.clone()).or_insert_with(|| m.channel.clone());
            messages.push((m.channel.topic.clone(), m.sequence, m.log_ns, m.publish_ns, m.data.to_vec()));
            Ok(())
        })
        .expect("read");
    let times = messages.iter().map(|m| m.2);
    let (first, last) = (times.clone().min().expect("messages"), times.max().expect("messages"));
    let share = |log_ns: u64| (log_ns - first) as f64 / (last - first) as f64;
    messages.retain(|m| part.contains(&share(m.2)));
    messages.sort_by(|a, b| (&a.0, a.2).cmp(&(&b.0, b.2)));

    let options = WriteOptions::new().compression(compression).chunk_size(Some(3000));
    let mut writer = options.create(std::fs::File::create(path).expect("a file")).expect("a writer");
    let mut ids = BTreeMap::new();
    for (topic, channel) in &channels {
        let schema = channel.schema.as_ref().expect("a schema");
        let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).expect("a schema");
        let encoding = &channel.message_encoding;
        let metadata = channel.metadata.iter().cloned().collect();
        ids.insert(topic, writer.add_channel(schema, topic, encoding, &metadata).expect("a channel"));
    }
    for (topic, sequence, log_time, publish_time, data) in &messages {
        let (log_time, publish_time) = (*log_time, *publish_time);
        let header = MessageHeader { channel_id: ids[topic], sequence: *sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, data).expect("written");
    }
    writer.finish().expect("finished");
    path.to_owned()
}

fn fixture(name: &str) -> PathBuf {
    root().join("fixtures/paper").join(format!("{name}.mcap"))
}

/// The paper's pipeline without its diagnosis on these recordings.
fn pipeline(folder: &Path, name: &str, recordings: &[&Path]) -> PathBuf {
    let text = quick_pipeline(Path::new("/nowhere"));
    let streams = text.find("[streams.joints]").expect("its streams");
    let entry = |path: &&Path| format!("[[recordings]]\npaths = [\"{}\"]\n", path.display());
    let entries: String = recordings.iter().map(entry).collect();
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, format!("name = \"{name}\"\n{entries}{}", &text[streams..])).expect("pipeline");
    path
}

fn said(output: &Output) -> String {
    let all = [output.stdout.as_slice(), &output.stderr].concat();
    in_one_line(&String::from_utf8_lossy(&all))
}

#[test]
fn a_recording_listed_twice_in_any_shape_is_refused_wherever_recordings_are_read_together() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let folder = folder.path();
    let (normal, roll) = (fixture("normal"), fixture("roll"));
    let same = folder.join("same.mcap");
    std::fs::copy(&normal, &same).expect("copied");
    let copies = [
        (same, 209.0..210.0),
        (rewritten(&normal, 0.0..2.0, &folder.join("unpacked.mcap"), None), 209.0..210.0),
        (rewritten(&normal, 0.7..2.0, &folder.join("end.mcap"), Some(Compression::Zstd)), 62.0..63.5),
    ];
    for (copy, seconds) in &copies {
        let twice = pipeline(folder, "twice", &[&normal, &roll, copy]);
        let out = folder.join("out");
        let output = armcal([Path::new("run"), &twice, Path::new("--out"), &out]);
        let words = said(&output);
        assert_eq!(output.status.code(), Some(1), "{words}");
        let name = copy.file_stem().expect("a name").to_string_lossy();
        assert!(words.contains(&format!("`normal` and `{name}`")) && words.contains("remove one"), "{words}");
        let (_, after) = words.split_once("same times, ").expect("for how long");
        let overlap_s: f64 = after.split_once(" s").and_then(|(s, _)| s.parse().ok()).expect("seconds");
        assert!(seconds.contains(&overlap_s), "{words}");
        assert!(!out.exists(), "results of evidence that counts twice");
    }
    // The last third of one is the first of another.
    let halves = [0.0..0.6, 0.4..2.0]
        .map(|part| rewritten(&normal, part.clone(), &folder.join(format!("{}.mcap", part.start)), None));
    let overlapping = pipeline(folder, "overlapping", &[&halves[0], &halves[1]]);
    for command in ["run", "diagnose", "plan", "export", "add"] {
        let mut args: Vec<&Path> = vec![Path::new(command)];
        args.extend((command == "add").then_some(Path::new("backlash:1")));
        args.push(&overlapping);
        let out = folder.join("out");
        if ["run", "export", "add"].contains(&command) {
            args.extend([Path::new("--out"), &out]);
        }
        let output = armcal(args);
        assert_eq!(output.status.code(), Some(1), "{command}: {}", said(&output));
        assert!(said(&output).contains("hold the same readings"), "{command}: {}", said(&output));
    }
    // Parts that share nothing are two recordings.
    let ends = [0.0..0.5, 0.5..2.0]
        .map(|part| rewritten(&normal, part.clone(), &folder.join(format!("part{}.mcap", part.start)), None));
    run_pipeline(&pipeline(folder, "ends", &[&ends[0], &ends[1]]), &folder.join("ends"), &[0, 3]);
}

#[test]
fn a_recording_of_two_arms_listed_twice_is_refused() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let text = shipped("two-arms.toml");
    let (_, rest) = text.split_once("paths = [\"").expect("a recording");
    let (source, _) = rest.split_once('"').expect("its path");
    let copy = rewritten(Path::new(source), 0.0..2.0, &folder.path().join("copy.mcap"), None);
    let twice = folder.path().join("twice.toml");
    let entry = format!("[[recordings]]\npaths = [\"{}\"]\n\n[[arms]]", copy.display());
    std::fs::write(&twice, text.replacen("[[arms]]", &entry, 1)).expect("pipeline");
    let output = armcal([Path::new("run"), &twice, Path::new("--out"), &folder.path().join("out")]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("hold the same readings"), "{}", said(&output));
}

/// One recording, a copy of it in another encoding, its first part and its last: each calibrated alone, then used together.
#[test]
fn copies_count_once_in_pool_batch_verify_and_compare() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let folder = folder.path();
    let normal = fixture("normal");
    let parts = [("copy", 0.0..2.0), ("first", 0.0..0.6), ("last", 0.4..2.0), ("roll", 0.0..2.0)];
    let files: Vec<PathBuf> = std::iter::once(normal.clone())
        .chain(parts.into_iter().map(|(name, part)| {
            let source = if name == "roll" { fixture("roll") } else { normal.clone() };
            rewritten(&source, part, &folder.join(format!("{name}.mcap")), Some(Compression::Lz4))
        }))
        .collect();
    let names = ["normal", "copy", "first", "last", "roll"];
    let result = |name: &str| folder.join("results").join(name);
    let alone = |name: &str| folder.join(format!("{name}.toml"));
    for (name, file) in names.iter().zip(&files) {
        run_pipeline(&pipeline(folder, name, &[file]), &result(name), &[0, 3]);
    }

    // Pool: a whole copy changes nothing but a sentence; of two parts the common dwells count once.
    let pool = |of: &[&str]| {
        let out = folder.join(format!("pool-{}", of.join("-")));
        let mut args = vec!["pool".into(), alone("normal").into_os_string()];
        args.extend(of.iter().map(|name| result(name).into_os_string()));
        args.extend(["--out".into(), out.clone().into_os_string()]);
        let output = armcal(args);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{}", said(&output));
        read_json(&out.join("pool.json"))
    };
    let (one, two, halves) = (pool(&["normal"]), pool(&["normal", "copy"]), pool(&["first", "last"]));
    assert_eq!(one["fit"], two["fit"]);
    assert_eq!(two["recordings"].as_array().map(Vec::len), Some(1));
    assert_eq!(two["warnings"][0]["code"], "counted-once");
    assert_eq!(number(&halves, "/fit/train/n"), number(&one, "/fit/train/n"), "{:#}", halves["warnings"]);
    let apart = pool(&["normal", "roll"]);
    assert!(apart["warnings"].as_array().is_some_and(|all| all.iter().all(|w| w["code"] != "counted-once")));

    // Batch: every recording is calibrated, and three of them are no evidence of their own.
    let manifest = folder.join("manifest.toml");
    let entries = files.iter().map(|file| format!("[[recordings]]\npaths = [\"{}\"]\n", file.display()));
    let text = format!("pipeline = \"normal.toml\"\n{}", entries.collect::<String>());
    std::fs::write(&manifest, text).expect("manifest");
    let output = armcal([Path::new("batch"), &manifest, Path::new("--out"), &folder.join("campaign")]);
    let words = said(&output);
    assert!(words.contains("5 of 5 recordings calibrated, 3 of them repetitions that count once"), "{words}");
    let campaign = read_json(&folder.join("campaign/campaign.json"));
    let repeated = campaign["repeated"].as_array().expect("repetitions");
    let rows: Vec<[u64; 2]> =
        repeated.iter().map(|r| ["row", "of"].map(|key| r[key].as_u64().expect("a row"))).collect();
    assert_eq!(rows, [[1, 0], [2, 0], [3, 0]]);

    // Verify: a copy is told to be one, a part in part, another recording not; two new ones that are alike count once.
    let verify = |of: &str, on: &Path, code: i32| {
        let output = armcal([Path::new("verify"), &result(of), on, Path::new("--json")]);
        assert_eq!(output.status.code(), Some(code), "{}", said(&output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
    };
    let seen = verify("normal", &alone("copy"), 3);
    assert_eq!((&seen["told"][0]["recording"], &seen["told"][0]["dwells"]), (&"copy".into(), &61.into()));
    let sentence = seen["conclusion"].as_str().expect("a sentence");
    assert!(sentence.starts_with("The calibration was made from `copy`, so this is no"), "{sentence}");
    let seen = verify("first", &alone("last"), 3);
    let (dwells, all) = (number(&seen, "/told/0/dwells"), number(&seen, "/told/0/all"));
    assert!(dwells > 5.0 && dwells < all, "{dwells} of {all}");
    let seen = verify("roll", &pipeline(folder, "alike", &[&files[0], &files[1], &files[2]]), 0);
    assert_eq!(seen["told"], serde_json::json!([]));
    let sentence = seen["conclusion"].as_str().expect("a sentence");
    assert!(
        sentence.starts_with("No dwell of these recordings was in the calibration: on 61 "),
        "{sentence}"
    );
    let warnings = seen["warnings"].as_array().expect("warnings");
    assert_eq!(warnings.iter().filter(|w| w["code"] == "counted-once").count(), 2, "{warnings:#?}");

    // Compare: the same dwells under another name, and none in common.
    let compared = armcal([Path::new("compare"), &result("normal"), &result("copy"), Path::new("--json")]);
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    assert_eq!((number(&compared, "/all/n"), number(&compared, "/unmatched")), (61.0, 0.0));
    let output = armcal([Path::new("compare"), &result("normal"), &result("roll")]);
    assert_eq!(output.status.code(), Some(1));
    let words = said(&output);
    assert!(
        words.contains("no dwell in common") && words.contains("not made from this recording"),
        "{words}"
    );
    let compared = armcal([Path::new("compare"), &result("first"), &result("last"), Path::new("--json")]);
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    let pairs = number(&compared, "/all/n");
    let alone = |name: &str| number(&read_json(&result(name).join("summary.json")), "/fit/train/n");
    assert_eq!(number(&compared, "/unmatched"), alone("first") + alone("last") - 2.0 * pairs);
    assert!(pairs > 5.0, "{compared:#}");
}
