//! Effects in a pipeline file: one `[[effects]]` table for each.
//!
//! ```toml
//! [[effects]]
//! kind = "periodic"
//! target = 1                     # joint, by number from 1 or by name
//! since = "1.17"                 # only where it matters: recording, recording.dwell or recording.first-last
//! frequency = 30                 # shapes, SI
//! parameters.sin = { prior = 0.1, bound = 2.0 }     # display units (mm, deg) unless `unit` is given
//!
//! [[effects]]
//! kind = "expression"
//! name = "cable"
//! formula = "k * sin(q1)"
//! acts_on = "joint3"             # a joint, a parameter such as "joint2.a", or world.x, world.y, world.z
//! parameters.k = { unit = "deg", prior = 0.3 }
//! ```

use super::classification::Target;
use super::overrides::Override;
use super::spec::{EffectSpec, Expression, Since, joint_index};
use crate::ModelError;
use crate::error::similar_name_hint;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One `[[effects]]` table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectTable {
    /// Name of the kind.
    pub kind: String,
    /// Its joint, or its marker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<JointReference>,
    /// When it acts: `1` or `"1.17"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since: Option<JointReference>,
    /// Name of an expression.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Formula of an expression.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formula: Option<String>,
    /// What an expression acts on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acts_on: Option<String>,
    /// Names that the data did not tell from it when it was added, its own among them. They do not act.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub one_of: Vec<String>,
    /// Shapes by their names, SI; any other key, which [`EffectTable::spec`] then names.
    #[serde(flatten)]
    pub shape: BTreeMap<String, JointReference<f64>>,
    /// Parameters of an expression, or changes to those of another kind.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Override>,
}

/// A number or a word. The value of a key that depends on the kind is a number of any size: no key of an effect has a text that
/// is not listed in [`EffectTable`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum JointReference<N = usize> {
    /// A number.
    Number(N),
    /// A word.
    Text(String),
}

impl std::fmt::Display for JointReference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            JointReference::Number(number) => write!(f, "{number}"),
            JointReference::Text(text) => f.write_str(text),
        }
    }
}

impl EffectTable {
    /// The spec it means on an arm with these joints.
    pub fn spec(&self, joint_names: &[String]) -> Result<EffectSpec, ModelError> {
        let bad = |problem: String| ModelError::BadEffect { effect: self.kind.clone(), problem };
        let mut spec = EffectSpec::new(&self.kind);
        match (&self.target, spec.kind()?.target) {
            (Some(word), Target::Marker) => spec.marker = Some(word.to_string()),
            (Some(word), _) => spec.target = Some(joint_index(&word.to_string(), joint_names).map_err(bad)?),
            (None, _) => {}
        }
        spec.since = match &self.since {
            Some(word) => Some(word.to_string().parse::<Since>().map_err(|e| bad(format!("since: {e}")))?),
            None => None,
        };
        for (key, value) in &self.shape {
            let JointReference::Number(value) = value else { return Err(bad(unknown_key(key))) };
            spec.shape.push((key.clone(), *value));
        }
        spec.overrides = self.parameters.clone();
        spec.expression = match (&self.name, &self.formula, &self.acts_on) {
            (None, None, None) => None,
            (Some(name), Some(formula), Some(acts_on)) => {
                Some(Expression { name: name.clone(), formula: formula.clone(), acts_on: acts_on.clone() })
            }
            _ => return Err(bad("an expression needs a name, a formula and acts_on".to_owned())),
        };
        Ok(spec)
    }
}

fn unknown_key(key: &str) -> String {
    let known = ["kind", "target", "since", "name", "formula", "acts_on", "one_of", "parameters"];
    format!("there is no key \"{key}\"{}", similar_name_hint(key, known.into_iter()))
}

impl From<&EffectSpec> for EffectTable {
    fn from(spec: &EffectSpec) -> EffectTable {
        let expression = spec.expression.as_ref();
        EffectTable {
            kind: spec.kind.clone(),
            target: spec
                .marker
                .clone()
                .map(JointReference::Text)
                .or(spec.target.map(|joint| JointReference::Number(joint + 1))),
            since: spec.since.map(|since| JointReference::Text(since.to_string())),
            name: expression.map(|e| e.name.clone()),
            formula: expression.map(|e| e.formula.clone()),
            acts_on: expression.map(|e| e.acts_on.clone()),
            one_of: Vec::new(),
            shape: spec
                .shape
                .iter()
                .map(|(key, value)| (key.clone(), JointReference::Number(*value)))
                .collect(),
            parameters: spec.overrides.clone(),
        }
    }
}

/// Effects as the `[[effects]]` tables of a pipeline file.
///
/// # Errors
/// A value that TOML cannot hold.
pub fn effects_toml(effects: &[EffectSpec]) -> Result<String, toml::ser::Error> {
    tables_toml(effects.iter().map(EffectTable::from).collect())
}

/// The same of tables.
///
/// # Errors
/// A value that TOML cannot hold.
pub fn tables_toml(effects: Vec<EffectTable>) -> Result<String, toml::ser::Error> {
    #[derive(Serialize)]
    struct Section {
        effects: Vec<EffectTable>,
    }
    toml::to_string(&Section { effects })
}
