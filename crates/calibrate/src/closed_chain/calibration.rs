//! The calibration of a closed chain: the same turns of fit and hold-out as for one arm.
//!
//! The nominal closing error is that of nominal arms after fitting only what nobody could know beforehand: an estimated
//! base, the length of a link that nobody measured.

use super::{ClosedChain, ClosedChainProblem, ClosedObservation};
use crate::calibration::{Judged, Turn, judged};
use crate::fit::{Near, fit_near};
use crate::noise::expected_norm_m;
use crate::outcome::{Calibration, Fit, Residual};
use crate::priors::scales_of;
use crate::problem::Problem as _;
use crate::{CalibrateError, FitConfig, HoldoutConfig, Objective, fit_problem, holdout};
use armcal_core::{Observation, Parameter, Role};
use nalgebra::Vector3;

/// Calibrates both arms of a closed chain and judges it on the dwells held out. The hold-out goes by dwell, by recording
/// or at random; there are no cavities.
///
/// In the result, an error is a closing error ([`ClosedChainProblem::closing_error_m`]).
pub fn calibrate_closed_chain(
    chain: &ClosedChain,
    observations: &[ClosedObservation],
    config: &FitConfig,
    holdout: &HoldoutConfig,
) -> Result<Calibration, CalibrateError> {
    config.check()?;
    if observations.is_empty() {
        return Err(CalibrateError::NoObservations { context: String::new() });
    }
    if let HoldoutConfig::Cavities { .. } | HoldoutConfig::EveryNthCavity { .. } = holdout {
        let problem = "[holdout] goes by cavity, but two arms have none in common that armcal knows; use kind = \"random\", \
                       \"cavity-folds\" (dwells are dealt out) or \"dwells\"";
        return Err(CalibrateError::ClosedChain { problem: problem.into() });
    }
    // A pose is one of both arms.
    let both = |o: &ClosedObservation| {
        let mut both = o.arms[0].clone();
        both.joint_rad.extend(&o.arms[1].joint_rad);
        both
    };
    let both: Vec<Observation> = observations.iter().map(both).collect();
    let holdout = holdout::resolve(holdout, &both, &[])?;
    judged(&Judge { chain, observations, config }, &holdout, config)
}

struct Judge<'a> {
    chain: &'a ClosedChain,
    observations: &'a [ClosedObservation],
    config: &'a FitConfig,
}

/// Parameters of nominal arms, with only what nobody knew beforehand fitted: an estimated base, the length of a link that
/// nobody measured.
pub fn closed_chain_nominal(
    chain: &ClosedChain,
    observations: &[ClosedObservation],
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    nominal_values(&ClosedChainProblem::new(chain, observations)?, chain, config)
}

fn nominal_values(
    problem: &ClosedChainProblem<'_>,
    chain: &ClosedChain,
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    let start = chain.nominal();
    let unknown = |p: &Parameter| p.free && p.role == Role::EstimatedFrame;
    if !chain.parameters().iter().any(unknown) {
        return Ok(start);
    }
    // Frames are never the subject of eq. 4; they are fitted robustly under it.
    let objective = if config.objective == Objective::Paper { Objective::Robust } else { config.objective };
    Ok(fit_problem(problem, &start, &unknown, &FitConfig { objective, ..config.clone() })?.values())
}

impl Judged for Judge<'_> {
    fn observations(&self) -> usize {
        self.observations.len()
    }

    fn turn(&self, held: &[usize], near: Option<&Fit>) -> Result<Turn, CalibrateError> {
        let kept = self.observations.iter().enumerate().filter(|(i, _)| held.binary_search(i).is_err());
        let train = ClosedChainProblem::new(self.chain, kept.map(|(_, o)| o))?;
        let nominal_values = nominal_values(&train, self.chain, self.config)?;
        let free = |p: &Parameter| p.free;
        let fit = match near {
            Some(fit) => {
                let prior_scales = scales_of(fit, train.parameters());
                let near = Near { values: fit.values(), sigma_scale: fit.sigma_scale, prior_scales };
                fit_near(&train, &near, &free, self.config)?
            }
            None => fit_problem(&train, &nominal_values, &free, self.config)?,
        };
        Ok(Turn::new(fit, nominal_values, held, self.observations.len()))
    }

    fn residual(&self, i: usize, turn: &Turn, held_out: bool) -> Result<Residual, CalibrateError> {
        let one = ClosedChainProblem::new(self.chain, [&self.observations[i]])?;
        let values = turn.fit.values();
        let bad = || CalibrateError::BadCovariance { observation: one.name(0) };
        let factor = one.covariance(0, &values).cholesky().ok_or_else(bad)?;
        let white = factor.l().solve_lower_triangular(&one.residual(0, &values)).ok_or_else(bad)?;
        Ok(Residual {
            dwell: self.observations[i].dwell(),
            held_out,
            nominal_m: one.closing_error_m(0, &turn.nominal_values),
            fitted_m: one.closing_error_m(0, &values),
            // A link has one row; the others are not observed.
            whitened: Vector3::from_fn(|r, _| white.get(r).copied().unwrap_or(0.0)),
            weight: if held_out { 1.0 } else { turn.weight(i) },
            expected_norm_m: expected_norm_m(&one.closing_covariance_m2(0, &values)),
        })
    }
}
