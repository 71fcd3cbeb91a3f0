//! The page of symptoms, line by line: every recording is made by the command that stands there, and armcal says of it what
//! is quoted.

use crate::support::{in_one_line, read_json, root, shipped};
use rayon::prelude::*;
use std::path::Path;
use std::process::Command;

/// One recording of the page.
struct Shown {
    /// The lines that a reader types.
    commands: Vec<String>,
    /// What armcal says at the end, white space apart.
    quoted: String,
}

fn page() -> String {
    std::fs::read_to_string(root().join("docs/symptoms.md")).expect("the page")
}

/// The first quotation after this place of the page, in one line.
fn quoted(after: &str) -> String {
    let lines = after.lines().skip_while(|line| !line.starts_with("> "));
    in_one_line(&lines.map_while(|line| line.strip_prefix("> ")).collect::<Vec<_>>().join(" "))
}

fn shown(page: &str) -> Vec<Shown> {
    let blocks = page.split("```console\n").skip(1).filter_map(|rest| rest.split_once("```"));
    let of = |(block, after): (&str, &str)| {
        let commands = block.lines().filter_map(|line| line.strip_prefix("$ armcal "));
        Shown { commands: commands.map(str::to_owned).collect(), quoted: quoted(after) }
    };
    blocks.map(of).collect()
}

/// What armcal says to a command in a folder, whatever it ends with.
fn said(command: &str, folder: &Path) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_armcal"))
        .args(command.split(' '))
        .current_dir(folder)
        .output()
        .expect("starting armcal");
    assert!(
        matches!(output.status.code(), Some(0 | 3)),
        "{command}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    in_one_line(&String::from_utf8_lossy(&output.stdout))
}

#[test]
fn every_symptom_is_answered_as_the_page_says_and_as_the_truth_has_it() {
    let all = shown(&page());
    assert!(all.len() >= 6, "{} recordings", all.len());
    all.par_iter().for_each(|Shown { commands, quoted }| {
        let folder = tempfile::tempdir().expect("temporary folder");
        let [simulate, run] = commands.as_slice() else { panic!("{commands:?}: one makes it, one runs it") };
        said(simulate, folder.path());
        let answer = said(run, folder.path());
        assert!(answer.contains(quoted), "{run}: `{quoted}` is not in\n{answer}");
        // The truth is opened only now: what is hidden is among the names that are quoted.
        let name = simulate.rsplit(' ').next().expect("a folder");
        let truth = read_json(&folder.path().join(format!("{name}-truth.json")));
        let effect = truth["hidden"][0]["effect"].as_str().expect("an effect of the catalogue");
        assert!(quoted.contains(effect), "{run}: {effect} is hidden, `{quoted}` quoted");
    });
}

/// The tool that is declared wrong, in the shipped recording of a real arm.
#[test]
fn a_tool_frame_that_is_wrong_is_told_so() {
    let page = page();
    let (wrong, after) = page
        .split_once("```toml\n")
        .and_then(|(_, rest)| rest.split_once("```"))
        .expect("what is wrong in the pipeline");
    let text = shipped("mukca-panda4.toml");
    let keep = |section: &&str| {
        !["[frames.tip]", "[holdout]"].iter().any(|own| section.starts_with(own))
            && (!section.starts_with("[[recordings]]") || section.contains("front.mcap"))
            && !section.contains("very-front")
    };
    let kept: Vec<&str> = text.split("\n\n").filter(keep).collect();
    let holdout = "[holdout]\nkind = \"random\"\nshare = 0.25\nseed = 1\n";
    let folder = tempfile::tempdir().expect("temporary folder");
    let pipeline = format!("{}\n\n{wrong}\n{holdout}", kept.join("\n\n"));
    std::fs::write(folder.path().join("panda.toml"), pipeline).expect("pipeline");
    let answer = said("run panda.toml", folder.path());
    assert!(answer.contains(&quoted(after)), "`{}` is not in\n{answer}", quoted(after));
}
