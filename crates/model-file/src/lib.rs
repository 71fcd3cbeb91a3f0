//! `model.json`: the calibrated model with all it needs to predict again, without the recordings it came from.
//!
//! [`StoredModel::from_json`] reads it, [`StoredModel::arms`] makes the models to compute with. The nominal arm is kept as the
//! text of its file, frames and effects as what was built on it, what drives the effects as the facts of the session; so
//! the model is made again by the code that made it first.

mod facts;

use armcal_core::{DwellMark, Load, Visited};
use armcal_model::{
    ArmFrames, Chain, EffectTable, FixedPlace, Frames, Knowledge, Length, Model, ModelError, Session,
};
pub use facts::{ArmText, ChainText, FrameFacts, LengthFacts, MarkerFacts, PlaceFacts};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Format of the file.
pub const SCHEMA: &str = "armcal.model/1";
/// Its name in the folder of results, and behind `armcal/` in `run.mcap`.
pub const FILE: &str = "model.json";

/// Why a text is no model.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It is not JSON, or lacks something.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    /// It is something else, or of another version.
    #[error("its schema is `{found}`, not `{SCHEMA}`")]
    Schema {
        /// The schema that it names.
        found: String,
    },
}

/// A calibrated model of an earlier run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoredModel {
    /// [`SCHEMA`].
    pub schema: String,
    /// The version of armcal that wrote it.
    pub version: String,
    /// Name of the pipeline.
    pub pipeline: String,
    /// The nominal arm.
    pub chain: ChainText,
    /// World to base, of several arms the first one's.
    pub base: FrameFacts,
    /// Last link to tip, of several arms the first one's.
    pub tip: FrameFacts,
    /// Markers; absent in a model without, and in one written before there were any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<MarkerFacts>,
    /// Of several arms, base and tip of each behind the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub more_arms: Vec<[FrameFacts; 2]>,
    /// Points and planes that stand in the world and were measured against.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<PlaceFacts>,
    /// Lengths that distances count from, a rigid link between two tips among them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lengths: Vec<LengthFacts>,
    /// World to board, recording by recording, where it has one.
    pub boards: Vec<FrameFacts>,
    /// The effects.
    pub effects: Vec<EffectTable>,
    /// What they refer to.
    pub session: Session,
    /// Every parameter, in the order of the model.
    pub parameters: Vec<Value>,
    /// The recordings, in the order of the pipeline.
    pub recordings: Vec<RecordingFacts>,
    /// Readings at rest, for a posture to start from [rad] (sliding: [m]).
    pub postures_rad: Vec<Vec<f64>>,
    /// Smallest and largest reading of each joint [rad] (sliding: [m]).
    pub range_rad: Vec<[f64; 2]>,
    /// What each joint visited between them; empty in a model written before this was kept.
    #[serde(default)]
    pub visited: Vec<Visited>,
    /// Mean error on points the fit did not see, else on those it saw [m]; `None` where it is not a number.
    pub mean_error_m: Option<f64>,
    /// What the diagnosis would add to the model, as `armcal add` takes it.
    pub missing: Vec<String>,
}

/// One parameter, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Value {
    /// Its name.
    pub name: String,
    /// With nominal robot parameters, estimated frames fitted.
    pub nominal: f64,
    /// As calibrated.
    pub calibrated: f64,
    /// Posterior standard deviation; 0 where it was fixed.
    pub sigma: f64,
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingFacts {
    /// Its name.
    pub name: String,
    /// What identifies its files (`armcal_recording::FileReport::identity`); in results of earlier versions their SHA-256.
    #[serde(alias = "sha256")]
    pub identity: Vec<String>,
    /// Its observed dwells, by which a copy of it is recognised; absent in a model written before this was kept.
    #[serde(default)]
    pub dwells: Option<Vec<DwellMark>>,
    /// Its last observed dwell.
    pub last_dwell: usize,
    /// When that was [ns], robot clock.
    pub last_ns: i64,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Loads at other points of the arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub more_loads: Vec<Load>,
    /// Mean temperature [degC].
    pub temperature_c: Option<f64>,
}

/// The model without effects and with them, and their parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredArms {
    /// The nominal arm in its frames: no effects.
    pub geometry: Model,
    /// Its parameters: robot nominal, estimated frames fitted.
    pub nominal_values: Vec<f64>,
    /// The model with its effects.
    pub model: Model,
    /// Its parameters as calibrated.
    pub values: Vec<f64>,
}

impl StoredModel {
    /// Its JSON.
    ///
    /// # Errors
    /// None that is known: every part has a form in JSON.
    pub fn json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }

    /// Reads the text of a `model.json`.
    ///
    /// # Errors
    /// A text that is no model in this format.
    pub fn from_json(text: &str) -> Result<StoredModel, FileError> {
        let model: StoredModel = serde_json::from_str(text)?;
        if model.schema != SCHEMA {
            return Err(FileError::Schema { found: model.schema });
        }
        Ok(model)
    }

    /// What the effects refer to.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The URDF that an arm came from and the link that its base is; none of one from a DH table.
    pub fn urdf(&self, arm: usize) -> Option<(&str, &str)> {
        let chain = match &self.chain {
            ChainText::Arms { arms } => &arms.get(arm)?.chain,
            one => one,
        };
        match chain {
            ChainText::Urdf { text, base_link, .. } => Some((text, base_link)),
            _ => None,
        }
    }

    /// Whether the fit could change a parameter.
    pub fn was_free(&self, index: usize) -> bool {
        self.parameters.get(index).is_some_and(|value| value.sigma > 0.0)
    }

    /// The nominal arm, or arms, in the frames.
    fn geometry(&self, chain: Chain) -> Result<Model, ModelError> {
        let place = |p: &PlaceFacts| FixedPlace { frame: p.frame.frame(), is_plane: p.is_plane };
        let length = |l: &LengthFacts| Length {
            name: l.name.clone(),
            length_m: l.length_m,
            knowledge: Knowledge::Given,
        };
        let places: Vec<FixedPlace> = self.places.iter().map(place).collect();
        let lengths: Vec<Length> = self.lengths.iter().map(length).collect();
        self.arms_in_frames(chain)?.against(&places, &lengths)
    }

    fn arms_in_frames(&self, chain: Chain) -> Result<Model, ModelError> {
        let (base, tip) = (self.base.frame(), self.tip.frame());
        if self.more_arms.is_empty() {
            let boards = self.boards.iter().map(FrameFacts::frame).collect();
            let markers = self.markers.iter().map(MarkerFacts::marker).collect();
            return Model::new(chain, Frames { base, tip, markers, boards });
        }
        let further =
            self.more_arms.iter().map(|[base, tip]| ArmFrames { base: base.frame(), tip: tip.frame() });
        let arms = std::iter::once(ArmFrames { base, tip }).chain(further).collect();
        Model::of_arms(chain, arms)
    }

    /// The models, made again.
    ///
    /// # Errors
    /// Contents that contradict each other, as only a file changed by hand has them.
    pub fn arms(&self) -> Result<StoredArms, ModelError> {
        let measured: Vec<&str> = self.markers.iter().map(|marker| marker.link.as_str()).collect();
        let geometry = self.geometry(self.chain.chain(&measured, Path::new(FILE))?)?;
        let joints = geometry.chain().joint_names();
        let specs = self.effects.iter().map(|e| e.spec(joints)).collect::<Result<Vec<_>, _>>()?;
        let model = geometry.with_effects(&specs, &self.session)?;
        let expected: Vec<&str> = model.parameters().iter().map(|p| p.name.as_str()).collect();
        let wrong = (0..expected.len().max(self.parameters.len()))
            .find(|i| self.parameters.get(*i).map(|v| v.name.as_str()) != expected.get(*i).copied());
        if let Some(index) = wrong {
            return Err(ModelError::UnknownParameter {
                name: self.parameters.get(index).map_or("(missing)".to_owned(), |v| v.name.clone()),
                nearest: expected.get(index).map(|name| (*name).to_owned()),
            });
        }
        let nominal = self.parameters.iter().take(geometry.parameters().len()).map(|v| v.nominal);
        Ok(StoredArms {
            nominal_values: nominal.collect(),
            geometry,
            values: self.parameters.iter().map(|v| v.calibrated).collect(),
            model,
        })
    }
}
