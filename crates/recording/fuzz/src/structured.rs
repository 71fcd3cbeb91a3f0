//! Recordings by construction: the input is a list of orders, each of which writes one record, sound unless the order
//! says how it lies. Random bytes hardly ever reach what lies behind a length, a CRC and a codec; these do.

use std::collections::BTreeMap;

pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const JOINTS: &str = "string[] name\nfloat64[] position\nfloat64[] effort";
const POINT: &str =
    "geometry_msgs/Point point\n===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z";
const SCALAR: &str = "float64 temperature\nfloat64 variance";

/// What the orders make.
pub struct Made {
    /// The file as it was written.
    pub sound: Vec<u8>,
    /// The same with bits flipped, if the orders say so.
    pub bytes: Vec<u8>,
    /// What compressed chunks hold, by where they are in the sound file.
    pub packed: BTreeMap<usize, Vec<u8>>,
}

/// The file that the orders make; it has an end, unless the last order wrote one.
pub fn mcap(orders: &[u8]) -> Made {
    let mut file = Writer { orders, out: MAGIC.to_vec(), ..Writer::default() };
    let mut header = text("ros2");
    header.extend(text("fuzz"));
    file.record(0x01, header);
    while file.order() {}
    if !file.out.ends_with(MAGIC) {
        file.end();
    }
    let mut bytes = file.out.clone();
    for (at, bit) in file.flips {
        let at = at % bytes.len();
        bytes[at] ^= 1 << (bit % 8);
    }
    Made { sound: file.out, bytes, packed: file.packed }
}

#[derive(Default)]
struct Writer<'a> {
    orders: &'a [u8],
    out: Vec<u8>,
    /// The records in the chunk that is open.
    chunk: Option<Vec<u8>>,
    packed: BTreeMap<usize, Vec<u8>>,
    summary: Vec<u8>,
    messages: u32,
    flips: Vec<(usize, u8)>,
}

impl Writer<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.orders.split_first() else { return 0 };
        self.orders = rest;
        *first
    }

    fn number(&mut self) -> u64 {
        let sizes = [1, 2, 4, 8];
        let size = sizes[usize::from(self.byte() % 4)];
        (0..size).fold(0, |n, i| n | u64::from(self.byte()) << (8 * i))
    }

    fn bytes(&mut self) -> Vec<u8> {
        let length = usize::from(self.byte());
        (0..length).map(|_| self.byte()).collect()
    }

    /// Carries out one order; false at the end of them.
    fn order(&mut self) -> bool {
        if self.orders.is_empty() {
            return false;
        }
        let order = self.byte();
        match order % 16 {
            0 => self.schema(),
            1 => self.channel(),
            2 | 3 => self.message(),
            4 => {
                let (at, bit) = (self.number() as usize, self.byte());
                self.flips.push((at, bit));
            }
            5 => self.close_chunk(0, 0),
            6 => {
                self.close_chunk(0, 0);
                self.chunk = Some(Vec::new());
            }
            7 => {
                let (size, crc) = (self.number(), self.number() as u32);
                self.close_chunk(size, crc);
            }
            8 => self.attachment(),
            9 => {
                let body = [text("m"), self.bytes()].concat();
                self.record(0x0c, body);
            }
            10 => self.chunk_index(),
            11 => self.statistics(),
            12 => self.end(),
            13 => {
                let (op, body) = (self.byte(), self.bytes());
                self.record(op, body);
            }
            14 => {
                let (op, length) = (self.byte(), self.number());
                self.raw(&[&[op], &length.to_le_bytes()[..]].concat());
            }
            _ => {
                let bytes = self.bytes();
                self.raw(&bytes);
            }
        }
        true
    }

    fn raw(&mut self, bytes: &[u8]) {
        self.chunk.as_mut().unwrap_or(&mut self.out).extend(bytes);
    }

    fn record(&mut self, op: u8, body: Vec<u8>) {
        self.raw(&[op]);
        self.raw(&(body.len() as u64).to_le_bytes());
        self.raw(&body);
    }

    fn schema(&mut self) {
        let pick = self.byte();
        let (name, own) = match pick % 4 {
            0 => ("sensor_msgs/msg/JointState", JOINTS.as_bytes().to_vec()),
            1 => ("geometry_msgs/msg/PointStamped", POINT.as_bytes().to_vec()),
            2 => ("sensor_msgs/msg/Temperature", SCALAR.as_bytes().to_vec()),
            _ => ("a/b", self.bytes()),
        };
        let id = u16::from(pick % 4) + 1;
        let data = [(own.len() as u32).to_le_bytes().to_vec(), own].concat();
        let body = [id.to_le_bytes().to_vec(), text(name), text("ros2msg"), data].concat();
        self.record(0x03, body);
    }

    fn channel(&mut self) {
        let (id, schema) = (u16::from(self.byte() % 8), u16::from(self.byte() % 6));
        let topic = format!("/t{id}");
        let metadata = self.bytes();
        let metadata = [(metadata.len() as u32).to_le_bytes().to_vec(), metadata].concat();
        let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        self.record(0x04, [ids, text(&topic), text("cdr"), metadata].concat());
    }

    fn message(&mut self) {
        let (kind, time) = (self.byte(), self.number());
        let number = |w: &mut Self| (w.number() as f64 * 1e-3).to_le_bytes();
        let data = match kind % 4 {
            0 => {
                let names = [&2_u32.to_le_bytes()[..], &name("joint1"), &[0], &name("joint2"), &[0]].concat();
                let positions = [&2_u32.to_le_bytes()[..], &number(self), &number(self)].concat();
                [&[0, 1, 0, 0], &names[..], &positions, &0_u32.to_le_bytes()].concat()
            }
            1 => [&[0, 1, 0, 0][..], &number(self), &number(self), &number(self)].concat(),
            2 => [&[0, 1, 0, 0][..], &number(self), &number(self)].concat(),
            _ => self.bytes(),
        };
        let id = u16::from(self.byte() % 8);
        let times = [time.to_le_bytes(), time.to_le_bytes()].concat();
        // No message is like another one.
        self.messages += 1;
        self.record(0x05, [&id.to_le_bytes()[..], &self.messages.to_le_bytes(), &times, &data].concat());
    }

    /// Writes the open chunk; a size or CRC that is not 0 is claimed in place of the right one.
    fn close_chunk(&mut self, size: u64, crc: u32) {
        let Some(records) = self.chunk.take() else { return };
        let (compression, packed) = match self.byte() % 3 {
            0 => ("", records.clone()),
            1 => ("zstd", zstd::bulk::compress(&records, 1).unwrap_or_default()),
            _ => ("lz4", lz4(&records)),
        };
        let size = if size == 0 { records.len() as u64 } else { size };
        let crc = if crc == 0 { crc32fast::hash(&records) } else { crc };
        let offset = self.out.len() as u64;
        if !compression.is_empty() {
            self.packed.insert(self.out.len(), records);
        }
        let lengths = [[0; 16].to_vec(), size.to_le_bytes().to_vec(), crc.to_le_bytes().to_vec()].concat();
        let packed = [(packed.len() as u64).to_le_bytes().to_vec(), packed].concat();
        self.record(0x06, [lengths, text(compression), packed].concat());
        let length = self.out.len() as u64 - offset;
        self.index(offset, length);
    }

    fn index(&mut self, offset: u64, length: u64) {
        let place = [[0; 16].to_vec(), offset.to_le_bytes().to_vec(), length.to_le_bytes().to_vec()].concat();
        let rest = [vec![0; 4 + 8], text(""), vec![0; 16]].concat();
        let body = [place, rest].concat();
        self.summary.push(0x08);
        self.summary.extend((body.len() as u64).to_le_bytes());
        self.summary.extend(body);
    }

    fn chunk_index(&mut self) {
        let (offset, length) = (self.number(), self.number());
        self.index(offset, length);
    }

    fn statistics(&mut self) {
        let messages = self.number();
        let counts = self.bytes();
        let body =
            [&messages.to_le_bytes()[..], &[0; 34], &(counts.len() as u32).to_le_bytes(), &counts].concat();
        self.summary.push(0x0b);
        self.summary.extend((body.len() as u64).to_le_bytes());
        self.summary.extend(body);
    }

    fn attachment(&mut self) {
        let (length, data) = (self.number(), self.bytes());
        let length = if length % 2 == 0 { data.len() as u64 } else { length };
        let mut body =
            [[0; 16].to_vec(), text("../../a"), text("x/y"), length.to_le_bytes().to_vec(), data].concat();
        body.extend(crc32fast::hash(&body).to_le_bytes());
        self.record(0x09, body);
    }

    /// Data end, summary, footer, magic, with their CRCs; a byte that is not 0 moves what the footer points to.
    fn end(&mut self) {
        self.close_chunk(0, 0);
        let crc = crc32fast::hash(&self.out);
        self.record(0x0f, crc.to_le_bytes().to_vec());
        let begun = self.out.len();
        let start = (begun as u64).wrapping_add_signed(i64::from(self.byte() as i8));
        let summary = std::mem::take(&mut self.summary);
        self.raw(&summary);
        self.raw(&[&[0x02][..], &20_u64.to_le_bytes(), &start.to_le_bytes(), &[0; 8]].concat());
        let crc = crc32fast::hash(&self.out[begun..]);
        self.raw(&crc.to_le_bytes());
        self.raw(MAGIC);
    }
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// A CDR string: 6 letters, their zero and a byte of padding after it, so that the next length is aligned.
fn name(six: &str) -> Vec<u8> {
    [&7_u32.to_le_bytes()[..], six.as_bytes(), &[0]].concat()
}

fn lz4(bytes: &[u8]) -> Vec<u8> {
    let Ok(mut encoder) = lz4::EncoderBuilder::new().build(Vec::new()) else { return Vec::new() };
    let written = std::io::Write::write_all(&mut encoder, bytes);
    let (packed, done) = encoder.finish();
    if written.and(done).is_ok() { packed } else { Vec::new() }
}
