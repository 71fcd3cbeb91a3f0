//! The JSON schema of `summary.json`, from its types.

use super::Summary;
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

/// The schema (draft 2020-12).
pub fn summary_schema() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = settings.into_generator().into_root_schema_for::<Summary<'_>>().to_value();
    allow_null_numbers(&mut schema);
    schema
}

/// JSON has no infinity, and what is not a number is `null` wherever a number stands.
fn allow_null_numbers(schema: &mut Value) {
    match schema {
        Value::Array(entries) => entries.iter_mut().for_each(allow_null_numbers),
        Value::Object(entries) => {
            if entries.get("type") == Some(&json!("number")) {
                entries.insert("type".to_owned(), json!(["number", "null"]));
            }
            entries.values_mut().for_each(allow_null_numbers);
        }
        _ => {}
    }
}
