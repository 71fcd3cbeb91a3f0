//! `armcal plan`: what to record next.

use super::{Outcome, joint_range, print};
use crate::error::Error;
use crate::progress::Progress;
use crate::view::Given;
use armcal_calibrate::{HoldoutConfig, calibrate};
use armcal_config::Pipeline;
use armcal_core::Arrival;
use armcal_model::{EffectSpec, Model};
use armcal_pipeline::Converged;
use armcal_plan::{
    Allowed, Known, Place, Proposal, Proposed, Standing, Tracking, propose, rivals_from_diagnosis,
    rivals_from_names,
};
use armcal_report::{number_cell, plain_table, table_text};
use armcal_stages::{Fitted, frames};
use clap::Args;
use comfy_table::Cell;
use nalgebra::Matrix3;
use std::path::PathBuf;

/// Standard error of a tracked tip that no recording shows and no pipeline declares [m].
const UNSEEN_SIGMA_M: f64 = 3e-4;

/// What `armcal plan` is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Pipeline file, or the results of its run (their folder or run.mcap): what these concluded is not looked for again.
    pub pipeline: PathBuf,
    /// Most dwells to propose.
    #[arg(long, default_value_t = 6)]
    pub dwells: usize,
    /// Effects to tell apart, such as compliance:2,belt_coupling; one alone is told from nothing. What the diagnosis
    /// leaves open when absent.
    #[arg(long)]
    pub effects: Option<String>,
    /// A load at hand [kg]; may be given again.
    #[arg(long = "load", value_name = "KG")]
    pub loads_kg: Vec<f64>,
    /// How far free poses may go beyond the recorded range of a joint [deg].
    #[arg(long = "margin", default_value_t = 30.0, value_name = "DEG")]
    pub margin_deg: f64,
    /// Range of one joint instead of that, such as 2=-75..20 [deg]; may be given again.
    #[arg(long = "range", value_name = "JOINT=LOW..HIGH", allow_hyphen_values = true)]
    pub ranges: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Calibrates, diagnoses, and proposes the dwells that tell apart what stands.
pub fn run(request: &Request) -> Result<Outcome, Error> {
    let given = Given::alone(&request.pipeline)?;
    let pipeline = Pipeline::load(&given.pipeline)?;
    let (_, chain) = frames::nominal_chain(&pipeline)?;
    let joints = chain.joint_names();
    let allowed = allowed_from_request(request, joints)?;
    let words = request.effects.as_deref().map(split_effects);
    for word in words.iter().flatten() {
        EffectSpec::parse(word, joints).map_err(Error::of_usage)?;
    }
    let progress = Progress::new();
    let settled = armcal_pipeline::settle_again(&pipeline, given.concluded, &progress)?;
    let diagnosis = settled.diagnose_and_refit(&pipeline, &progress)?;
    let open = match (&words, &diagnosis) {
        (Some(words), _) => rivals_from_names(words, diagnosis.as_ref(), joints)?,
        (None, Some(diagnosis)) => rivals_from_diagnosis(diagnosis, joints)?,
        (None, None) => return Err(Error::NotDiagnosed),
    };
    progress.step("weighing what could be recorded");
    let (model, values) = with_certain(&pipeline, &settled, &open)?;
    let known = Known {
        model: &model,
        values,
        observations: &settled.fitted.observations,
        session: &settled.fitted.session,
        fit: &pipeline.fit,
        board: settled.inputs.board.as_ref().filter(|_| pipeline.observations.seated),
        tracked: tracking_noise(&pipeline, &settled),
        recordings: settled.inputs.seen.iter().map(|s| s.name.clone()).collect(),
    };
    let proposal = propose(&known, &open, &allowed, &pipeline.diagnosis)?;
    progress.finish();
    print(&if request.json {
        super::json_text(&super::with_losses(serde_json::to_value(&proposal).map_err(Error::Json)?))?
    } else {
        proposal_text(&proposal, joints)
    })?;
    Ok(Outcome::Done)
}

/// Commas between effects; a part such as `frequency=30` belongs to the effect before it.
fn split_effects(words: &str) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for part in words.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        match all.last_mut() {
            Some(effect) if part.contains('=') => *effect = format!("{effect},{part}"),
            _ => all.push(part.to_owned()),
        }
    }
    all
}

fn allowed_from_request(request: &Request, joints: &[String]) -> Result<Allowed, Error> {
    let bad = |option, value: String, problem: &str| {
        Err(Error::BadOption { option, value, problem: problem.to_owned() })
    };
    if let Some(load) = request.loads_kg.iter().find(|l| !l.is_finite() || **l < 0.0) {
        return bad("--load", load.to_string(), "give a mass in kg, zero or more");
    }
    if !request.margin_deg.is_finite() || request.margin_deg < 0.0 {
        return bad("--margin", request.margin_deg.to_string(), "give an angle in degrees, zero or more");
    }
    let mut ranges_deg = Vec::new();
    for words in &request.ranges {
        match joint_range(words, joints) {
            Some(range) => ranges_deg.push(range),
            None => {
                let problem = "write a joint's number or name and its range in degrees, such as 2=-75..20";
                return bad("--range", words.clone(), problem);
            }
        }
    }
    let (dwells, loads_kg) = (request.dwells, request.loads_kg.clone());
    Ok(Allowed { dwells, loads_kg, margin_deg: request.margin_deg, ranges_deg })
}

/// The calibrated model with the effects that are beyond doubt, and its parameters.
fn with_certain(
    pipeline: &Pipeline,
    settled: &Converged,
    open: &Standing,
) -> Result<(Model, Vec<f64>), Error> {
    let Fitted { model, observations, session, calibration, .. } = &settled.fitted;
    if open.certain.is_empty() {
        return Ok((model.clone(), calibration.fit.values()));
    }
    let model = model.with_effects(&open.certain, session)?;
    let calibration = calibrate(&model, observations, &pipeline.fit, &HoldoutConfig::default())?;
    Ok((model, calibration.fit.values()))
}

/// How well the sensor saw the tip in the dwells of these recordings (their median).
fn tracking_noise(pipeline: &Pipeline, settled: &Converged) -> Option<Tracking> {
    if !pipeline.tip_is_tracked() || !pipeline.observations.tracked {
        return None;
    }
    let settings = &pipeline.observations;
    let mut seen: Vec<_> =
        settled.inputs.seen.iter().flat_map(|s| &s.dwells).filter_map(|d| d.tip.as_ref()).collect();
    seen.sort_by(|a, b| a.covariance_m2.trace().total_cmp(&b.covariance_m2.trace()));
    let floor_m2 = Matrix3::identity() * (settings.sensor_sigma_mm * 1e-3).powi(2);
    Some(match seen.get(seen.len() / 2) {
        Some(tip) => Tracking {
            covariance_m2: tip.covariance_m2 + floor_m2,
            orientation_sigma_rad: tip
                .orientation
                .map(|_| tip.orientation_sigma_rad.hypot(settings.sensor_sigma_deg.to_radians())),
        },
        None => Tracking {
            covariance_m2: Matrix3::identity() * UNSEEN_SIGMA_M.powi(2) + floor_m2,
            orientation_sigma_rad: None,
        },
    })
}

fn proposal_text(proposal: &Proposal, joints: &[String]) -> String {
    let mut text = format!("To tell apart: {}\n({})\n\n", proposal.explanations.join(", "), proposal.why);
    if !proposal.dwells.is_empty() {
        text.push_str(&dwell_table(proposal, joints));
        text.push('\n');
    }
    text.push_str(&pair_table(proposal));
    text.push_str(&format!("\n{}.\n", capitalise_first(&proposal.sentence)));
    let ranges = proposal.range_deg.iter().zip(joints);
    let ranges: Vec<String> =
        ranges.map(|([low, high], name)| format!("{name} {low:.0}..{high:.0}")).collect();
    text.push_str(&format!("\nWeighed {} dwells within {} deg.\n", proposal.pool, ranges.join(", ")));
    for assumption in &proposal.assumptions {
        text.push_str(&format!("- {assumption}\n"));
    }
    text
}

fn dwell_table(proposal: &Proposal, joints: &[String]) -> String {
    let mut table = plain_table();
    let mut header = vec!["".to_owned(), "where".to_owned()];
    header.extend(joints.iter().map(|name| format!("{name} [deg]")));
    header.extend(["arrive", "load [kg]", "Delta"].map(str::to_owned));
    table.set_header(header);
    for (i, dwell) in proposal.dwells.iter().enumerate() {
        let mut cells = vec![number_cell(format!("{}", i + 1)), Cell::new(place_text(dwell))];
        cells.extend(dwell.joint_deg.iter().map(|q| number_cell(format!("{q:.1}"))));
        cells.push(Cell::new(dwell.arrival.iter().map(Arrival::symbol).collect::<String>()));
        cells.push(number_cell(format!("{}", dwell.load_kg)));
        cells.push(number_cell(format!("{:.1}", dwell.delta)));
        table.add_row(cells);
    }
    table_text(&table)
}

fn pair_table(proposal: &Proposal) -> String {
    let mut table = plain_table();
    table.set_header(["pair", "Delta now", "then", "motion or sensor"]);
    for pair in &proposal.pairs {
        table.add_row([
            Cell::new(pair.names.join(" or ")),
            number_cell(format!("{:.1}", pair.delta_before)),
            number_cell(format!("{:.1}", pair.delta_after)),
            Cell::new(pair.sensor.as_deref().unwrap_or("these dwells")),
        ]);
    }
    table_text(&table)
}

fn place_text(dwell: &Proposed) -> String {
    match &dwell.place {
        Place::Cavity { cavity, recording, slide_from_deg } => {
            let way =
                slide_from_deg.map_or("straight down".to_owned(), |deg| format!("slid in from {deg:.0} deg"));
            format!("{cavity} (board as in {recording}), {way}")
        }
        Place::Free => "free pose".to_owned(),
        Place::Joined => "tips joined".to_owned(),
        Place::Again { dwell } => format!("again: {dwell}"),
    }
}

fn capitalise_first(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters
        .next()
        .map(|first| first.to_uppercase().collect::<String>() + letters.as_str())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::split_effects;

    #[test]
    fn a_shape_stays_with_its_effect() {
        assert_eq!(
            split_effects("backlash:1, periodic:2,frequency=30"),
            ["backlash:1", "periodic:2,frequency=30"]
        );
    }
}
