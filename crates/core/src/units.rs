//! Physical units: one enum decides symbols and display scaling everywhere a number leaves armcal.

use serde::Serialize;

/// The SI unit of a number inside armcal, and how it is shown to people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
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
}

impl Unit {
    /// Symbol of the SI unit, as written to machine-readable output.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Metre => "m",
            Unit::Radian => "rad",
            Unit::Second => "s",
            Unit::One => "1",
            Unit::RadianPerNewtonMetre => "rad/(N*m)",
            Unit::PerKelvin => "1/K",
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
        }
    }

    /// Converts an SI value to the unit shown to people.
    pub fn to_display(self, si: f64) -> f64 {
        match self {
            Unit::Metre => si * 1e3,
            Unit::Radian | Unit::RadianPerNewtonMetre => si.to_degrees(),
            Unit::Second | Unit::One => si,
            Unit::PerKelvin => si * 1e6,
        }
    }
}

impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.symbol())
    }
}
