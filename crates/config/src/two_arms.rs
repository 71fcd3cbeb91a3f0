//! `[[arms]]`: two arms with a model file each, whose tips are joined.

use crate::{FrameSection, ModelSection, ParameterOverride};
use armcal_model::EffectTable;
use armcal_recording::{JointStream, Streams};
use serde::Deserialize;

/// The two arms of a pipeline.
#[derive(Debug, Clone)]
pub struct TwoArms {
    /// The arms.
    pub arms: [ArmSection; 2],
}

/// One arm.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmSection {
    /// Its name, the prefix of its parameters.
    pub name: String,
    /// Its joint stream.
    pub joints: JointStream,
    /// Its nominal model.
    pub model: ModelSection,
    /// Its base in the common world. `at` counts for every `pose`; `"measured"` takes it with `sigma_mm`, `sigma_deg`.
    #[serde(default)]
    pub base: FrameSection,
    /// The joined point on its last link.
    #[serde(default)]
    pub tip: FrameSection,
    /// Changes to single parameters, by their names without the arm's prefix.
    #[serde(default)]
    pub parameters: Vec<ParameterOverride>,
    /// Physical effects beyond geometry.
    #[serde(default)]
    pub effects: Vec<EffectTable>,
}

impl TwoArms {
    /// What to read of both arms.
    pub(crate) fn streams(&self) -> Streams {
        let of = |arm: &ArmSection| JointStream { arm: Some(arm.name.clone()), ..arm.joints.clone() };
        Streams { joints: self.arms.iter().map(of).collect(), ..Streams::default() }
    }

    /// What serde cannot see.
    pub(crate) fn contradiction(&self) -> Option<(&'static str, String)> {
        let arms = &self.arms;
        // They name files.
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
        let taken = ["parameters", "pipeline", "calibrated"];
        let is_file_name = |name: &str| !name.is_empty() && !taken.contains(&name) && name.chars().all(plain);
        if let Some(arm) = arms.iter().find(|arm| !is_file_name(&arm.name)) {
            return Some(("arms.name", format!("`{}` cannot be the name of a file of results", arm.name)));
        }
        if arms[0].joints.topic == arms[1].joints.topic && arms[0].joints.names == arms[1].joints.names {
            return Some((
                "arms.joints",
                "is the same for both arms; give each its own topic, or its own joint names on a topic they share".into(),
            ));
        }
        None
    }
}
