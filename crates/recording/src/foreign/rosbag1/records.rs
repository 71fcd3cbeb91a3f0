//! Records of a ROS 1 bag, format 2.0: a header of named fields, then data.
//!
//! Format: <https://wiki.ros.org/Bags/Format/2.0>.

/// What a record is, by its field `op`.
pub(super) mod op {
    pub const MESSAGE: u8 = 0x02;
    pub const BAG_HEADER: u8 = 0x03;
    pub const INDEX: u8 = 0x04;
    pub const CHUNK: u8 = 0x05;
    pub const CHUNK_INFO: u8 = 0x06;
    pub const CONNECTION: u8 = 0x07;
}

/// One record.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record<'a> {
    header: &'a [u8],
    pub data: &'a [u8],
    /// Where it begins and ends in the bytes that it was read from.
    pub start: usize,
    pub end: usize,
}

impl<'a> Record<'a> {
    /// The record that begins at a place; `None` where it does not end within the bytes, or is none.
    pub fn at(bytes: &'a [u8], start: usize) -> Option<Record<'a>> {
        let (header, behind) = sized(bytes, start)?;
        let (data, end) = sized(bytes, behind)?;
        let record = Record { header, data, start, end };
        record.op()?;
        Some(record)
    }

    pub fn op(&self) -> Option<u8> {
        match self.field("op")? {
            [op] => Some(*op),
            _ => None,
        }
    }

    /// The value of a field of the header.
    pub fn field(&self, name: &str) -> Option<&'a [u8]> {
        field(self.header, name)
    }

    pub fn u32(&self, name: &str) -> Option<u32> {
        self.field(name)?.try_into().ok().map(u32::from_le_bytes)
    }

    pub fn u64(&self, name: &str) -> Option<u64> {
        self.field(name)?.try_into().ok().map(u64::from_le_bytes)
    }

    pub fn text(&self, name: &str) -> Option<&'a str> {
        std::str::from_utf8(self.field(name)?).ok()
    }

    /// A field of time [ns].
    pub fn time_ns(&self, name: &str) -> Option<u64> {
        time_ns(self.field(name)?)
    }
}

/// Seconds and nanoseconds.
pub(super) fn time_ns(bytes: &[u8]) -> Option<u64> {
    let (seconds, nanoseconds) = bytes.split_first_chunk::<4>()?;
    let nanoseconds = u32::from_le_bytes(nanoseconds.try_into().ok()?);
    (nanoseconds < 1_000_000_000)
        .then(|| u64::from(u32::from_le_bytes(*seconds)) * 1_000_000_000 + u64::from(nanoseconds))
}

/// The value of a field in a header: each field is its length, its name, `=`, its value.
pub(super) fn field<'a>(header: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let mut at = 0;
    while let Some((field, behind)) = sized(header, at) {
        let value = field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
        if value.is_some() {
            return value;
        }
        at = behind;
    }
    None
}

/// Bytes behind their length, and where they end.
fn sized(bytes: &[u8], at: usize) -> Option<(&[u8], usize)> {
    let length = bytes.get(at..)?.first_chunk::<4>()?;
    let start = at + 4;
    let end = start.checked_add(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    Some((bytes.get(start..end)?, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_by_the_whole_of_their_names() {
        let mut header = Vec::new();
        for field in [&b"conn_count=1"[..], b"conn=22", b"op=\x07", b"empty="] {
            header.extend((field.len() as u32).to_le_bytes());
            header.extend(field);
        }
        assert_eq!(field(&header, "conn"), Some(&b"22"[..]));
        assert_eq!(field(&header, "empty"), Some(&b""[..]));
        assert_eq!(field(&header, "con"), None);
        let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
        bytes.extend(&header);
        bytes.extend(3_u32.to_le_bytes());
        bytes.extend(b"abc");
        let record = Record::at(&bytes, 0).expect("a record");
        assert_eq!((record.op(), record.data, record.end), (Some(op::CONNECTION), &b"abc"[..], bytes.len()));
        for cut in 0..bytes.len() {
            assert!(Record::at(&bytes[..cut], 0).is_none(), "{cut}");
        }
    }

    #[test]
    fn a_time_has_less_than_a_second_of_nanoseconds() {
        assert_eq!(time_ns(&[1, 0, 0, 0, 2, 0, 0, 0]), Some(1_000_000_002));
        assert_eq!(time_ns(&[0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff]), None);
        assert_eq!(time_ns(&[0; 7]), None);
    }
}
