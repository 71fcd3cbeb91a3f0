//! Protobuf wire format: fields one after another, each with its tag and wire type.

use super::DecodeError;

/// Groups nest at most this deep, like messages in the official decoders.
const MAX_GROUPS: usize = 100;

/// How a number is written.
#[derive(Debug, Clone, Copy)]
pub(super) enum Scalar {
    Varint,
    SignedVarint,
    ZigZag,
    U32,
    I32,
    F32,
    U64,
    I64,
    F64,
}

/// The value of a field, as far as its wire type tells.
#[derive(Debug, Clone, Copy)]
pub(super) enum Value<'m> {
    Varint(u64),
    Fixed32([u8; 4]),
    Fixed64([u8; 8]),
    /// Text, bytes, a message, or packed numbers.
    Bytes(&'m [u8]),
    /// A group, skipped.
    Group,
}

impl Scalar {
    /// The number a value stands for; `None` if it has another wire type.
    pub(super) fn number(self, value: Value<'_>) -> Option<f64> {
        Some(match (self, value) {
            (Scalar::Varint, Value::Varint(v)) => v as f64,
            // Negative int32 are written as 64 bits, so one rule serves both sizes.
            (Scalar::SignedVarint, Value::Varint(v)) => v as i64 as f64,
            (Scalar::ZigZag, Value::Varint(v)) => ((v >> 1) as i64 ^ -((v & 1) as i64)) as f64,
            (Scalar::U32, Value::Fixed32(b)) => f64::from(u32::from_le_bytes(b)),
            (Scalar::I32, Value::Fixed32(b)) => f64::from(i32::from_le_bytes(b)),
            (Scalar::F32, Value::Fixed32(b)) => f64::from(f32::from_le_bytes(b)),
            (Scalar::U64, Value::Fixed64(b)) => u64::from_le_bytes(b) as f64,
            (Scalar::I64, Value::Fixed64(b)) => i64::from_le_bytes(b) as f64,
            (Scalar::F64, Value::Fixed64(b)) => f64::from_le_bytes(b),
            _ => return None,
        })
    }
}

/// Reading position in a message.
pub(super) struct Reader<'m> {
    rest: &'m [u8],
    bytes: usize,
}

impl<'m> Reader<'m> {
    pub(super) fn new(data: &'m [u8]) -> Reader<'m> {
        Reader { rest: data, bytes: data.len() }
    }

    /// Tag and value of the next field; `None` at the end.
    pub(super) fn next_field(&mut self) -> Result<Option<(u32, Value<'m>)>, DecodeError> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let (tag, wire_type) = self.key()?;
        let value = match wire_type {
            3 => {
                self.skip_group(tag)?;
                Value::Group
            }
            _ => self.value(wire_type)?,
        };
        Ok(Some((tag, value)))
    }

    /// The next of several packed numbers; `None` at the end.
    pub(super) fn next_packed(&mut self, scalar: Scalar) -> Result<Option<f64>, DecodeError> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let value = match scalar {
            Scalar::Varint | Scalar::SignedVarint | Scalar::ZigZag => Value::Varint(self.varint()?),
            Scalar::U32 | Scalar::I32 | Scalar::F32 => Value::Fixed32(self.fixed()?),
            Scalar::U64 | Scalar::I64 | Scalar::F64 => Value::Fixed64(self.fixed()?),
        };
        Ok(scalar.number(value))
    }

    fn key(&mut self) -> Result<(u32, u8), DecodeError> {
        let key = self.varint()?;
        match u32::try_from(key >> 3) {
            Ok(tag) if tag != 0 => Ok((tag, (key & 7) as u8)),
            _ => Err(malformed_error(format!("field number {} at byte {}", key >> 3, self.at()))),
        }
    }

    fn value(&mut self, wire_type: u8) -> Result<Value<'m>, DecodeError> {
        Ok(match wire_type {
            0 => Value::Varint(self.varint()?),
            1 => Value::Fixed64(self.fixed()?),
            2 => {
                let length = self.varint()?;
                let length = usize::try_from(length).unwrap_or(usize::MAX);
                let (bytes, rest) =
                    self.rest.split_at_checked(length).ok_or_else(|| self.truncated(length))?;
                self.rest = rest;
                Value::Bytes(bytes)
            }
            5 => Value::Fixed32(self.fixed()?),
            _ => return Err(malformed_error(format!("wire type {wire_type} at byte {}", self.at()))),
        })
    }

    /// Skips to the end of a group, and of all groups inside it.
    fn skip_group(&mut self, tag: u32) -> Result<(), DecodeError> {
        let mut open = vec![tag];
        while let Some(&innermost) = open.last() {
            match self.key()? {
                (inner, 3) if open.len() < MAX_GROUPS => open.push(inner),
                (_, 3) => {
                    return Err(malformed_error(format!("groups nested deeper than {MAX_GROUPS} levels")));
                }
                (end, 4) if end == innermost => _ = open.pop(),
                (_, wire_type) => _ = self.value(wire_type)?,
            }
        }
        Ok(())
    }

    fn varint(&mut self) -> Result<u64, DecodeError> {
        let mut value = 0;
        for i in 0..10 {
            let Some((&byte, rest)) = self.rest.split_first() else { return Err(self.truncated(1)) };
            self.rest = rest;
            value |= u64::from(byte & 0x7f) << (7 * i);
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err(malformed_error(format!("a varint longer than 10 bytes before byte {}", self.at())))
    }

    fn fixed<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or_else(|| self.truncated(N))?;
        self.rest = rest;
        Ok(*bytes)
    }

    fn at(&self) -> usize {
        self.bytes - self.rest.len()
    }

    #[cold]
    fn truncated(&self, needed: usize) -> DecodeError {
        DecodeError::Truncated { bytes: self.bytes, at: self.at(), needed }
    }
}

#[cold]
fn malformed_error(why: String) -> DecodeError {
    DecodeError::Malformed { encoding: "protobuf", why }
}
