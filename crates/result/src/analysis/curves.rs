//! Unlisted errors over what they depend on, with their band.

use crate::proto::ErrorCurve;
use armcal_core::Unit;
use armcal_diagnose::UnknownReport;
use armcal_model::Chain;

/// Standard deviations on each side of a 95 % band.
const BAND: f64 = 1.96;

/// The shape over its driver in the units that people read.
pub fn error_curve(u: &UnknownReport, chain: &Chain) -> ErrorCurve {
    let (driver_unit, driver_symbol) = driver_unit(&u.driver, chain);
    let (factor, unit) = value_unit(&u.channel, u.unit);
    let shown = |si: f64| factor * u.unit.to_display(si);
    let mut m = ErrorCurve {
        timestamp: None,
        channel: u.channel.clone(),
        driver: u.driver.clone(),
        unit: unit.into(),
        driver_unit: driver_symbol.into(),
        formula: u.expression.as_ref().map(|e| e.formula.clone()).unwrap_or_default(),
        ..Default::default()
    };
    let points = u.shape.iter().filter(|p| [p.at, p.value, p.sigma].iter().all(|x| x.is_finite()));
    for p in points {
        m.at.push(driver_unit.to_display(p.at));
        m.value.push(shown(p.value));
        m.low.push(shown(p.value - BAND * p.sigma));
        m.high.push(shown(p.value + BAND * p.sigma));
    }
    m
}

/// Factor and symbol of an error that enters there. Shares of lengths are thousandths at most, and axes of viewers have three
/// decimals.
fn value_unit(channel: &str, unit: Unit) -> (f64, &'static str) {
    match channel {
        "lengths" if unit == Unit::One => (1e6, "ppm"),
        _ => (1.0, unit.display_symbol()),
    }
}

/// Unit of a driver as formulas name it: `q2`, `q2+q3`, `s1*q1`, `tau1`, `t`, `temperature`, `load`, `s1`, `recording`.
fn driver_unit(driver: &str, chain: &Chain) -> (Unit, &'static str) {
    // An angle that counts with the direction of arrival is an angle.
    let angle = driver.split_once('*').map_or(driver, |(_, angle)| angle);
    if let Some(joint) = angle.strip_prefix('q') {
        let number = joint.split('+').next().and_then(|n| n.parse::<usize>().ok());
        let unit = chain.joint_unit(number.map_or(0, |n| n.saturating_sub(1)));
        return (unit, unit.display_symbol());
    }
    match driver.trim_end_matches(|c: char| c.is_ascii_digit()) {
        "t" => (Unit::Second, "s"),
        "tau" => (Unit::NewtonMetre, "N*m"),
        "load" => (Unit::Kilogram, "kg"),
        "temperature" => (Unit::One, "degC"),
        _ => (Unit::One, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");

    #[test]
    fn shares_of_lengths_are_shown_in_millionths() {
        assert_eq!(value_unit("lengths", Unit::One), (1e6, "ppm"));
        assert_eq!(value_unit("joint1", Unit::Radian), (1.0, "deg"));
    }

    #[test]
    fn angles_are_shown_in_degrees_and_directions_as_they_are() {
        let chain = Chain::from_dh_toml(ARM, std::path::Path::new("arm.toml")).expect("arm");
        let drivers = ["q2", "q1+q2", "s1*q1", "t", "tau1", "s3", "recording", "load"];
        let units = drivers.map(|d| driver_unit(d, &chain).1);
        assert_eq!(units, ["deg", "deg", "deg", "s", "N*m", "", "", "kg"]);
    }
}
