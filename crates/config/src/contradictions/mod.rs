//! What serde cannot see: parts of a pipeline that contradict each other.

mod closed_chain;
mod loads;
mod markers;
mod measures;
mod points;

use crate::{BoardPose, ConfigError, FramePose, ModelSection, Pipeline};
use armcal_model::Masses;
use std::path::Path;

/// Recordings that contradict each other.
pub fn in_recordings(pipeline: &Pipeline, path: &Path) -> Result<(), ConfigError> {
    let fail = |key: &str, problem: String| {
        Err(ConfigError::Contradiction { path: path.to_owned(), key: key.into(), problem })
    };
    if pipeline.recordings.is_empty() {
        return fail("recordings", "names no recording; add [[recordings]] with paths = [...]".into());
    }
    for (i, entry) in pipeline.recordings.iter().enumerate() {
        let name = entry.name();
        if entry.paths.is_empty() {
            return fail(&format!("recordings[{i}].paths"), "is empty".into());
        }
        if pipeline.recordings[..i].iter().any(|other| other.name() == name) {
            return fail(
                &format!("recordings[{i}].name"),
                format!("`{name}` names two recordings; give one of them another name = \"...\""),
            );
        }
        loads::check(pipeline, i, entry, &fail)?;
    }
    Ok(())
}

/// Sections that contradict each other.
pub fn in_sections(pipeline: &Pipeline, path: &Path) -> Result<(), ConfigError> {
    let fail = |key: &str, problem: String| {
        Err(ConfigError::Contradiction { path: path.to_owned(), key: key.into(), problem })
    };
    if pipeline.table.as_ref().is_some_and(|t| t.pose == BoardPose::Measured)
        && pipeline.streams.table.is_none()
    {
        return fail("table.pose", "is \"measured\" but there is no [streams.table]".into());
    }
    if pipeline.frames.base.pose == FramePose::Measured && pipeline.streams.base.is_none() {
        return fail("frames.base.pose", "is \"measured\" but there is no [streams.base]".into());
    }
    let tracked = pipeline.tip_is_tracked() || !pipeline.markers.is_empty();
    let measured = pipeline.closed_chain.is_some() || !pipeline.measure.is_empty();
    if !measured && pipeline.table.is_none() && !tracked {
        let problem = "is absent and so are [streams.tip], `points` of [[recordings]] and [[measure]]: nothing says where the tip was";
        return fail("table", problem.into());
    }
    points::check(pipeline, &fail)?;
    markers::check(pipeline, &fail)?;
    measures::check(pipeline, &fail)?;
    if let Some((key, said)) =
        pipeline.closed_chain.as_ref().and_then(|chain| closed_chain::find_contradiction(chain, pipeline))
    {
        return fail(key, said);
    }
    if pipeline.sensor.scale_sigma_ppm.is_some_and(|ppm| !(ppm >= 0.0 && ppm.is_finite())) {
        return fail("sensor.scale_sigma_ppm", "must be 0 or more".into());
    }
    pipeline.pool.check(path)?;
    let one_file = |model: &&ModelSection| model.dh.is_some() != model.urdf.is_some();
    if !pipeline.models().iter().all(one_file) {
        return fail("model", "needs exactly one of dh = \"...\" or urdf = \"...\"".into());
    }
    let of_table = |model: &&ModelSection| model.urdf.is_none() && model.masses == Some(Masses::Urdf);
    match pipeline.models().iter().any(of_table) {
        true => fail("model.masses", "is \"urdf\", but a DH table gives no masses; leave it out".into()),
        false => Ok(()),
    }
}
