//! The units of a formula: what its parts are measured in, as far as the formula tells.

use super::algebra::{Algebra, Function};
use armcal_core::Unit;
use std::str::FromStr;

/// Powers of metre, kilogram, second, kelvin; an angle has none.
pub(super) type Dimension = [f64; 4];

/// What is known about the unit of a part of a formula.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum Measure {
    /// Nothing: it goes with everything.
    #[default]
    Anything,
    /// A number in the text: it takes the unit of what it is added to.
    Literal(f64),
    /// A unit.
    Known(Dimension),
    /// A contradiction, in words.
    Wrong(String),
}

impl FromStr for Measure {
    type Err = std::num::ParseFloatError;

    fn from_str(text: &str) -> Result<Measure, Self::Err> {
        Ok(Measure::Literal(text.parse()?))
    }
}

impl Measure {
    /// The sum or difference of two: of one unit, or a contradiction.
    fn with(self, other: Measure) -> Measure {
        match (self, other) {
            (Measure::Wrong(why), _) | (_, Measure::Wrong(why)) => Measure::Wrong(why),
            (Measure::Known(a), Measure::Known(b)) if a == b => Measure::Known(a),
            (Measure::Known(a), Measure::Known(b)) => {
                Measure::Wrong(format!("it adds {} to {}", dimension_symbol(&b), dimension_symbol(&a)))
            }
            (known @ Measure::Known(_), _) | (_, known @ Measure::Known(_)) => known,
            _ => Measure::Anything,
        }
    }

    /// The product (+1) or quotient (-1) of two. A number in the text may stand for a quantity of any unit, such as
    /// the 60 in `t / 60`.
    fn scaled(self, other: Measure, sign: f64) -> Measure {
        match (self, other) {
            (Measure::Wrong(why), _) | (_, Measure::Wrong(why)) => Measure::Wrong(why),
            (Measure::Known(a), Measure::Known(b)) => {
                Measure::Known(std::array::from_fn(|k| a[k] + sign * b[k]))
            }
            _ => Measure::Anything,
        }
    }
}

impl Algebra for Measure {
    fn number(value: f64) -> Measure {
        Measure::Literal(value)
    }

    fn add(self, other: Measure) -> Measure {
        self.with(other)
    }

    fn subtract(self, other: Measure) -> Measure {
        self.with(other)
    }

    fn multiply(self, other: Measure) -> Measure {
        self.scaled(other, 1.0)
    }

    fn divide(self, other: Measure) -> Measure {
        self.scaled(other, -1.0)
    }

    fn power(self, exponent: Measure) -> Measure {
        match (self, exponent) {
            (Measure::Wrong(why), _) | (_, Measure::Wrong(why)) => Measure::Wrong(why),
            (Measure::Known(d), Measure::Literal(n)) => Measure::Known(d.map(|power| power * n)),
            (_, Measure::Known(d)) if d != [0.0; 4] => {
                Measure::Wrong(format!("its exponent is in {}", dimension_symbol(&d)))
            }
            _ => Measure::Anything,
        }
    }

    fn negate(self) -> Measure {
        match self {
            Measure::Literal(value) => Measure::Literal(-value),
            other => other,
        }
    }

    fn apply(self, function: Function) -> Measure {
        match (function, self) {
            (_, Measure::Wrong(why)) => Measure::Wrong(why),
            (Function::Abs, own) => own,
            (Function::Sqrt, Measure::Known(d)) => Measure::Known(d.map(|power| 0.5 * power)),
            (Function::Sqrt, _) => Measure::Anything,
            (Function::Sign, _) => Measure::Known([0.0; 4]),
            (function, Measure::Known(d)) if d != [0.0; 4] => {
                let name = format!("{function:?}").to_lowercase();
                Measure::Wrong(format!("it takes the {name} of {}", dimension_symbol(&d)))
            }
            _ => Measure::Known([0.0; 4]),
        }
    }
}

/// The dimension of a unit.
pub(super) fn dimension(unit: Unit) -> Dimension {
    const TORQUE: Dimension = [2.0, 1.0, -2.0, 0.0];
    match unit {
        Unit::Radian | Unit::One => [0.0; 4],
        Unit::Metre => [1.0, 0.0, 0.0, 0.0],
        Unit::Second => [0.0, 0.0, 1.0, 0.0],
        Unit::Kilogram => [0.0, 1.0, 0.0, 0.0],
        Unit::Kelvin => [0.0, 0.0, 0.0, 1.0],
        Unit::NewtonMetre => TORQUE,
        Unit::RadianPerNewtonMetre => TORQUE.map(|power| -power),
        Unit::MetrePerNewtonMetre => [-1.0, -1.0, 2.0, 0.0],
        Unit::PerKelvin | Unit::RadianPerKelvin => [0.0, 0.0, 0.0, -1.0],
        Unit::MetrePerKelvin => [1.0, 0.0, 0.0, -1.0],
        Unit::RadianPerKilogram => [0.0, -1.0, 0.0, 0.0],
        Unit::MetrePerKilogram => [1.0, -1.0, 0.0, 0.0],
        Unit::RadianPerSecond => [0.0, 0.0, -1.0, 0.0],
        Unit::MetrePerSecond => [1.0, 0.0, -1.0, 0.0],
    }
}

/// A dimension in words: the unit that has it, or its powers.
pub(super) fn dimension_symbol(d: &Dimension) -> String {
    if *d == [0.0; 4] {
        return "an angle or a number".to_owned();
    }
    let known = Unit::ALL.into_iter().find(|unit| dimension(*unit) == *d);
    known.map_or_else(
        || {
            let power = |(name, power): (&str, &f64)| (*power != 0.0).then(|| format!("{name}^{power}"));
            ["m", "kg", "s", "K"].into_iter().zip(d).filter_map(power).collect::<Vec<_>>().join(" ")
        },
        |unit| unit.symbol().to_owned(),
    )
}
