use crate::support::{paper_pipeline, root, run_pipeline};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Every key of the sections that have defaults, as the program itself spells them.
fn keys<T: Serialize>(section: &T) -> Vec<String> {
    let value = serde_json::to_value(section).expect("a section is a table");
    value.as_object().expect("a section is a table").keys().cloned().collect()
}

#[test]
fn the_reference_lists_every_key_with_a_default() {
    let reference = std::fs::read_to_string(root().join("docs/pipeline-reference.md")).expect("reference");
    let sections = [
        keys(&armcal_dwell::ClockConfig::default()),
        keys(&armcal_dwell::DwellConfig::default()),
        keys(&armcal_table::AssociationConfig::default()),
        keys(&armcal_calibrate::FitConfig::default()),
        keys(&armcal_model::Deviation::default()),
        keys(&armcal_diagnose::DiagnosisConfig::default()),
        keys(&armcal_config::PoolSection::default()),
        keys(&armcal_config::CheckSection::default()),
        keys(&armcal_config::MaxWarnings::default()),
    ];
    for key in sections.concat() {
        assert!(reference.contains(&format!("`{key}`")), "docs/pipeline-reference.md does not list `{key}`");
    }
}

#[test]
fn every_shipped_pipeline_is_valid() {
    for entry in std::fs::read_dir(root().join("pipelines")).expect("pipelines") {
        let path = entry.expect("entry").path();
        if path.extension().is_some_and(|e| e == "toml") {
            armcal::Pipeline::load(&path).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

/// The catalogue is printed by the program; the guide to the diagnosis must not name effects that do not exist.
#[test]
fn effects_named_in_the_guide_to_the_diagnosis_exist() {
    let guide = std::fs::read_to_string(root().join("docs/diagnosis.md")).expect("guide");
    let known: Vec<&str> = armcal_model::catalogue().iter().map(|kind| kind.name).collect();
    let effects = guide.split("## Effects").nth(1).expect("the section on effects");
    let rows = effects.lines().filter(|line| line.starts_with("| `"));
    for row in rows {
        let name = row.trim_start_matches("| `").split(['`', ':', '@', ',']).next().unwrap_or_default();
        assert!(known.contains(&name), "docs/diagnosis.md: `{name}` is not in the catalogue");
    }
}

/// Somebody will paste it.
#[test]
fn the_limits_shown_in_the_guide_to_checks_are_understood() {
    #[derive(serde::Deserialize)]
    struct Shown {
        check: armcal_config::CheckSection,
    }
    let guide = std::fs::read_to_string(root().join("docs/check.md")).expect("guide");
    let block = guide.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a section");
    let shown: Shown = toml::from_str(block).unwrap_or_else(|e| panic!("{e}"));
    let all = serde_json::to_value(&shown.check).expect("JSON");
    let unset: Vec<&String> =
        all.as_object().expect("a table").iter().filter(|(_, v)| v.is_null()).map(|(k, _)| k).collect();
    assert!(unset.is_empty(), "docs/check.md does not show {unset:?}");
}

/// The mistake that the guide begins with, made in the shipped pipeline.
#[test]
fn the_mistake_shown_in_the_guide_to_the_setup_is_told_so() {
    let guide = std::fs::read_to_string(root().join("docs/setup.md")).expect("guide");
    let quoted: Vec<&str> = guide.lines().filter_map(|line| line.strip_prefix("> ")).collect();
    let folder = tempfile::tempdir().expect("temporary folder");
    let (right, wrong) = ("names = [\"joint1\", \"joint2\",", "names = [\"joint2\", \"joint1\",");
    let pipeline = paper_pipeline(&root().join("fixtures/paper")).replace(right, wrong);
    assert!(pipeline.contains(wrong), "the shipped pipeline names its joints otherwise");
    let path = folder.path().join("p.toml");
    std::fs::write(&path, pipeline).expect("written");
    let summary = run_pipeline(&path, &folder.path().join("out"), &[3]);
    let message = summary["setup"]["findings"][0]["message"].as_str().expect("a finding");
    assert_eq!(quoted.join(" "), format!("Setup first: {message}."));
}

/// Stands before a block that quotes what a command prints.
const PRINTS: &str = "<!-- prints: armcal ";

/// README.md and the guides.
fn documents() -> Vec<PathBuf> {
    let guides =
        std::fs::read_dir(root().join("docs")).expect("docs").map(|entry| entry.expect("entry").path());
    let mut all: Vec<PathBuf> = guides.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    all.push(root().join("README.md"));
    all.sort();
    all
}

/// Line number from 1, what stands before it and the lines of every fenced block without a language.
fn plain_blocks(text: &str) -> Vec<(usize, &str, Vec<&str>)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut blocks: Vec<(usize, &str, Vec<&str>)> = Vec::new();
    let mut opened: Option<(usize, bool)> = None;
    for (i, line) in lines.iter().enumerate() {
        match (line.strip_prefix("```"), opened) {
            (Some(language), None) => opened = Some((i, language.is_empty())),
            (Some(_), Some((from, plain))) => {
                let before = from.checked_sub(1).map_or("", |before| lines[before]);
                if plain {
                    blocks.push((from + 1, before, lines[from + 1..i].to_vec()));
                }
                opened = None;
            }
            (None, _) => {}
        }
    }
    blocks
}

/// What a command prints, run in the repository with its results elsewhere; `write out` in a folder where `out` is the result of
/// the README's main job.
fn printed(command: &str, out: &Path) -> String {
    let mut armcal = Command::new(env!("CARGO_BIN_EXE_armcal"));
    armcal.current_dir(root()).args(command.split(' '));
    if command.starts_with("run ") {
        armcal.arg("--out").arg(out);
    }
    if command.starts_with("init ") {
        armcal.arg("--out").arg(out.with_extension("toml"));
    }
    if command.starts_with("write out ") {
        run_pipeline(&root().join("pipelines/paper.toml"), &out.join("out"), &[0]);
        armcal.current_dir(out);
    }
    let output = armcal.output().expect("starting armcal");
    assert!(output.status.success(), "armcal {command}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The first quoted line that is not printed where it stands; `...` stands for any number of lines.
fn first_misquote<'a>(quoted: &[&'a str], printed: &str) -> Option<&'a str> {
    let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
    let (mut at, mut anywhere) = (0, true);
    for line in quoted {
        if line.trim() == "..." {
            anywhere = true;
            continue;
        }
        let found = if anywhere {
            printed[at..].iter().position(|p| p == line)
        } else {
            printed.get(at).filter(|p| *p == line).map(|_| 0)
        };
        match found {
            Some(by) => at += by + 1,
            None => return Some(line),
        }
        // Sections are quoted without what stands between them: an empty line ends one.
        anywhere = line.is_empty();
    }
    None
}

#[test]
fn a_misquote_is_found() {
    let printed = "a 1\nb 2\n\nc 3\nd 4\n";
    assert_eq!(first_misquote(&["a 1", "...", "d 4"], printed), None);
    assert_eq!(first_misquote(&["b 2", "", "d 4"], printed), None);
    assert_eq!(first_misquote(&["a 1", "c 3"], printed), Some("c 3"));
    assert_eq!(first_misquote(&["a 1", "...", "d 5"], printed), Some("d 5"));
    assert_eq!(first_misquote(&["...", "d 4", "...", "a 1"], printed), Some("a 1"));
}

#[test]
fn what_the_documents_quote_is_what_the_commands_print() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (mut said, mut quotes): (BTreeMap<String, String>, usize) = (BTreeMap::new(), 0);
    for path in documents() {
        let text = std::fs::read_to_string(&path).expect("document");
        for (line, before, quoted) in plain_blocks(&text) {
            let at = format!("{}:{line}", path.display());
            assert!(before.starts_with("<!-- prints"), "{at}: say what prints this, in a comment before it");
            let Some(command) = before.strip_prefix(PRINTS).and_then(|c| c.strip_suffix(" -->")) else {
                continue;
            };
            let out = folder.path().join(said.len().to_string());
            let said = said.entry(command.to_owned()).or_insert_with(|| printed(command, &out));
            let misquote = first_misquote(&quoted, said);
            assert!(
                misquote.is_none(),
                "{at}: `armcal {command}` does not print {misquote:?} there, but\n{said}"
            );
            quotes += 1;
        }
    }
    assert!(quotes >= 2, "only {quotes} quotes were found");
}

/// `cargo run -- run ...` needs one program to run.
#[test]
fn the_first_command_of_the_readme_has_one_program() {
    let output = std::process::Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    let workspace: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let default = workspace["workspace_default_members"].as_array().expect("members");
    let packages = workspace["packages"].as_array().expect("packages");
    let programs: Vec<&str> = packages
        .iter()
        .filter(|p| default.contains(&p["id"]))
        .flat_map(|p| p["targets"].as_array().expect("targets"))
        .filter(|t| t["kind"].as_array().is_some_and(|k| k.iter().any(|k| k == "bin")))
        .filter_map(|t| t["name"].as_str())
        .collect();
    assert_eq!(programs, ["armcal"]);
}
