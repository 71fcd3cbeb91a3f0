//! What the page may ask for.

use armcal_calibrate::HoldoutConfig;
use armcal_model::{EffectTable, Override};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Effects of one model, at most: more than an arm can have, and few enough for the name of a file.
pub(super) const MOST_EFFECTS: usize = 64;

/// Effects and hold-out of a refit.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wanted {
    /// All effects of the model, as `armcal add` names them.
    #[serde(default)]
    pub effects: Vec<String>,
    /// Formulas beside them.
    #[serde(default)]
    pub expressions: Vec<Formula>,
    /// What the fit must not see; the pipeline's own when absent.
    pub holdout: Option<HoldoutConfig>,
}

impl Wanted {
    /// How many effects they are.
    pub fn count(&self) -> usize {
        self.effects.len() + self.expressions.len()
    }
}

/// A formula of the user: an `[[effects]]` table of kind `expression`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Formula {
    name: String,
    formula: String,
    acts_on: String,
    #[serde(default)]
    parameters: BTreeMap<String, Override>,
}

impl Formula {
    /// As the pipeline file writes it.
    pub fn table(&self) -> EffectTable {
        EffectTable {
            kind: "expression".into(),
            target: None,
            since: None,
            name: Some(self.name.clone()),
            formula: Some(self.formula.clone()),
            acts_on: Some(self.acts_on.clone()),
            one_of: Vec::new(),
            shape: BTreeMap::new(),
            parameters: self.parameters.clone(),
        }
    }
}

/// What can be chosen.
#[derive(Debug, Serialize)]
pub(super) struct Choices {
    /// Effects that this arm and these dwells could show.
    pub effects: Vec<String>,
    /// Hold-outs with their names.
    pub holdouts: Vec<(String, HoldoutConfig)>,
}
