use crate::support::{armcal, number, paper_pipeline, python, root, run_pipeline};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Runs a script of `tests/python` and returns the JSON line it prints.
fn script(python: &Path, name: &str, argument: &Path) -> Value {
    let output = Command::new(python)
        .arg(root().join("tests/python").join(name))
        .arg(argument)
        .output()
        .expect("starting python");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {said}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{name}: {e}\n{said}"))
}

#[test]
fn scipy_finds_the_same_optimum_with_kinematics_of_its_own() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    // Plain least squares, because scipy's robust losses act on single rows.
    let text = paper_pipeline(&root().join("fixtures/paper"));
    let pipeline = folder.path().join("least-squares.toml");
    std::fs::write(&pipeline, text + "\n[fit]\nobjective = \"least-squares\"\n")
        .expect("writing the pipeline");
    let problem = folder.path().join("problem.json");
    let output = armcal(["export".as_ref(), pipeline.as_os_str(), "--out".as_ref(), problem.as_os_str()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let verdict = script(&python, "solve_problem.py", &problem);
    println!("{verdict}");
    let (scipy, ours) = (number(&verdict, "/cost_scipy"), number(&verdict, "/cost_armcal"));
    assert!((ours - scipy).abs() <= 1e-6 * scipy, "cost {ours} against scipy's {scipy}");
    assert!(number(&verdict, "/worst_sigmas") < 0.01, "parameters differ: {verdict}");
}

#[test]
fn python_decodes_every_message_of_the_output() {
    let Some(python) = python() else { return };
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/paper.toml"), out.path(), &[0]);
    let decoded = script(&python, "decode_output.py", &out.path().join("run.mcap"));
    println!("{decoded}");
    for topic in
        ["/joint_states", "/vicon/tip/tip", "/armcal/scene", "/armcal/residuals", "/armcal/parameters"]
    {
        assert!(decoded["counts"][topic].as_u64().is_some_and(|n| n > 0), "no {topic}");
    }
    // Cavities are held out in turn, so every observation is on both sides and has one residual.
    assert_eq!(number(&decoded["counts"], "/~1armcal~1residuals"), number(&summary, "/fit/train/n"));
}

/// Runs `check_layouts.py` on a run's results: every path of both layouts resolves in `run.mcap`, with the type that its
/// panel draws and as many numbers as its x; keys are those of the formats; both show the same.
fn layouts_resolve(python: &Path, out: &Path) -> Vec<String> {
    let checked = script(python, "check_layouts.py", out);
    println!("{checked}");
    assert!(number(&checked, "/messages") < 5000.0, "too many messages for a viewer: {checked}");
    let titles = checked["titles"].as_array().expect("titles");
    titles.iter().map(|t| t.as_str().expect("a title").to_owned()).collect()
}

#[test]
fn every_path_of_the_layouts_resolves() {
    let Some(python) = python() else { return };
    let out = tempfile::tempdir().expect("temporary folder");
    run_pipeline(&root().join("pipelines/paper.toml"), out.path(), &[0]);
    let titles = layouts_resolve(&python, out.path());
    assert!(titles.iter().any(|t| t == "Errors on the boards, from above"));
    assert!(!titles.iter().any(|t| t.contains(" effects")), "nothing was found: {titles:?}");
}

#[test]
fn every_path_of_the_layouts_of_two_arms_resolves() {
    let Some(python) = python() else { return };
    let out = tempfile::tempdir().expect("temporary folder");
    run_pipeline(&root().join("pipelines/two-arms.toml"), out.path(), &[0]);
    let titles = layouts_resolve(&python, out.path());
    println!("{titles:?}");
    for title in ["Status", "right.joint1", "left.joint3", "What these data could not have shown"] {
        assert!(titles.iter().any(|t| t.starts_with(title)), "no {title} in {titles:?}");
    }
}

#[test]
fn the_layout_of_a_hidden_effect_shows_what_it_does() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("temporary folder");
    let rig = folder.path().join("rig");
    let hidden = ["--hide", "backlash", "--design", "free-poses", "--size", "medium", "--seed", "3"];
    let arguments = ["simulate"].into_iter().chain(hidden).map(std::ffi::OsStr::new);
    let output = armcal(arguments.chain(["--out".as_ref(), rig.as_os_str()]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let out = folder.path().join("out");
    let summary = run_pipeline(&rig.join("pipeline.toml"), &out, &[0, 3]);
    assert_eq!(summary["diagnosis"]["names"][0], "backlash:1", "{}", summary["diagnosis"]["names"]);
    let titles = layouts_resolve(&python, &out);
    for title in ["joint1 effects", "joint1 rest"] {
        assert!(titles.iter().any(|t| t.starts_with(title)), "no {title} in {titles:?}");
    }
}

#[test]
fn rerun_draws_robots_board_and_errors_without_any_configuration() {
    let Some(python) = python() else { return };
    let out = tempfile::tempdir().expect("temporary folder");
    let summary = run_pipeline(&root().join("pipelines/paper.toml"), out.path(), &[0]);
    let drawn = script(&python, "check_rerun.py", &out.path().join("run.mcap"));
    println!("{drawn}");
    assert_eq!(number(&drawn, "/points"), number(&summary, "/fit/train/n"));
    // The plate and the 33 cavities that the board file lists.
    assert_eq!(number(&drawn, "/drawn/board/shapes"), 34.0);
}
