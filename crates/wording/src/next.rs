//! What to do next.

use crate::found::kind_of;
use crate::look_at::look_at;
use armcal_core::printable_name;
use armcal_diagnose::Diagnosis;
use armcal_model::Family;
use armcal_result::Called;

/// What to do next, one step an entry.
pub fn next_steps(called: &Called, d: &Diagnosis) -> Vec<String> {
    let recorded = d.record_next.iter().map(|r| called.in_words(&printable_name(r)));
    addition_step(called, d).into_iter().chain(looked_at(called, d)).chain(recorded).collect()
}

/// What to look at on the rig, once for all effects of one kind; only where one name is left.
fn looked_at(called: &Called, d: &Diagnosis) -> Vec<String> {
    let mut steps: Vec<(&str, Vec<&str>)> = Vec::new();
    for e in d.effects.iter().filter(|e| e.set.len() == 1) {
        let Some(kind) = kind_of(e).filter(|kind| kind.family != Family::User) else { continue };
        match steps.iter_mut().find(|(advice, _)| *advice == look_at(kind)) {
            Some((_, names)) => names.push(&e.name),
            None => steps.push((look_at(kind), vec![&e.name])),
        }
    }
    let step = |(advice, names): (&str, Vec<&str>)| {
        let (capital, rest) = advice.split_at(1);
        let advice = format!("{}{}", capital.to_ascii_lowercase(), rest.trim_end_matches('.'));
        printable_name(&format!("{}: {advice}", names.join(", ")))
    };
    steps.into_iter().map(|s| called.in_words(&step(s))).collect()
}

/// What adding it to the model does, where something was found and a calibration with it confirms it.
fn addition_step(called: &Called, d: &Diagnosis) -> Option<String> {
    if !called.is_refitted {
        return None;
    }
    let (before, after) = (d.holdout_mm.before, d.holdout_mm.after);
    let error = d.judged.words();
    // `armcal add` reads the recordings of a pipeline; a pool has none.
    let adds = match called.is_pool {
        true => "with it under `[[effects]]` of the pipeline, pooled again",
        false => "`armcal add suggested PIPELINE` adds it to the model",
    };
    Some(format!("{adds}: the mean {error} error goes from {before:.3} to {after:.3} mm"))
}
