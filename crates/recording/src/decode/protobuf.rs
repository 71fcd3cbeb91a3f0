//! Decoder of protobuf messages: the `FileDescriptorSet` in the file says which tags to follow; the bytes are
//! walked once, and everything else is skipped.
//!
//! Wire format: <https://protobuf.dev/programming-guides/encoding/>.

use super::DecodeError;
use super::shapes::{Want, Wanted};
use super::sink::Sink;
use super::slot::Slot;
use super::types::{Field, Kind, MessageType, Number, Repeat, Types};
use super::wire::{Reader, Scalar, Value};
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Full names of messages may take this many bytes for each of their schema. Each repeats the names around it, so that
/// one long name around many messages would take the square of what the file holds.
const NAME_BYTES_A_BYTE: usize = 16;

/// The descriptors of a schema, in the order of its [`Types`].
#[derive(Debug)]
pub(super) struct Schema {
    pub(super) types: Types,
    descriptors: Vec<Descriptor>,
}

/// A message type of a descriptor set.
#[derive(Debug, Clone)]
struct Descriptor {
    /// Whether fields that are not marked `optional` have no presence: left out means zero.
    implicit_presence: bool,
    message: DescriptorProto,
}

impl Schema {
    /// Reads the `FileDescriptorSet` of a channel whose messages are of type `schema`.
    pub(super) fn read(schema: &str, data: &[u8]) -> Result<Schema, String> {
        let set = FileDescriptorSet::decode(data).map_err(|e| format!("not a FileDescriptorSet: {e}"))?;
        let all = by_name(set, NAME_BYTES_A_BYTE.saturating_mul(data.len()))?;
        let root = format!(".{}", schema.trim_start_matches('.'));
        if !all.contains_key(&root) {
            return Err(format!("its FileDescriptorSet does not define {schema}"));
        }
        // Indices are given out when a type is first used, the channel's own message first.
        let mut index = BTreeMap::from([(root.as_str(), 0)]);
        let mut used = vec![root.as_str()];
        let (mut messages, mut descriptors) = (Vec::new(), Vec::new());
        while let Some(descriptor) = used.get(messages.len()).and_then(|&name| all.get(name)) {
            let mut fields = Vec::new();
            for field in &descriptor.message.field {
                let kind = match all.get_key_value(field.type_name()) {
                    Some((_, inner)) if is_map_entry(inner) => Kind::Other,
                    Some((name, _)) if is_message(field) => {
                        Kind::Message(*index.entry(name).or_insert_with(|| {
                            used.push(name);
                            used.len() - 1
                        }))
                    }
                    _ => plain_kind(field),
                };
                let repeat = if is_list(field) { Repeat::Sequence } else { Repeat::Once };
                fields.push(Field { name: field.name().to_owned(), kind, repeat });
            }
            messages.push(MessageType { fields });
            descriptors.push(descriptor.clone());
        }
        Ok(Schema { types: Types { messages }, descriptors })
    }

    /// Compiles what is wanted to tags.
    pub(super) fn compile(&self, wanted: &Wanted) -> Code {
        Code { main: self.fields(0, wanted) }
    }

    fn fields(&self, message: usize, wanted: &Wanted) -> Vec<TagField> {
        let descriptor = &self.descriptors[message];
        let compile = |(index, want): &(usize, Want)| {
            let field = descriptor.message.field.get(*index)?;
            let action = match (want, self.types.messages[message].fields.get(*index)?.kind) {
                (Want::Inside(inside), Kind::Message(inner)) => Action::Message(self.fields(inner, inside)),
                (Want::Value(slot), Kind::Text) => Action::Text(*slot),
                (Want::Value(slot), _) => {
                    let has_presence = !descriptor.implicit_presence
                        || field.proto3_optional()
                        || field.oneof_index.is_some();
                    let default = (!is_list(field) && !has_presence).then_some(0.0);
                    Action::Number { slot: *slot, scalar: scalar_type(field)?, default }
                }
                (Want::Inside(_), _) => return None,
            };
            let tag = u32::try_from(field.number()).ok()?;
            Some(TagField { tag, name: field.name().to_owned(), list: is_list(field), action })
        };
        wanted.fields.iter().filter_map(compile).collect()
    }
}

/// All message types of a descriptor set by full name, `.package.Outer.Inner`; an error if the names take more than
/// `most_bytes` together.
fn by_name(set: FileDescriptorSet, most_bytes: usize) -> Result<BTreeMap<String, Descriptor>, String> {
    let mut all = BTreeMap::new();
    let mut bytes = 0;
    for file in set.file {
        let implicit_presence = file.syntax() == "proto3";
        let scope = if file.package().is_empty() { String::new() } else { format!(".{}", file.package()) };
        let scope: Rc<str> = scope.into();
        let mut open: Vec<(Rc<str>, DescriptorProto)> =
            file.message_type.into_iter().map(|message| (scope.clone(), message)).collect();
        while let Some((scope, mut message)) = open.pop() {
            let name = format!("{scope}.{}", message.name());
            bytes += name.len();
            if bytes > most_bytes {
                return Err("the names of its nested messages are out of all proportion".to_owned());
            }
            let inside: Rc<str> = name.as_str().into();
            let nested = std::mem::take(&mut message.nested_type);
            open.extend(nested.into_iter().map(|inner| (inside.clone(), inner)));
            all.insert(name, Descriptor { implicit_presence, message });
        }
    }
    Ok(all)
}

fn is_list(field: &FieldDescriptorProto) -> bool {
    field.label() == Label::Repeated
}

fn is_map_entry(descriptor: &Descriptor) -> bool {
    descriptor.message.options.as_ref().is_some_and(|options| options.map_entry())
}

/// Whether a field of a named type holds a message, not an enumeration or a group.
fn is_message(field: &FieldDescriptorProto) -> bool {
    field.r#type.is_none() || field.r#type() == Type::Message
}

/// What a field is that does not hold a known message.
fn plain_kind(field: &FieldDescriptorProto) -> Kind {
    match field.r#type() {
        Type::String => Kind::Text,
        _ if scalar_type(field).is_some() => Kind::Number(Number::Float(8)),
        _ => Kind::Other,
    }
}

/// How a number is written; `None` if the field is none.
fn scalar_type(field: &FieldDescriptorProto) -> Option<Scalar> {
    // An unknown type, or none, must not pass for the first of the enumeration.
    let kind = Type::try_from(field.r#type?).ok()?;
    Some(match kind {
        Type::Double => Scalar::F64,
        Type::Float => Scalar::F32,
        Type::Int32 | Type::Int64 | Type::Enum => Scalar::SignedVarint,
        Type::Uint32 | Type::Uint64 | Type::Bool => Scalar::Varint,
        Type::Sint32 | Type::Sint64 => Scalar::ZigZag,
        Type::Fixed32 => Scalar::U32,
        Type::Sfixed32 => Scalar::I32,
        Type::Fixed64 => Scalar::U64,
        Type::Sfixed64 => Scalar::I64,
        Type::String | Type::Bytes | Type::Message | Type::Group => return None,
    })
}

/// The tags to follow.
#[derive(Debug)]
pub(super) struct Code {
    main: Vec<TagField>,
}

#[derive(Debug)]
struct TagField {
    tag: u32,
    name: String,
    list: bool,
    action: Action,
}

#[derive(Debug)]
enum Action {
    Message(Vec<TagField>),
    Text(Slot),
    /// `default`: what it is when it is left out; `None` where leaving it out means that there is none.
    Number {
        slot: Slot,
        scalar: Scalar,
        default: Option<f64>,
    },
}

impl Code {
    /// Walks one message.
    pub(super) fn run<'m, S: Sink<'m>>(&self, data: &'m [u8], sink: &mut S) -> Result<(), DecodeError> {
        decode_fields(&self.main, data, sink)
    }
}

fn decode_fields<'m, S: Sink<'m>>(
    fields: &[TagField],
    data: &'m [u8],
    sink: &mut S,
) -> Result<(), DecodeError> {
    let mut reader = Reader::new(data);
    while let Some((tag, value)) = reader.next_field()? {
        let Some(field) = fields.iter().find(|field| field.tag == tag) else { continue };
        match (&field.action, value) {
            (Action::Message(inside), Value::Bytes(bytes)) if field.list => {
                sink.begin_item();
                decode_fields(inside, bytes, sink)?;
                sink.end_item();
            }
            (Action::Message(inside), Value::Bytes(bytes)) => decode_fields(inside, bytes, sink)?,
            (Action::Text(slot), Value::Bytes(bytes)) => sink.text(*slot, bytes),
            (Action::Number { slot, scalar, .. }, Value::Bytes(packed)) if field.list => {
                let mut packed = Reader::new(packed);
                while let Some(number) = packed.next_packed(*scalar)? {
                    sink.number(*slot, number);
                }
            }
            (Action::Number { slot, scalar, .. }, value) => match scalar.number(value) {
                Some(number) => sink.number(*slot, number),
                None => return Err(wrong_wire_type(field)),
            },
            _ => return Err(wrong_wire_type(field)),
        }
    }
    for field in fields {
        if let Action::Number { slot, default: Some(default), .. } = field.action {
            sink.absent(slot, default);
        }
    }
    Ok(())
}

#[cold]
fn wrong_wire_type(field: &TagField) -> DecodeError {
    DecodeError::Malformed {
        encoding: "protobuf",
        why: format!("field {} ({}) has another wire type than its schema says", field.tag, field.name),
    }
}
