use crate::support::{armcal, number, real_recordings, root, run_as_shipped, run_pipeline, shipped, skip};
use std::path::{Path, PathBuf};

/// Every pipeline of `pipelines/`, in order.
fn all_shipped() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join("pipelines")).expect("pipelines");
    let paths = entries.map(|entry| entry.expect("entry").path());
    let mut all: Vec<PathBuf> = paths.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    all.sort();
    assert!(all.len() >= 9, "{all:?}");
    all
}

fn text(pipeline: &Path) -> String {
    std::fs::read_to_string(pipeline).expect("pipeline")
}

/// The keys that name files.
fn files_named(pipeline: &Path) -> Vec<PathBuf> {
    fn collect(value: &toml::Value, named: &mut Vec<PathBuf>) {
        match value {
            toml::Value::Table(table) => {
                for (key, value) in table {
                    match value.as_str() {
                        Some(path) if ["dh", "urdf", "board"].contains(&key.as_str()) => {
                            named.push(path.into())
                        }
                        _ if key == "paths" => {
                            let paths = value.as_array().into_iter().flatten();
                            named.extend(paths.filter_map(toml::Value::as_str).map(PathBuf::from));
                        }
                        _ => collect(value, named),
                    }
                }
            }
            toml::Value::Array(values) => values.iter().for_each(|value| collect(value, named)),
            _ => {}
        }
    }
    let mut named = Vec::new();
    collect(&toml::Value::Table(text(pipeline).parse().expect("TOML")), &mut named);
    named
}

/// Whether a file that the pipeline names lies outside the repository.
fn needs_more_than_a_clone(pipeline: &Path) -> bool {
    files_named(pipeline).iter().any(|path| path.starts_with("../.."))
}

/// As shipped, except that the diagnosis of the UR10's 1,495 poses, which takes minutes without optimisation, is left out.
#[test]
fn every_shipped_pipeline_runs() {
    let mut from_a_clone = Vec::new();
    for pipeline in all_shipped() {
        let name = pipeline.file_name().expect("a name").to_string_lossy().into_owned();
        if needs_more_than_a_clone(&pipeline) {
            if real_recordings().is_none() {
                skip(&format!("{name} needs recordings of ../shared/real"));
                continue;
            }
        } else {
            from_a_clone.push(name.clone());
        }
        let summary = if name.starts_with("ur10-tracker") {
            let folder = tempfile::tempdir().expect("temporary folder");
            let quick = folder.path().join(&name);
            std::fs::write(&quick, shipped(&name) + "\n[diagnosis]\nenabled = false\n").expect("pipeline");
            run_pipeline(&quick, &folder.path().join("out"), &[0, 3])
        } else {
            run_as_shipped(&name)
        };
        let dwells: f64 = (0..summary["recordings"].as_array().map_or(0, Vec::len))
            .map(|i| number(&summary, &format!("/recordings/{i}/dwells")))
            .sum();
        assert!(dwells > 30.0, "{name}: {dwells} dwells");
    }
    let expected = [
        "mukca-panda4.toml",
        "paper-camera-free.toml",
        "paper-normal.toml",
        "paper-verify.toml",
        "paper.toml",
        "two-arms.toml",
    ];
    assert_eq!(from_a_clone, expected, "docs and README say which pipelines run from a clone");
}

/// A file that every clone has: recordings that are fetched are big, and would end in the repository by mistake.
#[test]
fn pipelines_that_run_from_a_clone_name_files_of_the_repository_alone() {
    for pipeline in all_shipped().into_iter().filter(|p| !needs_more_than_a_clone(p)) {
        for file in files_named(&pipeline) {
            let path = root().join("pipelines").join(&file);
            assert!(path.is_file(), "{}: {}", pipeline.display(), file.display());
        }
    }
    let tracked =
        std::process::Command::new("du").arg("-sk").arg(root().join("fixtures")).output().expect("du");
    let kib = String::from_utf8_lossy(&tracked.stdout)
        .split_whitespace()
        .next()
        .and_then(|n| n.parse::<u64>().ok());
    assert!(kib.expect("a size") < 20_000, "the fixtures of the repository stay below 20 MB");
}

/// In a folder where nothing of what they name is, as in a clone: the message names the file, and what to fetch to where.
#[test]
fn pipelines_that_need_more_say_so_and_what_to_fetch() {
    let needing: Vec<PathBuf> = all_shipped().into_iter().filter(|p| needs_more_than_a_clone(p)).collect();
    assert_eq!(needing.len(), 5);
    for pipeline in needing {
        let comment: String = text(&pipeline).lines().take_while(|line| line.starts_with('#')).collect();
        assert!(comment.contains("not in this repository"), "{}: {comment}", pipeline.display());

        let folder = tempfile::tempdir().expect("temporary folder");
        let pipelines = folder.path().join("clone/pipelines");
        std::fs::create_dir_all(pipelines.join("models")).expect("folder");
        std::fs::create_dir(pipelines.join("boards")).expect("folder");
        for file in ["boards/mukca.toml", "models/ur10.toml"] {
            std::fs::copy(root().join("pipelines").join(file), pipelines.join(file)).expect("copied");
        }
        let copy = pipelines.join(pipeline.file_name().expect("a name"));
        std::fs::copy(&pipeline, &copy).expect("copied");
        let data: toml::Table = text(&pipeline).parse().expect("TOML");
        let data = data["data"].as_str().expect("`data` says what to fetch");
        assert!(data.contains("github.com/") && data.contains("../../shared/real/"), "{data}");

        let out = folder.path().join("out");
        let ways: [Vec<&Path>; 2] =
            [vec!["run".as_ref(), &copy, "--out".as_ref(), &out], vec!["inspect".as_ref(), &copy]];
        for arguments in ways {
            let output = armcal(&arguments);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
            assert!(said.contains("shared/real/") && said.contains(data), "{arguments:?}: {said}");
            assert!(!out.exists(), "{arguments:?} left something");
        }
    }
}
