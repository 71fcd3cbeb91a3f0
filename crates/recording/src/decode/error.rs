//! Why a channel or a message cannot be decoded.

use super::Role;
use crate::error::did_you_mean;
use crate::shortened;

/// Why a channel or a message cannot be decoded. The caller adds file and topic.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum DecodeError {
    /// Nobody here reads this pair of encodings.
    #[error(
        "cannot read message encoding `{}` with schema encoding `{}`; supported are cdr with ros2msg, ros1 with ros1msg, \
         protobuf with protobuf, json with jsonschema: record or convert the channel as one of these",
        shortened(message),
        shortened(schema)
    )]
    Encoding { schema: String, message: String },
    /// The schema text of the channel is unusable.
    #[error("the schema of {} in the file cannot be used: {}", shortened(schema), shortened(why))]
    Schema { schema: String, why: String },
    /// The schema is sound, but holds nothing armcal reads in any role.
    #[error(
        "{} holds no joints, pose or scalar that armcal knows (its fields: {})",
        shortened(schema),
        shortened(fields)
    )]
    Unknown { schema: String, fields: String },
    /// The schema has nothing of the kind at a path that the user names.
    #[error(
        "{} has no {needs} at {path:?}{}; it has such at: {}",
        shortened(schema),
        did_you_mean(nearest),
        listed(present)
    )]
    NoField {
        schema: String,
        path: String,
        /// What has to be there.
        needs: &'static str,
        nearest: Option<String>,
        present: Vec<String>,
    },
    /// The schema is read in another role than the one asked for.
    #[error("{} holds {found}, not {wanted}: choose another topic for the {wanted}", shortened(schema))]
    OtherRole { schema: String, wanted: Role, found: Role },
    /// A body was asked for on a channel whose messages do not name bodies.
    #[error(
        "{} does not name the body it tracks: remove `body = \"{body}\"` from this stream",
        shortened(schema)
    )]
    NoBodyName { schema: String, body: String },
    /// Several bodies in a channel, and none or an ambiguous one asked for.
    #[error("several bodies on this channel, set `body` to one of: {}", listed(bodies))]
    SeveralBodies { bodies: Vec<String> },
    /// The message ends before its schema does.
    #[error("message of {bytes} bytes ends inside a field that needs {needed} bytes at byte {at}")]
    Truncated {
        /// Length of the message [bytes].
        bytes: usize,
        /// Where the field starts [byte].
        at: usize,
        /// What the field needs at least [bytes].
        needed: usize,
    },
    /// The message goes on behind its schema.
    #[error(
        "message of {bytes} bytes goes on for {left} bytes behind its last field: the definition in the file is not \
         the one it was written with"
    )]
    LeftOver {
        /// Length of the message [bytes].
        bytes: usize,
        /// What is behind the last field [bytes].
        left: usize,
    },
    /// The four bytes before a CDR message name a representation that is not read.
    #[error(
        "CDR encapsulation {id:#06x} is not read; supported are plain CDR, plain CDR2 and delimited CDR2"
    )]
    Encapsulation { id: u16 },
    /// The bytes are not a message of the declared encoding.
    #[error("not a valid {encoding} message: {why}")]
    Malformed { encoding: &'static str, why: String },
    /// A field that is needed is absent from this message.
    #[error("the message has no {field}")]
    Missing { field: String },
    /// Two lists that belong together differ in length.
    #[error("the message has {positions} positions but {others} {of}")]
    Lengths {
        positions: usize,
        others: usize,
        /// What the others are: `names` or `efforts`.
        of: &'static str,
    },
    /// The rows given are of another role than the plan.
    #[error("a plan for {plan} was given rows for {rows}")]
    RowsOfOtherRole { plan: Role, rows: Role },
}

/// At most twenty names.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 20;
    if names.is_empty() {
        return "none".to_owned();
    }
    let shown = names.iter().take(SHOWN).map(|n| shortened(n)).collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
