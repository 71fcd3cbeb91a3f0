use crate::support::{armcal, number, paper_pipeline, root, run_pipeline};
use serde_json::Value;
use std::path::Path;

fn compared(before: &Path, after: &Path) -> Value {
    let output = armcal([Path::new("compare"), before, after, Path::new("--json")]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// A model whose joint zeros may not move must do worse on the same held-out points, and by what the two summaries say.
#[test]
fn a_crippled_model_is_seen_to_do_worse_on_the_same_points() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let crippled = folder.path().join("crippled.toml");
    let fixed = "\n[[parameters]]\nname = \"joint?.a\"\nfree = false\n";
    std::fs::write(&crippled, paper_pipeline(&root().join("fixtures/paper")) + fixed).expect("pipeline");
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    let full = run_pipeline(&root().join("pipelines/paper.toml"), &a, &[0]);
    let less = run_pipeline(&crippled, &b, &[0, 3]);

    let comparison = compared(&a, &b.join("run.mcap"));
    let mean = |summary: &Value| number(summary, "/fit/holdout/fitted_mm/mean");
    let difference = number(&comparison, "/held_out/difference_mm");
    assert!((difference - (mean(&less) - mean(&full))).abs() < 1e-9);
    assert!(number(&comparison, "/held_out/ci95_mm/0") > 0.0, "{comparison:#}");
    assert_eq!(number(&comparison, "/unmatched"), 0.0);
    let text = String::from_utf8(armcal([Path::new("compare"), &a, &b]).stdout).expect("text");
    assert!(text.contains("the mean error rises from"), "{text}");

    let same = compared(&a, &a);
    assert_eq!(number(&same, "/held_out/difference_mm"), 0.0);
    assert!(same["moved"].as_array().expect("list").iter().all(|m| number(m, "/in_half_widths") == 0.0));
}

#[test]
fn a_recording_that_is_no_result_is_refused_by_name() {
    let recording = root().join("fixtures/paper/normal.mcap");
    let output = armcal([Path::new("compare"), &recording, &recording]);
    assert_eq!(output.status.code(), Some(1));
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(words.contains("normal.mcap") && words.contains("/armcal/report"), "{words}");
}
