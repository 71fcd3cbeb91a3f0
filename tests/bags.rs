use crate::support::{armcal, number, python_with, quick_pipeline, root, run_pipeline};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The messages of the paper's upright recording in every form that `write_bags.py` knows; the folder of each.
fn bags(folder: &Path) -> Option<BTreeMap<&'static str, PathBuf>> {
    let python = python_with("mcap, rosbags")?;
    let script = root().join("tests/python/write_bags.py");
    let fixture = root().join("fixtures/paper/normal.mcap");
    let output = Command::new(python).args([&script, folder, &fixture]).output().expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let forms = ["mcap", "db3", "file", "message", "mcap-file", "mcap-message", "old", "split"];
    let ros1 = ["ros1", "ros1-bz2", "ros1-lz4"];
    let all = forms.map(|form| (form, folder.join(form).join("normal"))).into_iter();
    Some(all.chain(ros1.map(|form| (form, folder.join(form).join("normal.bag")))).collect())
}

fn said(output: &std::process::Output) -> String {
    [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text)).concat()
}

/// A copy of a bag's one file, as a change leaves it.
fn changed(bag: &Path, to: &Path, change: impl FnOnce(&mut Vec<u8>)) -> PathBuf {
    let inside = std::fs::read_dir(bag).into_iter().flatten().flatten().map(|e| e.path());
    let file = inside.into_iter().find(|p| p.extension().is_none_or(|e| e != "yaml"));
    let file = file.unwrap_or_else(|| bag.to_owned());
    let mut bytes = std::fs::read(&file).expect("readable");
    change(&mut bytes);
    std::fs::create_dir_all(to).expect("a folder");
    let to = to.join(file.file_name().expect("a name"));
    std::fs::write(&to, bytes).expect("written");
    to
}

/// One recording, by PyPI `rosbags` as MCAP, as a database, compressed in four ways, without definitions and in two
/// parts: the same rows, the same model, and nothing is left beside the files.
#[test]
fn every_form_of_a_bag_gives_the_same_calibration() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let Some(bags) = bags(folder.path()) else { return };
    let mut expected: Option<Value> = None;
    for (form, bag) in &bags {
        let names = || -> Vec<_> {
            let folder = if bag.is_dir() { bag } else { bag.parent().expect("a folder") };
            std::fs::read_dir(folder).expect("a bag").flatten().map(|e| e.file_name()).collect()
        };
        let before = names();
        let paths = format!("[\"{}\"]", bag.display());
        let text = quick_pipeline(Path::new("here")).replace("[\"here/normal.mcap\"]", &paths);
        assert!(text.contains(&paths), "{text}");
        let pipeline = folder.path().join(format!("{form}.toml"));
        std::fs::write(&pipeline, text).expect("pipeline");
        let out = folder.path().join("out").join(form);
        let summary = run_pipeline(&pipeline, &out, &[0, 3]);
        let fit = summary["fit"].clone();
        assert!(number(&fit, "/holdout/fitted_mm/mean") < 0.2, "{form}: {fit}");
        assert_eq!(&fit, expected.get_or_insert(fit.clone()), "{form}");
        assert_eq!(names(), before, "{form}: nothing is written beside it");
    }
}

fn flip_middle(bytes: &mut [u8]) {
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
}

/// Of a database that is cut off, shorn of its definitions, or of other messages than it says: counted, told, no panic.
#[test]
fn damaged_bags_end_in_words() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let Some(bags) = bags(folder.path()) else { return };
    let at = |name: &str| folder.path().join(name);
    let inspect = |path: &Path| {
        let output = armcal([Path::new("inspect"), path]);
        let said = said(&output);
        assert!(!said.contains("panicked"), "{said}");
        (output.status.code(), said)
    };
    let cut = |bag: &Path, name: &str, share: f64| {
        changed(bag, &at(name), |bytes| bytes.truncate((bytes.len() as f64 * share) as usize))
    };
    let cases = [
        (cut(&bags["db3"], "cut", 0.8), Some(3), "read up to its message 1"),
        (cut(&bags["file"], "cut-zstd", 0.6), Some(3), "cut off"),
        (cut(&bags["mcap-file"], "cut-mcap", 0.6), Some(3), "cut off"),
        (cut(&bags["db3"], "head", 0.0001), Some(1), "cannot be read"),
        (changed(&bags["db3"], &at("other"), |bytes| bytes.truncate(16)), Some(1), "not a database"),
        (cut(&bags["ros1"], "cut-ros1", 0.6), Some(3), "cut off"),
        (cut(&bags["ros1-bz2"], "cut-bz2", 0.99), Some(3), "chunks"),
        (changed(&bags["ros1-bz2"], &at("flip-bz2"), |b| flip_middle(b)), Some(3), "does not inflate"),
    ];
    for (file, code, words) in cases {
        let (got, said) = inspect(&file);
        println!(
            "{}",
            said.lines()
                .filter(|l| l.contains("error") || l.contains("warning"))
                .collect::<Vec<_>>()
                .join("\n")
        );
        assert!(got == code && said.contains(words), "{}: {got:?} {said}", file.display());
    }
    // Bytes gone bad anywhere: an answer each time.
    for (k, form) in (0..80_usize).map(|k| (k, ["db3", "ros1", "ros1-lz4", "ros1-bz2"][k % 4])) {
        let file = changed(&bags[form], &at("flipped"), |bytes| {
            for i in 0..20 {
                let place = (k * 7919 + i * 104_729) * 31 % bytes.len();
                bytes[if k % 3 == 0 { place % 8192 } else { place }] ^= 1 << (i % 8);
            }
        });
        let (code, said) = inspect(&file);
        assert!(matches!(code, Some(0 | 1 | 3)), "{k}: {code:?} {said}");
    }
}

/// A definition that does not fit the messages reads numbers out of the wrong bytes: it is refused by what is left over.
#[test]
fn messages_longer_than_their_definition_are_refused() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let Some(bags) = bags(folder.path()) else { return };
    let python = python_with("rosbags").expect("found before");
    let wrong = "import sqlite3, sys; d = sqlite3.connect(sys.argv[1]); \
                 d.execute(\"UPDATE message_definitions SET encoded_message_definition = \
                 replace(encoded_message_definition, 'float64[] velocity', '')\"); d.commit()";
    let file = changed(&bags["db3"], &folder.path().join("wrong"), |_| ());
    let output = Command::new(python).args(["-c", wrong]).arg(&file).output().expect("python");
    assert!(output.status.success(), "{}", said(&output));
    let pipeline = folder.path().join("p.toml");
    let text = quick_pipeline(Path::new("here")).replace("here/normal.mcap", &file.to_string_lossy());
    std::fs::write(&pipeline, text).expect("pipeline");
    let output = armcal([Path::new("run"), &pipeline, Path::new("--out"), &folder.path().join("out")]);
    assert_eq!(output.status.code(), Some(1));
    let said = said(&output);
    assert!(said.contains("/joint_states") && said.contains("behind its last field"), "{said}");
}

/// What is proposed for a database is what is proposed for the same messages as MCAP, but for the path.
#[test]
fn a_pipeline_is_proposed_for_a_database_as_for_mcap() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let Some(bags) = bags(folder.path()) else { return };
    let [dh, board] =
        ["models/right_arm.toml", "boards/paper.toml"].map(|name| root().join("pipelines").join(name));
    let proposed = |form: &str| {
        let out = folder.path().join(format!("{form}.toml"));
        let files = [Path::new("--dh"), &dh, Path::new("--board"), &board, Path::new("--out"), &out];
        let output = armcal([&[Path::new("init"), &bags[form]], &files[..]].concat());
        assert_eq!(output.status.code(), Some(0), "{form}: {}", said(&output));
        let text = std::fs::read_to_string(out).expect("a pipeline");
        // The first line has the hash of the others.
        text.lines().skip(1).filter(|l| !l.contains(form)).map(str::to_owned).collect::<Vec<_>>()
    };
    let expected = proposed("mcap");
    assert!(expected.iter().any(|line| line.contains("[streams.joints]")), "{expected:?}");
    for form in ["old", "file", "split"] {
        // A split bag says that it has two parts, and after what both are called.
        let mut differ = proposed(form);
        differ.retain(|line| !expected.contains(line) && (form != "split" || line != "name = \"normal\""));
        assert!(differ.is_empty(), "{form}: {differ:?} {expected:?}");
    }
}
