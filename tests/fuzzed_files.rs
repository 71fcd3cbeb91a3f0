//! Replays what fuzzing of pipelines, models, boards and results found (docs/hardening.md), and damages the shipped ones.

#[path = "../crates/recording/fuzz/src/files.rs"]
mod files;

use crate::support::root;
use std::path::{Path, PathBuf};

type Target = fn(&[u8]);
const TARGETS: [(&str, Target); 3] =
    [("pipeline", files::pipeline), ("geometry", files::geometry), ("results", files::results)];

fn files_in(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        folder.read_dir().into_iter().flatten().flatten().map(|e| e.path()).collect();
    paths.retain(|p| p.is_file());
    paths.sort();
    paths
}

#[test]
fn findings_of_fuzzing_stay_mended() {
    for (name, target) in TARGETS {
        for path in files_in(&root().join("crates/recording/fuzz/regressions").join(name)) {
            println!("{}", path.display());
            target(&std::fs::read(path).expect("a finding"));
        }
    }
}

/// Bytes replaced and runs of them removed or repeated, all over each file that the repository ships.
#[test]
fn shipped_files_with_bytes_gone_bad_end_in_words() {
    let fuzz = root().join("crates/recording/fuzz/seeds");
    let pipelines = root().join("pipelines");
    let folders: [(&str, &[u8]); 4] = [("", &[0, 1]), ("lab", &[2, 3]), ("boards", &[5]), ("models", &[6])];
    let mut cases: Vec<(PathBuf, u8)> = vec![(fuzz.join("arm.urdf"), 7), (fuzz.join("effects.toml"), 13)];
    for (folder, kinds) in folders {
        let shipped = files_in(&pipelines.join(folder));
        cases
            .extend(shipped.into_iter().flat_map(|path| kinds.iter().map(move |kind| (path.clone(), *kind))));
    }
    for (path, kind) in cases {
        let (target, kind): (Target, u8) = match kind {
            0..5 => (files::pipeline, kind),
            5..10 => (files::geometry, kind - 5),
            _ => (files::results, kind - 10),
        };
        let text = std::fs::read(&path).expect("a shipped file");
        for at in (0..text.len()).step_by(11) {
            let end = (at + 40).min(text.len());
            let replaced = |byte: u8| [&text[..at], &[byte], &text[at + 1..]].concat();
            let versions = [
                replaced(b'-'),
                replaced(b'9'),
                replaced(b'\n'),
                [&text[..at], b"1e308", &text[at..]].concat(),
                [&text[..at], &text[end..]].concat(),
                [&text[..end], &text[at..]].concat(),
            ];
            for version in versions {
                target(&[&[kind], &version[..]].concat());
            }
        }
    }
}
