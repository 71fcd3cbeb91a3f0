//! What a file says, and whether it is what the lab can work with.

use crate::LabError;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Degrees of freedom of Student's t.
pub fn check_tail_degrees(key: &str, degrees: f64) -> Result<(), LabError> {
    if degrees == 0.0 || (degrees.is_finite() && degrees > 2.0) {
        return Ok(());
    }
    Err(value_error(key, "must be 0 (normal) or above 2, where Student's t has a variance".into()))
}

/// What a TOML file says.
pub fn parse_toml<T: DeserializeOwned>(what: &'static str, text: &str, path: &Path) -> Result<T, LabError> {
    let refused = |source| LabError::Parse { what, path: path.to_owned(), source: Box::new(source) };
    toml::from_str(text).map_err(refused)
}

pub fn value_error(key: &str, why: String) -> LabError {
    LabError::Value { key: key.to_owned(), why }
}

pub fn check_positive(key: &str, v: f64) -> Result<(), LabError> {
    if v.is_finite() && v > 0.0 { Ok(()) } else { Err(value_error(key, format!("must be above 0, is {v}"))) }
}

pub fn check_not_negative(key: &str, v: f64) -> Result<(), LabError> {
    if v.is_finite() && v >= 0.0 {
        Ok(())
    } else {
        Err(value_error(key, format!("must not be negative, is {v}")))
    }
}

pub fn check_share(key: &str, v: f64) -> Result<(), LabError> {
    if (0.0..=1.0).contains(&v) {
        Ok(())
    } else {
        Err(value_error(key, format!("must lie between 0 and 1, is {v}")))
    }
}

pub fn check_range(key: &str, [low, high]: [f64; 2]) -> Result<(), LabError> {
    if low.is_finite() && high.is_finite() && low <= high {
        return Ok(());
    }
    Err(value_error(key, format!("must be [smallest, largest], is [{low}, {high}]")))
}
