//! `armcal export`: the residual problem of a pipeline, to solve it with another tool.

use super::{Outcome, may_write, print};
use crate::error::Error;
use crate::progress::Progress;
use armcal_calibrate::position_covariance_m2;
use armcal_config::Pipeline;
use armcal_core::{Observation, Parameter, Pose, Reference};
use armcal_recording::atomic;
use armcal_result::Run;
use nalgebra::SMatrix;
use serde_json::{Value, json};
use std::path::Path;

/// Runs the pipeline and writes its least-squares problem with armcal's own answer beside it.
pub fn run(pipeline: &Path, out: &Path) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load(pipeline)?;
    may_write([out])?;
    let progress = Progress::new();
    let (run, _) = armcal_pipeline::settle(&pipeline, &progress)?.diagnosed(&pipeline, &progress);
    progress.finish();
    let text = format!("{:#}\n", super::with_losses(problem_json(&run)));
    atomic::write(out, text.as_bytes()).map_err(Error::Output)?;
    print(&format!("{}\n", out.display()))?;
    Ok(Outcome::Done)
}

/// Everything a solver needs that does not share armcal's code: the nominal arm, the observations with the
/// covariances that whiten their residuals, the parameters with bounds and priors, and which of them the fit saw.
fn problem_json(run: &Run) -> Value {
    let model = &run.model;
    let fit = &run.calibration.fit;
    // Held out in turn, every observation takes part in the fit whose parameters are written.
    let in_turn = run.calibration.train.fitted.n == run.observations.len();
    let rows = run.observations.iter().zip(&run.calibration.residuals);
    let observations: Vec<Value> = rows
        .map(|(o, residual)| {
            let mut row = observation_json(o);
            if let Some(marker) = model.marker_name(o.feature) {
                row["feature"] = json!(marker);
            }
            row["covariance_m2"] =
                json!(matrix_rows(&position_covariance_m2(model, &run.calibration.nominal_values, o)));
            row["in_fit"] = json!(!residual.held_out || in_turn);
            row
        })
        .collect();
    json!({
        "schema": "armcal.problem/1",
        "pipeline": run.pipeline_name,
        "model": run.model_texts[0],
        "sigma_scale": fit.sigma_scale,
        "parameters": model.parameters().iter().zip(fit.values()).map(parameter_json).collect::<Vec<Value>>(),
        "frames": frames_json(run),
        "board_names": run.recordings.iter().map(|r| format!("board.{}", r.name)).collect::<Vec<String>>(),
        "observations": observations,
    })
}

fn frames_json(run: &Run) -> Value {
    let nominal = run.model.nominal();
    let matrix = |pose: Pose| json!(matrix_rows(&pose.to_homogeneous()));
    let boards: Vec<Value> =
        (0..run.recordings.len()).filter_map(|r| run.model.board_in_world(&nominal, r)).map(matrix).collect();
    json!({
        "world_from_base": matrix(run.model.base_in_world(&nominal)),
        "last_link_from_tip": matrix(run.model.tip_in_last_link(&nominal)),
        "world_from_board": boards,
    })
}

/// A square matrix as rows.
fn matrix_rows<const N: usize>(m: &SMatrix<f64, N, N>) -> Vec<Vec<f64>> {
    m.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn parameter_json((p, value): (&Parameter, f64)) -> Value {
    let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    json!({
        "name": p.name, "unit": p.unit.symbol(), "nominal": p.nominal, "lower": finite(p.lower),
        "upper": finite(p.upper), "prior_sigma": p.prior_sigma, "free": p.free, "value": value,
    })
}

fn observation_json(o: &Observation) -> Value {
    let reference = match &o.reference {
        Reference::Seated { cavity, in_board_m } => {
            json!({"cavity": cavity, "in_board_m": in_board_m.as_slice()})
        }
        Reference::Tracked { position_m, .. } => json!({"position_m": position_m.as_slice()}),
        Reference::Joined { to } => json!({"joined_to": to}),
        Reference::Number { kind, to, length, reading_m } => {
            json!({"measured": kind, "to": to, "length": length, "reading_m": reading_m})
        }
    };
    json!({
        "recording": o.dwell.recording, "dwell": o.dwell.dwell, "joint_rad": o.joint_rad, "reference": reference,
    })
}
