//! How much memory reading takes, over the size of the recording: the same joint samples among ever more camera images.
//!
//! `cargo run --release -p armcal-recording --example peak_memory [FOLDER]` generates recordings of 10 MB, 100 MB and
//! 1 GB, one after the other, in the folder (default: the one for temporary files), reads each in a process of its own,
//! mapped and by ranges, prints the peak resident memory (Linux: `VmHWM`), and removes it. The same bytes every time.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a program that measures says what it measured")]

use armcal_recording::output::McapOutput;
use armcal_recording::ros2::{self, Header};
use armcal_recording::{Access, Extract, JointStream, Recording, Streams, extract};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Joint samples of every recording: 200 s at 100 Hz.
const SAMPLES: u64 = 20_000;
const IMAGE_BYTES: u64 = 200_000;
const MB: u64 = 1_000_000;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["read", how, path] => read(how, Path::new(path)),
        [folder] => measure(Path::new(folder)),
        _ => measure(&std::env::temp_dir()),
    }
}

fn measure(folder: &Path) {
    let path = folder.join(format!("armcal-peak-memory-{}.mcap", std::process::id()));
    println!("file [MB]  how      joint samples  peak resident memory [MB]");
    for size_mb in [10, 100, 1000] {
        generate(&path, size_mb * MB);
        for how in ["mapped", "ranges", "extract"] {
            let program = std::env::current_exe().unwrap();
            let output =
                Command::new(program).args(["read".as_ref(), how.as_ref(), path.as_os_str()]).output();
            let said = String::from_utf8(output.unwrap().stdout).unwrap();
            println!("{size_mb:9}  {how:7}  {}", said.trim());
        }
    }
    std::fs::remove_file(&path).unwrap();
}

/// Joint states among images that do not compress.
fn generate(path: &Path, bytes: u64) {
    let mut out = McapOutput::create(path, "ros2").unwrap();
    let schema = ros2::JOINT_STATE;
    let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
    let joints =
        out.add_channel("/joint_states", Some(schema), ros2::MESSAGE_ENCODING, &BTreeMap::new()).unwrap();
    let camera = out.add_channel("/camera", None, "jpeg", &BTreeMap::new()).unwrap();
    let images = (bytes / IMAGE_BYTES).max(1);
    let (mut written, mut random) = (0, 1_u64);
    let mut image = vec![0; IMAGE_BYTES as usize];
    for i in 0..SAMPLES {
        let time_ns = 1_000_000_000_000 + i * 10_000_000;
        let q = (i as f64 * 1e-3).sin();
        let header = Header { stamp_ns: time_ns as i64, frame_id: "" };
        let data = ros2::joint_state(header, &["j1", "j2", "j3"], &[q, -q, 0.5 * q], &[], &[]);
        out.put(joints, 0, time_ns, time_ns, &data).unwrap();
        while written * SAMPLES < images * i {
            for word in image.chunks_exact_mut(8) {
                random =
                    random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                word.copy_from_slice(&(random ^ random >> 29).to_le_bytes());
            }
            out.put(camera, 0, time_ns, time_ns, &image).unwrap();
            written += 1;
        }
    }
    out.finish().unwrap();
}

fn read(how: &str, path: &Path) {
    let access = if how == "ranges" { Access::Ranges } else { Access::Mapped };
    let recording = Recording::open_with(&[PathBuf::from(path)], access).unwrap();
    let names = ["j1", "j2", "j3"].map(str::to_owned).to_vec();
    let joints = JointStream { topic: "/joint_states".to_owned(), names, ..JointStream::default() };
    let streams = Streams { joints: vec![joints], ..Streams::default() };
    let samples = match how {
        "extract" => {
            let thin = path.with_extension("thin.mcap");
            let wanted = Extract { topics: &["/joint_states".to_owned()], attachments: false };
            let count = extract(&recording, &wanted, &thin).unwrap().topics[0].1;
            std::fs::remove_file(thin).unwrap();
            count
        }
        _ => recording.read(&streams).unwrap().0.joints.time_ns.len() as u64,
    };
    assert!(recording.report().warnings.is_empty());
    println!("{samples:13}  {:25.1}", peak_mb());
}

/// Peak resident memory of this process; not a number where the system does not say.
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kib = line.and_then(|line| line.split_whitespace().nth(1)).and_then(|kib| kib.parse::<f64>().ok());
    kib.map_or(f64::NAN, |kib| kib * 1024.0 / 1e6)
}
