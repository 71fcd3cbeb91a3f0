//! Recordings made to do harm: whatever they claim, no more is allocated than their bytes could hold, and nothing takes
//! forever.

#[path = "../fuzz/src/memory.rs"]
mod memory;
#[path = "../fuzz/src/recordings.rs"]
mod recordings;

use armcal_recording::Recording;
use armcal_recording::decode::{Plan, Role, Rows, readable_as};
use memory::peak_bytes;

#[global_allocator]
static COUNTING: memory::Counting = memory::Counting;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const ATTACHMENT: u8 = 0x09;
const METADATA: u8 = 0x0c;

/// Runs on one thread, and checks what was allocated at once.
fn measured<R: Send>(what: &str, most_bytes: usize, f: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let (result, peak) = pool.install(|| peak_bytes(f));
    assert!(peak <= most_bytes, "{what}: {peak} bytes allocated, at most {most_bytes} allowed");
    result
}

fn record(op: u8, body: &[u8]) -> Vec<u8> {
    [&[op][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

fn text(text: &[u8]) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text].concat()
}

fn header() -> Vec<u8> {
    record(0x01, &[0; 8])
}

/// A file of these records, finished without a summary.
fn file(records: &[Vec<u8>]) -> Vec<u8> {
    let end = [record(0x0f, &[0; 4]), record(0x02, &[0; 20])].concat();
    [MAGIC, &header(), &records.concat(), &end, MAGIC].concat()
}

fn chunk(compression: &[u8], size: u64, packed: &[u8]) -> Vec<u8> {
    let head = [&[0; 16][..], &size.to_le_bytes(), &[0; 4], &text(compression)].concat();
    record(CHUNK, &[&head, &(packed.len() as u64).to_le_bytes()[..], packed].concat())
}

#[test]
fn lengths_that_lie_reserve_nothing() {
    let huge = u32::MAX.to_le_bytes();
    let id = [1, 0];
    let schema =
        |name: &[u8], data: &[u8]| record(SCHEMA, &[&id[..], name, &text(b"ros2msg"), data].concat());
    let channel = |topic: &[u8], metadata: &[u8]| {
        record(CHANNEL, &[&id[..], &[0, 0], topic, &text(b"cdr"), metadata].concat())
    };
    let frame = zstd::bulk::compress(&[7; 100_000], 3).expect("compresses");
    let key = [&8_u32.to_le_bytes()[..], &huge, &huge].concat();
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("header", [MAGIC, &record(0x01, &huge)].concat()),
        ("schema name", file(&[schema(&huge, b"")])),
        ("schema data", file(&[schema(&text(b"a/b"), &huge)])),
        ("topic", file(&[channel(&huge, b"")])),
        ("channel metadata", file(&[channel(&text(b"/a"), &huge)])),
        ("channel metadata key", file(&[channel(&text(b"/a"), &key)])),
        ("metadata name", file(&[record(METADATA, &huge)])),
        ("attachment name", file(&[record(ATTACHMENT, &[&[0; 16][..], &huge].concat())])),
        ("attachment data", file(&[record(ATTACHMENT, &[&[0; 24][..], &[0xff; 8]].concat())])),
        ("record", [MAGIC, &[CHUNK], &u64::MAX.to_le_bytes()[..], &[0; 30]].concat()),
        ("record that overflows", [MAGIC, &[CHUNK], &(u64::MAX - 8).to_le_bytes()[..], &[0; 30]].concat()),
        ("chunk, zstd", file(&[chunk(b"zstd", 1 << 30, &frame)])),
        ("chunk, lz4", file(&[chunk(b"lz4", 1 << 30, &frame)])),
        ("chunk, plain", file(&[chunk(b"", 1 << 40, &frame)])),
        ("chunk, beyond everything", file(&[chunk(b"zstd", u64::MAX, &frame)])),
        ("compression", file(&[record(CHUNK, &[&[0; 28][..], &huge].concat())])),
        ("cut chunk", {
            let whole = [MAGIC, &header(), &chunk(b"zstd", 1 << 30, &frame)].concat();
            whole[..whole.len() - frame.len() / 2].to_vec()
        }),
    ];
    for (what, bytes) in cases {
        // Half a megabyte: what reading takes whatever the file, and the 128 KiB of one zstd block.
        measured(what, 16 * bytes.len() + (512 << 10), || recordings::recording(&bytes));
    }
}

/// 64 MiB of zeros in 2 KiB are honest for the codec, but nothing that a recorder writes.
#[test]
fn a_bomb_is_refused_by_what_the_file_may_inflate_to() {
    let bomb = zstd::bulk::compress(&vec![0; 64 << 20], 3).expect("compresses");
    let report = |bytes: &[u8]| {
        recordings::on_disk(bytes, |path| Recording::open(&[path.to_owned()]).map(|r| r.report().clone()))
            .expect("an MCAP file")
    };
    let bombs = file(&vec![chunk(b"zstd", 64 << 20, &bomb); 20]);
    let said = measured("bombs", 1 << 20, || report(&bombs));
    assert_eq!(said.files[0].damaged.len(), 20);
    assert!(said.files[0].damaged.iter().all(|(_, why)| why.contains("ARMCAL_INFLATE_MIB")), "{said:?}");
    // Many small ones are no way around it: together they make no more than one.
    let small = zstd::bulk::compress(&vec![0; 1 << 20], 3).expect("compresses");
    let many = file(&vec![chunk(b"zstd", 1 << 20, &small); 300]);
    let said = measured("many bombs", 3 << 20, || report(&many));
    let refused = |report: &armcal_recording::RecordingReport| {
        report.warnings.iter().any(|w| w.message.contains("ARMCAL_INFLATE_MIB"))
    };
    assert!(refused(&said), "{said:?}");
    // What alone is large is in memory once, and once more for a moment while it grows.
    let noise: Vec<u8> = (0..4_u32 << 20).flat_map(|i| i.wrapping_mul(2_654_435_761).to_le_bytes()).collect();
    let large = zstd::bulk::compress(&noise, 1).expect("compresses");
    let bytes = file(&[chunk(b"zstd", noise.len() as u64, &large)]);
    let said = measured("a large chunk", 2 * noise.len() + (1 << 20), || report(&bytes));
    assert!(!refused(&said), "{said:?}");
}

/// Messages that are compressed one by one, in a chunk that is compressed: the sum of all is what counts.
#[test]
fn messages_that_are_bombs_end_the_pass() {
    let schema = "string[] name\nfloat64[] position\n";
    let definitions = [
        record(SCHEMA, &[&[1, 0][..], &text(b"a/J"), &text(b"ros2msg"), &text(schema.as_bytes())].concat()),
        record(CHANNEL, &[&[0, 0, 1, 0][..], &text(b"/j"), &text(b"cdr"), &text(b"")].concat()),
    ];
    let bomb = zstd::bulk::compress(&vec![0; 64 << 20], 3).expect("compresses");
    let message = record(MESSAGE, &[&[0; 22][..], &bomb].concat());
    let records = [definitions.concat(), message.repeat(50)].concat();
    let packed = zstd::bulk::compress(&records, 3).expect("compresses");
    let bytes = file(&[chunk(b"zstd", records.len() as u64, &packed)]);
    let joints = armcal_recording::JointStream {
        topic: "/j".into(),
        names: vec!["joint1".into()],
        ..Default::default()
    };
    let streams = armcal_recording::Streams { joints: vec![joints], ..Default::default() };
    let said = measured("bombs in messages", 48 << 20, || {
        recordings::on_disk(&bytes, |path| {
            let recording = Recording::open(&[path.to_owned()]).expect("an MCAP file");
            recording.read(&streams).map(drop).map_err(|e| e.to_string())
        })
    });
    assert!(said.is_err_and(|e| e.contains("inflates to more") && e.contains("ARMCAL_INFLATE_MIB")));
}

/// What one pass may inflate is inflated by ten of them and no more: nobody has a recording read again and again.
#[test]
fn passes_over_a_recording_are_limited_together() {
    // A record of somebody else's, of 1 MiB.
    let records = record(0x90, &vec![0; (1 << 20) - 9]);
    let packed = zstd::bulk::compress(&records, 3).expect("compresses");
    let bytes = file(&vec![chunk(b"zstd", records.len() as u64, &packed); 7]);
    recordings::on_disk(&bytes, |path| {
        let recording = Recording::open(&[path.to_owned()]).expect("an MCAP file");
        let mut passes = 1;
        let refused = loop {
            match recording.for_each_raw(&mut |_| Ok(())) {
                Ok(()) => passes += 1,
                Err(e) => break e.to_string(),
            }
        };
        // 8 MiB and a hundred times the file are a little more than the 7 MiB that it inflates to.
        assert!((10..15).contains(&passes), "{passes}");
        assert!(
            refused.contains("read again and again") && refused.contains("ARMCAL_INFLATE_MIB"),
            "{refused}"
        );
    });
}

/// What is remembered of a file does not grow with its records: ten times as many take no more.
#[test]
fn records_that_say_nothing_take_no_memory_each() {
    let empty = |op: u8| record(op, b"");
    let sound = chunk(b"", 0, b"");
    let broken = chunk(b"zstd", 100, b"abc");
    let kinds = [
        ("empty chunks", empty(CHUNK), 16),
        ("sound chunks without records", sound, 24),
        ("broken chunks", broken, 24),
        ("unknown records", empty(0x20), 0),
        ("private records", empty(0x90), 0),
        ("message indexes of nothing", empty(0x07), 0),
        ("messages without a header", empty(MESSAGE), 0),
    ];
    for (what, one, each) in kinds {
        let peak = |n: usize| {
            let bytes = file(&vec![one.clone(); n]);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
            let read = || {
                recordings::on_disk(&bytes, |path| {
                    Recording::open(&[path.to_owned()]).map(|r| r.report().warnings.len()).expect("MCAP")
                })
            };
            pool.install(|| peak_bytes(read)).1
        };
        let (few, many) = (peak(10_000), peak(200_000));
        // Where each chunk is, while the index is compared with that: less than the chunk itself.
        assert!(many <= few + (256 << 10) + 2 * each * 200_000, "{what}: {few} and {many}");
    }
}

/// What a file defines, lists or attaches takes memory in proportion, and all that a file can define within the bar: 64 MiB
/// with the program itself, which is 20 of them.
#[test]
fn definitions_and_lists_take_memory_in_proportion() {
    let schema = |id: u16, data: &str| {
        let name = format!("a/J{id}");
        let text = [text(name.as_bytes()), text(b"ros2msg"), text(data.as_bytes())].concat();
        record(SCHEMA, &[&id.to_le_bytes()[..], &text].concat())
    };
    let channel = |id: u16, schema: u16, metadata: &[u8]| {
        let topic = format!("/topic{id}");
        let texts = [text(topic.as_bytes()), text(b"cdr"), text(metadata)].concat();
        record(CHANNEL, &[&id.to_le_bytes()[..], &schema.to_le_bytes(), &texts].concat())
    };
    let joints = "string[] name\nfloat64[] position\n";
    let entry = [text(b"a"), text(b"b")].concat();
    let message = |id: u16| record(MESSAGE, &[&id.to_le_bytes()[..], &[0; 20 + 5]].concat());
    type One<'a> = &'a dyn Fn(u16) -> Vec<u8>;
    let kinds: [(&str, One<'_>); 7] = [
        ("channels", &|id| channel(id, 0, b"")),
        ("channels with metadata", &|id| channel(id, 0, &entry)),
        ("schemas", &|id| [schema(id, joints), channel(id, id, b"")].concat()),
        ("schemas that cannot be read", &|id| [schema(id, "x"), channel(id, id, b"")].concat()),
        ("a chunk a channel", &|id| {
            let records = [schema(id, joints), channel(id, id, b""), message(id)].concat();
            chunk(b"", records.len() as u64, &records)
        }),
        ("attachments", &|_| record(ATTACHMENT, &[0; 36])),
        ("metadata records", &|_| record(METADATA, &[0; 8])),
    ];
    for (what, one) in kinds {
        let peak = |n: u16| {
            let bytes = file(&(1..n).map(one).collect::<Vec<_>>());
            let read = || {
                recordings::on_disk(&bytes, |path| {
                    let recording = Recording::open(&[path.to_owned()]).expect("an MCAP file");
                    recording.report().channels.len()
                })
            };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
            pool.install(|| peak_bytes(read)).1
        };
        let (few, many) = (peak(16_000), peak(64_000));
        assert!(many <= 4 * few + (1 << 20), "{what}: {few} and {many}");
        assert!(many <= 44 << 20, "{what}: {many} bytes allocated");
    }
}

/// A schema of 1 MiB in each of 200 chunks, which compresses well: the same one is held once, and of different ones no more than
/// is allowed.
#[test]
fn definitions_in_chunks_are_held_once_and_to_their_limit() {
    let chunk_of = |id: u16| {
        let noise: Vec<u8> = (0..5_000_u32)
            .flat_map(|i| (i + u32::from(id)).wrapping_mul(2_654_435_761).to_le_bytes())
            .collect();
        let texts = [text(b"a/J"), text(b"ros2msg"), text(&noise.repeat(50))].concat();
        let records = record(SCHEMA, &[&id.to_le_bytes()[..], &texts].concat());
        let packed = zstd::bulk::compress(&records, 3).expect("compresses");
        chunk(b"zstd", records.len() as u64, &packed)
    };
    let report = |what: &str, most_bytes: usize, chunks: &[Vec<u8>]| {
        let bytes = file(chunks);
        measured(what, most_bytes, || {
            let open =
                |path: &std::path::Path| Recording::open(&[path.to_owned()]).map(|r| r.report().clone());
            recordings::on_disk(&bytes, open).expect("an MCAP file")
        })
    };
    // Four chunks at a time for each thread, and what is kept.
    let same = report("the same", 6 << 20, &vec![chunk_of(1); 200]);
    assert_eq!(same.warnings, []);
    let others = report("others", 48 << 20, &(1..=200).map(chunk_of).collect::<Vec<_>>());
    assert!(others.warnings.iter().any(|w| w.message.contains("32 MiB")), "{:?}", others.warnings);
}

#[test]
fn a_million_faults_are_counted_and_not_listed() {
    let short = record(MESSAGE, b"").repeat(300_000);
    let packed = zstd::bulk::compress(&short, 3).expect("compresses");
    let bad = record(ATTACHMENT, b"").repeat(10_000);
    let bytes = file(&[chunk(b"zstd", short.len() as u64, &packed), bad]);
    let report = measured("faults", 8 << 20, || {
        recordings::on_disk(&bytes, |path| {
            Recording::open(&[path.to_owned()]).map(|r| r.report().clone()).map_err(|e| e.to_string())
        })
    });
    let report = report.expect("an MCAP file");
    let damaged = &report.files[0].damaged;
    assert!(damaged.iter().any(|(_, why)| why.contains("300000")), "{damaged:?}");
    let last = damaged.last().map(|(_, why)| why.as_str());
    assert_eq!((damaged.len(), last), (51, Some("9951 more places of damage from here on")));
    assert_eq!(report.warnings.len(), damaged.len());
}

/// Many entries of an index that lead into the same bytes must not multiply what is read.
#[test]
fn chunks_that_overlap_are_read_once() {
    let schema = record(SCHEMA, &[&[1, 0][..], &text(b"a/b"), &text(b"ros2msg"), &text(b"bool x")].concat());
    let channel = record(CHANNEL, &[&[0, 0, 1, 0][..], &text(b"/a"), &text(b"cdr"), &text(b"")].concat());
    let records = [schema, channel, record(MESSAGE, &[0; 22 + 5])].concat();
    let real = zstd::bulk::compress(&records, 3).expect("compresses");
    // Chunks one in the other: each skips the headers of the next ones as a skippable frame (RFC 8878, 3.1.2).
    let (mut nested, mut starts) = (real.clone(), Vec::new());
    for _ in 0..50 {
        let inside = (nested.len() - real.len()) as u32;
        let skip = [0x184d_2a50_u32, inside].map(u32::to_le_bytes).concat();
        let outer = chunk(b"zstd", records.len() as u64, &[&skip, &nested[..]].concat());
        starts.iter_mut().for_each(|start| *start += outer.len() - nested.len());
        starts.push(0);
        nested = outer;
    }
    // Hidden in a record of unknown kind, so that only the index leads to them.
    let base = MAGIC.len() + header().len() + 9;
    let index = |start: &usize| {
        let place = [(base + start) as u64, (nested.len() - start) as u64].map(u64::to_le_bytes).concat();
        record(0x08, &[&[0; 16][..], &place, &[0; 4 + 8 + 4 + 16]].concat())
    };
    let summary: Vec<u8> = starts.iter().flat_map(index).collect();
    let before = [MAGIC, &header(), &record(0x80, &nested), &record(0x0f, &[0; 4])].concat();
    let footer = record(0x02, &[&(before.len() as u64).to_le_bytes()[..], &[0; 12]].concat());
    let bytes = [&before, &summary, &footer[..], MAGIC].concat();
    let messages = recordings::on_disk(&bytes, |path| {
        let recording = Recording::open(&[path.to_owned()]).expect("an MCAP file");
        recording.report().channels.iter().map(|c| c.messages).sum::<u64>()
    });
    assert_eq!(messages, 1, "one message was written");
}

/// 5^30 messages without bytes, in a schema of a few kilobytes.
#[test]
fn messages_without_bytes_nest_without_end() {
    let separator = "=".repeat(80);
    let nested = |leaf: &str| {
        let mut schema: String = (0..5).map(|i| format!("m/L0 z{i}\n")).collect();
        schema += "string[] name\nfloat64[] position\n";
        for level in 0..28 {
            schema += &format!("{separator}\nMSG: m/L{level}\n");
            (0..5).for_each(|i| schema += &format!("m/L{} f{i}\n", level + 1));
        }
        schema + &format!("{separator}\nMSG: m/L28\n{leaf}")
    };
    let decode = |encoding: &str, leaf: &str| {
        let schema = nested(leaf);
        let wire = if encoding == "ros1msg" { "ros1" } else { "cdr" };
        let plan = Plan::compile(Role::Joints, "m/A", encoding, schema.as_bytes(), wire, None)?;
        plan.decode(&[0, 1, 0, 0, 0, 0, 0, 0], &mut Rows::new(Role::Joints))
    };
    assert_eq!(decode("ros1msg", ""), Err(decode("ros1msg", "").expect_err("256 names do not fit")));
    let zero_length = "uint8[0] a\nuint8[0] b\nuint8[0] c\nuint8[0] d\nuint8[0] e";
    for encoding in ["ros1msg", "ros2msg"] {
        let refused = decode(encoding, zero_length).expect_err("lists without elements").to_string();
        assert!(refused.contains("at least one element"), "{refused}");
    }
    // An empty message of ROS 2 takes a byte, which there are not 5^30 of.
    assert!(decode("ros2msg", "").is_err());
}

/// The full name of each nested message repeats those around it.
#[test]
fn long_names_around_many_messages_stay_small() {
    let nested = |tag: u8, bytes: &[u8]| {
        let mut field = vec![tag << 3 | 2];
        let mut length = bytes.len();
        while length >= 0x80 {
            field.push(length as u8 | 0x80);
            length >>= 7;
        }
        field.push(length as u8);
        [&field, bytes].concat()
    };
    let inner = nested(3, &nested(1, b"i")).repeat(20_000);
    let outer = [nested(1, &[b'o'; 50_000]), inner].concat();
    let set = nested(1, &[nested(4, &outer), nested(4, &nested(1, b"Root"))].concat());
    let found =
        measured("nested names", 200 * set.len(), || readable_as("Root", "protobuf", &set, "protobuf"));
    assert!(found.is_err_and(|e| e.to_string().contains("proportion")));
}

#[test]
fn a_topic_of_megabytes_is_neither_compared_nor_shown_whole() {
    let long = vec![b'j'; 4 << 20];
    let channel = record(CHANNEL, &[&[0; 4][..], &text(&long), &text(b"cdr"), &text(b"")].concat());
    let bytes = file(&[channel]);
    let joints = armcal_recording::JointStream {
        topic: "/joint_states".into(),
        names: vec!["joint1".into()],
        ..Default::default()
    };
    let streams = armcal_recording::Streams { joints: vec![joints], ..Default::default() };
    let said = measured("long topic", 8 * bytes.len(), || {
        recordings::on_disk(&bytes, |path| {
            let recording = Recording::open(&[path.to_owned()]).expect("an MCAP file");
            recording.read(&streams).map(drop).map_err(|e| e.to_string())
        })
    });
    let said = said.expect_err("no such topic");
    assert!(said.len() < 1000 && said.contains("4194304 bytes"), "{}", said.len());
}

/// A message with very many bodies: naming them takes time in proportion.
#[test]
fn very_many_bodies_are_told_in_part() {
    let schema = "m/Body[] markers\n===\nMSG: m/Body\nstring marker_name\nm/Point translation\n===\nMSG: m/Point\n\
                  float64 x\nfloat64 y\nfloat64 z";
    let plan =
        Plan::compile(Role::Pose, "m/Bodies", "ros1msg", schema.as_bytes(), "ros1", None).expect("compiles");
    let bodies = 200_000_u32;
    let mut message = bodies.to_le_bytes().to_vec();
    for body in 0..bodies {
        message.extend(text(body.to_string().as_bytes()));
        message.extend([0; 24]);
    }
    let said = plan.decode(&message, &mut Rows::new(Role::Pose)).expect_err("several bodies").to_string();
    assert!(said.contains("and 199980 more") && said.len() < 2000, "{}", said.len());
}

#[test]
fn a_pipe_is_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.mcap");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.is_ok_and(|s| s.success()), "mkfifo is part of every POSIX system");
    let refused = Recording::open(&[pipe]).err().map(|e| e.to_string());
    assert!(refused.is_some_and(|e| e.contains("pipe.mcap") && e.contains("copy it into a file")));
    assert!(Recording::open(&["/dev/zero".into()]).is_err());
}
