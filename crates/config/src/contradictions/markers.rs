//! Markers that contradict the streams, or themselves.

use crate::{ConfigError, FramePose, Pipeline};

/// Markers that contradict the streams, or themselves; `fail` makes an error of a key and what is wrong with it.
pub fn check(
    pipeline: &Pipeline,
    fail: &dyn Fn(&str, String) -> Result<(), ConfigError>,
) -> Result<(), ConfigError> {
    let bodies = &pipeline.streams.bodies;
    for (name, marker) in &pipeline.markers {
        let key = format!("markers.{name}");
        if let Some(why) = no_name(name) {
            return fail(&key, why);
        }
        let joined = pipeline.closed_chain.iter().flat_map(|chain| &chain.between).flatten();
        if !bodies.contains_key(name) && !joined.into_iter().any(|point| point == name) {
            return fail(&key, format!("has no [streams.bodies.{name}] that says where it is read"));
        }
        if marker.pose == FramePose::Measured && marker.sigma_mm == 0.0 {
            let problem = "is \"measured\" without sigma_mm; give it, or pose = \"given\"";
            return fail(&format!("{key}.pose"), problem.into());
        }
    }
    match bodies.keys().find(|name| !pipeline.markers.contains_key(*name)) {
        None => Ok(()),
        Some(name) => {
            let next = format!("add [markers.{name}] with link = \"...\"");
            let problem = format!("is read, but nothing says which link it is on: {next}");
            fail(&format!("streams.bodies.{name}"), problem)
        }
    }
}

/// Why a marker, or a place, cannot have a name; it begins the names of its parameters.
pub fn no_name(name: &str) -> Option<String> {
    let taken = ["tip", "base", "board", "world", "table"].contains(&name);
    let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    match (taken, plain) {
        (true, _) => Some("is the name of something else; give it another".to_owned()),
        (_, false) => Some("is no name: use letters, digits, _ and -".to_owned()),
        _ => None,
    }
}
