//! Inflating a chunk, and judging it before any of its messages is used.

use crate::bytes::budget::Share;
use crate::structure::records::ChunkHeader;
use std::io::Read as _;

/// Largest chunk inflated. Writers use 0.75 to 4 MiB; a larger claim than this is damage or an attack.
const MAX_CHUNK_BYTES: u64 = 1 << 30;
/// A claim of up to this is reserved at once; a larger one grows as the chunk inflates.
const RESERVED_BYTES: usize = 16 << 20;
/// Chunks that inflate to more than this share a budget, however many threads there are; smaller ones stay in the buffer
/// of their thread.
const LARGE_BYTES: usize = if cfg!(test) { 64 << 10 } else { RESERVED_BYTES };
/// What is reserved before anything has been read from a stream: more than a block of either codec at its default.
const FIRST_STEP_BYTES: usize = 128 << 10;
/// What one compressed byte can stand for at most: a zstd block of 128 KiB may be a repeated byte, written in 4 (RFC 8878,
/// 3.1.1.2.2), and a byte of an lz4 match length is 255 (lz4 block format).
const ZSTD_RATIO: u64 = (128 << 10) / 4;
const LZ4_RATIO: u64 = 255;

/// A decompressor and its output buffer, reused from chunk to chunk by one thread. The buffer never holds more than
/// what the codec could make of the bytes that are there, nor much more than what it has made of them.
#[derive(Default)]
pub(crate) struct Inflater {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
    buffer: Vec<u8>,
    /// Held as long as the buffer holds a large chunk.
    share: Option<Share>,
}

impl Inflater {
    /// Says that the chunk is no longer needed.
    pub fn done(&mut self) {
        if self.share.is_some() {
            self.buffer = Vec::new();
            self.share = None;
        }
    }

    /// What was inflated last, to keep.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.buffer)
    }

    /// The records of a whole chunk, given the body of its record. Size and CRC have been checked (MCAP allows a
    /// CRC of 0 for "not computed"). The error is the reason why nothing of the chunk may be used.
    pub fn whole<'b>(&'b mut self, body: &'b [u8]) -> Result<&'b [u8], String> {
        let (header, rest) = ChunkHeader::parse(body).ok_or("its header is cut off or not readable")?;
        let length = usize::try_from(header.compressed_size).ok().filter(|n| *n <= rest.len());
        let Some(packed) = length.map(|n| &rest[..n]) else {
            return Err(format!(
                "it claims {} compressed bytes, {} are there",
                header.compressed_size,
                rest.len()
            ));
        };
        if header.uncompressed_size > MAX_CHUNK_BYTES {
            return Err(format!("it claims to inflate to {} bytes", header.uncompressed_size));
        }
        let size = header.uncompressed_size as usize;
        let possible =
            |ratio: u64| match header.uncompressed_size <= ratio.saturating_mul(packed.len() as u64) {
                true => Ok(()),
                false => Err(format!("it claims to inflate to {size} bytes, which {} cannot", packed.len())),
            };
        if size > LARGE_BYTES && !header.compression.is_empty() && self.share.is_none() {
            self.share = Some(Share::of(size));
        }
        let data: &[u8] = match header.compression {
            "" => packed,
            "zstd" => {
                possible(ZSTD_RATIO)?;
                self.zstd(packed, size)?;
                &self.buffer
            }
            "lz4" => {
                possible(LZ4_RATIO)?;
                stream_into(&mut self.buffer, lz4::Decoder::new(packed).map_err(|e| e.to_string())?, size)?;
                &self.buffer
            }
            other => return Err(format!("compression {other:?} is not one of zstd, lz4, none")),
        };
        if data.len() != size {
            return Err(format!("it inflates to {} bytes instead of {size}", data.len()));
        }
        let crc = crc32fast::hash(data);
        if header.uncompressed_crc != 0 && crc != header.uncompressed_crc {
            return Err(format!("its CRC is {crc:08x} instead of {:08x}", header.uncompressed_crc));
        }
        Ok(data)
    }

    /// Whatever of a cut-off chunk still inflates, from the start; nothing vouches for it but the codec.
    pub fn prefix<'b>(&'b mut self, body: &'b [u8]) -> Option<&'b [u8]> {
        let (header, packed) = ChunkHeader::parse(body)?;
        let size = header.uncompressed_size.min(MAX_CHUNK_BYTES) as usize;
        // A failing stream is expected here: what it gave before it failed is what we came for.
        match header.compression {
            "" => return Some(&packed[..packed.len().min(size)]),
            "zstd" => {
                let _ = stream_into(&mut self.buffer, zstd::Decoder::new(packed).ok()?, size);
            }
            "lz4" => {
                let _ = stream_into(&mut self.buffer, lz4::Decoder::new(packed).ok()?, size);
            }
            _ => return None,
        }
        Some(&self.buffer)
    }

    fn zstd(&mut self, packed: &[u8], size: usize) -> Result<(), String> {
        let failed = |e: std::io::Error| format!("it does not inflate: {e}");
        if size > RESERVED_BYTES {
            return stream_into(&mut self.buffer, zstd::Decoder::new(packed).map_err(failed)?, size);
        }
        if self.zstd.is_none() {
            self.zstd = Some(zstd::bulk::Decompressor::new().map_err(failed)?);
        }
        self.buffer.clear();
        self.buffer.reserve(size);
        match &mut self.zstd {
            Some(zstd) => zstd.decompress_to_buffer(packed, &mut self.buffer).map(drop).map_err(failed),
            None => Ok(()),
        }
    }
}

/// Reads at most one byte more than `size`, so that too much is noticed and a bomb is not inflated. The buffer grows to
/// twice what has been read, and never beyond what is asked for.
pub(crate) fn stream_into(
    buffer: &mut Vec<u8>,
    mut reader: impl std::io::Read,
    size: usize,
) -> Result<(), String> {
    buffer.clear();
    let limit = size + 1;
    while buffer.len() < limit {
        let step = buffer.len().max(FIRST_STEP_BYTES).min(limit - buffer.len());
        buffer.reserve_exact(step);
        let read = reader.by_ref().take(step as u64).read_to_end(buffer);
        if read.map_err(|e| format!("it does not inflate: {e}"))? < step {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(compression: &str, size: u64, crc: u32, packed: &[u8]) -> Vec<u8> {
        let mut body = vec![0; 16];
        body.extend(size.to_le_bytes());
        body.extend(crc.to_le_bytes());
        body.extend((compression.len() as u32).to_le_bytes());
        body.extend(compression.as_bytes());
        body.extend((packed.len() as u64).to_le_bytes());
        body.extend(packed);
        body
    }

    #[test]
    fn a_bomb_and_a_lying_size_are_refused() {
        let zeros = zstd::bulk::compress(&vec![0_u8; 1 << 20], 3).expect("compresses");
        let mut inflater = Inflater::default();
        let claim = |size| chunk("zstd", size, 0, &zeros);
        assert!(inflater.whole(&claim(1 << 20)).is_ok());
        assert!(inflater.whole(&claim(1000)).is_err());
        assert!(inflater.whole(&claim((1 << 20) + 1)).is_err());
        assert!(inflater.whole(&claim(u64::MAX)).is_err_and(|why| why.contains("claims to inflate")));
        assert!(inflater.whole(&chunk("xz", 3, 0, b"abc")).is_err_and(|why| why.contains("xz")));
        assert!(inflater.whole(&chunk("", 3, 1, b"abc")).is_err_and(|why| why.contains("CRC")));
    }

    #[test]
    fn a_claim_is_not_reserved_before_something_inflates() {
        // Incompressible bytes: as many as they claim to be, but cut to a tenth.
        let noise: Vec<u8> =
            (0..8_u32 << 20).flat_map(|i| i.wrapping_mul(2_654_435_761).to_le_bytes()).collect();
        let packed = zstd::bulk::compress(&noise, 1).expect("compresses");
        let mut inflater = Inflater::default();
        assert_eq!(inflater.whole(&chunk("zstd", noise.len() as u64, 0, &packed)), Ok(&noise[..]));
        inflater.done();
        for compression in ["zstd", "lz4"] {
            let mut inflater = Inflater::default();
            let claims_a_gigabyte = chunk(compression, 1 << 30, 0, &packed[..packed.len() / 10]);
            assert!(inflater.whole(&claims_a_gigabyte).is_err());
            assert!(inflater.buffer.capacity() <= 16 << 20, "{compression}: {}", inflater.buffer.capacity());
            let impossible = chunk(compression, 1 << 30, 0, &packed[..1000]);
            assert!(inflater.whole(&impossible).is_err_and(|why| why.contains("cannot")), "{compression}");
        }
    }

    #[test]
    fn the_best_the_codecs_can_do_is_allowed() {
        // 16 MiB of one byte is the most that they compress.
        let zeros = vec![0_u8; 16 << 20];
        let packed = zstd::bulk::compress(&zeros, 19).expect("compresses");
        assert!((zeros.len() / packed.len()) as u64 <= ZSTD_RATIO && zeros.len() / packed.len() > 20_000);
        let mut inflater = Inflater::default();
        assert!(inflater.whole(&chunk("zstd", zeros.len() as u64, 0, &packed)).is_ok());
        let mut encoder = lz4::EncoderBuilder::new().level(16).build(Vec::new()).expect("an encoder");
        std::io::Write::write_all(&mut encoder, &zeros).expect("compresses");
        let (packed, done) = encoder.finish();
        done.expect("finished");
        assert!((zeros.len() / packed.len()) as u64 <= LZ4_RATIO && zeros.len() / packed.len() > 200);
        assert!(inflater.whole(&chunk("lz4", zeros.len() as u64, 0, &packed)).is_ok());
    }

    #[test]
    fn a_cut_stream_gives_its_prefix() {
        let text: Vec<u8> =
            (0..400_000_u32).flat_map(|i| i.wrapping_mul(2_654_435_761).to_le_bytes()).collect();
        let packed = zstd::bulk::compress(&text, 3).expect("compresses");
        let mut body = chunk("zstd", text.len() as u64, 0, &packed);
        body.truncate(body.len() / 2);
        let mut inflater = Inflater::default();
        let prefix = inflater.prefix(&body).expect("something inflates");
        assert!(prefix.len() > text.len() / 3 && prefix.len() < text.len());
        assert_eq!(prefix, &text[..prefix.len()]);
    }
}
