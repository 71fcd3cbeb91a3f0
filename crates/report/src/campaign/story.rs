//! What a campaign comes to: how many, how well, what is wrong, what to do next.

use super::describe::{change_meaning, change_sentence};
use armcal_campaign::{ErrorFigures, Row, Status};
use armcal_core::units::format_mm;
use armcal_core::{Severity, list_names, printable_name};
use armcal_result::Campaign;
use armcal_wording::{Story, ToldWarning};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// The end of a campaign.
pub(super) fn campaign_story(campaign: &Campaign) -> Story {
    let wrong = problem_summary(campaign);
    let wrong = (!wrong.is_empty()).then(|| format!("{}.", wrong.join("; ")));
    Story::undiagnosed(
        campaign_conclusion(campaign),
        wrong.into_iter().collect(),
        campaign.status(),
        next_steps(campaign),
        grave_warnings(campaign),
    )
}

/// What it comes to, in one sentence.
pub(super) fn campaign_conclusion(campaign: &Campaign) -> String {
    let (done, failed) = (campaign.rows.len(), campaign.failed.len());
    let of = done + failed;
    let median = |of: fn(&Row) -> &ErrorFigures| {
        let mut means: Vec<f64> = campaign.counted().filter_map(|r| of(r).mean_m).collect();
        means.sort_by(f64::total_cmp);
        means.get(means.len() / 2).map(|m| format_mm(*m))
    };
    let errors = match (median(|r| &r.nominal), median(|r| &r.calibrated)) {
        (Some(before), Some(after)) => format!(": mean error {before} mm before, {after} mm after (median)"),
        _ => String::new(),
    };
    let changes = match campaign.changes.len() {
        0 => "nothing changed beyond scatter".to_owned(),
        1 => "1 change".to_owned(),
        n => format!("{n} changes"),
    };
    let once = match done - campaign.counted().count() {
        0 => String::new(),
        1 => ", 1 of them a repetition that counts once".to_owned(),
        n => format!(", {n} of them repetitions that count once"),
    };
    format!("{done} of {of} recordings calibrated{once}{errors}; {changes}.")
}

/// How many are doubtful, and what is named in them.
fn problem_summary(campaign: &Campaign) -> Vec<String> {
    let count = |status| campaign.rows.iter().filter(|row| row.status == status).count();
    let told = [
        (campaign.failed.len(), "not calibrated at all"),
        (count(Status::DataLost), "calibrated from damaged data"),
        (count(Status::Inadequate), "inadequate"),
    ];
    let all = campaign.rows.len() + campaign.failed.len();
    let doubtful = told.into_iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} of {all} {what}"));
    let named = missing_effect_counts(campaign)
        .into_iter()
        .map(|(name, n)| format!("{name} missing in {n} of {all}"));
    doubtful.chain(named.take(1)).collect()
}

/// What the diagnosis names, and in how many recordings, the most frequent first. Moments differ from recording to recording
/// and are left away.
fn missing_effect_counts(campaign: &Campaign) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for row in campaign.counted() {
        let kinds = row.missing.iter().map(|name| name.split('@').next().unwrap_or(name).to_owned());
        kinds.collect::<std::collections::BTreeSet<_>>().into_iter().for_each(|kind| {
            *counts.entry(printable_name(&kind)).or_default() += 1;
        });
    }
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    counts
}

fn next_steps(campaign: &Campaign) -> Vec<String> {
    let failed = campaign.failed.first().map(|f| {
        let more = match campaign.failed.len() {
            1 => String::new(),
            n => format!(" (and {} more under \"Not calibrated\")", n - 1),
        };
        format!(
            "mend what keeps `{}` from being calibrated{more}: {}",
            printable_name(&f.recording),
            printable_name(&f.why)
        )
    });
    let worst = (campaign.rows.iter().zip(&campaign.folders))
        .filter(|(row, _)| row.status != Status::Ok)
        .filter_map(|(row, folder)| Some((row, folder, row.calibrated.mean_m?)))
        .max_by(|a, b| a.2.total_cmp(&b.2));
    let worst = worst.map(|(row, folder, mean_m)| {
        format!(
            "look at `{}` first, which errs most of the doubtful ones ({} mm): its warnings are below, and in `{}`",
            printable_name(&row.recording),
            format_mm(mean_m),
            printable_name(&format!("{folder}/summary.json"))
        )
    });
    // An event is no part of the arm: there is nothing to add for other recordings.
    let lasting = |name: &str| campaign.rows.iter().flat_map(|row| &row.missing).any(|m| m == name);
    let effect = missing_effect_counts(campaign).into_iter().find(|(name, n)| *n > 1 && lasting(name)).map(|(name, n)| {
        format!("`armcal add {name} PIPELINE` adds what {n} recordings name; run the campaign again with what it writes")
    });
    let change = campaign.changes.first().map(|c| {
        let meaning = change_meaning(c).map_or(String::new(), |meaning| format!(" ({meaning}?)"));
        format!("find out what changed: {}{meaning}", change_sentence(campaign, c))
    });
    let steps: Vec<String> = [failed, worst, effect, change].into_iter().flatten().collect();
    if steps.is_empty() && campaign.status() == Status::Ok && campaign.rows.len() > 1 {
        return vec!["`armcal pool` calibrates the arm on all of them together".to_owned()];
    }
    steps
}

/// What keeps recordings from being calibrated or relied upon, what several have once, the gravest first. Notices are left to
/// the results of each.
fn grave_warnings(campaign: &Campaign) -> Vec<ToldWarning> {
    let mut all: BTreeMap<(Reverse<Severity>, &str), Vec<String>> = BTreeMap::new();
    for f in &campaign.failed {
        all.entry((Reverse(Severity::DataLost), &f.why)).or_default().push(printable_name(&f.recording));
    }
    for row in &campaign.rows {
        for (text, severity) in row.warnings.iter().zip(&row.severities) {
            let grave = [Severity::Inadequate, Severity::DataLost].into_iter().find(|s| s.word() == severity);
            if let Some(severity) = grave {
                all.entry((Reverse(severity), text)).or_default().push(printable_name(&row.recording));
            }
        }
    }
    let told =
        |((Reverse(severity), text), recordings): ((Reverse<Severity>, &str), Vec<String>)| ToldWarning {
            severity,
            code: String::new(),
            subject: list_names(&recordings),
            message: printable_name(text),
        };
    all.into_iter().map(told).collect()
}
