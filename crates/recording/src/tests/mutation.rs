//! Whatever happens to the bytes, reading neither panics nor invents messages.

use super::{OnDisk, Style, attachments, mcap_bytes, opaque, raw_count};
use crate::Access;
use mcap::Compression;
use proptest::prelude::*;

const N: u64 = 300;

fn style() -> impl Strategy<Value = Style> {
    let compression = prop_oneof![Just(None), Just(Some(Compression::Zstd)), Just(Some(Compression::Lz4))];
    let chunk = prop_oneof![Just(None), Just(Some(700)), Just(Some(4000))];
    (chunk, compression, any::<bool>(), any::<bool>()).prop_map(|(chunk_bytes, compression, summary, crc)| {
        Style { chunk_bytes, compression, summary, crc, fillers: 1 }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn mutated_bytes_never_panic_and_never_add_messages(
        style in style(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        cut in prop::option::of(any::<prop::sample::Index>()),
        zeros in prop::option::of((any::<prop::sample::Index>(), 1_usize..600)),
    ) {
        let mut bytes = mcap_bytes(&[opaque("/a", N)], &style);
        for (at, mask) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= mask;
        }
        if let Some((at, length)) = zeros {
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            bytes[at..end].fill(0);
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let disk = OnDisk::new(&[bytes]);
        for access in [Access::Mapped, Access::Ranges] {
            if let Ok(recording) = disk.open_with(access) {
                let found = raw_count(&recording);
                prop_assert!(found <= N, "{found} of {N}");
                let counted: u64 = recording.report().channels.iter().map(|c| c.messages).sum();
                prop_assert_eq!(found, counted);
                attachments(&recording);
                recording.metadata().expect("a local file is there");
            }
        }
    }
}
