//! The types of JSON messages that no schema describes, from the messages themselves.

use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Messages that nest deeper are not looked into further; nor are longer lists, or more fields of a message.
const DEEPEST: usize = 16;
const ELEMENTS: usize = 64;
const FIELDS: usize = 1000;

/// What messages were seen to hold.
#[derive(Debug, Default)]
pub(crate) struct InferredTypes(Node);

/// What a place in the messages was seen to hold; a field may be `null` in one message and a number in the next.
#[derive(Debug, Default)]
struct Node {
    number: bool,
    text: bool,
    elements: Option<Box<Node>>,
    /// By name, with its place in the order in which they were first seen.
    fields: BTreeMap<String, (usize, Node)>,
}

impl InferredTypes {
    /// Takes in a message; one that is no JSON says nothing.
    pub fn add(&mut self, message: &[u8]) {
        if let Ok(value) = serde_json::from_slice(message) {
            self.0.add(&value, 0);
        }
    }

    /// As a JSON schema.
    pub fn schema(&self) -> Vec<u8> {
        self.0.schema().to_string().into_bytes()
    }
}

impl Node {
    fn add(&mut self, value: &Value, depth: usize) {
        match value {
            Value::Null => {}
            Value::Number(_) | Value::Bool(_) => self.number = true,
            // What has no number in JSON is written as text: "NaN", "Infinity".
            Value::String(text) => match text.parse::<f64>() {
                Ok(number) if !number.is_finite() => self.number = true,
                _ => self.text = true,
            },
            _ if depth == DEEPEST => {}
            Value::Array(values) => {
                let elements = self.elements.get_or_insert_default();
                values.iter().take(ELEMENTS).for_each(|value| elements.add(value, depth + 1));
            }
            Value::Object(fields) => {
                for (name, value) in fields {
                    let place = self.fields.len();
                    if let Some((_, known)) = self.fields.get_mut(name) {
                        known.add(value, depth + 1);
                    } else if place < FIELDS {
                        let mut node = Node::default();
                        node.add(value, depth + 1);
                        self.fields.insert(name.clone(), (place, node));
                    }
                }
            }
        }
    }

    fn schema(&self) -> Value {
        if !self.fields.is_empty() {
            let mut fields: Vec<_> = self.fields.iter().collect();
            fields.sort_by_key(|(_, (place, _))| *place);
            let fields = fields.into_iter().map(|(name, (_, node))| (name.clone(), node.schema()));
            return json!({ "type": "object", "properties": Value::Object(fields.collect::<Map<_, _>>()) });
        }
        match &self.elements {
            Some(elements) => json!({ "type": "array", "items": elements.schema() }),
            None if self.number => json!({ "type": "number" }),
            None if self.text => json!({ "type": "string" }),
            None => json!({}),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schema(messages: &[&str]) -> Value {
        let mut types = InferredTypes::default();
        messages.iter().for_each(|message| types.add(message.as_bytes()));
        serde_json::from_slice(&types.schema()).expect("JSON")
    }

    #[test]
    fn what_is_missing_or_null_in_one_message_is_seen_in_another() {
        let seen = schema(&[
            r#"{"b":null,"a":[],"q":{"x":1}}"#,
            "no JSON",
            r#"{"a":[1,"NaN"],"b":"NaN","q":{"y":"text"},"c":true}"#,
        ]);
        let number = json!({ "type": "number" });
        let inside = json!({ "type": "object", "properties": { "x": number, "y": { "type": "string" } } });
        let properties =
            json!({ "b": number, "a": { "type": "array", "items": number }, "q": inside, "c": number });
        assert_eq!(seen, json!({ "type": "object", "properties": properties }));
    }

    #[test]
    fn what_nests_without_end_is_cut_off() {
        let deep = "[".repeat(100) + &"]".repeat(100);
        assert!(schema(&[&deep]).to_string().len() < 600);
        assert_eq!(schema(&["3"]), json!({ "type": "number" }));
        assert_eq!(schema(&["null"]), json!({}));
    }
}
