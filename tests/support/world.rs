//! One small folder with an input of every kind, and every way in which a command writes a file there.

use super::{quick_pipeline, root};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// Files of a folder by their paths in it, as they were.
pub type Files = BTreeMap<PathBuf, Vec<u8>>;

/// What an option takes as the place of results.
pub enum Place {
    /// A file.
    File,
    /// A folder, and the files that the command writes into it.
    Folder(Vec<String>),
}

/// One output of one command.
pub struct Case {
    /// The subcommand, and how clap calls the argument.
    pub name: [&'static str; 2],
    /// Option before the output; empty where it is positional.
    pub option: &'static str,
    /// Everything else that is typed.
    pub arguments: Vec<&'static str>,
    /// The files that the command reads.
    pub inputs: Vec<&'static str>,
    /// What the output is.
    pub place: Place,
}

/// What `armcal run` reads of the quick pipeline.
const OF_PIPELINE: [&str; 4] = ["p.toml", "normal.mcap", "board.toml", "arm.toml"];
/// What `armcal run` writes.
pub const RUN: [&str; 13] = [
    "run.mcap",
    "report.html",
    "summary.json",
    "parameters.toml",
    "calibrated.toml",
    "model.json",
    "observations.json",
    "foxglove-layout.json",
    "foxglove-layout-legacy.json",
    "dwells.parquet",
    "observations.parquet",
    "parameters.parquet",
    "view.toml",
];
const POOL: [&str; 13] = [
    "run.mcap",
    "report.html",
    "summary.json",
    "pool.json",
    "parameters.toml",
    "calibrated.toml",
    "model.json",
    "foxglove-layout.json",
    "foxglove-layout-legacy.json",
    "dwells.parquet",
    "observations.parquet",
    "parameters.parquet",
    "view.toml",
];
const CAMPAIGN: [&str; 3] = ["campaign.html", "campaign.json", "campaign.parquet"];

/// The folder.
pub struct World {
    folder: TempDir,
}

impl World {
    /// A pipeline with what it names, results of it, a campaign, a rig, targets.
    pub fn new() -> World {
        let world = World { folder: tempfile::tempdir().expect("temporary folder") };
        let copy = |from: &str, to: &str| {
            std::fs::copy(root().join(from), world.path(to)).expect("copying a file of the repository");
        };
        copy("fixtures/paper/normal.mcap", "normal.mcap");
        copy("fixtures/two-arms/closed.mcap", "closed.mcap");
        copy("pipelines/boards/paper.toml", "board.toml");
        for arm in ["right_arm", "left_arm"] {
            copy(&format!("pipelines/models/{arm}.toml"), &format!("{arm}.toml"));
        }
        copy("pipelines/models/right_arm.toml", "arm.toml");
        let shipped = |name: &str| {
            let text = std::fs::read_to_string(root().join("pipelines").join(name)).expect("a shipped file");
            text.replace("../fixtures/two-arms/", "").replace("models/", "")
        };
        let pipelines = format!("{}/pipelines", root().display());
        let pipeline = quick_pipeline(Path::new("."))
            .replace(&format!("{pipelines}/boards/paper.toml"), "board.toml")
            .replace(&format!("{pipelines}/models/right_arm.toml"), "arm.toml");
        world.write("p.toml", &pipeline);
        let rolled =
            format!("\"{}/fixtures/paper/roll.mcap\"]\ntilt = {{ roll_deg = 11.7 }}", root().display());
        world.write("other.toml", &pipeline.replace("\"./normal.mcap\"]", &rolled));
        world.write("check.toml", &format!("{pipeline}\n[check]\nmin_dwells = 3\n"));
        world.write("two.toml", &shipped("two-arms.toml"));
        let lab = shipped("lab/paper-small.toml").replace("../boards/paper.toml", "board.toml");
        world.write("lab.toml", &lab);
        world.write("manifest.txt", "normal.mcap\n");
        world.write("targets.csv", "x_m,y_m,z_m\n1.56,-0.19,0.95\n");
        std::fs::create_dir(world.path("here")).expect("a folder");
        world.done(&["run", "p.toml", "--out", "result"]);
        world.done(&["map", "--manifest", "manifest.txt", "--shard", "1/1", "--pipeline", "p.toml"]);
        world
    }

    /// A path of the folder.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a text.
    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    /// `armcal` in the folder.
    pub fn command<S: AsRef<std::ffi::OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
        command.current_dir(self.folder.path()).args(arguments);
        command
    }

    /// Runs `armcal` in the folder.
    pub fn armcal<S: AsRef<std::ffi::OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Output {
        self.command(arguments).output().expect("starting armcal")
    }

    /// The same; panics unless it succeeds.
    pub fn done(&self, arguments: &[&str]) {
        let output = self.armcal(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(matches!(output.status.code(), Some(0 | 3)), "{arguments:?}: {said}");
    }

    /// The same, which must end by itself: what waits for somebody else is ended and named.
    pub fn ends<S: AsRef<std::ffi::OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Output {
        let mut command = Command::new("timeout");
        command.args(["--signal=KILL", "120"]).arg(env!("CARGO_BIN_EXE_armcal")).args(arguments);
        let output = command.current_dir(self.folder.path()).output().expect("starting armcal");
        assert!(output.status.code().is_some_and(|code| code != 137), "it waits: {command:?}");
        output
    }

    /// Runs a case with this output.
    pub fn attempt(&self, case: &Case, output: &Path) -> Output {
        let mut arguments: Vec<&std::ffi::OsStr> = case.arguments.iter().map(std::ffi::OsStr::new).collect();
        if !case.option.is_empty() {
            arguments.push(case.option.as_ref());
        }
        arguments.push(output.as_os_str());
        self.armcal(arguments)
    }

    /// All files, links as what they point to.
    pub fn files(&self) -> Files {
        let mut files = Files::new();
        let mut folders = vec![self.folder.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
                let kind = entry.file_type().expect("a kind");
                if kind.is_dir() {
                    folders.push(entry.path());
                    continue;
                }
                let content = match std::fs::read_link(entry.path()) {
                    Ok(target) => target.into_os_string().into_encoded_bytes(),
                    Err(_) => std::fs::read(entry.path()).expect("readable"),
                };
                files.insert(entry.path(), content);
            }
        }
        files
    }
}

/// Every output of every command.
pub fn cases() -> Vec<Case> {
    let folder = |names: &[&str]| Place::Folder(names.iter().map(|name| (*name).to_owned()).collect());
    let with = |more: &[&'static str]| [more, &OF_PIPELINE[..]].concat();
    let check = ["check.toml", "normal.mcap", "board.toml", "arm.toml"];
    let of = |name, option, arguments: &[&'static str], inputs: Vec<&'static str>, place| Case {
        name,
        option,
        arguments: arguments.to_vec(),
        inputs,
        place,
    };
    let results = ["result/model.json", "targets.csv"];
    let two = vec!["two.toml", "closed.mcap", "right_arm.toml", "left_arm.toml"];
    let of_two = [
        "run.mcap",
        "summary.json",
        "parameters.toml",
        "foxglove-layout.json",
        "foxglove-layout-legacy.json",
        "right.toml",
        "left.toml",
    ];
    let simulated = ["normal.mcap", "roll.mcap", "pitch.mcap", "truth.json"];
    let hidden = ["pipeline.toml", "arm.toml", "board.toml"];
    let map = ["map", "--shard", "1/1", "--manifest", "manifest.txt", "--pipeline", "p.toml"];
    let compensate = ["compensate", "result", "targets.csv"];
    let init = ["init", "normal.mcap", "--dh", "arm.toml", "--board", "board.toml", "--force"];
    let thin = ["extract", "normal.mcap", "--pipeline", "p.toml"];
    vec![
        of(["run", "out"], "--out", &["run", "p.toml"], with(&[]), folder(&RUN)),
        of(["run", "out"], "--out", &["run", "two.toml"], two, folder(&of_two)),
        of(["add", "write"], "--write", &["add", "backlash:1", "p.toml"], with(&[]), Place::File),
        of(["add", "out"], "--out", &["add", "backlash:1", "p.toml"], with(&[]), folder(&RUN)),
        of(["check", "junit"], "--junit", &["check", "check.toml"], check.to_vec(), Place::File),
        of(["check", "markdown"], "--markdown", &["check", "check.toml"], check.to_vec(), Place::File),
        of(["check", "out"], "--out", &["check", "check.toml"], check.to_vec(), folder(&RUN)),
        of(
            ["pool", "out"],
            "--out",
            &["pool", "p.toml", "result"],
            vec!["p.toml", "board.toml", "arm.toml", "result/observations.json"],
            folder(&POOL),
        ),
        of(
            ["batch", "out"],
            "--out",
            &["batch", "normal.mcap", "--pipeline", "p.toml"],
            with(&[]),
            folder(&CAMPAIGN),
        ),
        of(["map", "out"], "--out", &map, with(&["manifest.txt"]), folder(&["shards/1-of-1.json"])),
        of(["reduce", "out"], "", &["reduce"], vec!["campaign/shards/1-of-1.json"], folder(&CAMPAIGN)),
        of(
            ["compare", "html"],
            "--html",
            &["compare", "result", "result/run.mcap"],
            vec!["result/run.mcap"],
            Place::File,
        ),
        of(
            ["verify", "out"],
            "--out",
            &["verify", "result", "p.toml"],
            with(&["result/model.json"]),
            folder(&["verification.html", "verification.json", "paths.parquet"]),
        ),
        of(["compensate", "out"], "--out", &compensate, results.to_vec(), Place::File),
        of(["compensate", "mcap"], "--mcap", &compensate, results.to_vec(), Place::File),
        of(
            ["write", "out"],
            "--out",
            &["write", "result", "--as", "joint-zeros"],
            vec!["result/model.json", "result/observations.json"],
            Place::File,
        ),
        of(
            ["simulate", "out"],
            "--out",
            &["simulate", "lab.toml"],
            vec!["lab.toml", "board.toml"],
            folder(&simulated),
        ),
        of(["simulate", "out"], "--out", &["simulate", "--hide", "backlash"], vec![], folder(&hidden)),
        of(["init", "out"], "--out", &init, vec!["normal.mcap", "board.toml", "arm.toml"], Place::File),
        of(["extract", "out"], "--out", &thin, vec!["normal.mcap", "p.toml"], Place::File),
        of(["man", "folder"], "", &["man"], vec![], folder(&["armcal.1", "armcal-run.1"])),
        of(["export", "out"], "--out", &["export", "p.toml"], with(&[]), Place::File),
    ]
}

/// What a command takes a file for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Read {
    /// A text or a result: read whole, up to a limit.
    Whole,
    /// A recording: read in part, of any size.
    Recording,
}

/// One input of one command.
pub struct Reads {
    /// The subcommand, and how clap calls the argument.
    pub name: [&'static str; 2],
    /// All that is typed; [`INPUT`] stands for the input.
    pub arguments: Vec<&'static str>,
    /// How the input's name ends.
    pub ending: &'static str,
    pub read: Read,
    /// Whether clap knows it for a path; patterns and other words are texts to it.
    pub typed: bool,
}

/// Stands for an input in [`Reads::arguments`].
pub const INPUT: &str = "INPUT";

/// Every input of every command.
pub fn reads() -> Vec<Reads> {
    let of = |name: [&'static str; 2], arguments: &[&'static str], ending, read| {
        let arguments = [&name[..1], arguments].concat();
        let typed = !matches!(name, ["batch" | "init", "inputs"]);
        Reads { name, arguments, ending, read, typed }
    };
    let whole = |name, arguments: &[&'static str], ending| of(name, arguments, ending, Read::Whole);
    let recording = |name, arguments: &[&'static str]| of(name, arguments, "mcap", Read::Recording);
    let init = |name, option, ending| {
        whole(name, &["normal.mcap", "--dh", "arm.toml", "--out", "new.toml", option, INPUT], ending)
    };
    let map = ["--shard", "1/1", "--pipeline"];
    vec![
        whole(["run", "pipeline"], &[INPUT], "toml"),
        recording(["inspect", "inputs"], &[INPUT]),
        whole(["inspect", "inputs"], &[INPUT], "toml"),
        whole(["diagnose", "input"], &[INPUT], "toml"),
        recording(["diagnose", "input"], &[INPUT]),
        whole(["add", "pipeline"], &["backlash:1", INPUT], "toml"),
        whole(["plan", "pipeline"], &[INPUT], "toml"),
        whole(["pool", "pipeline"], &[INPUT, "result"], "toml"),
        whole(["pool", "results"], &["p.toml", INPUT], "json"),
        whole(["check", "pipeline"], &[INPUT], "toml"),
        whole(["batch", "pipeline"], &["normal.mcap", "--pipeline", INPUT], "toml"),
        recording(["batch", "inputs"], &[INPUT, "--pipeline", "p.toml"]),
        whole(["map", "manifest"], &[&map[..], &["p.toml", "--manifest", INPUT]].concat(), "txt"),
        whole(["map", "pipeline"], &[&map[..], &[INPUT, "--manifest", "manifest.txt"]].concat(), "toml"),
        recording(["compare", "before"], &[INPUT, "result"]),
        recording(["compare", "after"], &["result", INPUT]),
        whole(["verify", "result"], &[INPUT, "p.toml"], "json"),
        whole(["verify", "pipeline"], &["result", INPUT], "toml"),
        whole(["transfer", "from"], &[INPUT, "other.toml"], "toml"),
        whole(["transfer", "to"], &["p.toml", INPUT], "toml"),
        whole(["compensate", "result"], &[INPUT, "targets.csv"], "json"),
        whole(["compensate", "targets"], &["result", INPUT], "csv"),
        whole(["compensate", "targets"], &["result", INPUT], "toml"),
        whole(["view", "input"], &[INPUT], "toml"),
        whole(["simulate", "lab"], &[INPUT], "toml"),
        recording(["init", "inputs"], &[INPUT, "--dh", "arm.toml"]),
        init(["init", "points"], "--points", "csv"),
        init(["init", "board"], "--board", "toml"),
        whole(["init", "dh"], &["normal.mcap", "--out", "new.toml", "--dh", INPUT], "toml"),
        whole(["init", "urdf"], &["normal.mcap", "--out", "new.toml", "--urdf", INPUT], "urdf"),
        recording(["extract", "inputs"], &[INPUT, "--topic", "*", "--out", "thin.mcap"]),
        whole(["extract", "pipeline"], &["normal.mcap", "--out", "thin.mcap", "--pipeline", INPUT], "toml"),
        whole(["export", "pipeline"], &[INPUT], "toml"),
        whole(["write", "result"], &[INPUT, "--as", "joint-zeros"], "json"),
        recording(["write", "result"], &[INPUT, "--as", "joint-zeros"]),
        whole(["write", "hash_from"], &["result", "--as", "ur-yaml", "--hash-from", INPUT], "yaml"),
    ]
}

/// Arguments with which every command prints something, in a [`World`].
pub fn printing() -> Vec<Vec<&'static str>> {
    vec![
        vec!["--help"],
        vec!["--version"],
        vec!["run", "p.toml"],
        vec!["run", "p.toml", "--json"],
        vec!["init", "normal.mcap", "--dh", "arm.toml", "--out", "proposed.toml"],
        vec!["inspect", "normal.mcap"],
        vec!["diagnose", "result"],
        vec!["add", "backlash:1", "p.toml", "--write", "more.toml"],
        vec!["plan", "p.toml", "--effects", "backlash:1", "--dwells", "1"],
        vec!["pool", "p.toml", "result"],
        vec!["effects"],
        vec!["check", "check.toml"],
        vec!["batch", "normal.mcap", "--pipeline", "p.toml"],
        vec!["map", "--shard", "1/1", "--manifest", "manifest.txt", "--pipeline", "p.toml"],
        vec!["reduce"],
        vec!["compare", "result", "result"],
        vec!["verify", "result", "p.toml"],
        vec!["transfer", "p.toml", "other.toml"],
        vec!["compensate", "result", "targets.csv"],
        vec!["write", "result", "--as", "sdf"],
        vec!["view", "p.toml"],
        vec!["simulate", "--hide", "nothing"],
        vec!["extract", "normal.mcap", "--topic", "*", "--out", "thin.mcap"],
        vec!["export", "p.toml"],
        vec!["completions", "bash"],
        vec!["man", "pages"],
        vec!["help"],
    ]
}

/// What a program said on stderr.
pub fn complaint(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
