//! Tables as recordings: what a lab published of one session in any form ends in the same calibration.

use crate::support::{armcal, number, python_with, root, run_pipeline};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The tables that `write_tables.py` makes of one session of the Panda; the folder.
fn tables(folder: &Path) -> Option<PathBuf> {
    let python = python_with("pyarrow, scipy")?;
    let script = root().join("tests/python/write_tables.py");
    let urdf = urdf();
    let links = ["panda_link0", "panda_link8"].map(Path::new);
    let output =
        Command::new(python).arg(&script).args([folder, &urdf]).args(links).output().expect("python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(folder.to_owned())
}

fn urdf() -> PathBuf {
    root().join("fixtures/mukca-panda4/panda.urdf")
}

fn said(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text)).concat()
}

/// Proposes for a table and runs what is proposed: the text of the pipeline and the summary of the run.
fn calibrated(table: &Path, folder: &Path) -> (String, Value) {
    let pipeline = folder.join(table.file_name().expect("a name")).with_added_extension("toml");
    let output =
        armcal([Path::new("init"), table, Path::new("--urdf"), &urdf(), Path::new("--out"), &pipeline]);
    assert_eq!(output.status.code(), Some(0), "{}: {}", table.display(), said(&output));
    let text = std::fs::read_to_string(&pipeline).expect("a pipeline");
    let summary = run_pipeline(&pipeline, &pipeline.with_extension("out"), &[0, 3]);
    (text, summary)
}

/// 20 um of noise in each axis, 0.5 mm and 0.3 deg off at each joint: what is left is some tens of micrometres.
#[test]
fn every_form_of_a_table_ends_in_the_calibration_of_its_session() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let Some(tables) = tables(&folder.path().join("tables")) else { return };
    for (name, says) in [
        ("counted.csv", "position = \"row.*\""),
        ("named.csv", "unit = \"deg\""),
        ("tabs.tsv", "/columns/tool"),
        ("plain.csv", "position = \"row.*\""),
        ("matrices.npz", "/columns/T_world_tool"),
        ("points.npz", "/columns/tip_position"),
        ("lists.parquet", "position = \"row.joints[]\""),
        ("columns.parquet", "topic = \"/columns/tip\""),
        ("stream.csv", "topic = \"/columns/tip\""),
        ("lerobot", "observation.state"),
    ] {
        let (text, summary) = calibrated(&tables.join(name), folder.path());
        let mm = number(&summary, "/fit/holdout/fitted_mm/mean");
        println!("{name}: {mm:.4} mm");
        assert!(text.contains(says), "{name}: {says}: {text}");
        assert!(mm < 0.15, "{name}: {mm} mm");
    }
}

/// What is assumed of a table is said, what of it cannot be read is lost aloud, and what is none is refused in words.
#[test]
fn what_a_table_does_not_say_is_said() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let at = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        path
    };
    let rows: String = (0..40).map(|i| format!("{},{},{},{},1\n", i % 7, i % 5, i % 3, i % 4)).collect();
    let stream: String = (0..400).map(|i| format!("{0},{0}\n", (f64::from(i) * 0.02).sin())).collect();
    for (path, code, words) in [
        (at("poses.csv", &format!("q1,q2,x,y,z\n{rows}")), 0, "40 rows are taken for poses at rest"),
        (at("short.csv", &format!("q1,q2,x,y,z\n{rows}1,2\n")), 3, "1 rows have more or fewer cells"),
        (at("stream.csv", &format!("q1,q2\n{stream}")), 1, "name it `time`"),
        (at("empty.csv", "q1,q2,x,y,z\n"), 1, "without any row"),
        (at("none.parquet", "PAR1 and no more"), 1, "Parquet file that cannot be read"),
        (at("none.npz", "PK"), 1, "no archive of NumPy arrays"),
    ] {
        let output = armcal([Path::new("inspect"), &path]);
        let said = said(&output);
        assert!(output.status.code() == Some(code) && said.contains(words), "{}: {said}", path.display());
        assert!(!said.contains("panicked"), "{said}");
    }
}

/// Bytes gone bad anywhere in a table: an answer each time, in words.
#[test]
fn damaged_tables_end_in_words() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let Some(tables) = tables(&folder.path().join("tables")) else { return };
    for (name, k) in ["lists.parquet", "columns.parquet", "matrices.npz", "points.npz", "named.csv"]
        .into_iter()
        .flat_map(|name| (0..24_usize).map(move |k| (name, k)))
    {
        let mut bytes = std::fs::read(tables.join(name)).expect("readable");
        let length = bytes.len();
        if k % 4 == 3 {
            bytes.truncate(length * k / 24);
        }
        for i in 0..=k % 3 {
            // The ends have what describes the rest.
            let place = (k * 7919 + i * 104_729) * 31 % length;
            let place = if k % 2 == 0 { place } else { length.saturating_sub(1 + place % 400) };
            if let Some(byte) = bytes.get_mut(place) {
                *byte ^= 1 << (k % 8);
            }
        }
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).expect("written");
        let output = armcal([Path::new("inspect"), &file]);
        let said = said(&output);
        assert!(matches!(output.status.code(), Some(0 | 1 | 3)), "{name} {k}: {said}");
        assert!(!said.contains("panicked"), "{name} {k}: {said}");
    }
}
