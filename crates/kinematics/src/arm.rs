//! The model, read and made.

use crate::KinematicsError;
use armcal_compensate::{Compensator, Drive, TargetFrame};
use armcal_core::{FeatureId, Unit};
use armcal_model_file::{StoredArms, StoredModel};

/// A calibrated arm with its effects.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedArm {
    /// What the file says.
    pub file: StoredModel,
    /// The models that it is about.
    pub models: StoredArms,
}

/// Under which conditions the arm is driven.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Conditions {
    /// What is meant by the tip, of several: its place among [`CalibratedArm::tips`].
    pub tip: usize,
    /// Whether poses are in the base of that tip's arm, as calibrated; in the world of the measurement otherwise.
    pub in_base: bool,
    /// The recording as in which the arm is, what has happened until then; the last when absent.
    pub recording: Option<usize>,
    /// Load at the tip [kg]; that of the recording when absent.
    pub load_kg: Option<f64>,
    /// Temperature [degC]; that of the recording when absent.
    pub temperature_c: Option<f64>,
}

impl CalibratedArm {
    /// Reads the text of a `model.json` and makes its models.
    ///
    /// # Errors
    /// A text that is none, or whose parts contradict each other.
    pub fn from_json(text: &str) -> Result<CalibratedArm, KinematicsError> {
        let file = StoredModel::from_json(text)?;
        let models = file.arms()?;
        let arm = CalibratedArm { file, models };
        let (tip, frame, drive) = arm.drive(&Conditions::default())?;
        Compensator::of_result(&arm.file, &arm.models, (tip, frame), &drive).check(None)?;
        Ok(arm)
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.models.model.joint_count()
    }

    /// Names of the joints, in the order of every joint vector.
    pub fn joints(&self) -> &[String] {
        self.models.model.chain().joint_names()
    }

    /// Whether a joint slides: [m] in the place of [rad].
    pub fn slides(&self, joint: usize) -> bool {
        self.models.model.chain().joint_unit(joint) == Unit::Metre
    }

    /// Names of what can be asked for: the tip, of several arms each one's, then markers.
    pub fn tips(&self) -> impl Iterator<Item = &str> {
        self.models.model.features().map(|(_, name)| name)
    }

    /// The effects in the model, as `armcal add` takes them.
    pub fn effects(&self) -> impl Iterator<Item = String> {
        self.models.model.effects().iter().map(|effect| effect.spec.to_string())
    }

    /// The conditions as `armcal compensate` takes them, once they make sense.
    pub(crate) fn drive(
        &self,
        asked: &Conditions,
    ) -> Result<(FeatureId, TargetFrame, Drive), KinematicsError> {
        let bad = |what, problem: String| Err(KinematicsError::argument(what, problem));
        let (tips, recordings) = (self.tips().count(), self.file.recordings.len());
        if asked.tip >= tips {
            return bad("tip", format!("{} is not known, there are {tips}, counted from 0", asked.tip));
        }
        if let Some(recording) = asked.recording.filter(|recording| *recording >= recordings) {
            return bad(
                "recording",
                format!("{recording} is not known, there are {recordings}, counted from 0"),
            );
        }
        if asked.load_kg.is_some_and(|kg| !(kg.is_finite() && kg >= 0.0)) {
            return bad("load_kg", "give a mass in kg, zero or more".into());
        }
        if asked.temperature_c.is_some_and(|celsius| !celsius.is_finite()) {
            return bad("temperature_c", "give a temperature in degC".into());
        }
        let frame = if asked.in_base { TargetFrame::Base } else { TargetFrame::World };
        let drive = Drive {
            recording: asked.recording,
            load_kg: asked.load_kg,
            temperature_c: asked.temperature_c,
            ..Drive::default()
        };
        Ok((FeatureId(asked.tip), frame, drive))
    }
}
