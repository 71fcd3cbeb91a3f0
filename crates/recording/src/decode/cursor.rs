//! Reading position in the bytes of a CDR or ROS 1 message. Every read is checked against the end.
//!
//! CDR aligns each primitive to its own size, counted from the end of the encapsulation header; XCDR2 to at most
//! 4 bytes (OMG DDS-XTypes 1.3, 7.4.1 to 7.4.3). ROS 1 does not align.

use super::DecodeError;
use super::sink::Sink;
use super::slot::Slot;
use super::types::Number;

/// Bytes of the header that names the representation of a CDR message.
const ENCAPSULATION_BYTES: usize = 4;

/// Reading position in a message.
#[derive(Debug, Clone)]
pub(super) struct Cursor<'m> {
    data: &'m [u8],
    at: usize,
    /// Where alignment is counted from.
    origin: usize,
    little_endian: bool,
    /// Largest alignment: 1, 4 or 8.
    max_align: usize,
    /// How XCDR2 delimits things.
    pub(super) delimiters: Delimiters,
    /// Why a read gave `None`. Kept here so that reads return values small enough for registers.
    error: Option<DecodeError>,
}

/// Which parts of a message are preceded by their size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delimiters {
    /// None: XCDR1 and ROS 1.
    None,
    /// Lists of texts and messages: XCDR2 of final types.
    Lists,
    /// Also the messages themselves: XCDR2 of appendable types.
    ListsAndMessages,
}

impl<'m> Cursor<'m> {
    /// At the start of a ROS 1 message.
    pub(super) fn ros1(data: &'m [u8]) -> Cursor<'m> {
        Cursor {
            data,
            at: 0,
            origin: 0,
            little_endian: true,
            max_align: 1,
            delimiters: Delimiters::None,
            error: None,
        }
    }

    /// Behind the encapsulation header of a CDR message (DDS-XTypes 1.3, table 59).
    pub(super) fn cdr(data: &'m [u8]) -> Result<Cursor<'m>, DecodeError> {
        let Some((header, _)) = data.split_first_chunk::<ENCAPSULATION_BYTES>() else {
            return Err(DecodeError::Truncated { bytes: data.len(), at: 0, needed: ENCAPSULATION_BYTES });
        };
        let id = u16::from_be_bytes([header[0], header[1]]);
        let (max_align, delimiters) = match id {
            0x0000 | 0x0001 => (8, Delimiters::None),
            0x0006 | 0x0007 => (4, Delimiters::Lists),
            0x0008 | 0x0009 => (4, Delimiters::ListsAndMessages),
            _ => return Err(DecodeError::Encapsulation { id }),
        };
        let at = ENCAPSULATION_BYTES;
        Ok(Cursor { data, at, origin: at, little_endian: id & 1 == 1, max_align, delimiters, error: None })
    }

    /// Why the last read gave `None`.
    pub(super) fn into_error(self) -> DecodeError {
        self.error.unwrap_or(DecodeError::Truncated { bytes: self.data.len(), at: self.at, needed: 1 })
    }

    /// Goes on at `end`, where a delimiter says that a message ends.
    pub(super) fn finish_at(&mut self, end: usize) -> Option<()> {
        if self.at > end {
            let why = format!("a delimited message ends at byte {end}, its fields at byte {}", self.at);
            self.error = Some(DecodeError::Malformed { encoding: "cdr", why });
            return None;
        }
        self.at = end;
        Some(())
    }

    /// What is left of the message.
    pub(super) fn rest(&self) -> &'m [u8] {
        self.data.get(self.at..).unwrap_or_default()
    }

    /// What is left of the message from where the next 32-bit number begins.
    pub(super) fn rest_at_u32(&mut self) -> &'m [u8] {
        self.align(4);
        self.rest()
    }

    /// The next `bytes` bytes.
    #[inline]
    pub(super) fn take(&mut self, bytes: usize) -> Option<&'m [u8]> {
        match self.data.get(self.at..).and_then(|rest| rest.get(..bytes)) {
            Some(taken) => {
                self.at += bytes;
                Some(taken)
            }
            None => self.truncated(bytes),
        }
    }

    /// The next primitive of `N` bytes, aligned.
    #[inline]
    fn primitive<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.align(N);
        let Some((bytes, _)) = self.rest().split_first_chunk::<N>() else { return self.truncated(N) };
        self.at += N;
        Some(*bytes)
    }

    /// The next unsigned 32-bit number.
    #[inline]
    pub(super) fn u32(&mut self) -> Option<u32> {
        let bytes = self.primitive()?;
        Some(if self.little_endian { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    /// The number of elements of a list; refused if they cannot fit into what is left of the message.
    #[inline]
    pub(super) fn count(&mut self, min_element_bytes: usize) -> Option<usize> {
        let count = self.u32()? as usize;
        self.check_room(count, min_element_bytes)?;
        Some(count)
    }

    /// Checks that `count` elements can fit into what is left of the message.
    #[inline]
    pub(super) fn check_room(&mut self, count: usize, min_element_bytes: usize) -> Option<()> {
        let needed = count.saturating_mul(min_element_bytes);
        if needed > self.data.len().saturating_sub(self.at) { self.truncated(needed) } else { Some(()) }
    }

    /// The next text, without the terminating zero that CDR counts in.
    #[inline]
    pub(super) fn text(&mut self) -> Option<&'m [u8]> {
        let bytes = self.u32()? as usize;
        let text = self.take(bytes)?;
        Some(if self.max_align > 1 { text.strip_suffix(&[0]).unwrap_or(text) } else { text })
    }

    /// Reads the end of a delimited part, and returns where it is [byte].
    pub(super) fn delimiter(&mut self) -> Option<usize> {
        let bytes = self.u32()? as usize;
        self.check_room(bytes, 1)?;
        Some(self.at + bytes)
    }

    /// The next number.
    #[inline]
    pub(super) fn number(&mut self, number: Number) -> Option<f64> {
        match (number, self.little_endian) {
            (Number::Float(8), true) => Some(f64::from_le_bytes(self.primitive()?)),
            (Number::Signed(4), true) => Some(f64::from(i32::from_le_bytes(self.primitive()?))),
            (Number::Unsigned(4), true) => Some(f64::from(u32::from_le_bytes(self.primitive()?))),
            (_, little_endian) => {
                Some(decode_number(number, little_endian, self.skip_numbers(number.bytes(), 1)?))
            }
        }
    }

    /// Hands the next `count` numbers to the sink.
    #[inline]
    pub(super) fn numbers(
        &mut self,
        number: Number,
        count: usize,
        slot: Slot,
        sink: &mut impl Sink<'m>,
    ) -> Option<()> {
        let bytes = self.skip_numbers(number.bytes(), count)?;
        match (number, self.little_endian) {
            (Number::Float(8), true) => {
                sink.numbers(slot, bytes.as_chunks().0.iter().map(|&bytes| f64::from_le_bytes(bytes)));
            }
            (_, little_endian) => {
                let each = bytes.chunks_exact(number.bytes());
                sink.numbers(slot, each.map(|bytes| decode_number(number, little_endian, bytes)));
            }
        }
        Some(())
    }

    /// Hands the next `count` numbers to `each`, by their place.
    #[inline]
    pub(super) fn each(
        &mut self,
        number: Number,
        count: usize,
        mut each: impl FnMut(usize, f64),
    ) -> Option<()> {
        let bytes = self.skip_numbers(number.bytes(), count)?;
        match (number, self.little_endian) {
            (Number::Float(8), true) => {
                let numbers = bytes.as_chunks().0.iter().enumerate();
                numbers.for_each(|(k, &bytes)| each(k, f64::from_le_bytes(bytes)));
            }
            (_, little_endian) => {
                let numbers = bytes.chunks_exact(number.bytes()).enumerate();
                numbers.for_each(|(k, bytes)| each(k, decode_number(number, little_endian, bytes)));
            }
        }
        Some(())
    }

    /// Goes past `count` numbers of `size` bytes, and returns their bytes.
    #[inline]
    pub(super) fn skip_numbers(&mut self, size: usize, count: usize) -> Option<&'m [u8]> {
        if count == 0 {
            return Some(&[]);
        }
        self.align(size);
        self.take(count.saturating_mul(size))
    }

    /// Skips padding to a multiple of `bytes`, a power of two. Reading at a position beyond the end fails, so that
    /// it need not be checked here.
    #[inline]
    fn align(&mut self, bytes: usize) {
        let mask = bytes.min(self.max_align) - 1;
        self.at += self.origin.wrapping_sub(self.at) & mask;
    }

    #[cold]
    fn truncated<T>(&mut self, needed: usize) -> Option<T> {
        self.error = Some(DecodeError::Truncated { bytes: self.data.len(), at: self.at, needed });
        None
    }
}

/// The number in these bytes, as many as it has. 64-bit integers are rounded to 53 bits.
#[inline]
fn decode_number(number: Number, little_endian: bool, bytes: &[u8]) -> f64 {
    let bits = match <[u8; 8]>::try_from(bytes) {
        Ok(all) if little_endian => u64::from_le_bytes(all),
        Ok(all) => u64::from_be_bytes(all),
        Err(_) if little_endian => bytes.iter().rev().fold(0, |bits, &b| bits << 8 | u64::from(b)),
        Err(_) => bytes.iter().fold(0, |bits, &b| bits << 8 | u64::from(b)),
    };
    match number {
        Number::Unsigned(_) => bits as f64,
        Number::Signed(n) => {
            let unused = 64 - 8 * n as u32;
            ((bits << unused) as i64 >> unused) as f64
        }
        Number::Float(4) => f64::from(f32::from_bits(bits as u32)),
        Number::Float(_) => f64::from_bits(bits),
    }
}
