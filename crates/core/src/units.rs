//! Physical units: one enum decides symbols and display scaling everywhere a number leaves armcal.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Degrees in a radian.
pub const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// The SI unit of a number inside armcal, and how it is shown to people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Unit {
    /// Length; shown in millimetres.
    #[serde(rename = "m")]
    Metre,
    /// Angle; shown in degrees.
    #[serde(rename = "rad")]
    Radian,
    /// Duration.
    #[serde(rename = "s")]
    Second,
    /// A pure number, such as a relative scale error.
    #[serde(rename = "1")]
    One,
    /// Torsional compliance.
    #[serde(rename = "rad/(N*m)")]
    RadianPerNewtonMetre,
    /// Relative expansion per temperature.
    #[serde(rename = "1/K")]
    PerKelvin,
    /// Mass.
    #[serde(rename = "kg")]
    Kilogram,
    /// Temperature difference.
    #[serde(rename = "K")]
    Kelvin,
    /// Torque.
    #[serde(rename = "N*m")]
    NewtonMetre,
    /// Displacement per torque.
    #[serde(rename = "m/(N*m)")]
    MetrePerNewtonMetre,
    /// Angle per temperature.
    #[serde(rename = "rad/K")]
    RadianPerKelvin,
    /// Displacement per temperature.
    #[serde(rename = "m/K")]
    MetrePerKelvin,
    /// Angle per load.
    #[serde(rename = "rad/kg")]
    RadianPerKilogram,
    /// Displacement per load.
    #[serde(rename = "m/kg")]
    MetrePerKilogram,
    /// Angular velocity, or drift of an angle.
    #[serde(rename = "rad/s")]
    RadianPerSecond,
    /// Velocity, or drift of a length.
    #[serde(rename = "m/s")]
    MetrePerSecond,
}

impl Unit {
    /// Every unit.
    pub const ALL: [Unit; 16] = [
        Unit::Metre,
        Unit::Radian,
        Unit::Second,
        Unit::One,
        Unit::RadianPerNewtonMetre,
        Unit::PerKelvin,
        Unit::Kilogram,
        Unit::Kelvin,
        Unit::NewtonMetre,
        Unit::MetrePerNewtonMetre,
        Unit::RadianPerKelvin,
        Unit::MetrePerKelvin,
        Unit::RadianPerKilogram,
        Unit::MetrePerKilogram,
        Unit::RadianPerSecond,
        Unit::MetrePerSecond,
    ];

    /// Symbol of the SI unit, symbol of the unit shown to people, and how much of that one SI unit is.
    fn symbols(self) -> (&'static str, &'static str, f64) {
        let (milli, micro, deg) = (1e3, 1e6, 1f64.to_degrees());
        match self {
            Unit::Metre => ("m", "mm", milli),
            Unit::Radian => ("rad", "deg", deg),
            Unit::Second => ("s", "s", 1.0),
            Unit::One => ("1", "", 1.0),
            Unit::RadianPerNewtonMetre => ("rad/(N*m)", "deg/(N*m)", deg),
            Unit::PerKelvin => ("1/K", "ppm/K", micro),
            Unit::Kilogram => ("kg", "kg", 1.0),
            Unit::Kelvin => ("K", "K", 1.0),
            Unit::NewtonMetre => ("N*m", "N*m", 1.0),
            Unit::MetrePerNewtonMetre => ("m/(N*m)", "mm/(N*m)", milli),
            Unit::RadianPerKelvin => ("rad/K", "deg/K", deg),
            Unit::MetrePerKelvin => ("m/K", "mm/K", milli),
            Unit::RadianPerKilogram => ("rad/kg", "deg/kg", deg),
            Unit::MetrePerKilogram => ("m/kg", "mm/kg", milli),
            Unit::RadianPerSecond => ("rad/s", "deg/s", deg),
            Unit::MetrePerSecond => ("m/s", "mm/s", milli),
        }
    }

    /// Symbol of the SI unit, as written to machine-readable output.
    pub fn symbol(self) -> &'static str {
        self.symbols().0
    }

    /// Symbol of the unit shown to people.
    pub fn display_symbol(self) -> &'static str {
        self.symbols().1
    }

    /// Converts an SI value to the unit shown to people.
    pub fn to_display(self, si: f64) -> f64 {
        si * self.symbols().2
    }

    /// Converts a value in the unit shown to people to SI.
    pub fn from_display(self, shown: f64) -> f64 {
        shown / self.to_display(1.0)
    }
}

impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.symbol())
    }
}

/// A length in millimetres: two decimals, more where two would hide the digits that matter.
pub fn format_mm(metres: f64) -> String {
    let mm = metres * 1e3;
    match mm.abs() {
        a if !a.is_finite() => "-".into(),
        a if a >= 0.095 => format!("{mm:.2}"),
        a if a < 1e-9 => "0.00".into(),
        a if a >= 0.0095 => format!("{mm:.3}"),
        a if a >= 0.00095 => format!("{mm:.4}"),
        _ => format!("{mm:.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lengths_keep_two_digits() {
        assert_eq!(format_mm(0.123_456), "123.46");
        assert_eq!(format_mm(0.000_034_2), "0.034");
        assert_eq!(format_mm(0.000_003_42), "0.0034");
        assert_eq!((format_mm(0.0), format_mm(f64::NAN)), ("0.00".into(), "-".into()));
    }
}
