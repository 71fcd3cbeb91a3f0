//! No target: writes what fuzzing starts from into `grown/` when it is run with `-runs=0`. Small recordings made here, and
//! the files that the repository ships. It is built like a target because instrumented crates link only so.
#![no_main]

use armcal_fuzz::structured;
use armcal_recording::output::McapOutput;
use armcal_recording::ros2::{self, Header, Schema};
use std::collections::BTreeMap;
use std::path::Path;

type Any<T> = Result<T, Box<dyn std::error::Error>>;

libfuzzer_sys::fuzz_target!(init: write().expect("writing the seeds"), |_bytes: &[u8]| {});

fn write() -> Any<()> {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR"));
    recordings(fuzz)?;
    bags(fuzz)?;
    messages(fuzz)?;
    #[cfg(feature = "files")]
    written(fuzz)?;
    Ok(())
}

/// Files that people write, and results.
#[cfg(feature = "files")]
fn written(fuzz: &Path) -> Any<()> {
    let repository = fuzz.join("../../..");
    let shipped = |pattern: &str| files(&repository.join("pipelines").join(pattern));
    for path in shipped("")? {
        let two_arms = path.ends_with("two-arms.toml");
        seed(fuzz, "pipeline", two_arms.into(), &std::fs::read(path)?)?;
    }
    for path in shipped("lab")? {
        let two_arms = path.ends_with("two-arms.toml");
        seed(fuzz, "pipeline", 2 + u8::from(two_arms), &std::fs::read(path)?)?;
    }
    for (kind, folder) in [(0, "boards"), (1, "models")] {
        for path in shipped(folder)? {
            seed(fuzz, "geometry", kind, &std::fs::read(path)?)?;
        }
    }
    seed(fuzz, "geometry", 2, include_bytes!("../seeds/arm.urdf"))?;
    seed(fuzz, "geometry", 3, b"name, x_m, y_m, z_m, qx, qy, qz, qw, t_s\na, 0.4, -0.1, 0.2, 0, 0, 0, 1, 0.0\n")?;
    seed(fuzz, "geometry", 4, b"[[targets]]\nname = 'a'\nxyz_m = [0.4, -0.1, 0.2]\nt_s = 0.0\n")?;
    seed(fuzz, "results", 3, include_bytes!("../seeds/effects.toml"))?;
    for entry in armcal_model::catalogue() {
        for word in [entry.name.to_owned(), format!("{}:1@0.3", entry.name), format!("{}:joint2,period=2", entry.name)] {
            seed(fuzz, "results", 2, word.as_bytes())?;
        }
    }
    // Results of a run, where one has been made.
    for (kind, name) in [(0, "model.json"), (1, "summary.json")] {
        if let Ok(text) = std::fs::read(repository.join("out").join(name)) {
            seed(fuzz, "results", kind, &text)?;
        }
    }
    Ok(())
}

#[cfg(feature = "files")]
fn files(folder: &Path) -> Any<Vec<std::path::PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        files.push(entry?.path());
    }
    files.retain(|path| path.is_file());
    files.sort();
    Ok(files)
}

/// Writes one seed, its kind before it, under a name made of its content.
#[cfg(feature = "files")]
fn seed(fuzz: &Path, target: &str, kind: u8, bytes: &[u8]) -> Any<()> {
    put(fuzz, target, &[&[kind], bytes].concat())
}

fn put(fuzz: &Path, target: &str, bytes: &[u8]) -> Any<()> {
    let folder = fuzz.join("grown").join(target);
    std::fs::create_dir_all(&folder)?;
    Ok(std::fs::write(folder.join(format!("seed-{:08x}", crc32fast::hash(bytes))), bytes)?)
}

fn recordings(fuzz: &Path) -> Any<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("small.mcap");
    let mut out = McapOutput::create(&path, "ros2")?;
    let nothing = BTreeMap::new();
    let mut channel = |topic: &str, schema: &Schema| {
        let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
        out.add_channel(topic, Some(schema), ros2::MESSAGE_ENCODING, &nothing)
    };
    let joints = channel("/joint_states", &ros2::JOINT_STATE)?;
    let tip = channel("/tip", &ros2::POSE_STAMPED)?;
    let temperature = channel("/temperature", &ros2::TEMPERATURE)?;
    for i in 0..30_u32 {
        let log_ns = 1_000_000_000 + u64::from(i) * 10_000_000;
        let (header, x) = (Header { stamp_ns: log_ns as i64, frame_id: "world" }, f64::from(i) * 1e-3);
        let state = ros2::joint_state(header, &["joint1", "joint2"], &[x, -x], &[0.1, 0.1], &[]);
        out.put(joints, i, log_ns, log_ns, &state)?;
        let header = Header { stamp_ns: log_ns as i64, frame_id: "world" };
        out.put(tip, i, log_ns, log_ns, &ros2::pose_stamped(header, [x, 0.2, 0.3], [0.0, 0.0, 0.0, 1.0]))?;
        let header = Header { stamp_ns: log_ns as i64, frame_id: "" };
        out.put(temperature, i, log_ns, log_ns, &ros2::temperature(header, 21.0 + x, 0.01))?;
    }
    out.attach("notes.txt", "text/plain", 1, 1, b"a note")?;
    out.metadata("about", &BTreeMap::from([("key".to_owned(), "value".to_owned())]))?;
    out.finish()?;
    put(fuzz, "recording", &std::fs::read(&path)?)?;
    // Schemas, channels, messages outside and inside chunks of each compression, an attachment, and the end.
    for compression in 0..3 {
        for chunked in [false, true] {
            let mut orders = if chunked { vec![6] } else { Vec::new() };
            for kind in 0..3 {
                orders.extend([0, kind, 1, kind, kind + 1, 0]);
                for time in 0..4 {
                    orders.extend([2, kind, 0, time, 0, 1, 0, 2, 0, 3, kind]);
                }
            }
            orders.extend([5, compression, 8, 0, 2, 7, 7, 11, 0, 12, 0, 12, 0]);
            put(fuzz, "records", &orders)?;
            put(fuzz, "recording", &structured::mcap(&orders).bytes)?;
        }
    }
    Ok(())
}

/// Rows of both topics, with a description and a log or without; then one of the ways in which they break.
fn bags(fuzz: &Path) -> Any<()> {
    let breaks: [&[u8]; 7] =
        [&[], &[2, 40], &[5, 8, 9, 0, 3], &[6, 12, 0, 0, 3], &[7, 30, 0, 0, 0], &[133, 2, 9, 0, 3], &[135, 9, 0, 0, 0]];
    for described in [0, 1] {
        for log in [&[][..], &[3, 8, 20, 30, 4, 0, 9, 40]] {
            for broken in breaks {
                put(fuzz, "bag", &[&[described, 0, 31, 40, 8, 31, 90, 0, 31, 200], log, broken].concat())?;
            }
        }
    }
    Ok(())
}

/// A schema and a message of it, in each encoding.
fn messages(fuzz: &Path) -> Any<()> {
    let header = || Header { stamp_ns: 1_500_000_000, frame_id: "world" };
    let joints = ros2::joint_state(header(), &["a", "b"], &[1.0, 2.0], &[0.0, 0.0], &[3.0, 4.0]);
    let pose = ros2::pose_stamped(header(), [1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]);
    let transform = ros2::transform_stamped(header(), "tip", [1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]);
    for (schema, message) in
        [(&ros2::JOINT_STATE, joints), (&ros2::POSE_STAMPED, pose), (&ros2::TRANSFORM_STAMPED, transform)]
    {
        // The same bytes behind the encapsulation header are nearly a ROS 1 message.
        for encoding in [0, 1] {
            let message = &message[4 * usize::from(encoding)..];
            case(fuzz, encoding, schema.name, schema.text.as_bytes(), message)?;
        }
    }
    let bodies = "Body[] markers\n===\nMSG: m/Body\nstring marker_name\nm/Point translation\n===\nMSG: m/Point\nfloat64 x\nfloat64 y\nfloat64 z";
    let body = [&[4, 0, 0, 0, b't', b'i', b'p', 0][..], &[0; 24]].concat();
    let list = [&[0, 1, 0, 0, 2, 0, 0, 0][..], &body, &[0; 4], &body].concat();
    case(fuzz, 0, "m/Bodies", bodies.as_bytes(), &list)?;
    // message A { string name = 1; double value... } as its descriptor set: joints { name, position } repeated.
    let field = |name: &str, number: u8, label: u8, kind: u8, of: &str| {
        let mut f = vec![0x0a, name.len() as u8];
        f.extend(name.bytes());
        f.extend([0x18, number, 0x20, label, 0x28, kind]);
        if !of.is_empty() {
            f.extend([0x32, of.len() as u8]);
            f.extend(of.bytes());
        }
        nested(2, &f)
    };
    let joint = [nested(1, b"J"), field("name", 1, 1, 9, ""), field("position", 2, 1, 1, "")].concat();
    let list = [nested(1, b"S"), field("joints", 1, 3, 11, ".J")].concat();
    let file = [nested(4, &joint), nested(4, &list), nested(12, b"proto3")].concat();
    let one = |name: &[u8]| nested(1, &[nested(1, name), [&[0x11][..], &1.5_f64.to_le_bytes()].concat()].concat());
    case(fuzz, 2, "S", &nested(1, &file), &[one(b"a"), one(b"b")].concat())?;
    let schema = br#"{"type":"object","properties":{"name":{"type":"array","items":{"type":"string"}},"position":{"type":"array","items":{"type":"number"}}}}"#;
    case(fuzz, 3, "json", schema, br#"{"name":["a","b"],"position":[1.5,-2]}"#)
}

fn nested(tag: u8, bytes: &[u8]) -> Vec<u8> {
    [&[tag << 3 | 2, bytes.len() as u8][..], bytes].concat()
}

fn case(fuzz: &Path, encoding: u8, name: &str, schema: &[u8], message: &[u8]) -> Any<()> {
    let head = [encoding, name.len() as u8];
    let length = (schema.len() as u16).to_le_bytes();
    put(fuzz, "message", &[&head[..], name.as_bytes(), &length, schema, message].concat())
}
