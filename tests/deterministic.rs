use crate::support::{files_made, root};
use std::collections::BTreeMap;
use std::process::Command;

fn run_with_threads(threads: &str) -> BTreeMap<String, Vec<u8>> {
    let out = tempfile::tempdir().expect("temporary folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
    command.env("RAYON_NUM_THREADS", threads).arg("run").arg(root().join("pipelines/paper.toml"));
    files_made(&mut command, out.path())
}

#[test]
fn one_thread_and_five_give_the_same_bytes() {
    let (one, five) = (run_with_threads("1"), run_with_threads("5"));
    assert_eq!(one.keys().collect::<Vec<_>>(), five.keys().collect::<Vec<_>>());
    for (name, bytes) in &one {
        assert!(bytes == &five[name], "{name} differs between 1 and 5 threads");
    }
}

#[test]
fn the_shipped_fixtures_are_what_their_seed_gives() {
    let out = tempfile::tempdir().expect("temporary folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal"));
    command.arg("simulate").arg(root().join("pipelines/lab/paper-small.toml"));
    let made = files_made(&mut command, out.path());
    for name in ["normal.mcap", "roll.mcap", "pitch.mcap"] {
        let shipped = std::fs::read(root().join("fixtures/paper").join(name)).expect("shipped fixture");
        assert!(
            made[name] == shipped,
            "fixtures/paper/{name} is not what pipelines/lab/paper-small.toml makes"
        );
    }
}
