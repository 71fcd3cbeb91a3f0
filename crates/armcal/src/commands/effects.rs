//! `armcal effects`: the catalogue of physical effects.

use super::{Outcome, print};
use crate::error::Error;
use armcal_model::{EffectKind, EffectSpec, Target, catalogue};
use armcal_report::{plain_table, table_text};
use comfy_table::ContentArrangement;
use serde_json::{Value, json};

/// Prints the catalogue, or everything about one entry.
pub fn run(name: Option<&str>, json: bool) -> Result<Outcome, Error> {
    let text = match (name, json) {
        (None, false) => catalogue_text(),
        (None, true) => {
            super::json_text(&catalogue().iter().map(|k| effect_json(k)).collect::<Vec<Value>>())?
        }
        (Some(name), json) => {
            let kind = EffectSpec::new(name).kind().map_err(Error::of_usage)?;
            if json { super::json_text(&effect_json(kind))? } else { effect_text(kind) }
        }
    };
    print(&text)?;
    Ok(Outcome::Done)
}

fn catalogue_text() -> String {
    let mut table = plain_table();
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(100);
    table.set_header(["effect", "what it is"]);
    for kind in catalogue() {
        table.add_row([spec_syntax(kind), kind.summary.to_owned()]);
    }
    format!(
        "{}\n`armcal effects NAME` explains one; JOINT is a number from 1 or a name; add @RECORDING or \
         @RECORDING.DWELL to an event.\n",
        table_text(&table)
    )
}

/// How it is written: `backlash:JOINT`, `periodic:JOINT,frequency=..`.
fn spec_syntax(kind: &EffectKind) -> String {
    let joint = match kind.target {
        Target::Joint => ":JOINT",
        Target::Marker => ":MARKER",
        Target::Whole => "",
    };
    let needed = kind.shapes.iter().filter(|s| s.default.is_none());
    let shapes: String = needed.map(|s| format!(",{}=..", s.name)).collect();
    format!("{}{joint}{shapes}", kind.name)
}

fn effect_text(kind: &EffectKind) -> String {
    let mut text = format!("{}\n{}\n", spec_syntax(kind), kind.summary);
    if !kind.aliases.is_empty() {
        text.push_str(&format!("The same to the data: {}.\n", kind.aliases.join(", ")));
    }
    if !kind.confused_with.is_empty() {
        text.push_str(&format!("Looks alike in common data: {}.\n", kind.confused_with.join(", ")));
    }
    format!("{text}\n{}\n", kind.docs().trim())
}

fn effect_json(kind: &EffectKind) -> Value {
    let shapes: Vec<Value> = kind
        .shapes
        .iter()
        .map(|s| {
            json!({ "name": s.name, "unit": s.unit, "default": s.default, "lower": s.lower, "upper": s.upper,
                    "meaning": s.meaning })
        })
        .collect();
    json!({
        "name": kind.name,
        "spec": spec_syntax(kind),
        "summary": kind.summary,
        "same_to_the_data": kind.aliases,
        "confused_with": kind.confused_with,
        "family": kind.family,
        "toggle": kind.toggle,
        "target": kind.target,
        "shapes": shapes,
        "docs": kind.docs(),
    })
}
