//! Physical units: one enum decides symbols and display scaling everywhere a number leaves armcal.

use serde::{Deserialize, Serialize};

/// The SI unit of a number inside armcal, and how it is shown to people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
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

    /// Symbol of the SI unit, as written to machine-readable output.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Metre => "m",
            Unit::Radian => "rad",
            Unit::Second => "s",
            Unit::One => "1",
            Unit::RadianPerNewtonMetre => "rad/(N*m)",
            Unit::PerKelvin => "1/K",
            Unit::Kilogram => "kg",
            Unit::Kelvin => "K",
            Unit::NewtonMetre => "N*m",
            Unit::MetrePerNewtonMetre => "m/(N*m)",
            Unit::RadianPerKelvin => "rad/K",
            Unit::MetrePerKelvin => "m/K",
            Unit::RadianPerKilogram => "rad/kg",
            Unit::MetrePerKilogram => "m/kg",
            Unit::RadianPerSecond => "rad/s",
            Unit::MetrePerSecond => "m/s",
        }
    }

    /// Symbol of the unit shown to people.
    pub fn display_symbol(self) -> &'static str {
        match self {
            Unit::Metre => "mm",
            Unit::Radian => "deg",
            Unit::Second => "s",
            Unit::One => "",
            Unit::RadianPerNewtonMetre => "deg/(N*m)",
            Unit::PerKelvin => "ppm/K",
            Unit::Kilogram => "kg",
            Unit::Kelvin => "K",
            Unit::NewtonMetre => "N*m",
            Unit::MetrePerNewtonMetre => "mm/(N*m)",
            Unit::RadianPerKelvin => "deg/K",
            Unit::MetrePerKelvin => "mm/K",
            Unit::RadianPerKilogram => "deg/kg",
            Unit::MetrePerKilogram => "mm/kg",
            Unit::RadianPerSecond => "deg/s",
            Unit::MetrePerSecond => "mm/s",
        }
    }

    /// Converts an SI value to the unit shown to people.
    pub fn to_display(self, si: f64) -> f64 {
        match self {
            Unit::Metre
            | Unit::MetrePerNewtonMetre
            | Unit::MetrePerKelvin
            | Unit::MetrePerKilogram
            | Unit::MetrePerSecond => si * 1e3,
            Unit::Radian
            | Unit::RadianPerNewtonMetre
            | Unit::RadianPerKelvin
            | Unit::RadianPerKilogram
            | Unit::RadianPerSecond => si.to_degrees(),
            Unit::Second | Unit::One | Unit::Kilogram | Unit::Kelvin | Unit::NewtonMetre => si,
            Unit::PerKelvin => si * 1e6,
        }
    }
}

impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.symbol())
    }
}
