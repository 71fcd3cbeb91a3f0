use crate::support::{armcal, paper_pipeline, python_with, root};
use armcal_recording::output::McapOutput;
use armcal_recording::{EXTRACT_METADATA, Recording};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const TILTS: [&str; 3] = ["normal", "roll", "pitch"];

fn extract(input: &Path, out: &Path, more: &[&str]) -> Output {
    let mut arguments = vec!["extract".as_ref(), input.as_os_str(), "--out".as_ref(), out.as_os_str()];
    arguments.extend(more.iter().map(std::ffi::OsStr::new));
    armcal(arguments)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[output.stdout.as_slice(), &output.stderr].concat()).into_owned()
}

fn open(path: &Path) -> Recording {
    Recording::open(&[PathBuf::from(path)]).expect("an MCAP file")
}

/// Everything there is to a message, and its channel, in file order.
fn messages(
    path: &Path,
    wanted: impl Fn(&str) -> bool + Sync,
) -> Vec<(String, String, u32, u64, u64, Vec<u8>)> {
    let mut all = Vec::new();
    open(path)
        .for_each_raw(&mut |m| {
            if wanted(&m.channel.topic) {
                let channel = format!("{:?}", m.channel);
                all.push((
                    m.channel.topic.clone(),
                    channel,
                    m.sequence,
                    m.log_ns,
                    m.publish_ns,
                    m.data.to_vec(),
                ));
            }
            Ok(())
        })
        .expect("nothing stops the pass");
    all
}

/// A recording of the fixtures with a camera, an attachment and metadata beside what the pipeline reads.
fn thicken(fixture: &str, path: &Path) {
    let mut out = McapOutput::create(path, "ros2").expect("created");
    let camera = out.add_channel("/camera", None, "jpeg", &BTreeMap::new()).expect("a channel");
    out.add_channel("/camera/info", None, "json", &BTreeMap::new()).expect("a channel");
    let (mut count, image) = (0_u64, vec![7; 5000]);
    open(&root().join("fixtures/paper").join(fixture))
        .for_each_raw(&mut |m| {
            let schema = m.channel.schema.as_ref().map(|s| (&*s.name, &*s.encoding, &s.data[..]));
            let encoding = &m.channel.message_encoding;
            let metadata = m.channel.metadata.iter().cloned().collect();
            let id = out.add_channel(&m.channel.topic, schema, encoding, &metadata)?;
            count += 1;
            if count % 50 == 0 {
                out.put(camera, 1, m.log_ns, m.publish_ns, &image)?;
            }
            out.put(id, m.sequence, m.log_ns, m.publish_ns, m.data)
        })
        .expect("copied");
    out.attach("notes.txt", "text/plain", 1, 2, b"gripper removed").expect("attached");
    out.metadata("lab", &BTreeMap::from([("operator".to_owned(), "wl".to_owned())])).expect("written");
    out.finish().expect("finished");
}

#[test]
fn a_thin_recording_gives_the_same_observations() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (thick, thin) = (folder.path().join("thick"), folder.path().join("thin"));
    let pipeline = root().join("pipelines/paper.toml");
    for made in [&thick, &thin] {
        std::fs::create_dir(made).expect("folder");
    }
    for tilt in TILTS {
        let name = format!("{tilt}.mcap");
        thicken(&name, &thick.join(&name));
        let output =
            extract(&thick.join(&name), &thin.join(&name), &["--pipeline", &pipeline.to_string_lossy()]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    }
    let problem = |recordings: &Path| {
        let (pipeline, out) = (recordings.join("pipeline.toml"), recordings.join("problem.json"));
        std::fs::write(&pipeline, paper_pipeline(recordings)).expect("writing the pipeline");
        let output = armcal(["export".as_ref(), pipeline.as_os_str(), "--out".as_ref(), out.as_os_str()]);
        assert!(output.status.success(), "{}", said(&output));
        std::fs::read(out).expect("the problem")
    };
    assert!(problem(&thick) == problem(&thin), "every observation is the same to the last digit");

    let (whole, part) = (thick.join("roll.mcap"), thin.join("roll.mcap"));
    let kept = messages(&part, |_| true);
    assert!(kept == messages(&whole, |topic| !topic.starts_with("/camera")) && kept.len() > 10_000);
    let again = folder.path().join("again.mcap");
    extract(&whole, &again, &["--pipeline", &pipeline.to_string_lossy()]);
    assert!(
        std::fs::read(&again).expect("there") == std::fs::read(&part).expect("there"),
        "not the same bytes"
    );
}

#[test]
fn a_thin_recording_says_where_it_is_from_and_python_reads_it() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (whole, part) = (folder.path().join("whole.mcap"), folder.path().join("part.mcap"));
    thicken("normal.mcap", &whole);
    let output = extract(&whole, &part, &["--topic", "/vicon/*", "--topic", "/camera/info", "--json"]);
    assert!(output.status.success(), "{}", said(&output));
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let recording = open(&part);
    let metadata: BTreeMap<_, _> = recording.metadata().expect("readable").into_iter().collect();
    assert_eq!(metadata["lab"]["operator"], "wl");
    let about = &metadata[EXTRACT_METADATA];
    assert_eq!(about["source0.name"], "whole.mcap");
    assert_eq!(about["source0.identity"], open(&whole).report().files[0].identity);
    let topics: Vec<&str> =
        recording.report().channels.iter().map(|channel| channel.topic.as_str()).collect();
    assert_eq!(topics, ["/camera/info", "/vicon/base/base", "/vicon/table/table", "/vicon/tip/tip"]);
    for topic in topics {
        assert!(about.values().any(|value| value == topic), "{topic} in {about:?}");
    }
    let attached = |path: &Path| {
        let mut names = Vec::new();
        let pass = open(path).for_each_attachment(&mut |a| {
            names.push(a.name.to_owned());
            Ok(())
        });
        pass.expect("nothing stops the pass");
        names
    };
    assert!(attached(&part).is_empty());
    let with = folder.path().join("with.mcap");
    assert!(extract(&whole, &with, &["--topic", "*", "--attachments"]).status.success());
    assert_eq!(attached(&with), ["notes.txt"]);
    assert!(messages(&with, |_| true) == messages(&whole, |_| true));

    let Some(python) = python_with("mcap.reader, mcap_ros2.decoder, mcap_protobuf.decoder") else { return };
    let script = root().join("tests/python/decode_output.py");
    let output = Command::new(python).args([&script, &part]).output().expect("starting python");
    let decoded: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", said(&output)));
    for topic in told["topics"].as_array().expect("topics") {
        let name = topic["topic"].as_str().expect("a name");
        let counted = decoded["counts"].get(name).and_then(Value::as_u64).unwrap_or(0);
        assert_eq!(Some(counted), topic["messages"].as_u64(), "{name}");
    }
    assert_eq!(decoded["metadata"], serde_json::json!([EXTRACT_METADATA, "lab"]));
}

#[test]
fn damage_costs_what_it_hit_and_mistakes_cost_nothing() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (damaged, part) = (folder.path().join("damaged.mcap"), folder.path().join("part.mcap"));
    let mut bytes = std::fs::read(root().join("fixtures/paper/normal.mcap")).expect("fixture");
    let chunks = mcap::Summary::read(&bytes).expect("readable").expect("a summary").chunk_indexes;
    let hit = &chunks[chunks.len() / 2];
    bytes[(hit.chunk_start_offset + hit.chunk_length / 2) as usize] ^= 1;
    std::fs::write(&damaged, &bytes).expect("written");
    let output = extract(&damaged, &part, &["--topic", "/joint_states"]);
    assert_eq!(output.status.code(), Some(3), "{}", said(&output));
    assert!(said(&output).contains("chunk dropped"), "{}", said(&output));
    let (kept, all) = (messages(&part, |_| true).len(), messages(&damaged, |t| t == "/joint_states").len());
    assert!(kept == all && kept > 0);

    let before = std::fs::read(&part).expect("there");
    let refused = extract(&damaged, &part, &["--topic", "/joint_state"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("did you mean \"/joint_states\"?"), "{}", said(&refused));
    let refused = extract(&damaged, &damaged, &["--topic", "/joint_states"]);
    assert!(
        refused.status.code() == Some(1) && said(&refused).contains("is an input of this command"),
        "{}",
        said(&refused)
    );
    assert_eq!(extract(&damaged, &part, &[]).status.code(), Some(2), "nothing is asked for");
    assert!(
        std::fs::read(&part).expect("there") == before && std::fs::read(&damaged).expect("there") == bytes
    );
}
