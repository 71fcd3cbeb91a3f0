//! What LeRobot's `meta/info.json` says of the columns beside it: the names in each list.
//!
//! Data sets of versions 2.0 to 3.0: `data/chunk-000/*.parquet`, `meta/info.json` with `features`.

use super::{Table, Values};
use crate::bytes::input;
use serde_json::Value;
use std::path::Path;

/// So far above a file of data its `meta` lies.
const LEVELS: usize = 4;

/// Names the numbers of lists.
pub(super) fn name_lists(table: &mut Table, path: &Path) {
    let info = path.ancestors().skip(1).take(LEVELS).map(|folder| folder.join("meta").join("info.json"));
    let Some(text) = info.into_iter().find_map(|path| input::read_to_string(&path, input::Kind::Data).ok())
    else {
        return;
    };
    let Ok(info) = serde_json::from_str::<Value>(&text) else { return };
    for column in &mut table.columns {
        if let Values::Lists { length, names, .. } = &mut column.values {
            let told = info.get("features").and_then(|all| all.get(&column.name)?.get("names"));
            let told = told.map(texts_in).unwrap_or_default();
            if told.len() == *length {
                *names = told;
            }
        }
    }
}

/// The names in a list, or in the only list of an object.
fn texts_in(names: &Value) -> Vec<String> {
    match names {
        Value::Array(all) => all.iter().filter_map(|name| Some(name.as_str()?.to_owned())).collect(),
        Value::Object(all) if all.len() == 1 => all.values().next().map(texts_in).unwrap_or_default(),
        _ => Vec::new(),
    }
}
