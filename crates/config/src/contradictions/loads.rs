//! Loads that are none, or that nothing holds.

use crate::{ConfigError, Pipeline, RecordingEntry};

/// Loads of recording `i` that are none, or that nothing holds; `fail` makes an error of a key and what is wrong with it.
pub fn check(
    pipeline: &Pipeline,
    i: usize,
    entry: &RecordingEntry,
    fail: &dyn Fn(&str, String) -> Result<(), ConfigError>,
) -> Result<(), ConfigError> {
    let is_mass = |kg: f64| kg.is_finite() && kg >= 0.0;
    let key = |key: &str| format!("recordings[{i}].{key}");
    if !is_mass(entry.load_kg) {
        return fail(&key("load_kg"), format!("is {}, and a load weighs 0 kg or more", entry.load_kg));
    }
    let hooks = pipeline.hooks();
    for (nth, load) in entry.loads.iter().enumerate() {
        let at = &load.at;
        if !hooks.contains(at) {
            let known = hooks.join(", ");
            return fail(
                &key("loads"),
                format!("hangs one at `{at}`, which the arm does not have; it has {known}"),
            );
        }
        if !is_mass(load.kg) {
            return fail(
                &key("loads"),
                format!("has {} kg at `{at}`, and a load weighs 0 kg or more", load.kg),
            );
        }
        let twice = entry.loads[..nth].iter().any(|other| other.at == *at);
        if twice || (*at == hooks[0] && entry.load_kg != 0.0) {
            let problem = format!("gives `{at}` two loads (load_kg is that of `{}`); add them up", hooks[0]);
            return fail(&key("loads"), problem);
        }
    }
    Ok(())
}
