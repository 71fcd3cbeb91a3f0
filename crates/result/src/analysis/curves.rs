//! Unlisted errors over what they depend on, with their band.

use crate::proto::ErrorCurve;
use armcal_core::Unit;
use armcal_diagnose::{DependsOn, EntersAt, UnknownReport};
use armcal_model::Chain;

/// Standard deviations on each side of a 95 % band.
const BAND: f64 = 1.96;

/// The shape over its driver in the units that people read.
pub fn error_curve(u: &UnknownReport, chain: &Chain) -> ErrorCurve {
    let (driver_unit, driver_symbol) = driver_unit(u.driver, chain);
    let (factor, unit) = value_unit(&u.channel, u.unit);
    let shown = |si: f64| factor * u.unit.to_display(si);
    let mut m = ErrorCurve {
        timestamp: None,
        channel: u.channel.to_string(),
        driver: u.driver.to_string(),
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
fn value_unit(channel: &EntersAt, unit: Unit) -> (f64, &'static str) {
    match channel {
        EntersAt::Lengths if unit == Unit::One => (1e6, "ppm"),
        _ => (1.0, unit.display_symbol()),
    }
}

/// Unit of a driver.
fn driver_unit(driver: DependsOn, chain: &Chain) -> (Unit, &'static str) {
    match driver {
        // An angle that counts with the direction of arrival is an angle.
        DependsOn::Angle(joint) | DependsOn::AngleSum(joint) | DependsOn::AngleByDirection(joint) => {
            let unit = chain.joint_unit(joint);
            (unit, unit.display_symbol())
        }
        DependsOn::SessionTime => (Unit::Second, "s"),
        DependsOn::Torque(_) => (Unit::NewtonMetre, "N*m"),
        DependsOn::Load => (Unit::Kilogram, "kg"),
        DependsOn::Temperature => (Unit::One, "degC"),
        _ => (Unit::One, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");

    #[test]
    fn shares_of_lengths_are_shown_in_millionths() {
        assert_eq!(value_unit(&EntersAt::Lengths, Unit::One), (1e6, "ppm"));
        assert_eq!(value_unit(&EntersAt::Joint(0), Unit::Radian), (1.0, "deg"));
    }

    #[test]
    fn angles_are_shown_in_degrees_and_directions_as_they_are() {
        let chain = Chain::from_dh_toml(ARM, std::path::Path::new("arm.toml")).expect("arm");
        let drivers = ["q2", "q1+q2", "s1*q1", "t", "tau1", "s3", "recording", "load"];
        let units = drivers.map(|d| driver_unit(d.to_owned().try_into().expect("a driver"), &chain).1);
        assert_eq!(units, ["deg", "deg", "deg", "s", "N*m", "", "", "kg"]);
    }
}
