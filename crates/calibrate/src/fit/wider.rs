//! Bounds that nobody declared, and that an arm goes beyond.
//!
//! The bounds of a model that declares none are an assumption, as its priors are. Where a fit ends on some of them, and with
//! those half as wide again the errors are as the declared noise, the arm is there. Where they are not, the bounds stay:
//! something else is wrong, and a wider fit would hide it.

use crate::fit::minimise::{Solved, minimise_objective};
use crate::objective::problem::Problem;
use crate::objective::robust::proposal2_scale;
use crate::objective::whitened::Whitened;
use crate::objective::with_priors::WithPriors;
use crate::{CalibrateError, FitConfig};
use armcal_core::{Code, Parameter, Severity, Stage, Warning, list_names};

/// How much further than assumed an arm may be from nominal.
const WIDER: f64 = 1.5;
/// Scatter of what is left, in units of the declared noise, that is still that noise.
const AS_DECLARED: f64 = 1.4;
/// Share of the scatter with the assumed bounds that is left at most.
const CLEARLY_LESS: f64 = 0.8;

/// The fit with wider bounds where it ended on assumed ones; none where it did not, or where that explains no more.
pub(crate) fn fit_wider_bounds<'a>(
    problem: &'a dyn Problem,
    (white, solved): (&Whitened<'_>, &Solved),
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Option<(Whitened<'a>, Solved)>, CalibrateError> {
    let values = white.parameters_at(&solved.at.x);
    let mut parameters = white.problem.parameters().to_vec();
    let ended_on = |p: &Parameter, value: f64| p.assumed.is_some() && (value <= p.lower || value >= p.upper);
    let tight: Vec<usize> =
        white.axes.iter().map(|axis| axis.index).filter(|k| ended_on(&parameters[*k], values[*k])).collect();
    if tight.is_empty() {
        return Ok(None);
    }
    for k in &tight {
        let p = &mut parameters[*k];
        p.lower = p.nominal + WIDER * (p.lower - p.nominal);
        p.upper = p.nominal + WIDER * (p.upper - p.nominal);
    }
    let again = Whitened::new(Box::new(WithPriors { problem, parameters }), &values, free, config)?;
    let mut better = minimise_objective(&again, Some(solved.sigma_scale), config)?;
    better.iterations += solved.iterations;
    let scatter = |white: &Whitened<'_>, solved: &Solved| {
        proposal2_scale(&solved.cost(white, config), &solved.at, white.axes.len() as f64)
    };
    let found = again.parameters_at(&better.at.x);
    let within = tight.iter().all(|k| !ended_on(&again.problem.parameters()[*k], found[*k]));
    let (before, after) = (scatter(white, solved), scatter(&again, &better));
    Ok((within && after < AS_DECLARED && after < CLEARLY_LESS * before).then_some((again, better)))
}

/// What was widened, in words.
pub(crate) fn widened_notice(
    problem: &dyn Problem,
    white: &Whitened<'_>,
    solved: &Solved,
) -> Option<Warning> {
    let values = white.parameters_at(&solved.at.x);
    let of = |k: usize| {
        let (assumed, used) = (&problem.parameters()[k], &white.problem.parameters()[k]);
        let shown = |si: f64| assumed.unit.to_display(si);
        (used.upper > assumed.upper).then(|| {
            format!(
                "{} is off by {:+.3} {}, and {:.3} was assumed as the most",
                used.name,
                shown(values[k] - used.nominal),
                assumed.unit.display_symbol(),
                shown(assumed.upper - assumed.nominal)
            )
        })
    };
    let all: Vec<String> = white.axes.iter().filter_map(|axis| of(axis.index)).collect();
    let message = format!(
        "{}: with the bounds that nobody declared the errors stay above the noise, so wider ones were taken; check the model file, \
         or declare [model.deviation] or the model's [deviation]",
        list_names(&all)
    );
    (!all.is_empty()).then(|| {
        Warning::new(Severity::Notice, Stage::Calibrate, Code::BoundWidened, "bounds".to_owned(), message)
    })
}
