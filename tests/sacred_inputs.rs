use crate::support::world::{Case, Files, Place, World, cases, complaint, reads};
use armcal::cli::Cli;
use clap::CommandFactory as _;
use clap::builder::ValueParser;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A new command with an input or an output, or a new option, must be tried: here, and with everything that is no file
/// (`bad_paths`).
#[test]
fn every_path_that_can_be_typed_is_tried_as_input_or_as_output() {
    let written = cases().into_iter().map(|case| case.name);
    let read = reads().into_iter().filter(|read| read.typed).map(|read| read.name);
    let expected: BTreeSet<[String; 2]> = written.chain(read).map(|name| name.map(str::to_owned)).collect();
    let path = ValueParser::path_buf().type_id();
    let mut typed = BTreeSet::new();
    for command in Cli::command().get_subcommands() {
        for arg in command.get_arguments().filter(|arg| arg.get_value_parser().type_id() == path) {
            typed.insert([command.get_name().to_owned(), arg.get_id().to_string()]);
        }
    }
    assert_eq!(typed, expected);
}

/// It ended with exit code 1, and names what it would have written over.
fn refused(output: &Output, names: &str, what: &str) {
    let said = complaint(output);
    assert_eq!(output.status.code(), Some(1), "{what}: {said}");
    assert!(said.starts_with("error: ") && said.contains(names), "{what}, which should name {names}: {said}");
}

/// Nothing that was there has changed; what was not there is removed again.
fn unchanged(world: &World, before: &Files, what: &str) {
    let now = world.files();
    for (path, content) in before {
        assert!(now.get(path) == Some(content), "{what}: {} has changed", path.display());
    }
    for path in now.keys().filter(|path| !before.contains_key(*path)) {
        std::fs::remove_file(path).expect("removed");
    }
}

/// One file by other names: plainly, by a detour, whole, through a link and through a hard link.
fn spellings(world: &World, input: &str) -> Vec<PathBuf> {
    let whole = world.path(input);
    let ext = Path::new(input).extension().and_then(|e| e.to_str()).unwrap_or_default();
    let [link, hard] = ["link", "hard"].map(|name| PathBuf::from(format!("{name}.{ext}")));
    for (name, link_it) in [(&link, true), (&hard, false)] {
        let _ = std::fs::remove_file(world.path(name));
        let made = if link_it {
            std::os::unix::fs::symlink(&whole, world.path(name))
        } else {
            std::fs::hard_link(&whole, world.path(name))
        };
        made.expect("linked");
    }
    vec![input.into(), Path::new("here/..").join(input), whole, link, hard]
}

fn describe(case: &Case, output: &Path) -> String {
    format!("armcal {} {} {}", case.arguments.join(" "), case.option, output.display())
}

#[test]
fn no_command_writes_a_file_over_one_of_its_inputs() {
    let world = World::new();
    let before = world.files();
    for case in cases().iter().filter(|case| matches!(case.place, Place::File)) {
        for input in &case.inputs {
            for output in spellings(&world, input) {
                let what = describe(case, &output);
                let name = Path::new(input).file_name().and_then(|n| n.to_str()).expect("a name");
                let linked = world.files();
                refused(&world.attempt(case, &output), name, &what);
                unchanged(&world, &linked, &what);
            }
        }
    }
    unchanged(&world, &before, "all of it");
}

/// A folder to write into: empty, but for `reduce`, whose inputs are in it.
fn folder_of(world: &World, case: &Case) -> PathBuf {
    let out = world.path("out");
    let _ = std::fs::remove_dir_all(&out);
    std::fs::create_dir(&out).expect("a folder");
    if case.name[0] == "reduce" {
        let copied = std::process::Command::new("cp")
            .args(["-r", "campaign/recordings", "campaign/shards", "out"])
            .current_dir(world.path(""))
            .status();
        assert!(copied.is_ok_and(|status| status.success()));
    }
    out
}

#[test]
fn no_command_writes_into_a_folder_over_one_of_its_inputs() {
    let world = World::new();
    for case in cases() {
        let Place::Folder(names) = &case.place else { continue };
        for input in &case.inputs {
            // The input itself in the place of the folder.
            if case.name[0] != "reduce" {
                let before = world.files();
                let what = describe(&case, Path::new(input));
                refused(&world.attempt(&case, Path::new(input)), input, &what);
                unchanged(&world, &before, &what);
            }
            // The input under the name of each result, by either kind of link; all results with the first input, one with
            // the others.
            let shown = if *input == case.inputs[0] { names.len() } else { 1 };
            for (at, name) in names.iter().enumerate().take(shown) {
                let out = folder_of(&world, &case);
                let input = match case.name[0] {
                    "reduce" => out.join("shards/1-of-1.json"),
                    _ => world.path(input),
                };
                let taken = out.join(name);
                std::fs::create_dir_all(taken.parent().expect("a parent")).expect("a folder");
                let linked = if at % 2 == 0 {
                    std::fs::hard_link(&input, &taken)
                } else {
                    std::os::unix::fs::symlink(&input, &taken)
                };
                linked.expect("linked");
                let before = world.files();
                let what = format!("{} with {name} as a link to {}", describe(&case, &out), input.display());
                refused(&world.attempt(&case, &out), name, &what);
                unchanged(&world, &before, &what);
            }
        }
    }
}

/// What the issue began with: everything in one folder, the recording called `run.mcap`.
#[test]
fn a_pipeline_whose_files_have_the_names_of_results_keeps_them() {
    let world = World::new();
    let text = std::fs::read_to_string(world.path("p.toml")).expect("pipeline");
    for (named, input) in
        [("normal.mcap", "run.mcap"), ("arm.toml", "calibrated.toml"), ("board.toml", "parameters.toml")]
    {
        let rig = world.path("rig");
        let _ = std::fs::remove_dir_all(&rig);
        std::fs::create_dir(&rig).expect("a folder");
        for file in ["normal.mcap", "arm.toml", "board.toml"] {
            let to = if file == named { input } else { file };
            std::fs::copy(world.path(file), rig.join(to)).expect("copied");
        }
        std::fs::write(rig.join("p.toml"), text.replace(named, input)).expect("pipeline");
        let before = world.files();
        for out in [rig.clone(), world.path("here/../rig")] {
            let output = world.command(["run", "p.toml", "--out", "."]).current_dir(&out).output();
            refused(&output.expect("starting armcal"), input, input);
            unchanged(&world, &before, input);
        }
    }
}

#[test]
fn what_armcal_did_not_make_is_not_written_over() {
    let world = World::new();
    let stranger = "{ \"schema\": \"mine/1\", \"days\": 3 }\n# months of work\n";
    let plant = |path: &Path| {
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(path, stranger).expect("written");
    };
    for case in cases() {
        let outputs = match &case.place {
            Place::File => vec![world.path("stranger")],
            Place::Folder(names) => names.iter().map(|name| world.path("out").join(name)).collect(),
        };
        for taken in outputs {
            let out = match case.place {
                Place::File => taken.clone(),
                Place::Folder(_) => folder_of(&world, &case),
            };
            plant(&taken);
            let before = world.files();
            let what = format!("{} with {} in the way", describe(&case, &out), taken.display());
            let name = taken.file_name().and_then(|n| n.to_str()).expect("a name");
            refused(&world.attempt(&case, &out), name, &what);
            unchanged(&world, &before, &what);
        }
    }
    // Beside the pipeline, where `add` writes without being told; and beside the folder of a sealed rig.
    for (taken, arguments) in [
        ("p+backlash-1.toml", vec!["add", "backlash:1", "p.toml"]),
        ("rig-truth.json", vec!["simulate", "--hide", "nothing", "--out", "rig"]),
    ] {
        plant(&world.path(taken));
        let before = world.files();
        refused(&world.armcal(arguments), taken, taken);
        unchanged(&world, &before, taken);
    }
}

/// A result of another kind is somebody's result too.
#[test]
fn a_result_is_replaced_by_its_own_kind_only() {
    let world = World::new();
    world.done(&["extract", "normal.mcap", "--topic", "*", "--out", "thin.mcap"]);
    world.done(&["compensate", "result", "targets.csv", "--mcap", "moves.mcap"]);
    world.done(&["simulate", "lab.toml", "--out", "lab"]);
    std::fs::copy(world.path("thin.mcap"), world.path("lab/roll.mcap")).expect("copied");
    let before = world.files();
    for (taken, arguments) in [
        (
            "thin.mcap",
            vec!["compensate", "result", "targets.csv", "--mcap", "thin.mcap", "--out", "fresh.csv"],
        ),
        ("result/summary.json", vec!["export", "p.toml", "--out", "result/summary.json"]),
        ("result/report.html", vec!["compare", "result", "result", "--html", "result/report.html"]),
        ("result/parameters.toml", vec!["pool", "p.toml", "result", "--out", "result"]),
        ("lab/roll.mcap", vec!["simulate", "lab.toml", "--out", "lab", "--seed", "9"]),
        (
            "result/observations.json",
            vec!["write", "result", "--as", "mjcf", "--out", "result/observations.json"],
        ),
        ("moves.mcap", vec!["extract", "normal.mcap", "--topic", "*", "--out", "moves.mcap"]),
    ] {
        let output = world.armcal(&arguments);
        refused(&output, taken, taken);
        let now = std::fs::read(world.path(taken)).expect("still there");
        assert!(before[&world.path(taken)] == now, "{taken} has changed");
    }
    // Its own kind is.
    for arguments in [
        vec!["extract", "normal.mcap", "--topic", "/joint*", "--out", "thin.mcap"],
        vec!["compensate", "result", "targets.csv", "--mcap", "moves.mcap", "--approach", "3"],
        vec!["compensate", "result", "targets.csv", "--mcap", "moves.mcap"],
        vec!["write", "result", "--as", "dh-csv"],
        vec!["write", "result", "--as", "dh-csv"],
        vec!["run", "p.toml", "--out", "result"],
        vec!["verify", "result", "p.toml", "--out", "result"],
        vec!["verify", "result", "p.toml", "--out", "result"],
        vec!["compare", "result", "result", "--html", "page.html"],
        vec!["compare", "result/run.mcap", "result", "--html", "page.html"],
        vec!["check", "check.toml", "--junit", "j.xml", "--markdown", "m.md"],
        vec!["check", "check.toml", "--junit", "j.xml", "--markdown", "m.md"],
        vec!["export", "p.toml"],
        vec!["export", "p.toml"],
        vec!["reduce"],
        vec!["reduce"],
        vec!["pool", "p.toml", "result"],
        vec!["pool", "p.toml", "result"],
        vec!["run", "two.toml", "--out", "two"],
        vec!["run", "two.toml", "--out", "two"],
        vec!["simulate", "--hide", "nothing", "--out", "sealed"],
        vec!["simulate", "--hide", "nothing", "--out", "sealed", "--seed", "2"],
    ] {
        world.done(&arguments);
    }
    // Nothing is lost with an empty file: CI makes one for the summary of a job.
    world.write("empty.md", "");
    world.done(&["check", "check.toml", "--markdown", "empty.md"]);
    // A link is nothing that armcal makes, even to its own.
    std::os::unix::fs::symlink(world.path("page.html"), world.path("latest.html")).expect("linked");
    refused(&world.armcal(["compare", "result", "result", "--html", "latest.html"]), "latest.html", "a link");
    refused(&world.armcal(["export", "p.toml", "--out", "/dev/null"]), "/dev/null", "a device");
}

/// What people change in a text of armcal's is theirs, whoever would write it again.
#[test]
fn what_was_changed_since_armcal_wrote_it_stays() {
    let world = World::new();
    let init = ["init", "normal.mcap", "--dh", "arm.toml", "--board", "board.toml", "--out", "new.toml"];
    world.done(&init);
    world.done(&["add", "backlash:1", "new.toml", "--out", "more"]);
    world.done(&["write", "result", "--as", "joint-zeros", "--out", "zeros.yaml"]);
    world.done(&["simulate", "--hide", "nothing", "--out", "sealed"]);
    let again: [(&str, &[&str]); 7] = [
        ("new.toml", &init),
        ("new+backlash-1.toml", &["add", "backlash:1", "new.toml", "--out", "more"]),
        ("more/parameters.toml", &["add", "backlash:1", "new.toml", "--out", "more"]),
        ("more/view.toml", &["add", "backlash:1", "new.toml", "--out", "more"]),
        ("result/calibrated.toml", &["run", "p.toml", "--out", "result"]),
        ("zeros.yaml", &["write", "result", "--as", "joint-zeros", "--out", "zeros.yaml"]),
        ("sealed/pipeline.toml", &["simulate", "--hide", "nothing", "--out", "sealed", "--seed", "2"]),
    ];
    for (name, arguments) in again {
        let written = std::fs::read_to_string(world.path(name)).expect("written");
        let changed = written.clone() + "\n# measured again on Monday\n";
        world.write(name, &changed);
        refused(&world.armcal(arguments), name, name);
        let now = std::fs::read_to_string(world.path(name)).expect("still there");
        assert!(now == changed, "{name} has changed");
        world.write(name, &written);
    }
    // As they were written, they give way; a proposal still only when that is asked for, and then with what was changed in it.
    for (name, arguments) in &again[1..] {
        world.done(arguments);
        assert!(world.path(name).is_file());
    }
    refused(&world.armcal(init), "--force", "a proposal");
    let written = std::fs::read(world.path("new.toml")).expect("written");
    world.write("new.toml", "# armcal.pipeline/1 sha256:0123456789abcdef\nname = \"mine\"\n");
    refused(&world.armcal(init), "may have been changed", "a changed proposal");
    world.done(&[&init[..], &["--force"]].concat());
    assert!(
        std::fs::read(world.path("new.toml")).expect("written") == written,
        "as it was proposed at first"
    );
}

/// A pipeline that people wrote has no mark, and what `add` makes of it has one.
#[test]
fn an_extended_pipeline_is_known_for_its_own_until_it_is_changed() {
    let world = World::new();
    let add = ["add", "backlash:1", "p.toml"];
    world.done(&add);
    let path = world.path("p+backlash-1.toml");
    let first = std::fs::read_to_string(&path).expect("written");
    assert!(first.starts_with("# armcal.pipeline/1 sha256:"), "{first}");
    let original = std::fs::read_to_string(world.path("p.toml")).expect("a pipeline");
    world.write("p.toml", &original.replace("k = 5", "k = 4"));
    world.done(&add);
    let second = std::fs::read_to_string(&path).expect("written");
    assert!(
        second != first && second.contains("k = 4"),
        "the original was changed, and the extended one follows"
    );
    std::fs::write(&path, second.replace("k = 4", "k = 3")).expect("changed");
    refused(&world.armcal(add), "p+backlash-1.toml", "a changed one");
}
