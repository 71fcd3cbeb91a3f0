//! Message types as the file defines them, the same for every schema language.

/// All message types of one schema. The first is the message of the channel; the others are used by it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Types {
    pub(super) messages: Vec<MessageType>,
}

/// One message type.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MessageType {
    pub(super) fields: Vec<Field>,
}

/// One field, in the order of its definition.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) repeat: Repeat,
}

/// What a field (or each element of it) is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A number or a boolean.
    Number(Number),
    /// Text.
    Text,
    /// Text of 16-bit characters: never read, and of unknown length in CDR.
    WideText,
    /// The `time` and `duration` of ROS 1: seconds and nanoseconds, 32 bits each.
    Time,
    /// Another message: its index in [`Types::messages`].
    Message(usize),
    /// Something that is never read: bytes, maps, untyped JSON.
    Other,
}

/// Layout of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    /// Unsigned integer (or boolean) of 1, 2, 4 or 8 bytes.
    Unsigned(usize),
    /// Signed integer of 1, 2, 4 or 8 bytes.
    Signed(usize),
    /// IEEE 754 number of 4 or 8 bytes.
    Float(usize),
}

impl Number {
    /// Size [bytes].
    pub(super) fn bytes(self) -> usize {
        match self {
            Number::Unsigned(n) | Number::Signed(n) | Number::Float(n) => n,
        }
    }
}

/// How often a field holds its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repeat {
    /// Once.
    Once,
    /// Always this often, without a count in the message.
    Fixed(usize),
    /// As often as the message says.
    Sequence,
}

impl Types {
    /// Whether these are `whole` up to somewhere before its end, as a text leaves them that was cut off.
    pub(super) fn breaks_off(&self, whole: &Types) -> bool {
        self.begins(0, whole, 0) == Some(false)
    }

    /// Whether a message is all of another one; `None` if it is no beginning of it either.
    fn begins(&self, own: usize, whole: &Types, other: usize) -> Option<bool> {
        let (own, other) = (&self.messages[own].fields, &whole.messages[other].fields);
        let mut all = own.len() == other.len();
        for (field, known) in own.iter().zip(other) {
            match (field.kind, known.kind) {
                _ if field.name != known.name || field.repeat != known.repeat => return None,
                (Kind::Message(a), Kind::Message(b)) => all &= self.begins(a, whole, b)?,
                // A stamp may be taken for granted.
                (Kind::Time, Kind::Message(_)) | (Kind::Message(_), Kind::Time) => {}
                (a, b) if a != b => return None,
                _ => {}
            }
        }
        (own.len() <= other.len()).then_some(all)
    }

    /// The field names of the channel's message, for error messages.
    pub(super) fn field_names(&self) -> String {
        let names: Vec<&str> = self.messages[0].fields.iter().map(|f| f.name.as_str()).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }
}
