//! How far from the calibrated model a file leaves the arm, at the readings of the session.

use super::Source;
use crate::error::DeployError;
use armcal_core::{DwellId, ErrorStats, FeatureId, Observation, Reference};
use armcal_formats::zeros::JointZeros;
use armcal_result::{OBSERVATIONS_FILE, StoredModel, StoredObservations};
use nalgebra::Vector3;
use std::path::Path;

/// What was recorded, as far as it is beside the result.
pub struct Recorded {
    observations: Vec<Observation>,
    /// What they are, in words.
    pub what: &'static str,
}

impl Recorded {
    /// The observations beside the model that `result` names, else its postures.
    ///
    /// # Errors
    /// A file of observations that cannot be read.
    pub fn beside(result: &Path, past: &StoredModel) -> Result<Recorded, DeployError> {
        let folder = if result.is_dir() { result } else { result.parent().unwrap_or(Path::new("")) };
        let path = folder.join(OBSERVATIONS_FILE);
        if path.is_file() {
            let observed = StoredObservations::open(&path)?;
            if of_this_result(&observed, past) {
                let observations = observed.recordings.into_iter().flat_map(|r| r.observations).collect();
                return Ok(Recorded { observations, what: "observations" });
            }
        }
        let last = past.recordings.len().saturating_sub(1);
        let facts = past.recordings.last();
        let dwell = DwellId { recording: last, dwell: facts.map_or(0, |facts| facts.last_dwell) };
        let posture = |joint_rad: &Vec<f64>| {
            let bare = Observation::bare(dwell, joint_rad.clone(), Reference::position(Vector3::zeros()));
            Observation {
                time_ns: facts.map_or(0, |facts| facts.last_ns),
                load_kg: facts.map_or(0.0, |facts| facts.load_kg),
                more_loads: facts.map_or_else(Vec::new, |facts| facts.more_loads.clone()),
                temperature_c: facts.and_then(|facts| facts.temperature_c),
                ..bare
            }
        };
        let observations = past.postures_rad.iter().map(posture).collect();
        let what = "recorded postures (without observations.json beside the model nobody knows from where their joints came)";
        Ok(Recorded { observations, what })
    }

    /// Every observation of the arm, and where the calibrated model with its effects has what it is of [m, world].
    pub fn tips(&self, source: &Source<'_>) -> Vec<(Observation, Vector3<f64>)> {
        let model = &source.arms.model;
        let of_several = !model.chain().arms().is_empty();
        let tip = |o: &Observation| {
            // Two arms share their observations: each is of both tips.
            let feature = if of_several { FeatureId(source.arm) } else { o.feature };
            let at = model.feature_in_world(&source.arms.values, feature, o);
            (Observation { feature, ..o.clone() }, at.translation.vector)
        };
        self.observations.iter().map(tip).collect()
    }
}

fn of_this_result(observed: &StoredObservations, past: &StoredModel) -> bool {
    let identities =
        observed.recordings.iter().map(|r| r.files.iter().map(|f| &f.identity).collect::<Vec<_>>());
    observed.pipeline == past.pipeline
        && identities.eq(past.recordings.iter().map(|r| r.identity.iter().collect::<Vec<_>>()))
}

/// Distances between where a file has the tip and where the calibrated model, with its effects, has it. What a file holds is the
/// geometry, or `zeros` on the nominal one.
pub fn remaining_errors(source: &Source<'_>, recorded: &Recorded, zeros: Option<&JointZeros>) -> ErrorStats {
    let geometry = &source.arms.geometry;
    let values = &source.arms.values[..geometry.parameters().len()];
    let off = |(o, tip_m): &(Observation, Vector3<f64>)| {
        let held = match zeros {
            Some(zeros) => zeros.tip_in_world(geometry, o),
            None => geometry.feature_in_world(values, o.feature, o).translation.vector,
        };
        (held - tip_m).norm()
    };
    ErrorStats::of_norms(&recorded.tips(source).iter().map(off).collect::<Vec<f64>>())
}
