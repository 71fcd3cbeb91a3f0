//! `report.html`: a run on one page that needs no network and no manual; served by `armcal view` it refits live.
//!
//! The numbers are worked out here and embedded as one JSON document; the page's scripts only draw. The page that is
//! opened from disk and the one that is served are the same; the served one may ask for refits.
//!
//! * [`Basis`]: what all refits share, with `sensitivity` (implied errors of joints and lengths);
//! * `shown`: one calibration as it is drawn, with `bands`, `groups`, `signature`;
//! * `document`: all of it as one value; `embed`: how it gets into the page; `quality`: the tables about the data;
//! * `shell`: what all pages have in common; `compared`: that of
//!   `armcal compare`.

mod compared;
mod document;
pub(crate) mod embed;
mod quality;
pub(crate) mod shell;
mod shown;

pub use compared::comparison_html;

use crate::ReportError;
use armcal_calibrate::Calibration;
use armcal_core::ErrorStats;
use armcal_core::units::format_mm;
use armcal_diagnose::{FoundEffect, NotTestable};
use armcal_result::by_marker::{MarkerErrors, by_marker};
use armcal_result::sensitivity::Basis;
use armcal_result::summary::Explanation;
use armcal_result::{Refit, Run};
use armcal_wording::{
    Story, ToldWarning, WITH_CURVES, explanations, joined_tips_text, kind_of, nested_sentence,
    shown_unlisted, sizes_of, unlisted_text, unlisted_toml,
};
use askama::Template;
use document::Document;
use shell::Shell;
use shown::Shown;

/// The page's own scripts, in the order in which they use each other.
const SCRIPTS: [&str; 12] = [
    embed::TEXT,
    embed::CHART,
    embed::TIME,
    include_str!("assets/page.js"),
    include_str!("assets/headline.js"),
    include_str!("assets/path.js"),
    include_str!("assets/candidates.js"),
    include_str!("assets/signature.js"),
    include_str!("assets/joints.js"),
    include_str!("assets/where.js"),
    include_str!("assets/parameters.js"),
    include_str!("assets/live.js"),
];

/// What differs in a page that has a server which refits: whom it may talk to, and whether it shows its form.
const LIVE: [[&str; 2]; 2] = [
    ["connect-src &#39;none&#39;", "connect-src &#39;self&#39;"],
    ["<section id=\"live\" class=\"no-print\" hidden>", "<section id=\"live\" class=\"no-print\">"],
];

/// The run as one HTML page.
///
/// # Errors
/// A template or document that cannot be written.
pub fn report_html(run: &Run, basis: &Basis) -> Result<String, ReportError> {
    let story = Story::of(run);
    let title = run.pipeline_name.clone();
    let about = joined_tips_text(run).map(|about| format!("{title} · {about}"));
    let kicker = about.unwrap_or_else(|| title.clone());
    let shell = Shell::new("report-page", (title, kicker), &SCRIPTS, &Document::of(run, basis))?;
    let page = ReportPage {
        shell: shell.telling(&story),
        verdict: verdict(run),
        run,
        recordings: quality::recording_rows(run),
        markers: by_marker(run),
        rejections: quality::rejection_rows(run),
        next: &story.next,
        warnings: &story.warnings,
    };
    Ok(page.render()?)
}

/// The page of a run as `armcal view` serves it; none of a text that is no such page.
pub fn live_page(page: &str) -> Option<String> {
    LIVE.iter().try_fold(page.to_owned(), |page, [file, live]| {
        page.contains(file).then(|| page.replacen(file, live, 1))
    })
}

/// A refit of the run as JSON, as the page's document holds it.
///
/// # Errors
/// A document that cannot be written.
pub fn refit_json(run: &Run, basis: &Basis, refit: &Refit) -> Result<String, ReportError> {
    serde_json::to_string(&Shown::of(run, basis, refit)).map_err(ReportError::Page)
}

#[derive(Template)]
#[template(path = "report.html")]
struct ReportPage<'a> {
    shell: Shell,
    verdict: Verdict,
    run: &'a Run,
    recordings: Vec<quality::RecordingRow<'a>>,
    markers: Vec<MarkerErrors<'a>>,
    rejections: Vec<quality::RejectionRow>,
    next: &'a [String],
    warnings: &'a [ToldWarning],
}

/// What the diagnosis says, in sentences.
#[derive(Default)]
struct Verdict {
    found: Vec<String>,
    /// Tables to paste into the pipeline for what is unlisted.
    paste: Vec<String>,
    same: Vec<[String; 2]>,
    unseen: Vec<NotTestable>,
    explanations: Vec<Explanation>,
}

fn verdict(run: &Run) -> Verdict {
    let Some(d) = &run.diagnosis else { return Verdict::default() };
    let names = run.recording_names();
    Verdict {
        found: (d.effects.iter().map(|e| effect_sentences(e, &error_fall_text(run, e))))
            .chain(shown_unlisted(d).map(unlisted_text))
            .chain(d.beside_curves().iter().map(|e| format!("{WITH_CURVES}{}", effect_sentences(e, ""))))
            .chain(d.nested.iter().map(nested_sentence))
            .map(|said| run.in_words(&said))
            .collect(),
        paste: shown_unlisted(d).map(unlisted_toml).filter(|table| !table.is_empty()).collect(),
        same: d.cannot_tell_apart.iter().map(|pair| pair.each_ref().map(|name| names.label(name))).collect(),
        unseen: (d.not_testable.iter().cloned())
            .map(|n| NotTestable { effect: names.label(&n.effect), ..n })
            .collect(),
        explanations: (explanations(d).into_iter())
            .map(|e| Explanation {
                number: names.number_label(&e.number),
                sentence: run.in_words(&e.sentence),
            })
            .collect(),
    }
}

/// A found effect in sentences, `fall` what it takes of the error.
fn effect_sentences(e: &FoundEffect, fall: &str) -> String {
    let summary = kind_of(e).map_or(String::new(), |kind| format!(": {}", kind.summary));
    let set = if e.set.len() > 1 { format!(" (one of {})", e.set.join(", ")) } else { String::new() };
    let rival =
        e.rival.as_ref().map_or(String::new(), |r| format!(" The next best explanation is {}.", r.name));
    let pairs = match &e.contrast {
        Some(c) if c.agrees => {
            format!(" {} pairs of dwells that differ only in {} confirm it.", c.pairs, c.differs)
        }
        _ => String::new(),
    };
    format!("{}{set}{summary}. Its size: {}.{fall}{rival}{pairs}", e.name, sizes_of(e))
}

/// How the error falls with an effect: that of the refits that the page shows, not that of the weighing.
fn error_fall_text(run: &Run, e: &FoundEffect) -> String {
    let step = run.steps.iter().position(|step| step.effects.last() == Some(&e.name));
    step.map_or(String::new(), |k| {
        let before = k.checked_sub(1).map_or(&run.calibration, |k| &run.steps[k].calibration);
        let after = &run.steps[k].calibration;
        let mean = |c: &Calibration| format_mm(judged_errors(c).mean_m);
        let fitted = |c: &Calibration| format_mm(c.train.fitted.mean_m);
        if judged_errors(after).mean_m < judged_errors(before).mean_m || !after.held_out() {
            return format!(" With it the mean error goes from {} to {} mm.", mean(before), mean(after));
        }
        // Where a fold holds all that shows an effect, the fold cannot learn it.
        format!(
            " With it the mean error of the fitted points goes from {} to {} mm; that of held-out ones is {} and {} mm.",
            fitted(before),
            fitted(after),
            mean(before),
            mean(after)
        )
    })
}

/// Errors on points that the fit never saw, or on all where nothing was held out.
fn judged_errors(c: &Calibration) -> &ErrorStats {
    &c.judged().fitted
}
