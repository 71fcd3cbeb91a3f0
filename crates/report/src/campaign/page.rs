//! The page of a campaign: errors over time, every change with its series, every recording.

use super::describe::{self, change_meaning, change_sentence, repeat_sentence};
use super::story::campaign_story;
use crate::ReportError;
use crate::page::embed;
use crate::page::shell::Shell;
use armcal_campaign::{Row, Series};
use armcal_result::Campaign;
use armcal_wording::ToldWarning;
use askama::Template;
use serde_json::{Value, json};

/// Points of one curve; more are thinned out evenly.
const MOST_POINTS: usize = 5000;

/// A campaign as one offline HTML page.
#[derive(Template)]
#[template(path = "campaign.html")]
pub(super) struct CampaignPage<'a> {
    shell: Shell,
    next: Vec<String>,
    changes: Vec<(String, &'static str)>,
    rows: Vec<(&'a Row, &'a String)>,
    failed: &'a [armcal_result::FailedRecording],
    repeats: Vec<String>,
    warnings: Vec<ToldWarning>,
}

impl<'a> CampaignPage<'a> {
    /// # Errors
    /// Data that cannot be written as JSON.
    pub fn of(campaign: &'a Campaign) -> Result<CampaignPage<'a>, ReportError> {
        let scripts = [embed::TEXT, embed::CHART, include_str!("../page/assets/campaign.js")];
        let name = &campaign.pipeline;
        let names = (format!("{name}, campaign"), format!("{name} · every recording calibrated by itself"));
        let shell = Shell::new("campaign-page", names, &scripts, &campaign_document(campaign))?;
        let story = campaign_story(campaign);
        let told = campaign
            .changes
            .iter()
            .map(|c| (change_sentence(campaign, c), change_meaning(c).unwrap_or_default()));
        Ok(CampaignPage {
            shell: shell.telling(&story),
            next: story.next,
            changes: told.collect(),
            rows: campaign.rows.iter().zip(&campaign.folders).collect(),
            failed: &campaign.failed,
            repeats: campaign.repeats.iter().map(|r| repeat_sentence(campaign, r)).collect(),
            warnings: story.warnings,
        })
    }
}

/// What the page's script draws: errors of every recording [mm] and quantities in their display units, by time.
fn campaign_document(campaign: &Campaign) -> Value {
    let rows = &campaign.rows;
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by_key(|i| (rows[*i].start_ns, *i));
    let order = thin_evenly(order);
    let mm = |f: fn(&Row) -> Option<f64>| -> Vec<Option<f64>> {
        order.iter().map(|i| f(&rows[*i]).map(|m| m * 1e3)).collect()
    };
    // What changes is shown first; a quantity that no other recording has is no curve.
    let mut series: Vec<&Series> = campaign.series.iter().filter(|s| s.points.len() > 1).collect();
    let changed = |s: &Series| campaign.changes.iter().any(|c| c.quantity == s.quantity);
    series.sort_by_key(|s| !changed(s));
    json!({
        "recordings": rows.iter().map(|r| r.recording.as_str()).collect::<Value>(),
        "errors": {
            "row": order,
            "time_ms": order.iter().map(|i| rows[*i].start_ns / 1_000_000).collect::<Value>(),
            "before": mm(|r| r.nominal.mean_m),
            "after": mm(|r| r.calibrated.mean_m),
            "floor": mm(|r| Some(r.noise_floor_m).filter(|m| m.is_finite())),
        },
        "curves": series.into_iter().map(|s| curve_json(campaign, s)).collect::<Value>(),
    })
}

fn curve_json(campaign: &Campaign, series: &Series) -> Value {
    use armcal_campaign::ChangeKind::{Outlier, Step, Trend};
    let points = thin_evenly(series.points.clone());
    let own = campaign.changes.iter().filter(|c| c.quantity == series.quantity);
    let marks = own.filter_map(|c| match c.kind {
        Step { after, .. } => Some(after),
        Outlier { at } => Some(at),
        Trend { .. } => None,
    });
    let unit = series.unit;
    json!({
        "name": series.quantity,
        "unit": unit.display_symbol(),
        "row": points.iter().map(|p| p.row).collect::<Value>(),
        "time_ms": points.iter().map(|p| p.time_ns / 1_000_000).collect::<Value>(),
        "value": points.iter().map(|p| unit.to_display(p.value)).collect::<Value>(),
        // Half widths of the 95 % intervals.
        "half": points.iter().map(|p| p.sigma.map(|s| 1.96 * unit.to_display(s))).collect::<Vec<_>>(),
        // Rows at which something changes.
        "marks": marks.collect::<Value>(),
    })
}

fn thin_evenly<T>(all: Vec<T>) -> Vec<T> {
    let stride = all.len().div_ceil(MOST_POINTS).max(1);
    all.into_iter().step_by(stride).collect()
}
