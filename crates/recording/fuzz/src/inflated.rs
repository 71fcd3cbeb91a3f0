//! What there is in the bytes of a recording, by a walk of its own.

use super::limits::Size;

/// What a recording may inflate to beside 100 times its bytes (docs/hardening.md).
const FREE_BYTES: usize = 8 << 20;
const TIMES: usize = 100;

/// Size of a recording, by what its chunks claim as far as that is granted. What is no MCAP file may be compressed as a whole.
pub fn size(bytes: &[u8]) -> Size {
    let granted = FREE_BYTES + TIMES * bytes.len();
    if !bytes.starts_with(b"\x89MCAP0\r\n") {
        return Size { bytes: bytes.len() + granted, chunk: granted };
    }
    let claim = |body: &[u8]| Some(u64::from_le_bytes(*body.get(16..24)?.first_chunk()?));
    let claims = records(&bytes[8..]).filter(|(op, _)| *op == 0x06).filter_map(|(_, body)| claim(body));
    let claims = claims.map(|claim| usize::try_from(claim).unwrap_or(usize::MAX).min(granted));
    let (sum, most) = claims.fold((0_usize, 0), |(sum, most), one| (sum.saturating_add(one), one.max(most)));
    Size { bytes: bytes.len() + sum.min(granted), chunk: most }
}

/// Opcodes and bodies of records that follow each other, up to one that is not whole.
pub fn records(mut rest: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    std::iter::from_fn(move || {
        let (head, behind) = rest.split_first_chunk::<9>()?;
        let length = u64::from_le_bytes(*head[1..].first_chunk()?);
        let (body, behind) = behind.split_at_checked(usize::try_from(length).ok()?)?;
        rest = behind;
        Some((head[0], body))
    })
}
