//! A file read by ranges gives what the same file mapped gives, and reads only what is wanted.

use super::{OnDisk, Style, attachments, mcap_bytes, messages_of, opaque, raw_count};
use crate::write::output::McapOutput;
use crate::{Access, Recording, RecordingError, Source};
use armcal_core::Severity;
use mcap::records::{Record, op};
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::io::Cursor;

const N: u64 = 1000;

fn by_ranges(bytes: &[u8]) -> (OnDisk, Recording) {
    let disk = OnDisk::new(&[bytes.to_vec()]);
    let recording = disk.open_with(Access::Ranges).expect("an MCAP file");
    (disk, recording)
}

fn fetched_bytes(recording: &Recording) -> u64 {
    recording.report().files[0].fetched.expect("read by ranges").bytes
}

/// Chunks of `/joints` between chunks of a camera, as a writer makes them that gives images chunks of their own.
fn with_camera(images: u64, image_bytes: usize) -> Vec<u8> {
    let options = WriteOptions::new().compression(Some(Compression::Zstd)).compression_threads(0);
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer into memory");
    let joints = writer.add_channel(0, "/joints", "json", &BTreeMap::new()).expect("a channel");
    let camera = writer.add_channel(0, "/camera", "jpeg", &BTreeMap::new()).expect("a channel");
    let mut random = 1_u64;
    for i in 0..images {
        let mut put = |channel_id, data: &[u8]| {
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: i as u32,
                log_time: i + 1,
                publish_time: i,
            };
            writer.write_to_known_channel(&header, data).expect("written to memory");
            writer.flush().expect("a chunk");
        };
        put(joints, format!("{{\"i\": {i}}}").as_bytes());
        let noise = (0..image_bytes).map(|_| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 56) as u8
        });
        put(camera, &noise.collect::<Vec<_>>());
    }
    writer.finish().expect("finished in memory");
    writer.into_inner().into_inner()
}

#[test]
fn every_layout_gives_the_messages_that_a_map_gives() {
    for chunk_bytes in [None, Some(500), Some(1 << 20)] {
        for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
            for summary in [true, false] {
                let style = Style { chunk_bytes, compression, summary, crc: true, fillers: 2 };
                let bytes = mcap_bytes(&[opaque("/a", N), opaque("/b", N / 2)], &style);
                let (disk, ranged) = by_ranges(&bytes);
                let mapped = disk.open().expect("an MCAP file");
                assert_eq!(messages_of(&ranged, "/a"), messages_of(&mapped, "/a"), "{style:?}");
                assert_eq!(raw_count(&ranged), N + N / 2, "{style:?}");
                let (report, of_map) = (ranged.report(), mapped.report());
                assert_eq!(report.channels, of_map.channels, "{style:?}");
                assert_eq!(report.files[0].identity, of_map.files[0].identity);
                assert!(of_map.files[0].fetched.is_none());
                let lost = report.warnings.iter().any(|w| w.severity > Severity::Notice);
                assert!(!lost && report.warnings.len() == usize::from(!summary), "{style:?}: {report:?}");
                if !summary {
                    assert!(report.files[0].damaged[0].1.contains("so all of it was read"), "{report:?}");
                    assert!(fetched_bytes(&ranged) >= bytes.len() as u64);
                }
            }
        }
    }
}

#[test]
fn only_chunks_with_a_wanted_channel_are_read_and_nothing_is_said_to_be_missing() {
    let bytes = with_camera(40, 400_000);
    let (disk, ranged) = by_ranges(&bytes);
    let mapped = disk.open().expect("an MCAP file");
    assert_eq!(messages_of(&ranged, "/joints"), messages_of(&mapped, "/joints"));
    let report = ranged.report();
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    assert_eq!(report.files[0].source, Source::Index);
    assert_eq!(report.channels, mapped.report().channels, "what was not read is what the summary declares");
    // The tail of 256 KiB, a head of 4 KiB, and 40 chunks of some hundred bytes. Hashing a local file reads the rest.
    let hash = bytes.len() as u64;
    assert!(fetched_bytes(&ranged) - hash < 300_000, "{} of {hash}", fetched_bytes(&ranged) - hash);
    assert!(fetched_bytes(&ranged) > hash);
}

#[test]
fn a_chunk_that_is_not_what_the_index_says_costs_its_messages_and_is_named() {
    let bytes = with_camera(10, 300_000);
    let chunks = mcap::Summary::read(&bytes).expect("readable").expect("a summary").chunk_indexes;
    let (joints, camera) = (&chunks[6], &chunks[7]);
    assert!(joints.chunk_length < 1000 && camera.chunk_length > 300_000);
    let flipped = |at: u64| {
        let mut bytes = bytes.clone();
        bytes[at as usize] ^= 0x40;
        bytes
    };
    for at in [0, 3, joints.chunk_length - 3].map(|within| joints.chunk_start_offset + within) {
        let (_disk, recording) = by_ranges(&flipped(at));
        assert_eq!(messages_of(&recording, "/joints").len(), 9);
        let damaged = &recording.report().files[0].damaged;
        assert!(
            damaged.iter().any(|(at, why)| *at == joints.chunk_start_offset && why.contains("chunk dropped"))
        );
        assert!(
            damaged.iter().any(|(_, why)| why.contains("declare 10 messages on /joints, 9 are usable")),
            "{damaged:?}"
        );
    }
    // What is not read is not judged, but where the file is hashed its CRC still tells.
    let (_disk, recording) = by_ranges(&flipped(camera.chunk_start_offset + 1000));
    assert_eq!(messages_of(&recording, "/joints").len(), 10);
    let warnings = &recording.report().warnings;
    assert!(warnings.len() == 1 && warnings[0].message.contains("CRC of the data section"), "{warnings:?}");
    assert_eq!(messages_of(&recording, "/camera").len(), 9);
}

#[test]
fn a_summary_that_does_not_fit_together_is_not_believed() {
    let style = Style { chunk_bytes: Some(2000), ..Style::default() };
    let bytes = mcap_bytes(&[opaque("/a", N)], &style);
    let summary = mcap::Summary::read(&bytes).expect("readable").expect("a summary");
    let footer = bytes.len() - 8 - 29;
    // Without its CRC nothing vouches for the summary but itself.
    let mut unprotected = bytes.clone();
    unprotected[footer + 25..footer + 29].fill(0);
    let (_disk, recording) = by_ranges(&unprotected);
    assert_eq!((raw_count(&recording), recording.report().files[0].source), (N, Source::Index));
    assert!(recording.report().warnings.is_empty());
    let needle = summary.chunk_indexes[3].chunk_start_offset.to_le_bytes();
    let start = u64::from_le_bytes(bytes[footer + 9..footer + 17].try_into().expect("eight bytes")) as usize;
    let found = bytes[start..].windows(8).position(|w| w == needle).expect("listed") + start;
    for lie in [0, 9_u64, summary.chunk_indexes[2].chunk_start_offset, u64::MAX, bytes.len() as u64] {
        let mut lying = unprotected.clone();
        lying[found..found + 8].copy_from_slice(&lie.to_le_bytes());
        let (_disk, recording) = by_ranges(&lying);
        assert_eq!(raw_count(&recording), N, "{lie}");
        let said = &recording.report().files[0].damaged;
        assert!(said.iter().any(|(_, why)| why.contains("so all of it was read")), "{lie}: {said:?}");
    }
    // Statistics that are not there cannot vouch for the chunks listed.
    let mut without = unprotected;
    let mut at = start;
    while let Some(op) = without.get(at).copied().filter(|op| *op != op::FOOTER) {
        let length = u64::from_le_bytes(without[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        if let Ok(Record::Statistics(_)) = mcap::parse_record(op, &without[at + 9..at + 9 + length]) {
            without[at] = op::SUMMARY_OFFSET;
        }
        at += 9 + length;
    }
    let (_disk, recording) = by_ranges(&without);
    assert_eq!((raw_count(&recording), recording.report().files[0].source), (N, Source::Index));
    assert!(recording.report().files[0].damaged[0].1.contains("no statistics, so all of it was read"));
}

#[test]
fn a_cut_file_is_read_whole_and_its_damage_told() {
    let bytes = with_camera(10, 100_000);
    let cut = &bytes[..bytes.len() * 2 / 3];
    let (disk, ranged) = by_ranges(cut);
    let mapped = disk.open().expect("an MCAP file");
    let messages = messages_of(&ranged, "/joints");
    assert_eq!(messages, messages_of(&mapped, "/joints"));
    assert!(messages.len() < 10 && messages.len() > 4);
    let (file, of_map) = (&ranged.report().files[0], &mapped.report().files[0]);
    assert_eq!(file.truncated_at, of_map.truncated_at);
    assert!(file.damaged.iter().any(|(_, why)| why.contains("does not end with a footer")), "{file:?}");
    assert!(ranged.report().warnings.iter().any(|w| w.severity == Severity::DataLost));
}

#[test]
fn attachments_and_metadata_are_read_when_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("out.mcap");
    let mut out = McapOutput::create(&path, "ros2").expect("created");
    let id = out.add_channel("/a", None, "json", &BTreeMap::new()).expect("a channel");
    out.put(id, 0, 1, 1, b"{}").expect("written");
    out.attach("big.bin", "application/octet-stream", 5, 6, &vec![7; 3 << 20]).expect("attached");
    out.metadata("lab", &BTreeMap::from([("room".to_owned(), "7".to_owned())])).expect("written");
    out.put(id, 1, 2, 2, b"{}").expect("written");
    out.finish().expect("finished");
    let recording = Recording::open_with(&[path], Access::Ranges).expect("an MCAP file");
    assert_eq!(messages_of(&recording, "/a").len(), 2);
    let attached = attachments(&recording);
    assert_eq!((attached[0].0.as_str(), attached[0].4.len()), ("big.bin", 3 << 20));
    assert_eq!(recording.metadata().expect("readable")[0].0, "lab");
    assert!(recording.report().warnings.is_empty(), "{:?}", recording.report().warnings);
}

#[test]
fn a_file_that_is_shortened_while_it_is_read_is_an_error() {
    let (disk, recording) = by_ranges(&with_camera(10, 300_000));
    let file = std::fs::OpenOptions::new().write(true).open(disk.path("part_0.mcap")).expect("there");
    file.set_len(100_000).expect("cut");
    let pass = recording.for_each_raw(&mut |_| Ok(()));
    let error = pass.expect_err("the rest is gone");
    assert!(matches!(error, RecordingError::Read { .. }), "{error}");
    assert!(error.to_string().contains("part_0.mcap") && error.to_string().contains("shortened"), "{error}");
    assert!(recording.report().warnings.iter().any(|w| w.message.contains("cannot be hashed")));
    assert!(
        matches!(recording.whole_report(), Err(RecordingError::Read { .. })),
        "it cannot be hashed either"
    );
}
