//! A formula of the user.
//!
//! # What moves
//! One joint reading, one parameter of the chain, the base or the tip, every length of the arm in proportion, or the tip
//! in the world.
//!
//! # Equation
//! Any, over q1.. (readings), s1.. (arrival: -1, 0, 1), tau1.. (gravity torque of the nominal masses and the load),
//! effort1.. (measured effort), temperature [degC], t (time since the first observation), load, and parameters;
//! with + - * / ^, pi, sin, cos, tan, atan, tanh, exp, ln, sqrt, abs, sign.
//!
//! # Parameters and units
//! As named in the table, each with a unit, and a prior or a bound. q [rad] (sliding joint: [m]), tau and effort
//! [N m], t [s], load [kg]. Units are checked as far as the formula tells them: a number in it, as the 60 in t/60, may
//! stand for any.
//!
//! # Signature in the data
//! Whatever the formula says.
//!
//! # Not to be confused with
//! An entry of the catalogue that says the same: prefer that, it carries its prior and its source.
//!
//! # Source
//! The user.

use super::formula::{Formula, Number};
use super::measure::{Dimension, Measure, dimension, dimension_symbol};
use super::overrides::unit_of;
use super::prelude::*;
use super::spec::joint_index;
use crate::error::similar_name_hint;
use crate::segment::Motion;
use num_dual::Dual64;

/// The name of all lengths of the arm together.
const LENGTHS: &str = "lengths";
/// Where a bound is given and no prior: how much of it is a typical size.
const SIGMA_OF_BOUND: f64 = 0.3;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "a formula of the user; written in an [[effects]] table",
    family: Family::User,
    target: Target::Whole,
    offered: Offered::Never,
    place: effect_placement,
    ..EffectKind::PLAIN
};

/// What a variable of a formula is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Variable {
    Parameter(usize),
    Reading(usize),
    Arrival(usize),
    Torque(usize),
    Effort(usize),
    Temperature,
    Time,
    Load,
}

/// What a formula changes.
#[derive(Debug, Clone, PartialEq)]
enum Acts {
    Joint(usize),
    Parameter(usize),
    /// Parameters with their nominal lengths [m].
    Lengths(Vec<(usize, f64)>),
    World(usize),
}

#[derive(Debug)]
struct UserEffect {
    formula: Formula,
    variables: Vec<Variable>,
    acts: Acts,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let expression = context
        .spec
        .expression
        .as_ref()
        .ok_or("write it as an [[effects]] table with name, formula, acts_on and parameters")?;
    let formula = Formula::read(&expression.formula)?;
    let mut amplitudes = Vec::new();
    for (name, said) in &context.spec.overrides {
        let unit = said.unit.as_deref().unwrap_or(Unit::One.symbol());
        let (unit, si) = unit_of(unit).ok_or_else(|| unknown_unit(name, unit))?;
        let sigma = said.prior.or(said.bound.map(|bound| SIGMA_OF_BOUND * bound));
        let sigma = sigma.ok_or_else(|| {
            format!("parameter \"{name}\" needs a typical size: prior = ..., or a bound = ...")
        })?;
        let bound = said.bound.unwrap_or(10.0 * sigma);
        if !(sigma > 0.0 && bound > 0.0) {
            return Err(format!("parameter \"{name}\": prior and bound must be positive"));
        }
        amplitudes.push(amplitude(
            name,
            unit,
            sigma * si,
            bound * si,
            format!("{name} of the user's formula"),
        ));
    }
    let names: Vec<&str> = context.spec.overrides.keys().map(String::as_str).collect();
    let variables = formula
        .variables()
        .iter()
        .map(|name| resolve_variable(name, &names, context))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(unused) = (0..names.len()).find(|k| !variables.contains(&Variable::Parameter(*k))) {
        return Err(format!("the formula \"{}\" has no \"{}\"", expression.formula, names[unused]));
    }
    let acts = acts_on(&expression.acts_on, context)?;
    let measures: Vec<Measure> = variables
        .iter()
        .map(|variable| match variable {
            Variable::Parameter(k) => Measure::Known(dimension(amplitudes[*k].unit)),
            other => other.measure(context),
        })
        .collect();
    let expected = acts.dimension(context);
    let wrong =
        |why: String| Err(format!("the units of the formula \"{}\" do not fit: {why}", expression.formula));
    match formula.measure(&measures) {
        Measure::Wrong(why) => return wrong(why),
        Measure::Known(found) if found != expected => {
            return wrong(format!(
                "{} takes {}, it gives {}",
                expression.acts_on,
                dimension_symbol(&expected),
                dimension_symbol(&found)
            ));
        }
        Measure::Known(_) | Measure::Literal(_) | Measure::Anything => {}
    }
    let in_world = matches!(acts, Acts::World(_));
    let physics = UserEffect { formula, variables, acts };
    Ok(match in_world {
        true => Placement::twisting(Slot::WORLD, amplitudes, physics),
        false => Placement::new(amplitudes, physics),
    })
}

fn unknown_unit(name: &str, unit: &str) -> String {
    let known: Vec<&str> = Unit::ALL.iter().map(|unit| unit.symbol()).collect();
    let hint = similar_name_hint(unit, known.iter().copied());
    format!("parameter \"{name}\": there is no unit \"{unit}\"{hint} The units are {}", known.join(", "))
}

fn resolve_variable(
    name: &str,
    parameters: &[&str],
    context: &EffectContext<'_>,
) -> Result<Variable, String> {
    if let Some(k) = parameters.iter().position(|parameter| *parameter == name) {
        return Ok(Variable::Parameter(k));
    }
    let joints = context.zero.joints.len();
    let session = context.session;
    let numbered = |prefix: &str| {
        let number: usize = name.strip_prefix(prefix)?.parse().ok()?;
        (1..=joints).contains(&number).then(|| number - 1)
    };
    let missing = |what: &str| Err(format!("the formula needs {name}, and the observations have no {what}"));
    match name {
        "t" => return Ok(Variable::Time),
        "load" => return Ok(Variable::Load),
        "temperature" if session.temperature => return Ok(Variable::Temperature),
        "temperature" => return missing("temperature"),
        _ => {}
    }
    if let Some(joint) = numbered("q") {
        return Ok(Variable::Reading(joint));
    }
    if let Some(joint) = numbered("s") {
        return Ok(Variable::Arrival(joint));
    }
    if let Some(joint) = numbered("tau") {
        return Ok(Variable::Torque(joint));
    }
    if let Some(joint) = numbered("effort") {
        let known = context.largest_effort_nm(joint).map(|_| Variable::Effort(joint));
        return known.map_err(|why| format!("the formula needs {name}, and {why}"));
    }
    let of_joints =
        (1..=joints).flat_map(|j| ["q", "s", "tau", "effort"].map(|prefix| format!("{prefix}{j}")));
    let known: Vec<String> = ["t", "load", "temperature"]
        .into_iter()
        .chain(parameters.iter().copied())
        .map(str::to_owned)
        .chain(of_joints)
        .collect();
    let hint = similar_name_hint(name, known.iter().map(String::as_str));
    Err(format!(
        "the formula has a variable \"{name}\" that is neither a parameter nor one of q1.. s1.. tau1.. effort1.. (to \
         {joints}), temperature, t, load{hint}"
    ))
}

fn acts_on(text: &str, context: &EffectContext<'_>) -> Result<Acts, String> {
    if let Some(axis) = ["world.x", "world.y", "world.z"].iter().position(|name| *name == text) {
        return Ok(Acts::World(axis));
    }
    if text == LENGTHS {
        return Ok(Acts::Lengths(context.nominal.lengths_m()));
    }
    let joint_names = context.nominal.chain.joint_names();
    let reading = text.strip_prefix('q').filter(|number| number.parse::<usize>().is_ok());
    if reading.is_some() || joint_names.iter().any(|name| name == text) {
        return joint_index(reading.unwrap_or(text), joint_names).map(Acts::Joint);
    }
    let on_path = || context.nominal.on_path();
    if let Some((index, _)) = on_path().find(|(_, parameter)| parameter.name == text) {
        return Ok(Acts::Parameter(index));
    }
    let names = on_path().map(|(_, parameter)| parameter.name.as_str());
    let all = names.chain(joint_names.iter().map(String::as_str)).chain([LENGTHS]);
    let hint = similar_name_hint(text, all);
    Err(format!(
        "acts_on = \"{text}\" is no joint, no parameter of chain, base or tip, and none of lengths, world.x, world.y, \
         world.z{hint}"
    ))
}

impl Acts {
    fn dimension(&self, context: &EffectContext<'_>) -> Dimension {
        dimension(match self {
            Acts::Joint(joint) => context.joint_unit(*joint),
            Acts::Parameter(index) => context.nominal.parameters[*index].unit,
            Acts::Lengths(_) => Unit::One,
            Acts::World(_) => Unit::Metre,
        })
    }
}

impl Variable {
    /// The unit of a driver.
    fn measure(self, context: &EffectContext<'_>) -> Measure {
        let unit = match self {
            Variable::Parameter(_) => return Measure::Anything,
            Variable::Reading(joint) => context.joint_unit(joint),
            Variable::Arrival(_) => Unit::One,
            Variable::Torque(joint) | Variable::Effort(joint) => match context.motion(joint) {
                Motion::Revolute => Unit::NewtonMetre,
                // Newtons: no parameter has them, so they go unchecked.
                Motion::Prismatic => return Measure::Anything,
            },
            Variable::Temperature => Unit::Kelvin,
            Variable::Time => Unit::Second,
            Variable::Load => Unit::Kilogram,
        };
        Measure::Known(dimension(unit))
    }

    fn value(self, theta: &[f64], x: &Drivers<'_>) -> f64 {
        let o = x.observation;
        match self {
            Variable::Parameter(k) => theta[k],
            Variable::Reading(joint) => x.joint_rad(joint),
            Variable::Arrival(joint) => x.arrival[joint],
            Variable::Torque(joint) => x.torque()[joint].total_nm(),
            Variable::Effort(joint) => o.effort_of(joint).unwrap_or(f64::NAN),
            Variable::Temperature => o.temperature_c.unwrap_or(f64::NAN),
            Variable::Time => x.time_s,
            Variable::Load => o.load_kg,
        }
    }
}

impl Physics for UserEffect {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let real: Vec<f64> = theta.iter().map(|value| value.re()).collect();
        let mut values: Vec<Number> =
            self.variables.iter().map(|variable| Number(Dual64::from(variable.value(&real, x)))).collect();
        let mut sum = D::from(self.formula.value(&values).re);
        for (position, variable) in self.variables.iter().enumerate() {
            let Variable::Parameter(k) = variable else { continue };
            // What the scalar carries beyond its real part: the derivatives it was seeded with.
            let seed = theta[*k] - real[*k];
            values[position].0.eps = 1.0;
            sum += seed * self.formula.value(&values).eps;
            values[position].0.eps = 0.0;
        }
        match &self.acts {
            Acts::Joint(joint) => change.joint(*joint, sum),
            Acts::Parameter(index) => change.parameter(*index, sum),
            Acts::Lengths(lengths) => {
                lengths.iter().for_each(|(index, length_m)| change.parameter(*index, sum * *length_m));
            }
            Acts::World(axis) => {
                let mut moved = [D::from(0.0); 3];
                moved[*axis] = sum;
                change.twist(Slot::WORLD, moved, [D::from(0.0); 3]);
            }
        }
    }
}
