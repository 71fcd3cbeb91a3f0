//! What is sound is used, what is not is named.

use super::{OnDisk, Style, mcap_bytes, opaque, open, raw_count};
use crate::{Recording, RecordingError, Source};
use armcal_core::Severity;
use mcap::Compression;

const N: u64 = 1000;

fn counted(recording: &Recording) -> u64 {
    let report: u64 = recording.report().channels.iter().map(|c| c.messages).sum();
    assert_eq!(report, raw_count(recording), "the report and the raw pass agree");
    report
}

fn loses(recording: &Recording) -> bool {
    recording.report().warnings.iter().any(|w| w.severity == Severity::DataLost)
}

fn every_style() -> Vec<Style> {
    let mut styles = Vec::new();
    for chunk_bytes in [None, Some(500), Some(8192), Some(1 << 20)] {
        for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
            for summary in [true, false] {
                styles.push(Style { chunk_bytes, compression, summary, crc: true, fillers: 2 });
            }
        }
    }
    styles
}

#[test]
fn sound_files_of_every_layout_are_read_whole_and_without_a_word() {
    for style in every_style() {
        let recording = open(&mcap_bytes(&[opaque("/a", N), opaque("/b", N / 2)], &style));
        assert_eq!(counted(&recording), N + N / 2, "{style:?}");
        let report = recording.report();
        assert!(report.warnings.is_empty() && report.files[0].damaged.is_empty(), "{style:?}: {report:?}");
        let by_index = style.chunk_bytes.is_some() && style.summary;
        assert_eq!(report.files[0].source, if by_index { Source::Index } else { Source::Scan }, "{style:?}");
        let a = report.channels.iter().find(|c| c.topic == "/a").expect("channel /a");
        assert_eq!((a.first_ns, a.last_ns), (1_000_000_000, 1_000_000_000 + 999 * 10_000_000));
    }
}

#[test]
fn the_report_hashes_the_file() {
    // sha256sum of the three letters "abc", FIPS 180-2 appendix B.1.
    let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    let disk = OnDisk::new(&[b"abc".to_vec()]);
    assert_eq!(crate::sha256_of(&disk.path("part_0.mcap")).expect("readable"), abc);
    // b3sum of the same; and of a recording of many pieces, whoever has hashed them and when.
    let abc = "blake3:6437b3ac38465133ffb63b75273a8db548c558465d79db03fd359c6cd5bd9d85";
    assert_eq!(crate::identity_of(&disk.path("part_0.mcap")).expect("readable"), abc);
    for style in [Style::default(), Style { summary: false, ..Style::default() }] {
        let bytes = mcap_bytes(&[opaque("/a", 30_000)], &style);
        assert!(bytes.len() > 1 << 20);
        let expected = format!("blake3:{}", blake3::hash(&bytes).to_hex());
        let disk = OnDisk::new(&[bytes]);
        let open = || disk.open().expect("an MCAP file");
        assert_eq!(open().report().files[0].identity, expected);
        assert_eq!(open().without_identity().report().files[0].identity, expected);
        assert_eq!(crate::identity_of(&disk.path("part_0.mcap")).expect("readable"), expected);
    }
}

#[test]
fn a_file_cut_in_mid_chunk_gives_all_whole_chunks_and_part_of_the_last() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let style = Style { compression, chunk_bytes: Some(1 << 20), ..Style::default() };
        let (small, large) = (opaque("/a", 100), opaque("/a", 20_000));
        // One chunk, cut in the middle: only streaming decompression gets anything out of it.
        let bytes = mcap_bytes(&[large], &style);
        let cut = open(&bytes[..bytes.len() / 2]);
        let found = counted(&cut);
        assert!((5_000..15_000).contains(&found), "{compression:?}: {found}");
        assert!(cut.report().files[0].truncated_at.is_some() && loses(&cut));
        // Many chunks: everything before the cut, to the message, and no more than was written.
        let bytes = mcap_bytes(&[small], &Style { chunk_bytes: Some(400), compression, ..Style::default() });
        let mut last = 0;
        for at in (60..bytes.len()).step_by(53).chain([bytes.len()]) {
            let found = counted(&open(&bytes[..at]));
            assert!(found >= last && found <= 100, "cut at {at}: {found} after {last}");
            last = found;
        }
        assert_eq!(last, 100);
    }
}

#[test]
fn a_flipped_bit_costs_its_chunk_and_is_named() {
    let bytes = mcap_bytes(&[opaque("/a", N)], &Style::default());
    let chunks = mcap::Summary::read(&bytes).expect("readable").expect("has a summary").chunk_indexes;
    assert!(chunks.len() > 5);
    let hit = &chunks[3];
    let mut flipped = bytes.clone();
    flipped[(hit.chunk_start_offset + hit.chunk_length / 2) as usize] ^= 0x10;
    let recording = open(&flipped);
    // 71 bytes a message: 9 envelope, 22 header, 40 payload.
    assert_eq!(counted(&recording), N - hit.uncompressed_size / 71);
    let damaged = &recording.report().files[0].damaged;
    let named = |(at, why): &(u64, String)| why.contains("chunk dropped") && *at == hit.chunk_start_offset;
    assert_eq!(damaged.iter().filter(|d| named(d)).count(), 1, "{damaged:?}");
    assert!(loses(&recording));
}

#[test]
fn a_flipped_bit_in_an_unchunked_file_is_said() {
    let bytes = mcap_bytes(&[opaque("/a", N)], &Style { chunk_bytes: None, ..Style::default() });
    let mut flipped = bytes.clone();
    let payload = opaque("/a", N).messages[500].2.clone();
    let at = bytes.windows(40).position(|w| w == payload).expect("the payload is there");
    flipped[at + 7] ^= 1;
    let recording = open(&flipped);
    assert_eq!(counted(&recording), N);
    assert!(recording.report().files[0].damaged[0].1.contains("CRC of the data section"));
}

#[test]
fn a_wrong_record_length_is_jumped_with_the_index() {
    let bytes = mcap_bytes(&[opaque("/a", N)], &Style::default());
    let summary = mcap::Summary::read(&bytes).expect("readable").expect("has a summary");
    let chunk = &summary.chunk_indexes[2];
    let mut lying = bytes.clone();
    lying[chunk.chunk_start_offset as usize + 6] = 0xff;
    let recording = open(&lying);
    assert_eq!(counted(&recording), N, "the index knows the right length");
    assert!(loses(&recording), "nobody knows what else was changed");
    // Long enough to swallow the next chunk, short enough to end at the one after.
    let mut swallowing = bytes.clone();
    let after = &summary.chunk_indexes[4];
    let length = after.chunk_start_offset - chunk.chunk_start_offset - 9;
    let at = chunk.chunk_start_offset as usize + 1;
    swallowing[at..at + 8].copy_from_slice(&length.to_le_bytes());
    assert_eq!(counted(&open(&swallowing)), N, "the index knows the hidden chunk");
    let mut zeroed = bytes.clone();
    let start = chunk.chunk_start_offset as usize;
    zeroed[start..start + 300].fill(0);
    let recording = open(&zeroed);
    let found = counted(&recording);
    assert!(found < N && found > N * 3 / 4, "{found}");
    assert!(loses(&recording));
}

#[test]
fn a_zero_filled_tail_is_a_cut() {
    for chunk_bytes in [None, Some(2000), Some(1 << 20)] {
        let n = if chunk_bytes == Some(1 << 20) { 20_000 } else { N };
        let mut bytes = mcap_bytes(&[opaque("/a", n)], &Style { chunk_bytes, ..Style::default() });
        let from = bytes.len() * 2 / 3;
        bytes[from..].fill(0);
        let recording = open(&bytes);
        let found = counted(&recording);
        assert!(found > n / 2 && found < n, "{chunk_bytes:?}: {found} of {n}");
        assert!(
            recording.report().files[0].truncated_at.is_some() || n > N,
            "{:?}",
            recording.report().files[0]
        );
        assert!(loses(&recording));
    }
}

#[test]
fn bytes_after_the_end_are_not_read_and_told() {
    let mut bytes = mcap_bytes(&[opaque("/a", N)], &Style::default());
    bytes.extend(b"appended by a careless tool");
    let recording = open(&bytes);
    assert_eq!(counted(&recording), N);
    assert!(recording.report().files[0].damaged[0].1.contains("27 bytes follow"));
    assert!(loses(&recording));
}

/// What is done to the bytes of a file.
type Change<'a> = &'a dyn Fn(&mut Vec<u8>);

/// The data section is there to the last message, but what would vouch for it is not.
#[test]
fn a_lost_footer_or_a_bad_summary_costs_no_message_and_is_told() {
    let bytes = mcap_bytes(&[opaque("/a", N)], &Style::default());
    let footer = bytes.len() - 8 - 29;
    let changed = |change: Change<'_>| {
        let mut changed = bytes.clone();
        change(&mut changed);
        open(&changed)
    };
    let cases: [(&str, Change<'_>); 5] = [
        ("before its footer", &|b| b.truncate(footer)),
        ("CRC of the summary", &|b| b[footer - 40] ^= 0xff),
        ("does not point to the summary", &|b| {
            b[footer + 9..footer + 17].copy_from_slice(&7_u64.to_le_bytes())
        }),
        ("before its footer", &|b| b[footer + 1] = 21),
        ("before its footer", &|b| b[footer] = 0x0e),
    ];
    for (says, change) in cases {
        let recording = changed(change);
        assert_eq!(counted(&recording), N, "{says}");
        let damaged = &recording.report().files[0].damaged;
        assert!(
            loses(&recording) && damaged.iter().any(|(_, why)| why.contains(says)),
            "{says}: {damaged:?}"
        );
    }
}

/// One flipped bit makes a chunk a footer; the index leads to it all the same.
#[test]
fn a_chunk_of_another_kind_is_found_by_the_index() {
    let bytes = mcap_bytes(&[opaque("/a", N)], &Style::default());
    let summary = mcap::Summary::read(&bytes).expect("readable").expect("has a summary");
    for chunk in [&summary.chunk_indexes[2], summary.chunk_indexes.last().expect("chunks")] {
        for bit in 0..8 {
            let mut flipped = bytes.clone();
            flipped[chunk.chunk_start_offset as usize] ^= 1 << bit;
            let recording = open(&flipped);
            assert_eq!(counted(&recording), N, "bit {bit}");
            assert!(loses(&recording), "bit {bit}");
        }
    }
}

#[test]
fn what_is_no_mcap_is_refused_with_its_name() {
    let refused = |bytes: &[u8]| match OnDisk::new(&[bytes.to_vec()]).open() {
        Err(RecordingError::NotMcap { why, .. } | RecordingError::Foreign { why, .. }) => why,
        other => panic!("expected a refusal, got {:?}", other.err()),
    };
    assert!(refused(b"").contains("empty"));
    assert!(refused(b"certainly not a recording").contains("magic"));
    assert!(refused(b"#ROSBAG V1.2\nxxxx").contains("rosbag fix"));
    assert!(refused(b"SQLite format 3\0xxx").contains("not a database"));
    assert!(refused(&[0x28, 0xb5, 0x2f, 0xfd, 0, 0]).contains("compressed"));
    let disk = OnDisk::new(&[]);
    assert!(matches!(disk.open(), Err(RecordingError::NoFiles)));
    let missing = Recording::open(&[disk.path("missing.mcap")]).err().map(|e| e.to_string());
    assert!(missing.is_some_and(|e| e.contains("missing.mcap")));
    assert!(Recording::open(&[disk.path(".")]).is_err());
}

#[test]
fn split_files_are_one_recording_in_any_order() {
    let mut late = opaque("/a", N);
    late.messages
        .iter_mut()
        .for_each(|(log, publish, _)| (*log, *publish) = (*log + 60_000_000_000, *publish));
    let first = mcap_bytes(&[opaque("/a", N)], &Style::default());
    let second = mcap_bytes(&[late], &Style { fillers: 3, summary: false, ..Style::default() });
    let disk = OnDisk::new(&[second, first]);
    let recording = disk.open().expect("two files");
    assert_eq!(counted(&recording), 2 * N);
    let report = recording.report();
    assert!(report.files[0].path.ends_with("part_1.mcap"), "in time order");
    let channel: Vec<_> = report.channels.iter().filter(|c| c.topic == "/a").collect();
    assert_eq!(channel.len(), 1, "one channel though its id differs");
    assert_eq!(channel[0].messages, 2 * N);
    let mut times = Vec::new();
    let pass = recording.for_each_raw(&mut |m| {
        times.push(m.log_ns);
        Ok(())
    });
    pass.expect("nothing stops the pass");
    assert!(times.is_sorted());
    let path = disk.path("part_0.mcap");
    assert!(matches!(Recording::open(&[path.clone(), path]), Err(RecordingError::ListedTwice { .. })));
}

#[test]
fn a_file_without_messages_opens() {
    for style in every_style() {
        let recording = open(&mcap_bytes(&[opaque("/a", 0)], &style));
        assert_eq!(counted(&recording), 0);
        assert!(!loses(&recording), "{style:?}: {:?}", recording.report().warnings);
    }
}
