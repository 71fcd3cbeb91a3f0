use crate::support::world::{World, complaint};
use crate::support::{armcal, paper_pipeline, read_json, root, skip};
use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

/// A folder with a copy of the shipped recordings and pipeline, to be damaged.
struct Bench {
    folder: TempDir,
    pipeline: String,
}

impl Bench {
    fn new() -> Bench {
        let folder = tempfile::tempdir().expect("temporary folder");
        for name in ["normal.mcap", "roll.mcap", "pitch.mcap"] {
            let from = root().join("fixtures/paper").join(name);
            std::fs::copy(&from, folder.path().join(name)).expect("copying a fixture");
        }
        let pipeline = paper_pipeline(folder.path());
        Bench { folder, pipeline }
    }

    /// Changes the pipeline's text; the text to replace must be there.
    fn edit(mut self, from: &str, to: &str) -> Bench {
        assert!(self.pipeline.contains(from), "the pipeline has no {from}");
        self.pipeline = self.pipeline.replace(from, to);
        self
    }

    /// Changes the bytes of a recording.
    fn damage(self, name: &str, change: impl FnOnce(&mut Vec<u8>)) -> Bench {
        let path = self.folder.path().join(name);
        let mut bytes = std::fs::read(&path).expect("recording");
        change(&mut bytes);
        std::fs::write(&path, bytes).expect("damaged recording");
        self
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn run(&self) -> Output {
        let pipeline = self.folder.path().join("pipeline.toml");
        std::fs::write(&pipeline, &self.pipeline).expect("writing the pipeline");
        armcal([Path::new("run"), &pipeline, Path::new("--out"), &self.out()])
    }

    /// Runs, expects a failure, and returns its words; nothing may have been written.
    fn fails(&self) -> String {
        let output = self.run();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(!said.contains("panicked"), "{said}");
        let left = std::fs::read_dir(self.out()).map(|d| d.count()).unwrap_or(0);
        assert_eq!(left, 0, "a failed run left {left} files");
        println!("{said}");
        said
    }
}

#[test]
fn a_recording_that_was_cut_off_gives_what_is_sound_and_exit_3() {
    let bench = Bench::new().damage("roll.mcap", |bytes| bytes.truncate(bytes.len() * 6 / 10));
    let output = bench.run();
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = read_json(&bench.out().join("summary.json"));
    let dwells = |i: usize| summary["recordings"][i]["dwells"].as_u64().expect("dwells");
    assert!(dwells(1) > 0 && dwells(1) < dwells(0), "{} of {} dwells", dwells(1), dwells(0));
    let warnings = summary["recordings"][1]["warnings"].to_string();
    assert!(warnings.contains("cut off") || warnings.contains("truncated"), "{warnings}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("roll"), "the terminal says which recording");
}

#[test]
fn a_flipped_bit_costs_one_chunk_and_is_said() {
    let bench = Bench::new().damage("normal.mcap", |bytes| {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
    });
    let output = bench.run();
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = read_json(&bench.out().join("summary.json"));
    assert!(!summary["recordings"][0]["warnings"].as_array().expect("warnings").is_empty());
    assert!(summary["fit"]["holdout"]["n"].as_u64().is_some_and(|n| n > 0));
}

#[test]
fn garbage_and_emptiness_are_errors_that_name_the_file() {
    let bench = Bench::new().damage("pitch.mcap", |bytes| bytes.clear());
    assert!(bench.fails().contains("pitch.mcap"));
    let bench = Bench::new().damage("pitch.mcap", |bytes| bytes.iter_mut().for_each(|b| *b = 0x55));
    assert!(bench.fails().contains("pitch.mcap"));
}

#[test]
fn a_misspelt_channel_names_the_nearest() {
    let said = Bench::new().edit("\"/joint_states\"", "\"/joint_sates\"").fails();
    assert!(said.contains("/joint_sates") && said.contains("/joint_states"), "{said}");
}

#[test]
fn a_misspelt_joint_names_the_nearest() {
    let said = Bench::new().edit("\"joint2\"", "\"join2\"").fails();
    assert!(said.contains("join2") && said.contains("joint2"), "{said}");
}

#[test]
fn a_misspelt_key_of_the_pipeline_names_itself_and_the_file() {
    let said = Bench::new()
        .edit(
            "pose = \"measured\"                        # Vicon sees markers on the board",
            "poze = \"measured\" #",
        )
        .fails();
    assert!(said.contains("poze") && said.contains("pipeline.toml"), "{said}");
}

#[test]
fn metres_declared_as_millimetres_are_detected() {
    let bench = Bench::new().edit("topic = \"/vicon/tip/tip\"", "topic = \"/vicon/tip/tip\"\nunit = \"mm\"");
    let output = bench.run();
    let said =
        String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert_ne!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("mm") && said.contains("unit"), "{said}");
}

#[test]
fn radians_declared_as_degrees_are_detected() {
    let bench = Bench::new().edit("topic = \"/joint_states\"", "topic = \"/joint_states\"\nunit = \"deg\"");
    let output = bench.run();
    let said =
        String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert_ne!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("deg") && said.contains("unit"), "{said}");
}

#[test]
fn a_board_that_does_not_fit_the_dwells_is_said() {
    let mut bench = Bench::new();
    let board = std::fs::read_to_string(root().join("pipelines/boards/paper.toml")).expect("board");
    // The same board, twice as large.
    let scaled: String = board
        .lines()
        .map(|line| match line.strip_prefix("xyz_mm = [") {
            Some(rest) => {
                let numbers: Vec<String> = rest
                    .split(']')
                    .next()
                    .unwrap_or_default()
                    .split(',')
                    .filter_map(|n| n.trim().parse::<f64>().ok())
                    .map(|n| (2.0 * n).to_string())
                    .collect();
                format!("xyz_mm = [{}]\n", numbers.join(", "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    let path = bench.folder.path().join("twice.toml");
    std::fs::write(&path, scaled).expect("writing the board");
    let shipped = format!("\"{}/boards/paper.toml\"", root().join("pipelines").display());
    bench = bench.edit(&shipped, "\"twice.toml\"");
    let output = bench.run();
    let said =
        String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(matches!(output.status.code(), Some(1 | 3)), "{said}");
    assert!(said.contains("board"), "{said}");
}

#[test]
fn too_few_dwells_for_the_free_parameters_is_said() {
    let bench =
        Bench::new().edit("kind = \"cavity-folds\"", "kind = \"random\"").edit("k = 5", "share = 0.96");
    let output = bench.run();
    let said =
        String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert!(matches!(output.status.code(), Some(1 | 3)), "{said}");
    assert!(said.contains("parameter"), "{said}");
}

#[test]
fn an_output_folder_that_cannot_be_made_is_an_error_that_names_it() {
    let bench = Bench::new();
    std::fs::write(bench.out(), "a file where the folder should be").expect("blocking file");
    let output = bench.run();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(&*bench.out().to_string_lossy()), "{said}");
}

#[test]
fn a_full_disk_leaves_nothing_half_written() {
    // /dev/full accepts the open and refuses the bytes; a folder on it cannot exist, so the disk is a tiny tmpfs where
    // the machine lets tests mount one.
    let bench = Bench::new();
    std::fs::create_dir(bench.out()).expect("output folder");
    let mounted = std::process::Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=64k", "tmpfs"])
        .arg(bench.out())
        .status()
        .is_ok_and(|s| s.success());
    if !mounted {
        skip("this machine lets nobody mount a tmpfs");
        return;
    }
    let output = bench.run();
    let left: Vec<String> = std::fs::read_dir(bench.out())
        .expect("output folder")
        .filter_map(|e| Some(e.ok()?.file_name().to_string_lossy().into_owned()))
        .collect();
    let unmounted = std::process::Command::new("umount").arg(bench.out()).status();
    assert!(unmounted.is_ok_and(|s| s.success()), "unmounting the test's own tmpfs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(!left.iter().any(|name| name == "run.mcap"), "a half-written run.mcap was left among {left:?}");
    assert!(!left.iter().any(|name| name.contains("tmp")), "temporary files were left: {left:?}");
}

/// Something else where a pipeline belongs is named for what it is, and what is wanted is said.
#[test]
fn what_is_no_pipeline_is_named_for_what_it_is() {
    let world = World::new();
    world.write("old.bag", "#ROSBAG V2.0\nxxxxxxxxxxxxxx");
    world.write("new.db3", "SQLite format 3\0xxxxxxxxxxxxx");
    std::fs::create_dir(world.path("plain")).expect("a folder");
    std::fs::write(world.path("odd.toml"), [0xff, 0xfe, b'n', 0]).expect("written");
    for (file, says) in [
        ("normal.mcap", "normal.mcap is a recording (MCAP), where a pipeline belongs"),
        ("normal.mcap", "armcal inspect normal.mcap"),
        ("old.bag", "old.bag is a ROS 1 bag, where a pipeline belongs: name it under [[recordings]]"),
        ("new.db3", "new.db3 is a rosbag2 database, where a pipeline belongs: name it under [[recordings]]"),
        ("plain", "plain is a folder, where a pipeline belongs"),
        ("odd.toml", "reading the pipeline odd.toml: it is not UTF-8 text"),
        ("none.toml", "reading the pipeline none.toml: No such file"),
    ] {
        for arguments in
            [&["run", file][..], &["add", "backlash:1", file], &["check", file], &["export", file]]
        {
            let output = world.armcal(arguments);
            let said = complaint(&output);
            assert!(output.status.code() == Some(1) && said.contains(says), "{arguments:?}: {said}");
        }
    }
    for (arguments, says) in [
        (vec!["simulate", "normal.mcap"], "is a recording (MCAP), where a lab file belongs"),
        (
            vec!["compensate", "result", "normal.mcap"],
            "is a recording (MCAP), where a file of targets belongs",
        ),
    ] {
        let said = complaint(&world.armcal(arguments));
        assert!(said.contains(says), "{said}");
    }
}

/// A name that the command line gets wrong is a mistake of usage (2), told before anything is computed, with the nearest
/// name; the same name in a file is a mistake in that file (1).
#[test]
fn names_that_do_not_exist_are_usage_errors_with_the_nearest_name() {
    let world = World::new();
    for (arguments, says) in [
        (&["effects", "backlas"][..], "did you mean \"backlash\"?"),
        (&["add", "complience:2", "p.toml"], "did you mean \"compliance\"?"),
        (&["add", "backlash:9", "p.toml"], "backlash:9"),
        (&["plan", "p.toml", "--effects", "backlash:1,eccentricty:2"], "did you mean \"eccentricity\"?"),
        (&["plan", "p.toml", "--range", "7=0..1"], "--range 7=0..1"),
        (&["simulate", "--hide", "bcklash"], "did you mean `backlash`?"),
        (&["simulate", "--hide", "nothing", "--size", "larg"], "large"),
        (
            &["extract", "normal.mcap", "--out", "x.mcap", "--topic", "/joint_state"],
            "did you mean \"/joint_states\"?",
        ),
        (&["compensate", "result", "targets.csv", "--as-in", "nomal"], "normal"),
        (&["compensate", "result", "targets.csv", "--frame", "board.nomal"], "normal"),
        (&["map", "--manifest", "manifest.txt", "--pipeline", "p.toml", "--shard", "3/2"], "--shard"),
    ] {
        let output = world.armcal(arguments);
        let said = complaint(&output);
        assert!(output.status.code() == Some(2) && said.contains(says), "{arguments:?}: {said}");
    }
    let text = std::fs::read_to_string(world.path("p.toml")).expect("pipeline");
    world.write("wrong.toml", &format!("{text}\n[[effects]]\nkind = \"backlas\"\ntarget = \"joint1\"\n"));
    let output = world.armcal(["run", "wrong.toml"]);
    assert_eq!(output.status.code(), Some(1), "{}", complaint(&output));
}

/// A recording in which nothing was recorded is no recording to look at.
#[test]
fn inspecting_a_recording_without_a_message_fails_and_says_so() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("zero.mcap"), b"").expect("written");
    let mut empty =
        mcap::Writer::new(std::fs::File::create(path("empty.mcap")).expect("created")).expect("begun");
    empty.add_channel(0, "/joint_states", "cdr", &Default::default()).expect("a channel");
    empty.finish().expect("finished");
    for (name, says) in [("zero.mcap", "the file is empty"), ("empty.mcap", "`empty` holds no message")] {
        let output = armcal([Path::new("inspect"), &path(name)]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(says), "{name}: {said}");
    }
}
