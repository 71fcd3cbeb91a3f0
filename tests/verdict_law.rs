use crate::support::{armcal, believable, read_json, root};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Pipelines of which one number is wrong.
const FUZZED: u64 = 10;

/// The shipped pipeline with its model and board beside it, one of their numbers multiplied.
fn fuzzed(seed: u64, folder: &Path) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let pipelines = root().join("pipelines");
    let read = |name: &str| std::fs::read_to_string(pipelines.join(name)).expect("a shipped file");
    let pipeline = read("paper-normal.toml")
        .replace("\"../fixtures/", &format!("\"{}/", root().join("fixtures").display()));
    let mut files = vec![("p.toml".to_owned(), pipeline.clone())];
    for word in pipeline.split('"').filter(|w| w.starts_with("boards/") || w.starts_with("models/")) {
        files.push((word.to_owned(), read(word)));
    }
    let chosen = rng.random_range(0..files.len());
    let factor = [-1.0, 0.5, 0.9, 0.98, 1.02, 1.1, 2.0, 57.3][rng.random_range(0..8)];
    let (name, text): &mut (String, String) = &mut files[chosen];
    let numbers: Vec<(usize, usize)> = numbers(text);
    let (from, to) = numbers[rng.random_range(0..numbers.len())];
    let value: f64 = text[from..to].parse().expect("a number");
    let changed = format!("{name}: {} at byte {from} times {factor}", &text[from..to]);
    text.replace_range(from..to, &format!("{:?}", value * factor));
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    }
    changed
}

/// Decimal fractions in a TOML text: integers are mostly counts and columns.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let of_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let mut found = Vec::new();
    let mut from = None;
    for (at, c) in text.char_indices().chain([(text.len(), ' ')]) {
        match (from, of_number(c)) {
            (None, true) => from = Some(at),
            (Some(start), false) => {
                let word = &text[start..at];
                if word.contains('.') && word.parse::<f64>().is_ok_and(|v| v != 0.0) {
                    found.push((start, at));
                }
                from = None;
            }
            _ => {}
        }
    }
    found
}

/// Whatever number of a pipeline, model or board is wrong: no false comfort.
#[test]
fn no_pipeline_with_a_wrong_number_is_told_that_nothing_is_missing() {
    let mut calibrated = 0;
    for seed in 0..FUZZED {
        let folder = tempfile::tempdir().expect("temporary folder");
        let changed = fuzzed(seed, folder.path());
        let out = folder.path().join("out");
        let output = armcal([
            "run".as_ref(),
            folder.path().join("p.toml").as_os_str(),
            "--out".as_ref(),
            out.as_os_str(),
        ]);
        let code = output.status.code().unwrap_or(-1);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!([0, 1, 2, 3].contains(&code), "{changed}: exit {code}\n{said}");
        if [0, 3].contains(&code) {
            calibrated += 1;
            believable(&read_json(&out.join("summary.json")), &changed);
        }
    }
    assert!(calibrated >= FUZZED / 2, "only {calibrated} of {FUZZED} were calibrated at all");
}
