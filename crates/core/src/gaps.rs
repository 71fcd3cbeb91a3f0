//! Lists with an entry a joint, of which some may be missing: NaN, which JSON has as `null`.

use serde::{Deserialize as _, Deserializer};

/// The list, unless every entry is missing.
pub fn if_any_known(all: Vec<f64>) -> Option<Vec<f64>> {
    all.iter().any(|entry| entry.is_finite()).then_some(all)
}

/// Reads what serde writes of such a list; for `#[serde(deserialize_with)]`.
///
/// # Errors
/// What is no list of numbers.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<f64>>, D::Error> {
    let all = Option::<Vec<Option<f64>>>::deserialize(deserializer)?;
    Ok(all.map(|all| all.into_iter().map(|entry| entry.unwrap_or(f64::NAN)).collect()))
}
