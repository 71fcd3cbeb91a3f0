use crate::support::{armcal, number, read_json, real_recordings, root, run_pipeline, shipped};
use armcal_lab::config::{LabConfig, RecordingConfig, TableMarkers};
use armcal_lab::sensors::{Log, Payload};
use armcal_lab::{nothing_hidden, record};
use armcal_recording::output::McapOutput;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

const QUICK: &str = "\n[diagnosis]\nenabled = false\n";

/// Proposes a pipeline; panics with its words unless it ends well.
fn proposed(folder: &Path, arguments: &[&Path]) -> PathBuf {
    let pipeline = folder.join("proposed.toml");
    let output = init(&pipeline, arguments);
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    pipeline
}

fn init(pipeline: &Path, arguments: &[&Path]) -> Output {
    let all = [&[Path::new("init")], arguments, &[Path::new("--out"), pipeline]].concat();
    armcal(all)
}

/// Mean error on held-out points [mm], without looking for what is missing.
pub(crate) fn held_out_mm(folder: &Path, name: &str, text: String) -> f64 {
    let pipeline = folder.join(format!("{name}.toml"));
    std::fs::write(&pipeline, text + QUICK).expect("pipeline");
    let summary = run_pipeline(&pipeline, &folder.join(name), &[0, 3]);
    number(&summary, "/fit/holdout/fitted_mm/mean")
}

/// What is shipped, written by hand, beside what is proposed from the same recordings and the model file alone, or with the
/// board that a drawing gives.
#[test]
fn what_is_proposed_errs_no_more_than_what_was_written_by_hand() {
    let real = real_recordings();
    let own = |path: &str| root().join(path);
    let mukca = own("pipelines/boards/mukca.toml");
    type Case<'a> = (&'a str, Vec<PathBuf>, &'a str, PathBuf, Option<PathBuf>);
    let mut cases: Vec<Case<'_>> = vec![
        (
            "paper",
            vec![own("fixtures/paper")],
            "--dh",
            own("pipelines/models/right_arm.toml"),
            Some(own("pipelines/boards/paper.toml")),
        ),
        (
            "mukca-panda4",
            vec![own("fixtures/mukca-panda4")],
            "--urdf",
            own("fixtures/mukca-panda4/panda.urdf"),
            None,
        ),
        (
            "mukca-panda4",
            vec![own("fixtures/mukca-panda4")],
            "--urdf",
            own("fixtures/mukca-panda4/panda.urdf"),
            Some(mukca.clone()),
        ),
    ];
    if let Some(real) = &real {
        for (set, urdf) in [("panda", "panda"), ("iiwa14", "iiwa14"), ("gen3lite", "gen3lite")] {
            let folder = real.join(format!("mukca_{set}"));
            let urdf = folder.join(format!("{urdf}.urdf"));
            let name: &str = match set {
                "panda" => "mukca-panda",
                "iiwa14" => "mukca-iiwa14",
                _ => "mukca-gen3lite",
            };
            cases.push((name, vec![folder.clone()], "--urdf", urdf.clone(), None));
            cases.push((name, vec![folder], "--urdf", urdf, Some(mukca.clone())));
        }
        for (name, set) in [("ur10-tracker", "ur10_tracker"), ("ur10-tracker-a", "ur10_tracker_a")] {
            cases.push((name, vec![real.join(set)], "--dh", own("pipelines/models/ur10.toml"), None));
        }
    }
    println!("pipeline, board given, by hand [mm], proposed [mm]");
    let (mut worse, mut by_hand) = (Vec::new(), BTreeMap::new());
    for (name, recordings, kind, model, board) in cases {
        let folder = tempfile::tempdir().expect("temporary folder");
        let hand = || held_out_mm(folder.path(), "hand", shipped(&format!("{name}.toml")));
        let by_hand_mm = *by_hand.entry(name).or_insert_with(hand);
        let mut arguments: Vec<&Path> = recordings.iter().map(PathBuf::as_path).collect();
        arguments.extend([Path::new(kind), &model]);
        if let Some(board) = &board {
            arguments.extend([Path::new("--board"), board]);
        }
        let text = std::fs::read_to_string(proposed(folder.path(), &arguments)).expect("a proposal");
        let proposed_mm = held_out_mm(folder.path(), "own", text);
        println!("{name}, {}, {by_hand_mm:.3}, {proposed_mm:.3}", if board.is_some() { "yes" } else { "no" });
        if proposed_mm > 1.05 * by_hand_mm {
            worse.push((name, by_hand_mm, proposed_mm));
        }
    }
    assert!(worse.is_empty(), "{worse:?}");
}

/// The messages of a recording dealt out to parts, with a latched description of the robot in the first.
fn split(recording: &Path, urdf: &str, parts: &[PathBuf]) {
    let bytes = std::fs::read(recording).expect("recording");
    let messages = mcap::MessageStream::new(&bytes).expect("MCAP").map(|m| m.expect("a message"));
    let messages: Vec<mcap::Message<'_>> = messages.collect();
    let size = messages.len().div_ceil(parts.len());
    let nothing = BTreeMap::new();
    for (at, (part, own)) in parts.iter().zip(messages.chunks(size)).enumerate() {
        let mut out = McapOutput::create(part, "ros2").expect("a part");
        if at == 0 {
            let schema = Some(("std_msgs/msg/String", "ros2msg", b"string data\n".as_slice()));
            let id = out.add_channel("/robot_description", schema, "cdr", &nothing).expect("a channel");
            let length = u32::try_from(urdf.len() + 1).expect("length").to_le_bytes();
            let data = [&[0, 1, 0, 0][..], &length, urdf.as_bytes(), &[0]].concat();
            out.put(id, 0, own[0].log_time, own[0].publish_time, &data).expect("written");
        }
        for message in own {
            let schema = message.channel.schema.as_ref().expect("a schema");
            let schema = Some((schema.name.as_str(), schema.encoding.as_str(), &*schema.data));
            let id = out.add_channel(&message.channel.topic, schema, "cdr", &nothing).expect("a channel");
            out.put(id, message.sequence, message.log_time, message.publish_time, &message.data)
                .expect("written");
        }
        out.finish().expect("finished");
    }
}

/// A folder with metadata.yaml, and parts that only their names and times join: one recording each, and the arm is the one that
/// the first part describes.
#[test]
fn a_split_bag_is_one_recording_and_describes_its_robot() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let fixture = root().join("fixtures/mukca-panda4");
    let urdf = std::fs::read_to_string(fixture.join("panda.urdf")).expect("URDF");
    let bag = folder.path().join("front");
    std::fs::create_dir(&bag).expect("a folder");
    split(
        &fixture.join("front.mcap"),
        &urdf,
        &["front_0", "front_1", "front_2"].map(|p| bag.join(format!("{p}.mcap"))),
    );
    std::fs::write(bag.join("metadata.yaml"), "rosbag2_bagfile_information: {}\n").expect("metadata");
    let [first, second] = ["right_0", "right_1"].map(|p| folder.path().join(format!("{p}.mcap")));
    split(&fixture.join("right.mcap"), &urdf, &[first.clone(), second.clone()]);
    let other = fixture.join("very-front.mcap");
    // Described in every recording but one: it is the robot of all.
    let pipeline = proposed(folder.path(), &[&bag, &first, &second, &other]);
    let text = std::fs::read_to_string(&pipeline).expect("proposal");
    assert_eq!(text.matches("\n[[recordings]]\n").count(), 3, "{text}");
    assert!(text.contains("front_0.mcap\", \"front/front_1.mcap\", \"front/front_2.mcap\"]"), "{text}");
    assert!(text.contains("[\"right_0.mcap\", \"right_1.mcap\"]"), "{text}");
    assert!(text.contains("urdf = \"proposed.urdf\""), "{text}");
    assert_eq!(std::fs::read_to_string(folder.path().join("proposed.urdf")).expect("URDF"), urdf);
    let again = init(&pipeline, &[&bag, &first, &second, &other, Path::new("--force")]);
    let said = String::from_utf8_lossy(&again.stdout).into_owned();
    assert!(said.contains("proposed.urdf") && !said.contains("Not used"), "{said}");
    let whole_mm = held_out_mm(folder.path(), "whole", shipped("mukca-panda4.toml"));
    let split_mm = held_out_mm(folder.path(), "split", text);
    println!("whole {whole_mm:.3}, split {split_mm:.3} mm");
    assert!(split_mm < 1.05 * whole_mm);
}

#[test]
fn nothing_is_written_over_but_an_earlier_proposal_and_only_when_asked() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let fixture = root().join("fixtures/mukca-panda4");
    let urdf = fixture.join("panda.urdf");
    let arguments = [fixture.as_path(), Path::new("--urdf"), &urdf];
    let pipeline = proposed(folder.path(), &arguments);
    let sockets = folder.path().join("proposed-sockets.toml");
    let before = [&pipeline, &sockets].map(|p| std::fs::read_to_string(p).expect("proposal"));
    let refused = |output: Output, word: &str| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(word), "{said}");
    };
    refused(init(&pipeline, &arguments), "--force");
    let forced = [&arguments[..], &[Path::new("--force")]].concat();
    std::fs::write(&pipeline, before[0].replace("# armcal.pipeline/1", "# armcal.pipeline/1 changed"))
        .expect("changed");
    assert!(init(&pipeline, &forced).status.success());
    // The same recordings give the same bytes.
    assert_eq!([&pipeline, &sockets].map(|p| std::fs::read_to_string(p).expect("proposal")), before);
    let own = "name = \"mine\"\n";
    std::fs::write(&pipeline, own).expect("own pipeline");
    refused(init(&pipeline, &forced), "was not made by armcal");
    assert_eq!(std::fs::read_to_string(&pipeline).expect("own pipeline"), own);
    std::fs::remove_file(&pipeline).expect("removed");
    std::fs::write(&sockets, own).expect("own board");
    refused(init(&pipeline, &forced), "proposed-sockets.toml");
    assert!(!pipeline.exists() && std::fs::read_to_string(&sockets).expect("own board") == own);
}

#[test]
fn what_cannot_be_proposed_is_refused_in_words_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    };
    let ros1 = file("a.bag", b"#ROSBAG V1.2\n");
    let database = file("b.db3", b"SQLite format 3\0");
    let unnamed = file("f.sqlite", b"SQLite format 3\0");
    let packed = file("c.mcap.zstd", &[0x28, 0xb5, 0x2f, 0xfd, 0, 0]);
    let garbage = file("d.mcap", b"garbage");
    let renamed = file("e.data", b"\x89MCAP0\r\n");
    let [empty, ros2] = ["empty", "ros2"].map(|name| folder.path().join(name));
    std::fs::create_dir(&empty).expect("a folder");
    std::fs::create_dir(&ros2).expect("a folder");
    std::fs::write(ros2.join("x_0.db3"), b"SQLite format 3\0").expect("a file");
    let nowhere = folder.path().join("nowhere.mcap");
    let nothing = file("g.mcap", b"");
    let metadata = file("metadata.yaml", b"rosbag2_bagfile_information: {}\n");
    let no_joints = folder.path().join("no-joints.mcap");
    let normal = root().join("fixtures/paper/normal.mcap");
    let thin = ["--topic", "/vicon/tip/tip", "--out"].map(Path::new);
    let thinned = armcal([&[Path::new("extract"), &normal], &thin[..], &[no_joints.as_path()]].concat());
    assert!(thinned.status.success(), "{}", String::from_utf8_lossy(&thinned.stderr));
    let fixtures = root().join("fixtures");
    let (paper, panda) = (fixtures.join("paper/normal.mcap"), fixtures.join("mukca-panda4/front.mcap"));
    let urdf = fixtures.join("mukca-panda4/panda.urdf");
    let dh = root().join("pipelines/models/right_arm.toml");
    let board = root().join("pipelines/boards/paper.toml");
    let no_xml = file("no.urdf", b"<robot><link");
    let option = Path::new;
    let cases: Vec<(Vec<&Path>, i32, Vec<&str>)> = vec![
        (vec![&ros1], 1, vec!["ROS 1 bag", "rosbag fix"]),
        (vec![&database], 1, vec!["b.db3", "SQLite database that cannot be read"]),
        (vec![&packed], 1, vec!["c.mcap.zstd", "compressed", "cut off"]),
        (vec![&unnamed], 1, vec!["f.sqlite", "database", ".db3: rename"]),
        (vec![&garbage, option("--dh"), &dh], 1, vec!["d.mcap", "no MCAP"]),
        (vec![&renamed], 1, vec!["e.data", "rename"]),
        (vec![&nothing], 1, vec!["g.mcap", "is empty", "nothing was recorded"]),
        (vec![&metadata], 1, vec!["metadata.yaml", "give the folder"]),
        (vec![&urdf], 1, vec!["panda.urdf", "--urdf"]),
        (
            vec![&no_joints, option("--dh"), &dh],
            1,
            vec!["/vicon/tip/tip (a tracked body)", "record the topic"],
        ),
        (vec![&panda, option("--dh"), &urdf], 1, vec!["panda.urdf", "--urdf"]),
        (vec![&panda, option("--urdf"), &dh], 1, vec!["right_arm.toml", "--dh"]),
        (vec![&empty], 1, vec!["empty", "without any recording"]),
        (vec![&ros2], 1, vec!["x_0.db3", "database"]),
        (vec![&nowhere, option("--dh"), &dh], 1, vec!["nowhere.mcap"]),
        (vec![&paper], 1, vec!["--urdf", "--dh", "joint1, joint2, joint3"]),
        (vec![&paper, option("--urdf"), &urdf], 1, vec!["panda_joint1", "joint1, joint2, joint3"]),
        (vec![&panda, option("--dh"), &dh], 1, vec!["joint1, joint2, joint3", "panda_joint7"]),
        (vec![&panda, option("--urdf"), &no_xml], 1, vec!["no.urdf", "XML"]),
        (
            vec![&panda, option("--urdf"), &urdf, option("--tip-link"), option("bal_link")],
            2,
            vec!["bal_link"],
        ),
        (
            vec![&paper, option("--dh"), &dh, option("--joints"), option("/joints")],
            2,
            vec!["/joints", "/joint_states"],
        ),
        (vec![&paper, option("--dh"), &dh, option("--board"), &dh], 1, vec!["right_arm.toml"]),
        (vec![&paper, option("--dh"), &board], 1, vec!["paper.toml"]),
        (vec![&paper, &paper, option("--dh"), option("--urdf")], 2, vec![]),
    ];
    let pipeline = folder.path().join("p.toml");
    for (arguments, code, words) in cases {
        let output = init(&pipeline, &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
        assert!(!said.contains("panicked") && !pipeline.exists(), "{arguments:?}: {said}");
        println!("{}", said.lines().next().unwrap_or_default());
    }
}

/// A simulated session whose messages are changed, and what `armcal init` proposes for it.
pub(crate) fn changed(
    folder: &Path,
    configure: impl Fn(&mut LabConfig),
    change: impl Fn(&mut Log),
) -> String {
    let text = std::fs::read_to_string(root().join("pipelines/lab/paper-small.toml")).expect("lab");
    let mut config = LabConfig::from_toml(&text, Path::new("lab.toml")).expect("lab");
    config.task.passes.truncate(1);
    config.task.passes[0].share = 0.6;
    config.recordings.truncate(1);
    configure(&mut config);
    let (_, mut logs) =
        armcal_lab::simulate_in_memory(&config, &root().join("pipelines/lab"), &nothing_hidden)
            .expect("a session");
    logs.iter_mut().for_each(change);
    let recording = |(at, log): (usize, &Log)| {
        let path = folder.join(format!("r{at}.mcap"));
        record::write(&path, "rig", "r", log).expect("written");
        path
    };
    let recordings: Vec<PathBuf> = logs.iter().enumerate().map(recording).collect();
    let [dh, board] =
        ["models/right_arm.toml", "boards/paper.toml"].map(|p| root().join("pipelines").join(p));
    let mut arguments: Vec<&Path> = recordings.iter().map(PathBuf::as_path).collect();
    arguments.extend([Path::new("--dh"), &dh, Path::new("--board"), &board]);
    let pipeline = proposed(folder, &arguments);
    std::fs::read_to_string(pipeline).expect("a proposal")
}

/// What lies there is not asked for: the one URDF beside the recordings, bags in folders of a folder.
#[test]
fn what_lies_beside_the_recordings_is_found() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let fixture = root().join("fixtures/mukca-panda4");
    let session = folder.path().join("monday");
    for part in ["front", "right", "very-front"] {
        let bag = session.join(part);
        std::fs::create_dir_all(&bag).expect("a folder");
        std::fs::copy(fixture.join(format!("{part}.mcap")), bag.join("bag_0.mcap")).expect("copied");
        std::fs::write(bag.join("metadata.yaml"), "rosbag2_bagfile_information: {}\n").expect("metadata");
    }
    let urdf = fixture.join("panda.urdf");
    let text = std::fs::read_to_string(proposed(folder.path(), &[&session, Path::new("--urdf"), &urdf]))
        .expect("a proposal");
    assert_eq!(text.matches("\n[[recordings]]\n").count(), 3, "{text}");
    let other = tempfile::tempdir().expect("temporary folder");
    let text = std::fs::read_to_string(proposed(other.path(), &[&fixture])).expect("a proposal");
    assert!(text.contains("panda.urdf\" # the only one beside the recordings"), "{text}");
}

/// Each changes nothing but how the same session is recorded: the proposal says so, and errs as the unchanged one.
#[test]
fn units_late_clocks_and_names_are_seen_for_what_they_are() {
    let hostile = |config: &mut LabConfig| {
        config.vicon.tip.subject = "a\"b\n[holdout]\u{1b}[2J".to_owned();
        config.vicon.base.subject = "table".to_owned();
        config.vicon.table.subject = "tip".to_owned();
    };
    let millimetres = |log: &mut Log| {
        for message in &mut log.messages {
            if let Payload::Pose { position_m, .. } = &mut message.payload {
                *position_m *= 1000.0;
            }
        }
    };
    let degrees = |log: &mut Log| {
        for message in &mut log.messages {
            if let Payload::Joints { position, velocity } = &mut message.payload {
                position.iter_mut().chain(velocity).for_each(|x| *x = x.to_degrees());
            }
        }
    };
    let late = |log: &mut Log| {
        for message in &mut log.messages {
            if let Payload::Pose { .. } = message.payload {
                message.stamp_ns += 41_300_000_000;
            }
        }
    };
    let nothing = |_: &mut LabConfig| ();
    type Change<'a> = (&'a dyn Fn(&mut LabConfig), &'a dyn Fn(&mut Log), &'a str);
    let cases: [Change<'_>; 5] = [
        (&nothing, &|_| (), "[streams.tip]"),
        (&hostile, &|_| (), "[streams.tip]"),
        (&nothing, &millimetres, "unit = \"mm\""),
        (&nothing, &degrees, "unit = \"deg\""),
        (&nothing, &late, "initial_offset_s = 41."),
    ];
    let mut plain_mm = f64::NAN;
    for (configure, change, says) in cases {
        let folder = tempfile::tempdir().expect("temporary folder");
        let text = changed(folder.path(), configure, change);
        assert!(text.contains(says), "{says}: {text}");
        let mm = held_out_mm(folder.path(), "own", text);
        println!("{says}: {mm:.3} mm");
        plain_mm = if plain_mm.is_nan() { mm } else { plain_mm };
        assert!(mm < 1.05 * plain_mm, "{says}: {mm} of {plain_mm} mm");
    }
}

/// Markers on the frame below the mechanism do not show the tilt: the pauses of the tip do.
#[test]
fn a_board_that_was_tilted_on_a_frame_that_stands_still_is_seen() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let below = |config: &mut LabConfig| {
        config.vicon.table_markers = TableMarkers::Frame;
        let roll = RecordingConfig { name: "roll".into(), roll_deg: 11.7, pitch_deg: 0.0, load_kg: 0.0 };
        config.recordings.push(roll);
    };
    let text = changed(folder.path(), below, |_| ());
    assert!(text.contains("markers_on = \"frame\""), "{text}");
    let tilt =
        text.split("roll_deg = ").nth(1).and_then(|rest| rest.split([',', ' ']).next()).expect("a tilt");
    let tilt_deg: f64 = tilt.parse().expect("a number");
    let mm = held_out_mm(folder.path(), "own", text);
    println!("tilt {tilt_deg} deg, {mm:.3} mm");
    assert!((tilt_deg - 11.7).abs() < 1.0 && mm < 0.5, "{tilt_deg} deg, {mm} mm");
}

/// For programs: roles, doubts, and what a first calibration came to.
#[test]
fn what_was_seen_is_told_to_programs_too() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let dh = root().join("pipelines/models/right_arm.toml");
    let output = init(
        &folder.path().join("p.toml"),
        &[&root().join("fixtures/paper/normal.mcap"), Path::new("--dh"), &dh, Path::new("--json")],
    );
    let path = folder.path().join("said.json");
    std::fs::write(&path, &output.stdout).expect("JSON");
    let said = read_json(&path);
    let roles: Vec<&str> =
        said["bodies"].as_array().expect("bodies").iter().filter_map(|b| b["role"].as_str()).collect();
    assert_eq!(roles, ["base", "table", "tip"]);
    // Nothing but its place says that the table is one.
    assert_eq!(said["bodies"][1]["sure"], false);
    assert!(
        said["not_visible"].to_string().contains("load_kg")
            && said["not_visible"].to_string().contains("--board")
    );
    assert!(number(&said, "/tried/calibrated_mm") < 0.2 * number(&said, "/tried/nominal_mm"));
}
