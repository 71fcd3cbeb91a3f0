//! Places and measurements that contradict each other.

use super::markers::no_name;
use crate::{ConfigError, FramePose, MeasureKind, MeasureSection, Pipeline};

/// Places and measurements that contradict each other; `fail` makes an error of a key and what is wrong with it.
pub fn check(
    pipeline: &Pipeline,
    fail: &dyn Fn(&str, String) -> Result<(), ConfigError>,
) -> Result<(), ConfigError> {
    for (kind, name, section) in pipeline
        .points
        .iter()
        .map(|(name, section)| ("points", name, section))
        .chain(pipeline.planes.iter().map(|(name, section)| ("planes", name, section)))
    {
        let key = format!("{kind}.{name}");
        if let Some(why) = no_name(name) {
            return fail(&key, why);
        }
        if pipeline.markers.contains_key(name) || kind == "planes" && pipeline.points.contains_key(name) {
            return fail(&key, "is the name of something else too; give one of them another".to_owned());
        }
        if section.pose == FramePose::Measured && section.sigma_mm == 0.0 {
            return fail(&format!("{key}.pose"), "is \"measured\" without sigma_mm".to_owned());
        }
    }
    let seen = pipeline.table.is_some() || pipeline.tip_is_tracked() || !pipeline.markers.is_empty();
    let all_estimated = || {
        let mut places = pipeline.points.values().chain(pipeline.planes.values());
        places.all(|place| place.pose == FramePose::Estimated)
    };
    let adrift = !pipeline.measure.is_empty() && !seen && all_estimated();
    if adrift && pipeline.frames.base.pose == FramePose::Estimated {
        let problem = "is \"estimated\" as all places are, so that nothing holds them; leave it \"given\": the base is the world then";
        return fail("frames.base.pose", problem.to_owned());
    }
    for (at, section) in pipeline.measure.iter().enumerate() {
        if let Some((key, problem)) = find_contradiction(pipeline, section) {
            return fail(&format!("measure[{at}].{key}"), problem);
        }
        if pipeline.measure[..at].iter().any(|other| other.name() == section.name()) {
            let problem = format!("`{}` names two of them; give one another name = \"...\"", section.name());
            return fail(&format!("measure[{at}].name"), problem);
        }
    }
    for (kind, names) in [("points", pipeline.points.keys()), ("planes", pipeline.planes.keys())] {
        let is_idle = |name: &&String| !pipeline.measure.iter().any(|m| m.between[1] == **name);
        if let Some(name) = names.into_iter().find(is_idle) {
            let problem = "is measured by no [[measure]]; add one with it in `between`";
            return fail(&format!("{kind}.{name}"), problem.to_owned());
        }
    }
    Ok(())
}

/// The key of a measurement that cannot be, and why.
fn find_contradiction(pipeline: &Pipeline, m: &MeasureSection) -> Option<(&'static str, String)> {
    let [of, against] = &m.between;
    if pipeline.feature(of).is_none() {
        let known: Vec<&str> =
            std::iter::once("tip").chain(pipeline.markers.keys().map(String::as_str)).collect();
        return Some(("between", format!("begins with `{of}`, which is none of {}", known.join(", "))));
    }
    let (kind, known) = match m.kind.is_against_plane() {
        true => ("planes", &pipeline.planes),
        false => ("points", &pipeline.points),
    };
    if !known.contains_key(against) {
        let problem = format!("ends with `{against}`, which is not there; add [{kind}.{against}]");
        return Some(("between", problem));
    }
    if let Some(why) = no_name(m.name()) {
        return Some(("name", why));
    }
    let positive = |v: f64| v.is_finite() && v > 0.0;
    if !positive(m.sigma_mm) {
        return Some(("sigma_mm", "must be above zero: nothing is measured exactly".into()));
    }
    if !positive(m.max_gap_mm) {
        return Some(("max_gap_mm", "must be above zero".into()));
    }
    let has_length = m.kind.has_length();
    if !has_length && m.length_mm.is_some() {
        return Some(("length_mm", "belongs to kind = \"distance\"".into()));
    }
    if has_length && m.reading.is_none() && !m.length_mm.is_some_and(positive) {
        let problem = "must be above zero where no instrument reads the distance; give it, or `reading`";
        return Some(("length_mm", problem.into()));
    }
    if m.kind == MeasureKind::Coincide && m.reading.is_some() {
        return Some(("reading", "belongs to kind = \"distance\" or \"plane\"".into()));
    }
    if m.reading.as_ref().is_some_and(|reading| reading.direction.abs() != 1) {
        return Some(("reading.direction", "must be 1 or -1".into()));
    }
    if let Some([low, high]) = m.range_mm
        && !(m.reading.is_some() && low < high)
    {
        return Some(("range_mm", "is [smallest, largest] of what the `reading` may be".into()));
    }
    let unknown = |name: &&String| !pipeline.recordings.iter().any(|r| r.name() == **name);
    let missing = m.recordings.iter().flatten().find(unknown).filter(|_| !pipeline.recordings.is_empty());
    missing.map(|name| ("recordings", format!("names `{name}`, which is no recording of this pipeline")))
}
