//! Bytes of a schema with a message of it, which are untrusted.

use armcal_recording::decode::{Plan, Rows, readable_as};

/// `[encoding][length of name][name][length of schema, u16][schema][message]`.
pub fn message(bytes: &[u8]) {
    let Some(case) = Case::split(bytes) else { return };
    let (name, schema) = (case.name, case.schema);
    let Ok(role) = readable_as(name, case.schema_encoding, schema, case.message_encoding) else { return };
    for body in [None, Some("tip")] {
        let plan = Plan::compile(role, name, case.schema_encoding, schema, case.message_encoding, body);
        let Ok(plan) = plan else { continue };
        let mut rows = Rows::new(role);
        let first = plan.decode(case.message, &mut rows);
        assert!(first.is_ok() || rows.is_empty());
        assert!(rows.len() <= case.message.len());
        let once = rows.len();
        assert_eq!(plan.decode(case.message, &mut rows), first, "the same message again");
        assert_eq!(rows.len(), 2 * once);
        let _ = plan.bodies(case.message);
    }
}

struct Case<'a> {
    schema_encoding: &'static str,
    message_encoding: &'static str,
    name: &'a str,
    schema: &'a [u8],
    message: &'a [u8],
}

impl<'a> Case<'a> {
    fn split(bytes: &'a [u8]) -> Option<Case<'a>> {
        const ENCODINGS: [(&str, &str); 4] =
            [("ros2msg", "cdr"), ("ros1msg", "ros1"), ("protobuf", "protobuf"), ("jsonschema", "json")];
        let (&[encoding, length], rest) = bytes.split_first_chunk()?;
        let (name, rest) = rest.split_at_checked(usize::from(length))?;
        let (length, rest) = rest.split_first_chunk()?;
        let (schema, message) = rest.split_at_checked(usize::from(u16::from_le_bytes(*length)))?;
        let (schema_encoding, message_encoding) = ENCODINGS[usize::from(encoding) % ENCODINGS.len()];
        Some(Case {
            schema_encoding,
            message_encoding,
            name: std::str::from_utf8(name).ok()?,
            schema,
            message,
        })
    }
}
