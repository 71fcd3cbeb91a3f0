//! Decoder of JSON messages whose `jsonschema` is in the file.
//!
//! Numbers may also be written the way protobuf's JSON mapping does: `"NaN"`, `"Infinity"`, 64-bit integers as text.

use super::DecodeError;
use super::shapes::{Want, Wanted};
use super::sink::Sink;
use super::slot::Slot;
use super::types::{Field, Kind, MessageType, Number, Repeat, Types};
use serde_json::Value;
use std::collections::BTreeMap;

/// Schemas nest at most this deep, references followed.
const MAX_DEPTH: usize = 64;

/// Reads the types of a JSON schema: objects, arrays, numbers, texts, and references inside the schema.
pub(super) fn parse(data: &[u8]) -> Result<Types, String> {
    let schema: Value = serde_json::from_slice(data).map_err(|e| format!("not JSON: {e}"))?;
    let mut parser = Parser { schema: &schema, known: BTreeMap::new(), messages: Vec::new() };
    match parser.kind(&schema, 0)? {
        (Kind::Message(0), Repeat::Once) => Ok(Types { messages: parser.messages }),
        _ => Err("its root is not an object with properties".to_owned()),
    }
}

struct Parser<'a> {
    schema: &'a Value,
    /// The message type of each object of the schema, by its address in it.
    known: BTreeMap<*const Value, usize>,
    messages: Vec<MessageType>,
}

impl<'a> Parser<'a> {
    fn kind(&mut self, node: &'a Value, depth: usize) -> Result<(Kind, Repeat), String> {
        if depth > MAX_DEPTH {
            return Err(format!("its types nest deeper than {MAX_DEPTH} levels"));
        }
        let node = self.follow(node)?;
        if let Some(properties) = node.get("properties").and_then(Value::as_object) {
            if let Some(&known) = self.known.get(&std::ptr::from_ref(node)) {
                return Ok((Kind::Message(known), Repeat::Once));
            }
            let index = self.messages.len();
            self.known.insert(node, index);
            self.messages.push(MessageType { fields: Vec::new() });
            let mut fields = Vec::new();
            for (name, property) in properties {
                let (kind, repeat) = self.kind(property, depth + 1)?;
                fields.push(Field { name: name.clone(), kind, repeat });
            }
            self.messages[index].fields = fields;
            return Ok((Kind::Message(index), Repeat::Once));
        }
        Ok(match type_name(node) {
            Some("number" | "integer" | "boolean") => (Kind::Number(Number::Float(8)), Repeat::Once),
            Some("string") => (Kind::Text, Repeat::Once),
            Some("array") => match node.get("items") {
                Some(items) => match self.kind(items, depth + 1)? {
                    (kind, Repeat::Once) => (kind, Repeat::Sequence),
                    // Lists of lists are never read.
                    _ => (Kind::Other, Repeat::Sequence),
                },
                None => (Kind::Other, Repeat::Sequence),
            },
            _ => (Kind::Other, Repeat::Once),
        })
    }

    /// Follows `$ref` within the schema.
    fn follow(&self, mut node: &'a Value) -> Result<&'a Value, String> {
        for _ in 0..16 {
            let Some(reference) = node.get("$ref").and_then(Value::as_str) else { return Ok(node) };
            node = reference
                .strip_prefix('#')
                .and_then(|pointer| self.schema.pointer(pointer))
                .ok_or_else(|| format!("its reference {reference} leads nowhere"))?;
        }
        Err("its references go in a circle".to_owned())
    }
}

/// The type of a node; of several, the one that is not null.
fn type_name(node: &Value) -> Option<&str> {
    match node.get("type")? {
        Value::String(name) => Some(name),
        Value::Array(names) => names.iter().filter_map(Value::as_str).find(|name| *name != "null"),
        _ => None,
    }
}

/// The properties to follow.
#[derive(Debug)]
pub(super) struct Code {
    fields: Vec<Property>,
}

#[derive(Debug)]
struct Property {
    name: String,
    list: bool,
    action: Action,
}

#[derive(Debug)]
enum Action {
    Inside(Code),
    Value(Slot),
}

impl Code {
    /// Compiles what is wanted to names of properties.
    pub(super) fn compile(types: &Types, wanted: &Wanted) -> Code {
        Code::of_message(types, 0, wanted)
    }

    fn of_message(types: &Types, message: usize, wanted: &Wanted) -> Code {
        let compile = |(index, want): &(usize, Want)| {
            let field = types.messages[message].fields.get(*index)?;
            let action = match (want, field.kind) {
                (Want::Inside(inside), Kind::Message(inner)) => {
                    Action::Inside(Code::of_message(types, inner, inside))
                }
                (Want::Value(slot), _) => Action::Value(*slot),
                (Want::Inside(_), _) => return None,
            };
            Some(Property { name: field.name.clone(), list: field.repeat != Repeat::Once, action })
        };
        Code { fields: wanted.fields.iter().filter_map(compile).collect() }
    }

    /// Walks one message.
    pub(super) fn run<'m, S: Sink<'m>>(&self, message: &'m Value, sink: &mut S) -> Result<(), DecodeError> {
        let Value::Object(object) = message else {
            return Err(malformed_error("the message", "an object", message));
        };
        for field in &self.fields {
            match object.get(&field.name) {
                None | Some(Value::Null) => {}
                Some(Value::Array(elements)) if field.list => {
                    for element in elements {
                        field.run(element, sink)?;
                    }
                }
                Some(other) if field.list => return Err(malformed_error(&field.name, "an array", other)),
                Some(value) => field.run(value, sink)?,
            }
        }
        Ok(())
    }
}

impl Property {
    fn run<'m, S: Sink<'m>>(&self, value: &'m Value, sink: &mut S) -> Result<(), DecodeError> {
        match &self.action {
            Action::Inside(inside) if self.list => {
                sink.begin_item();
                inside.run(value, sink)?;
                sink.end_item();
            }
            Action::Inside(inside) => inside.run(value, sink)?,
            Action::Value(slot) if slot.is_text() => match value {
                Value::String(text) => sink.text(*slot, text.as_bytes()),
                _ => return Err(malformed_error(&self.name, "a text", value)),
            },
            Action::Value(slot) => match as_number(value) {
                Some(number) => sink.number(*slot, number),
                None => return Err(malformed_error(&self.name, "a number", value)),
            },
        }
        Ok(())
    }
}

/// The number a JSON value stands for. `null` in a list is what JSON writers make of NaN.
fn as_number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::Bool(flag) => Some(f64::from(u8::from(*flag))),
        Value::String(text) => text.parse().ok(),
        Value::Null => Some(f64::NAN),
        Value::Array(_) | Value::Object(_) => None,
    }
}

fn malformed_error(field: &str, expected: &str, found: &Value) -> DecodeError {
    let found = match found {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    };
    DecodeError::Malformed { encoding: "json", why: format!("{field} should be {expected}, but is {found}") }
}

/// Parses the text of one message.
pub(super) fn parse_message(data: &[u8]) -> Result<Value, DecodeError> {
    serde_json::from_slice(data).map_err(|e| DecodeError::Malformed { encoding: "json", why: e.to_string() })
}
