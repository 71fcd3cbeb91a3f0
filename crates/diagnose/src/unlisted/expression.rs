//! A compact formula for an unlisted shape, chosen by evidence among a few families.

use crate::config::DiagnosisConfig;
use crate::diagnosis::{Expression, ExpressionParameter};
use crate::enters::DependsOn;
use crate::problem::{Channel, Columns, Problem};
use crate::weigh::Weighed;
use crate::weigh::drivers::{Driver, mean_and_sd, range};
use crate::weigh::evidence::{best_amplitude, of_all, posterior_coefficients};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Frequencies tried, and their distance in units of the lowest: fine enough not to lose the phase over the range.
const PERIODS: i32 = 192;
const PERIOD_STEP: f64 = 0.125;

/// Functions of a driver with the formula that makes them.
struct Family {
    /// One term for each column: `a1*(q1 - 0.2)`, the parameter's name first.
    terms: Vec<(String, String)>,
    /// Values at the dwells.
    basis: DMatrix<f64>,
    /// ln of the number of shapes tried for it.
    ln_tried: f64,
}

/// Fits every family on one axis of a channel and returns the formula with the largest evidence; its
/// `share_of_shape` is still the fall of the squared residual.
pub(crate) fn fit_expression(
    problem: &Problem,
    weighed: &Weighed,
    channel: &Channel,
    axis: usize,
    driver: &Driver,
    config: &DiagnosisConfig,
) -> Option<Expression> {
    let acts_on = channel.axes.get(axis)?;
    let base = Arc::new(channel.columns.columns(axis, 1).into_owned());
    let power: Vec<f64> = problem.dwells.iter().map(|d| d.moved_m2(&base)).collect();
    let families: Vec<(Family, Vec<f64>, Columns)> = families(problem, driver)
        .into_iter()
        .map(|family| {
            let rms = |k: usize| {
                let sum: f64 = power.iter().enumerate().map(|(i, p)| p * family.basis[(i, k)].powi(2)).sum();
                (sum / power.len() as f64).sqrt().max(1e-300)
            };
            let unit: Vec<f64> =
                (0..family.basis.ncols()).map(|k| config.unlisted_effect_mm * 1e-3 / rms(k)).collect();
            let mut basis = family.basis.clone();
            basis.column_iter_mut().zip(&unit).for_each(|(mut column, u)| column *= *u);
            let columns = Columns::Product { base: base.clone(), basis: Arc::new(basis), size: 1.0 };
            (family, unit, columns)
        })
        .collect();
    let columns: Vec<&Columns> = families.iter().map(|f| &f.2).collect();
    let base = &weighed.base;
    let weights = of_all(&columns, problem, weighed.scale, base, config);
    let value = |k: usize| weights[k] - families[k].0.ln_tried;
    let best = (0..families.len()).max_by(|a, b| value(*a).total_cmp(&value(*b)))?;
    let (family, unit, columns) = &families[best];
    let gram = base.gram(&weighed.dense(columns, problem));
    let a = best_amplitude(&gram, base, config);
    let (theta, _) = posterior_coefficients(&gram, a);
    let parameters = family
        .terms
        .iter()
        .zip(theta.iter().zip(unit))
        .map(|((name, _), (t, u))| {
            let found = t * u;
            ExpressionParameter {
                name: name.clone(),
                found,
                prior: to_digits(found.abs().max(1e-3 * u), 4),
                bound: to_digits(30.0 * found.abs().max(*u), 4),
            }
        })
        .collect();
    Some(Expression {
        formula: family.terms.iter().map(|t| t.1.clone()).collect::<Vec<_>>().join(" + "),
        acts_on: acts_on.clone(),
        unit: channel.unit,
        parameters,
        share_of_shape: theta.dot(&gram.g),
    })
}

fn families(problem: &Problem, driver: &Driver) -> Vec<Family> {
    match driver.what {
        DependsOn::Direction(_) => with_pose(problem, &driver.what.to_string(), &driver.value),
        DependsOn::AngleByDirection(joint) => direction_families(problem, driver, joint),
        DependsOn::Load => {
            let (mean, _) = mean_and_sd(&driver.value);
            let value: Vec<f64> = driver.value.iter().map(|v| v - mean).collect();
            with_pose(problem, &standardised_term("load", mean, 1.0), &value)
        }
        DependsOn::Recording => Vec::new(),
        what => smooth_families(what, &driver.value),
    }
}

/// Polynomials, harmonics, a smooth step, a bump, a warm-up.
fn smooth_families(what: DependsOn, value: &[f64]) -> Vec<Family> {
    let (low, high) = range(value);
    let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
    let x = if matches!(what, DependsOn::AngleSum(_)) { format!("({what})") } else { what.to_string() };
    // Every parameter then has the channel's unit: the numbers carry the driver's.
    let shifted = standardised_term(&x, centre, half);
    let mut all = Vec::new();
    let rows = value.len();
    for degree in 1..=5usize {
        let terms = (1..=degree).map(|k| {
            let power = if k == 1 { shifted.clone() } else { format!("{shifted}^{k}") };
            (format!("c{k}"), format!("c{k}*{power}"))
        });
        let basis = DMatrix::from_fn(rows, degree, |i, k| ((value[i] - centre) / half).powi(k as i32 + 1));
        all.push(Family { terms: terms.collect(), basis, ln_tried: 0.0 });
    }
    let mut harmonic = |frequencies: &[f64], tried: f64| {
        let mut terms = Vec::new();
        for (k, f) in frequencies.iter().enumerate() {
            let inner = if *f == 1.0 { x.clone() } else { format!("{}*{x}", format_number(*f)) };
            terms.push((format!("a{}", k + 1), format!("a{}*sin({inner})", k + 1)));
            terms.push((format!("b{}", k + 1), format!("b{}*cos({inner})", k + 1)));
        }
        let basis = DMatrix::from_fn(rows, 2 * frequencies.len(), |i, k| {
            let angle = frequencies[k / 2] * value[i];
            if k % 2 == 0 { angle.sin() } else { angle.cos() }
        });
        all.push(Family { terms, basis, ln_tried: tried.ln() });
    };
    // An angle has a sine of itself; of seconds and kelvins only a multiple has one.
    if matches!(what, DependsOn::Angle(_) | DependsOn::AngleSum(_)) {
        for order in 1..=3usize {
            harmonic(&(1..=order).map(|k| k as f64).collect::<Vec<_>>(), 1.0);
        }
    }
    let fundamental = std::f64::consts::PI / (1.2 * half);
    for order in 2..=5usize {
        harmonic(&(1..=order).map(|k| fundamental * k as f64).collect::<Vec<_>>(), 4.0);
    }
    for step in 1..=PERIODS {
        let frequency = fundamental * PERIOD_STEP * f64::from(step);
        harmonic(&[frequency], f64::from(PERIODS));
        // Teeth are no sines.
        harmonic(&[frequency, 2.0 * frequency, 3.0 * frequency], f64::from(PERIODS));
    }
    let mut shaped = |inner: String, f: &dyn Fn(f64) -> f64, tried: f64| {
        let basis = DMatrix::from_fn(rows, 1, |i, _| f(value[i]));
        all.push(Family {
            terms: vec![("a".to_string(), format!("a*{inner}"))],
            basis,
            ln_tried: tried.ln(),
        });
    };
    for place in 0..15 {
        let c = centre + half * (-0.7 + 0.1 * f64::from(place));
        for width in [0.05, 0.1, 0.2, 0.4] {
            let w = half * width;
            let u = standardised_term(&x, c, w);
            shaped(format!("tanh{u}"), &|v| ((v - c) / w).tanh(), 120.0);
            shaped(format!("exp(-({u}^2))"), &|v| (-((v - c) / w).powi(2)).exp(), 120.0);
        }
    }
    if what == DependsOn::SessionTime {
        for part in [0.05, 0.1, 0.2, 0.4, 0.8] {
            let constant = 2.0 * half * part;
            let inner = format!("(1 - exp(-{x}/{}))", format_number(constant));
            shaped(inner, &|v| 1.0 - (-v / constant).exp(), 5.0);
        }
    }
    all
}

/// A direction alone, and alone plus each smooth family of the angle times it.
fn direction_families(problem: &Problem, driver: &Driver, joint: usize) -> Vec<Family> {
    let sign = DependsOn::Direction(joint);
    let arrival = |i: usize| problem.dwells[i].arrival[joint];
    let with_sign = |family: Family| {
        let mut terms = vec![("c0".to_string(), format!("c0*{sign}"))];
        terms.extend(family.terms.into_iter().map(|(name, term)| (name, format!("{sign}*{term}"))));
        let basis = DMatrix::from_fn(family.basis.nrows(), terms.len(), |i, k| match k {
            0 => arrival(i),
            k => arrival(i) * family.basis[(i, k - 1)],
        });
        Family { terms, basis, ln_tried: family.ln_tried }
    };
    smooth_families(DependsOn::Angle(joint), &driver.value).into_iter().map(with_sign).collect()
}

/// A switched value alone, and with a part linear in each joint that moves.
fn with_pose(problem: &Problem, name: &str, value: &[f64]) -> Vec<Family> {
    let rows = value.len();
    let alone = Family {
        terms: vec![("c0".to_string(), format!("c0*{name}"))],
        basis: DMatrix::from_fn(rows, 1, |i, _| value[i]),
        ln_tried: 0.0,
    };
    let mut terms = alone.terms.clone();
    let mut joints = Vec::new();
    for j in 0..problem.joints() {
        let q: Vec<f64> = problem.dwells.iter().map(|d| d.joint_rad[j]).collect();
        let (mean, sd) = mean_and_sd(&q);
        if sd > 1e-6 {
            let inner = standardised_term(&DependsOn::Angle(j).to_string(), mean, sd);
            terms.push((format!("c{}", j + 1), format!("c{}*{name}*{inner}", j + 1)));
            joints.push((j, mean, sd));
        }
    }
    let basis = DMatrix::from_fn(rows, terms.len(), |i, k| {
        let Some((j, mean, sd)) = k.checked_sub(1).map(|k| joints[k]) else { return value[i] };
        value[i] * (problem.dwells[i].joint_rad[j] - mean) / sd
    });
    let mut all = vec![alone];
    // One joint at a time first: the shortest formula that fits.
    for (k, (j, mean, sd)) in joints.iter().enumerate() {
        let basis = DMatrix::from_fn(rows, 2, |i, c| {
            if c == 0 { value[i] } else { value[i] * (problem.dwells[i].joint_rad[*j] - mean) / sd }
        });
        let ln_tried = (joints.len() as f64).ln();
        all.push(Family { terms: vec![terms[0].clone(), terms[k + 1].clone()], basis, ln_tried });
    }
    all.push(Family { terms, basis, ln_tried: 0.0 });
    all
}

/// `((x - centre)/width)`.
fn standardised_term(x: &str, centre: f64, width: f64) -> String {
    let (sign, size) = if centre < 0.0 { ('+', -centre) } else { ('-', centre) };
    format!("(({x} {sign} {})/{})", format_number(size), format_number(width))
}

/// Six digits: a constant of a formula, not a result.
fn format_number(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.is_empty() || text == "-0" { "0".to_string() } else { text.to_string() }
}

/// To so many digits: a size that a person reads and changes.
pub(crate) fn to_digits(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}
