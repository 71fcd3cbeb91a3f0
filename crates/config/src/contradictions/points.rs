//! Exported points that contradict the rest.

use crate::{ConfigError, Pipeline};

/// Points that contradict the rest.
pub fn check(
    pipeline: &Pipeline,
    fail: &dyn Fn(&str, String) -> Result<(), ConfigError>,
) -> Result<(), ConfigError> {
    for (name, points) in pipeline.recordings.iter().filter_map(|r| Some((r.name(), r.points.as_ref()?))) {
        let key = format!("recordings.{name}.points");
        if pipeline.streams.tip.is_some() {
            return fail(&key, "says where the tip was, and so does [streams.tip]: leave one out".into());
        }
        if !(points.sigma_mm > 0.0 && points.sigma_mm.is_finite()) {
            return fail(&key, format!("sigma_mm must be positive, not {}", points.sigma_mm));
        }
    }
    Ok(())
}
