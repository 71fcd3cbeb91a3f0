//! The page of `armcal compare`: two results, dwell by dwell.

use super::embed;
use super::shell::Shell;
use crate::ReportError;
use crate::comparison::{comparison_sentence, difference_shown, moved_shown};
use armcal_result::{Comparison, Difference, StoredRun, pair_dwells};
use askama::Template;
use serde_json::{Value, json};

/// Two results, compared already, as one HTML page.
///
/// # Errors
/// A template or document that cannot be written.
pub fn comparison_html(
    before: &StoredRun,
    after: &StoredRun,
    comparison: &Comparison,
) -> Result<String, ReportError> {
    let with = |name: &str, effects: &[String]| match effects.is_empty() {
        true => name.to_owned(),
        false => format!("{name} with {}", effects.join(", ")),
    };
    let [own, other] = &comparison.effects;
    let kicker = format!("{} against {}", with(&before.pipeline, own), with(&after.pipeline, other));
    let title = format!("{} and {}", before.pipeline, after.pipeline);
    let scripts = [embed::TEXT, embed::CHART, include_str!("assets/compared.js")];
    let document = comparison_document(before, after, comparison);
    let shell = Shell::new("comparison-page", (title, kicker), &scripts, &document)?;
    Ok(ComparePage { shell: shell.saying(comparison_sentence(comparison)), comparison }.render()?)
}

#[derive(Template)]
#[template(path = "compare.html")]
struct ComparePage<'a> {
    shell: Shell,
    comparison: &'a Comparison,
}

/// What the page's scripts draw.
fn comparison_document(before: &StoredRun, after: &StoredRun, comparison: &Comparison) -> Value {
    let pairs = pair_dwells(before, after).pairs;
    let mut recordings: Vec<&str> = Vec::new();
    let rows = pairs.iter().map(|(earlier, r)| {
        let recording = recordings.iter().position(|known| *known == r.recording).unwrap_or_else(|| {
            recordings.push(&r.recording);
            recordings.len() - 1
        });
        json!({
            "recording": recording,
            "dwell": r.dwell.dwell,
            "cavity": r.cavity,
            "before_mm": earlier.error_m * 1e3,
            "after_mm": r.error_m * 1e3,
        })
    });
    let rows: Value = rows.collect();
    let change = |k: &usize| pairs[*k].1.error_m * 1e3 - pairs[*k].0.error_m * 1e3;
    let mut by_change: Vec<usize> = (0..pairs.len()).collect();
    by_change.sort_by(|a, b| change(a).total_cmp(&change(b)));
    let named = |(name, d): (String, Difference)| -> Value {
        json!({ "name": name, "difference_mm": d.difference_mm, "ci95_mm": d.ci95_mm })
    };
    json!({
        "recordings": recordings.iter().map(|name| json!({ "name": name })).collect::<Value>(),
        "pairs": rows,
        // Indices into `pairs`, the most improved first.
        "by_change": by_change,
        "differences": comparison.differences().into_iter().map(named).collect::<Value>(),
    })
}
