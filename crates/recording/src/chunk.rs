//! Inflating a chunk, and judging it before any of its messages is used.

use crate::records::ChunkHeader;
use std::io::Read as _;

/// Largest chunk inflated. Writers use 0.75 to 4 MiB; a larger claim than this is damage or an attack.
const MAX_CHUNK_BYTES: u64 = 1 << 30;

/// A decompressor and its output buffer, reused from chunk to chunk by one thread.
#[derive(Default)]
pub(crate) struct Inflater {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
    buffer: Vec<u8>,
}

impl Inflater {
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
        let data: &[u8] = match header.compression.as_str() {
            "" => packed,
            "zstd" => {
                self.zstd(packed, size)?;
                &self.buffer
            }
            "lz4" => {
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
        match header.compression.as_str() {
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
        if self.zstd.is_none() {
            self.zstd = Some(zstd::bulk::Decompressor::new().map_err(failed)?);
        }
        self.buffer.clear();
        self.buffer.try_reserve(size).map_err(|e| e.to_string())?;
        match &mut self.zstd {
            Some(zstd) => zstd.decompress_to_buffer(packed, &mut self.buffer).map(drop).map_err(failed),
            None => Ok(()),
        }
    }
}

/// Reads at most one byte more than `size`, so that too much is noticed and a bomb is not inflated.
fn stream_into(buffer: &mut Vec<u8>, reader: impl std::io::Read, size: usize) -> Result<(), String> {
    buffer.clear();
    let limit = size as u64 + 1;
    reader.take(limit).read_to_end(buffer).map(drop).map_err(|e| format!("it does not inflate: {e}"))
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
