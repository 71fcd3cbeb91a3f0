//! The URDF that an arm came from, with what its calibration changed.

use super::Model;
use crate::ModelError;
use crate::chain::{Source, with_origins};
use armcal_core::{Code, FeatureId, Pose, Severity, Stage, Warning};
use std::path::Path;

/// Origins by the names of their joints, and what of the calibration is in none of them.
pub type CalibratedOrigins<'m> = (Vec<(&'m str, Pose)>, Vec<Warning>);

impl Model {
    /// The URDF of an arm with the calibrated origins of its moving joints; every other byte stays as it was.
    ///
    /// `xml` is the file its chain was read from, `path` its name for errors, `p` the parameter vector. Only
    /// `xyz` or `rpy` attributes whose value changed are replaced. If the tip frame is calibrated (any of its
    /// parameters is free) it is written into the fixed joint that carries the tip link; where that joint
    /// moves there is no such place, which a warning says. Errors when the chain did not come from a URDF,
    /// when `xml` is not that URDF, or when `p` has the wrong length.
    pub fn to_urdf(
        &self,
        arm: usize,
        xml: &str,
        path: &Path,
        p: &[f64],
    ) -> Result<(String, Vec<Warning>), ModelError> {
        let tip = self.feature_parameters(FeatureId(arm)).any(|index| self.parameters()[index].free);
        self.to_urdf_with(arm, tip, xml, path, p)
    }

    /// [`Model::to_urdf`], said from outside whether the tip frame was calibrated: a model that was read back does not know.
    pub fn to_urdf_with(
        &self,
        arm: usize,
        tip: bool,
        xml: &str,
        path: &Path,
        p: &[f64],
    ) -> Result<(String, Vec<Warning>), ModelError> {
        let (origins, warnings) = self.calibrated_origins(arm, tip, p)?;
        Ok((with_origins(xml, path, &origins)?, warnings))
    }

    /// The origins that calibration changes, by the names of their joints in the URDF: of every moving joint and, with `tip`, of
    /// the fixed joint that carries the tip link. Errors as [`Model::to_urdf`].
    pub fn calibrated_origins(
        &self,
        arm: usize,
        tip: bool,
        p: &[f64],
    ) -> Result<CalibratedOrigins<'_>, ModelError> {
        let (chain, own) = self.chain().arm(arm);
        let Source::Urdf(joints) = &chain.source else {
            return Err(ModelError::WrongFormat { model: chain.name.clone(), format: "URDF" });
        };
        if p.len() != self.parameters().len() {
            return Err(ModelError::ParameterCount { actual: p.len(), expected: self.parameters().len() });
        }
        let (mut origins, mut warnings) = (Vec::new(), Vec::new());
        for joint in joints {
            // A moving joint is two segments: its origin and its motion.
            let carries_tip = tip && chain.end == Some(joint.segment + usize::from(joint.moves));
            if carries_tip && joint.moves {
                warnings.push(tip_not_written(&joint.name));
            }
            if !joint.moves && !carries_tip {
                continue;
            }
            let mut origin = Pose::from(&chain.segments[joint.segment].transform(&p[own.clone()], &[]));
            if carries_tip && !joint.moves {
                origin *= self.feature_in_link(p, FeatureId(arm));
            }
            origins.push((joint.name.as_str(), origin));
        }
        Ok((origins, warnings))
    }
}

fn tip_not_written(joint: &str) -> Warning {
    Warning::new(
        Severity::Notice,
        Stage::Output,
        Code::TipNotInUrdf,
        "tip",
        format!(
            "the tip link hangs on the moving joint \"{joint}\", so the calibrated tip frame is not in the URDF; \
             add a fixed joint with a tip link and name that as tip_link"
        ),
    )
}
