//! The `[diagnosis]` section of a pipeline. Every threshold of the verdict is here, and the report prints them.

use crate::DiagnoseError;
use armcal_calibrate::SignFlips;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Resamplings of the bootstrap where another search decides: enough for the gate at one percent.
pub(crate) const RESAMPLINGS: usize = 199;

/// How the diagnosis weighs and decides. Defaults: `notes/diagnosis.md` section 9.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiagnosisConfig {
    /// Whether `armcal run` diagnoses; default true.
    pub enabled: bool,
    /// Prior weight of "nothing is missing"; default 0.5.
    pub prior_nothing: f64,
    /// Prior weight of the catalogue, shared evenly by its entries; default 0.4.
    pub prior_catalogue: f64,
    /// Prior weight of "something outside the catalogue"; default 0.1, half cells, half smooth discrepancies.
    pub prior_unknown: f64,
    /// Amplitudes, in units of an effect's typical size, over which the evidence is averaged; default 0.3, 1, 3, 10.
    pub amplitude_scales: Vec<f64>,
    /// Degrees of freedom the declared noise is worth; default 8.
    pub noise_prior_dof: f64,
    /// Typical displacement of an effect nobody listed [mm]; default 0.5.
    pub unlisted_effect_mm: f64,
    /// Something is missing only below this probability of nothing; default 0.02.
    pub max_probability_nothing: f64,
    /// A name needs a family-wise p-value (bootstrap, max-T) at most this; default 0.01.
    pub max_p_adjusted: f64,
    /// What a further amplitude must gain in the score, the ln predictive density of dwells that a fit did not see; default 3.
    pub margin_nats: f64,
    /// Effects whose fitted signature is this parallel are one answer; default 0.98.
    pub merge_cosine: f64,
    /// Largest p-value of the leave-place-out gain (sign flips); default 0.05.
    pub max_p_heldout: f64,
    /// A further effect must remove at least this share of what each one before it removed whose shape it could be, and this
    /// share of what an effect gains may be the detail of its shape; default 0.01.
    pub leftover_share: f64,
    /// Pairs with an expected log-likelihood ratio (times two) below this cannot be told apart; default 6.
    pub min_delta: f64,
    /// Resamplings of the bootstrap; default 999.
    pub resamplings: usize,
    /// Seed of the bootstrap and the sign flips; default 0.
    pub seed: u64,
    /// Most effects accepted one after the other; default 8.
    pub max_effects: usize,
    /// A dwell is set aside when its left-out residual is as rare as this many sigma; default 5.
    pub outlier_sigma: f64,
    /// Errors up to this many times what the declared noise gives, scattering up to this many times as declared, are of it:
    /// only then may nothing be missing; default 1.5.
    pub floor_factor: f64,
    /// Most dwells that weigh explanations; of more, as many are drawn evenly over time. All of them take part in
    /// fits. Default 400.
    pub max_weighed: usize,
    /// Joint difference below which two dwells are visits to the same pose [deg]; default 0.6.
    pub same_pose_deg: f64,
    /// Effects that this arm cannot have, each with the reason: they are not tried. `backlash` is that of every joint.
    pub exclude: BTreeMap<String, String>,
    /// Where there are any, the only effects that are tried, each with the reason.
    pub only: BTreeMap<String, String>,
    /// Effects that are known to act, each with the reason: of names that the data cannot tell apart they are the answer.
    pub known: BTreeMap<String, String>,
}

impl Default for DiagnosisConfig {
    fn default() -> DiagnosisConfig {
        DiagnosisConfig {
            enabled: true,
            prior_nothing: 0.5,
            prior_catalogue: 0.4,
            prior_unknown: 0.1,
            amplitude_scales: vec![0.3, 1.0, 3.0, 10.0],
            noise_prior_dof: 8.0,
            unlisted_effect_mm: 0.5,
            max_probability_nothing: 0.02,
            max_p_adjusted: 0.01,
            margin_nats: 3.0,
            merge_cosine: 0.98,
            max_p_heldout: 0.05,
            leftover_share: 0.01,
            min_delta: 6.0,
            resamplings: 999,
            seed: 0,
            max_effects: 8,
            outlier_sigma: 5.0,
            floor_factor: 1.5,
            max_weighed: 400,
            same_pose_deg: 0.6,
            exclude: BTreeMap::new(),
            only: BTreeMap::new(),
            known: BTreeMap::new(),
        }
    }
}

impl DiagnosisConfig {
    /// The sign flips of groups.
    pub fn flips(&self) -> SignFlips {
        SignFlips { draws: self.resamplings, seed: self.seed }
    }

    /// Refuses impossible values.
    pub fn check(&self) -> Result<(), DiagnoseError> {
        let refuse = |key, value: String, why| Err(DiagnoseError::BadConfig { key, value, why });
        for (key, value) in [
            ("prior_nothing", self.prior_nothing),
            ("prior_catalogue", self.prior_catalogue),
            ("prior_unknown", self.prior_unknown),
            ("max_probability_nothing", self.max_probability_nothing),
            ("max_p_adjusted", self.max_p_adjusted),
            ("merge_cosine", self.merge_cosine),
            ("max_p_heldout", self.max_p_heldout),
        ] {
            if !(value > 0.0 && value < 1.0) {
                return refuse(key, value.to_string(), "give a number between 0 and 1, both excluded");
            }
        }
        for (key, value) in [
            ("noise_prior_dof", self.noise_prior_dof),
            ("unlisted_effect_mm", self.unlisted_effect_mm),
            ("outlier_sigma", self.outlier_sigma),
            ("floor_factor", self.floor_factor),
            ("same_pose_deg", self.same_pose_deg),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return refuse(key, value.to_string(), "give a number above zero");
            }
        }
        let scales = &self.amplitude_scales;
        if scales.is_empty() || !scales.iter().all(|a| a.is_finite() && *a > 0.0) {
            return refuse("amplitude_scales", format!("{scales:?}"), "give one or more numbers above zero");
        }
        if self.max_weighed < 20 {
            return refuse("max_weighed", self.max_weighed.to_string(), "20 or more");
        }
        if !(99..=99_999).contains(&self.resamplings) {
            return refuse("resamplings", self.resamplings.to_string(), "99 to 99999");
        }
        Ok(())
    }
}
