//! The plan for a model: which of many possible dwells separate effects that these observations leave standing.

use crate::confusion::one_step;
use crate::plan::{Plan, PoolDwell, Survivor, plan};
use crate::projection::Projection;
use crate::{DiagnoseError, DiagnosisConfig};
use armcal_calibrate::{Calibration, FitConfig, Linearisation, linearise};
use armcal_core::Observation;
use armcal_model::{EffectSpec, Model, PlacedEffect, Session};
use nalgebra::{DMatrix, DVector};

/// Chooses up to `count` observations of `pool` that best separate `survivors`, each at the size fitted to
/// `observations`. A single survivor is separated from "nothing" at its typical size.
///
/// `calibration` is that of `model` on `observations`. The pool holds observations that could be made: joint readings,
/// arrival directions, load, the covariance to expect, a recording of the model; what was measured does not matter.
#[allow(clippy::too_many_arguments, reason = "what a calibration is made of, and what could be added to it")]
pub fn plan_dwells(
    model: &Model,
    calibration: &Calibration,
    observations: &[Observation],
    session: &Session,
    fit: &FitConfig,
    survivors: &[EffectSpec],
    pool: &[Observation],
    count: usize,
    config: &DiagnosisConfig,
) -> Result<Plan, DiagnoseError> {
    config.check()?;
    let full = model.with_effects(survivors, session)?;
    let mut values = calibration.fit.values();
    values.extend(&full.nominal()[values.len()..]);
    let data = linearise(&full, observations, &values, fit)?;
    let more = if pool.is_empty() { None } else { Some(linearise(&full, pool, &values, fit)?) };
    let own: Vec<usize> =
        (0..data.axes.len()).filter(|c| data.axes[*c].index < model.parameters().len()).collect();
    let geometry = -data.jacobian.select_columns(&own);
    let of = |f: &dyn Fn(usize) -> f64| DVector::from_iterator(own.len(), own.iter().map(|c| f(*c)));
    let precision = of(&|c| data.axes[c].precision);
    let offset = of(&|c| data.axes[c].offset);
    let projection = Projection::new(&geometry, &precision, &offset, data.residual.clone());
    let effects = &full.effects()[model.effects().len()..];
    let mut standing: Vec<Survivor> = effects
        .iter()
        .map(|e| {
            let columns = columns(&data, e);
            let theta = match effects.len() {
                1 => DVector::from_element(columns.ncols(), 1.0),
                _ => one_step(&projection.gram(&columns), 1.0).estimate,
            };
            Survivor { name: e.spec.to_string(), columns, theta }
        })
        .collect();
    if standing.len() == 1 {
        let columns = DMatrix::zeros(data.residual.len(), 0);
        standing.push(Survivor { name: "nothing".to_string(), columns, theta: DVector::zeros(0) });
    }
    let mut dwells = Vec::new();
    if let Some(more) = &more {
        let signatures: Vec<DMatrix<f64>> = effects.iter().map(|e| columns(more, e)).collect();
        for rows in &more.rows {
            let part = |m: &DMatrix<f64>| m.rows(rows.start, rows.len()).into_owned();
            let mut effects: Vec<DMatrix<f64>> = signatures.iter().map(part).collect();
            effects.resize(standing.len(), DMatrix::zeros(rows.len(), 0));
            dwells.push(PoolDwell { geometry: -part(&more.jacobian.select_columns(&own)), effects });
        }
    }
    Ok(plan(&geometry, &precision, &standing, &dwells, count, config))
}

fn columns(linear: &Linearisation, effect: &PlacedEffect) -> DMatrix<f64> {
    let own: Vec<usize> =
        (0..linear.axes.len()).filter(|c| effect.parameters.contains(&linear.axes[*c].index)).collect();
    -linear.jacobian.select_columns(&own)
}
