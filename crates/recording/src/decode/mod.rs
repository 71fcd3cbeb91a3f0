//! Decoders: from the bytes of a message to rows, by the schema in the file, never by topic or message name.
//!
//! A schema (`msg`, `protobuf`, `json`) is read into message `types`; `shapes` recognises in them the fields armcal
//! wants; a [`Plan`] is compiled from those once per channel, and runs over the bytes of each message (`binary`,
//! `protobuf`, `json`), handing values to a `sink`, which appends [`Rows`]. Bytes are untrusted: every length is
//! checked against what is left of the message before anything is read or allocated.

mod binary;
mod cursor;
mod error;
mod inferred;
mod joint_sink;
mod json;
mod msg;
mod paths;
mod pose_sink;
mod protobuf;
mod rows;
mod shapes;
mod sink;
mod slot;
mod types;
mod wire;

pub use error::DecodeError;
pub(crate) use inferred::InferredTypes;
pub use paths::{has_list, parent_of};
pub use rows::{JointRow, JointRows, PoseRow, PoseRows, Rows, ScalarRows};
pub use shapes::Place;

use binary::Encoding;
use shapes::Wanted;
use sink::Sink;
use slot::Slot;
use types::Types;

/// What a channel can be read as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Positions (and efforts) of named joints.
    Joints,
    /// Position, perhaps orientation, of a tracked body.
    Pose,
    /// One number; what a rig has of those is temperature.
    Scalar,
}

impl Role {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Role::Joints => "joints",
            Role::Pose => "pose",
            Role::Scalar => "temperature",
        }
    }
}

impl std::fmt::Display for Role {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// What armcal can read messages of this schema as, or why it cannot.
pub fn readable_as(
    schema_name: &str,
    schema_encoding: &str,
    schema_data: &[u8],
    message_encoding: &str,
) -> Result<Role, DecodeError> {
    let source = [schema_name, schema_encoding, message_encoding];
    let (shape, ..) = compile_schema(source, schema_data, recognise)?;
    Ok(shape.role)
}

/// The paths of the fields of this schema in which there can be what `place` needs, whole numbers left out; none where the
/// schema cannot be read.
pub fn fields_for(
    place: Place,
    schema_name: &str,
    schema_encoding: &str,
    schema_data: &[u8],
    message_encoding: &str,
) -> Vec<String> {
    let find = |_: &str, types: &Types| Ok((shapes::quantities_for(types, place), Vec::new()));
    compile_schema([schema_name, schema_encoding, message_encoding], schema_data, find)
        .map_or(Vec::new(), |(fields, ..)| fields)
}

/// Why the definition of a ROS type that is known as `known` cannot be used: it is in another language than that one, or
/// unusable, or breaks off before the known one ends. None where it is that one, or another of its own.
pub(crate) fn ros_problem(
    name: &str,
    [language, known_language]: [&str; 2],
    data: &[u8],
    known: &str,
) -> Option<String> {
    if language != known_language {
        return Some(format!("it is in {language:?}, which is not read"));
    }
    match (msg::parse(data, name), msg::parse(known.as_bytes(), name)) {
        (Err(why), _) => Some(why),
        (Ok(own), Ok(whole)) => own.breaks_off(&whole).then(|| "it breaks off".to_owned()),
        (Ok(_), Err(_)) => None,
    }
}

/// Why a schema says nothing of JSON messages.
pub(crate) fn json_problem(language: &str, data: &[u8]) -> Option<String> {
    match language {
        "jsonschema" => json::parse(data).err(),
        _ => Some(format!("it is in {language:?}, which is not read")),
    }
}

/// How to decode the messages of one channel; compiled once from its schema, shared by threads.
#[derive(Debug)]
pub struct Plan {
    role: Role,
    in_millimetres: bool,
    /// Whether bodies are told by their places in a list.
    by_place: bool,
    body: Option<Vec<u8>>,
    /// Whether all bodies of a message are read, each as a row.
    every_body: bool,
    /// One, or one for each joint where each has a path of its own.
    code: Vec<Code>,
}

#[derive(Debug)]
enum Code {
    Binary(binary::Code),
    Protobuf(protobuf::Code),
    Json(json::Code),
}

impl Plan {
    /// Compiles the plan that reads `role` out of messages of this schema.
    ///
    /// `body` selects one of several bodies by the name the messages give it: `child_frame_id`, `rigid_body_name`,
    /// `marker_name` (or `subject/marker`), the number of a marker without a name, the place (from 0) in a list of poses.
    pub fn compile(
        role: Role,
        schema_name: &str,
        schema_encoding: &str,
        schema_data: &[u8],
        message_encoding: &str,
        body: Option<&str>,
    ) -> Result<Plan, DecodeError> {
        let source = [schema_name, schema_encoding, message_encoding];
        let (shape, wanted, code) = compile_schema(source, schema_data, recognise)?;
        let has = |slot| wanted.iter().any(|wanted| wanted.has(slot));
        if shape.role != role {
            return Err(DecodeError::OtherRole {
                schema: schema_name.to_owned(),
                wanted: role,
                found: shape.role,
            });
        }
        if let Some(body) = body
            && !has(Slot::Body)
            && !has(Slot::BodyIndex)
            && !shape.by_place
        {
            return Err(DecodeError::NoBodyName { schema: schema_name.to_owned(), body: body.to_owned() });
        }
        Ok(Plan {
            role,
            in_millimetres: shape.in_millimetres,
            by_place: shape.by_place,
            body: body.map(|b| b.as_bytes().to_vec()),
            every_body: false,
            code,
        })
    }

    /// Compiles the plan that reads `role` out of the fields at these paths, as `schema_data` defines them; the first is the
    /// one that stamp and frame belong to. `[]` in a path marks a list, `*` at its end stands for all fields of a message. Of
    /// several positions each is one number, of a joint each: a message without one has NaN there.
    pub fn at(
        role: Role,
        schema_name: &str,
        schema_encoding: &str,
        schema_data: &[u8],
        message_encoding: &str,
        (body, fields): (Option<&str>, &[(Place, &str)]),
    ) -> Result<Plan, DecodeError> {
        let positions = fields.iter().filter(|(place, _)| *place == Place::Positions).count();
        let find = |schema: &str, types: &Types| {
            let locate = |fields| shapes::locate_fields(schema, types, fields);
            let wanted = fields.chunks(if positions > 1 { 1 } else { fields.len().max(1) }).map(locate);
            Ok(((), wanted.collect::<Result<Vec<Wanted>, _>>()?))
        };
        let source = [schema_name, schema_encoding, message_encoding];
        let ((), _, code) = compile_schema(source, schema_data, find)?;
        let body = body.map(|b| b.as_bytes().to_vec());
        Ok(Plan { role, in_millimetres: false, by_place: true, body, every_body: false, code })
    }

    /// The same plan, which refuses messages that do not end where their definition does: for definitions that did not
    /// come with the messages.
    pub fn exact(mut self) -> Plan {
        for code in &mut self.code {
            if let Code::Binary(code) = code {
                code.go_to_the_end();
            }
        }
        self
    }

    /// The same plan for all the bodies of a message, whichever it was compiled for.
    pub fn every_body(self) -> Plan {
        Plan { body: None, every_body: true, ..self }
    }

    /// What the plan reads.
    pub fn role(&self) -> Role {
        self.role
    }

    /// Whether positions are in millimetres because the message type defines them so (Vicon's own types);
    /// otherwise they are metres by convention (REP-103), or whatever the user knows better.
    pub fn in_millimetres(&self) -> bool {
        self.in_millimetres
    }

    /// Decodes one message, appending zero or more rows. On an error `out` holds the rows it held before.
    ///
    /// A message without positions, or without the body asked for, gives no rows. With several bodies in the
    /// message and none asked for, the error names them.
    pub fn decode(&self, data: &[u8], out: &mut Rows) -> Result<(), DecodeError> {
        let found = out.role();
        match (self.role, out) {
            (Role::Joints, Rows::Joints(rows)) => {
                let value = self.json_value(data)?;
                let mut sink = joint_sink::JointSink::new(rows);
                let decoded = self.code.iter().try_for_each(|code| {
                    code.run(data, &value, &mut sink)?;
                    if self.code.len() > 1 {
                        sink.end_joint();
                    }
                    Ok(())
                });
                sink.finish(decoded)
            }
            (Role::Pose, Rows::Pose(rows)) => {
                self.decode_pose(data, (self.body.as_deref(), self.every_body), rows)
            }
            (Role::Scalar, Rows::Scalar(rows)) => {
                let value = self.json_value(data)?;
                let mut sink = sink::ScalarSink::new(rows);
                let decoded = self.run(data, &value, &mut sink);
                sink.finish(decoded)
            }
            _ => Err(DecodeError::RowsOfOtherRole { plan: self.role, rows: found }),
        }
    }

    /// The bodies named in one message, whichever was asked for: what to suggest when a body is never found.
    pub fn bodies(&self, data: &[u8]) -> Result<Vec<String>, DecodeError> {
        let mut rows = PoseRows::default();
        self.decode_pose(data, (None, true), &mut rows)?;
        Ok(rows.bodies().into_iter().map(str::to_owned).collect())
    }

    /// `wanted`: one body, and whether rows may be of several.
    fn decode_pose(
        &self,
        data: &[u8],
        wanted: (Option<&[u8]>, bool),
        rows: &mut PoseRows,
    ) -> Result<(), DecodeError> {
        let value = self.json_value(data)?;
        let mut sink = pose_sink::PoseSink::new(rows, wanted, self.by_place);
        let decoded = self.run(data, &value, &mut sink);
        sink.finish(decoded)
    }

    /// The parsed text of a JSON message; null for the other encodings.
    fn json_value(&self, data: &[u8]) -> Result<serde_json::Value, DecodeError> {
        match self.code.first() {
            Some(Code::Json(_)) => json::parse_message(data),
            _ => Ok(serde_json::Value::Null),
        }
    }

    fn run<'m, S: Sink<'m>>(
        &self,
        data: &'m [u8],
        value: &'m serde_json::Value,
        sink: &mut S,
    ) -> Result<(), DecodeError> {
        self.code.iter().try_for_each(|code| code.run(data, value, sink))
    }
}

impl Code {
    fn run<'m, S: Sink<'m>>(
        &self,
        data: &'m [u8],
        value: &'m serde_json::Value,
        sink: &mut S,
    ) -> Result<(), DecodeError> {
        match self {
            Code::Binary(code) => code.run(data, sink),
            Code::Protobuf(code) => code.run(data, sink),
            Code::Json(code) => code.run(value, sink),
        }
    }
}

/// The shape that fits these types, and where its values are.
fn recognise(schema: &str, types: &Types) -> Result<(&'static shapes::Shape, Vec<Wanted>), DecodeError> {
    shapes::recognise(schema, types).map(|(shape, wanted)| (shape, vec![wanted]))
}

/// What `find` makes of the message types of a schema, where values are, and the code that reads each of these. The source is
/// the schema's name and encoding and that of the messages.
fn compile_schema<T>(
    [schema, schema_encoding, message_encoding]: [&str; 3],
    data: &[u8],
    find: impl Fn(&str, &Types) -> Result<(T, Vec<Wanted>), DecodeError>,
) -> Result<(T, Vec<Wanted>, Vec<Code>), DecodeError> {
    let unusable = |why: String| DecodeError::Schema { schema: schema.to_owned(), why };
    let binary = |encoding: Encoding| {
        let types = msg::parse(data, schema).map_err(unusable)?;
        let (found, wanted) = find(schema, &types)?;
        let compile = |wanted| binary::Code::compile(&types, wanted, encoding).map(Code::Binary);
        let code = wanted.iter().map(compile).collect::<Result<_, _>>().map_err(unusable)?;
        Ok((found, wanted, code))
    };
    match (schema_encoding, message_encoding) {
        ("ros2msg", "cdr") => binary(Encoding::Cdr),
        ("ros1msg", "ros1") => binary(Encoding::Ros1),
        ("protobuf", "protobuf") => {
            let descriptors = protobuf::Schema::read(schema, data).map_err(unusable)?;
            let (found, wanted) = find(schema, &descriptors.types)?;
            let code = wanted.iter().map(|wanted| Code::Protobuf(descriptors.compile(wanted))).collect();
            Ok((found, wanted, code))
        }
        ("jsonschema", "json") => {
            let types = json::parse(data).map_err(unusable)?;
            let (found, wanted) = find(schema, &types)?;
            let code = wanted.iter().map(|wanted| Code::Json(json::Code::compile(&types, wanted))).collect();
            Ok((found, wanted, code))
        }
        _ => Err(DecodeError::Encoding {
            schema: schema_encoding.to_owned(),
            message: message_encoding.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests;
