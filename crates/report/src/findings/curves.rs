//! Unlisted errors over what they depend on, with their band.

use crate::proto::ErrorCurve;
use armcal_core::Unit;
use armcal_diagnose::UnknownReport;

/// Standard deviations on each side of a 95 % band.
const BAND: f64 = 1.96;

pub(super) fn error_curve(u: &UnknownReport) -> ErrorCurve {
    let (driver_unit, driver_symbol) = driver_unit(&u.driver);
    let mut m = ErrorCurve {
        timestamp: None,
        channel: u.channel.clone(),
        driver: u.driver.clone(),
        unit: u.unit.display_symbol().into(),
        driver_unit: driver_symbol.into(),
        formula: u.expression.as_ref().map(|e| e.formula.clone()).unwrap_or_default(),
        ..Default::default()
    };
    let points = u.shape.iter().filter(|p| [p.at, p.value, p.sigma].iter().all(|x| x.is_finite()));
    for p in points {
        m.at.push(driver_unit.to_display(p.at));
        m.value.push(u.unit.to_display(p.value));
        m.low.push(u.unit.to_display(p.value - BAND * p.sigma));
        m.high.push(u.unit.to_display(p.value + BAND * p.sigma));
    }
    m
}

/// Unit of a driver as formulas name it: `q2`, `q2+q3`, `tau1`, `t`, `temperature`, `load`, `s1`, `recording`.
fn driver_unit(driver: &str) -> (Unit, &'static str) {
    match driver.trim_end_matches(|c: char| c.is_ascii_digit()) {
        "t" => (Unit::Second, "s"),
        "tau" => (Unit::NewtonMetre, "N*m"),
        "load" => (Unit::Kilogram, "kg"),
        "temperature" => (Unit::One, "degC"),
        angle if angle.starts_with('q') => (Unit::Radian, "deg"),
        _ => (Unit::One, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_shown_in_degrees_and_directions_as_they_are() {
        let units = ["q2", "q2+q3", "t", "tau1", "s3", "recording", "load"].map(|d| driver_unit(d).1);
        assert_eq!(units, ["deg", "deg", "s", "N*m", "", "", "kg"]);
    }
}
