//! `[model]` and `[[parameters]]`: the nominal arm, and what is said of single parameters.

use armcal_model::{Deviation, Masses};
use serde::Deserialize;
use std::path::PathBuf;

/// The nominal arm: a DH file or a URDF chain.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelSection {
    /// DH file.
    pub dh: Option<PathBuf>,
    /// URDF file.
    pub urdf: Option<PathBuf>,
    /// First link of the chain, with `urdf`.
    pub base_link: Option<String>,
    /// Last link of the chain, with `urdf`.
    pub tip_link: Option<String>,
    /// Where the masses of its links come from; where nothing says it, from a URDF that gives all of them.
    pub masses: Option<Masses>,
    /// How far a joint origin may be from nominal, with `urdf`; a DH file says it itself. Learnt where nothing says it.
    pub deviation: Option<Deviation>,
}

/// A change to parameters whose names match a pattern such as `joint*.alpha`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterOverride {
    /// Name or glob; of an effect, a spec and a quantity (`backlash:2.width`, `sensor_scale.*`).
    pub name: String,
    /// Whether the fit may change it.
    pub free: Option<bool>,
    /// Largest deviation from nominal, display unit of the parameter (mm or deg).
    pub bound: Option<f64>,
    /// Standard deviation of the prior, display unit (mm or deg).
    pub prior: Option<f64>,
}
