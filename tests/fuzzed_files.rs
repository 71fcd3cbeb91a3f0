//! Replays the corpora of fuzzing pipelines, models, boards and results, and what it found (docs/hardening.md), and damages the
//! shipped ones.

#[path = "../crates/recording/fuzz/src/files.rs"]
mod files;
#[path = "../crates/recording/fuzz/src/limits.rs"]
mod limits;
#[path = "../crates/recording/fuzz/src/memory.rs"]
mod memory;

use crate::support::root;
use limits::{Size, held};
use std::path::{Path, PathBuf};

#[global_allocator]
static COUNTING: memory::Counting = memory::Counting;

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
fn corpora_and_findings_of_fuzzing_keep_to_the_limits() {
    for (name, target) in TARGETS {
        let folders = ["corpus", "regressions"].map(|kind| format!("crates/recording/fuzz/{kind}/{name}"));
        let files: Vec<PathBuf> = folders.iter().flat_map(|folder| files_in(&root().join(folder))).collect();
        assert!(files.len() > 10, "{name} has no corpus");
        for path in files {
            println!("{}", path.display());
            let bytes = std::fs::read(&path).expect("readable");
            held(Size::plain(&bytes), || target(&bytes));
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

/// A stack that overflows kills the program without a word.
#[test]
fn nesting_without_end_ends_in_words() {
    const LEVELS: usize = 100_000;
    let formula = |text: &str| {
        let effect = format!(
            "[[effects]]\nkind = 'expression'\nname = 'x'\nacts_on = 'joint1'\nformula = '{text}'\n\
             parameters = {{ k = {{ prior = 1.0, unit = 'deg' }} }}\n"
        );
        files::results(&[&[3], effect.as_bytes()].concat());
    };
    let around = |open: &str, inside: &str, close: &str| open.repeat(LEVELS) + inside + &close.repeat(LEVELS);
    for (open, close) in
        [("(", ")"), ("-(", ")"), ("sin(", ")"), ("(k*", ")"), ("sin ", ""), ("k^", ""), ("k+", "")]
    {
        formula(&around(open, "k", close));
        // As deep as a formula may be.
        let levels = 9_990 / (open.len() + close.len());
        formula(&(open.repeat(levels) + "k" + &close.repeat(levels)));
    }
    let urdf = format!("<robot>{}</robot>", around("<a>", "", "</a>"));
    files::geometry(&[&[2], urdf.as_bytes()].concat());
    let toml = format!("name = {}", around("[", "", "]"));
    let tables = format!("[{}a]\n", "a.".repeat(LEVELS));
    for kind in 0..4 {
        files::pipeline(&[&[kind], toml.as_bytes()].concat());
        files::pipeline(&[&[kind], tables.as_bytes()].concat());
    }
    let json = around("[", "", "]");
    let object = around("{\"a\":", "1", "}");
    for kind in 0..2 {
        files::results(&[&[kind], json.as_bytes()].concat());
        files::results(&[&[kind], object.as_bytes()].concat());
    }
}
