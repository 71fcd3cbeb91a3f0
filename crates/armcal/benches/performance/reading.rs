//! Reading two streams into columns, beside a bare walk over the same chunks and beside the readers of Python.

use crate::clock::{Spent, median, spent};
use crate::page::{Bar, Section, Table, seconds};
use crate::peers::{Python, number};
use crate::recordings::{self, JOINT_NAMES, JOINTS, TIP};
use crate::walk::walk;
use crate::{Options, Result};
use armcal_core::Samples;
use armcal_recording::{JointStream, PoseStream, Recording, Streams, sha256_of};
use rayon::ThreadPool;
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use std::path::{Path, PathBuf};

/// Rounds of the in-process readers, each reader once a round so that a busy machine hits all alike.
const ROUNDS: usize = 9;
/// What takes its turn in a round.
const READERS: [&str; 5] = [
    "armcal, to columns",
    "armcal, with identity",
    "bare: inflate and walk",
    "bare, and check the CRC",
    "SHA-256 of the file",
];

/// The recording that is read, made where it is not there.
pub fn placed(options: &Options) -> Result<PathBuf> {
    let path = options.data.join(format!("streams-{}mb-seed1.mcap", options.size_mb));
    recordings::streams(&path, options.size_mb * 1_000_000, 1)?;
    Ok(path)
}

pub fn section(options: &Options) -> Result<Section> {
    let path = placed(options)?;
    let bytes = std::fs::metadata(&path)?.len();
    let samples = read(&path, false)?;
    let mut section = Section::new("Reading two streams into columns");
    section.say(format!(
        "One recording of {:.3} GB: {} joint states (1 kHz, 3 joints with efforts), {} poses of the tip (250 Hz), camera \
         images (30 Hz, JPEG-like) between them; ROS 2 CDR, chunks of 1 MiB by zstd, in the page cache. armcal opens the \
         file, checks the CRC of every chunk, decodes, sorts, judges clocks and occlusion (`Recording::open` + `read`); \
         with identity it also hashes each chunk by BLAKE3 before it inflates it, and reports (`report`), as every command does. \
         The bare walk inflates the same chunks from the same mapping with the same threads and steps over their records, \
         and does nothing else. SHA-256 is that of the crate sha2, alone. Medians of {ROUNDS} rounds.",
        bytes as f64 * 1e-9,
        samples.joints.len(),
        samples.tip.as_ref().map_or(0, |t| t.len()),
    ));
    let threads = std::thread::available_parallelism()?.get();
    let mut table = Table::new(&["reader", "threads", "wall [s]", "CPU [s]", "GB/s", "to armcal"]);
    let (mut fastest, mut one_thread_s, mut one_thread_walk_s) = (None, None, None);
    let mut counts = vec![1, 2, threads];
    counts.retain(|count| *count <= threads);
    counts.dedup();
    for threads in counts {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let all @ [ours, identified, bare, checked, _] = rounds(&pool, &path)?;
        for (name, it) in READERS.into_iter().zip(all) {
            row(&mut table, name, threads, it, bytes, ours);
        }
        let rows = samples.joints.len() + samples.tip.as_ref().map_or(0, |tip| tip.len());
        for (what, it, limit) in [("reading", ours, 1.5), ("reading with identity", identified, 2.0)] {
            let ratio = it.wall_s / bare.wall_s;
            let bar = Bar {
                what: format!("{what} within {limit}x of inflating and walking, {threads} threads"),
                limit: format!("<= {limit}"),
                measured: format!("{ratio:.2} (CPU {:.2})", it.cpu_s / bare.cpu_s),
                met: ratio <= limit,
            };
            let hashed_s = it.cpu_s - ours.cpu_s;
            section.bar_of(bar, || beside_the_walk(ours, [bare, checked], hashed_s, (limit, rows)));
        }
        let faster = *one_thread_s.get_or_insert(identified.wall_s) / identified.wall_s;
        if threads == 2 {
            let bar = Bar {
                what: format!("reading with identity faster on {threads} threads than on one"),
                limit: ">= 1.8".into(),
                measured: format!("{faster:.2}"),
                met: faster >= 1.8,
            };
            let walk_alone = one_thread_walk_s.unwrap_or(bare.wall_s) / bare.wall_s;
            section.bar_of(bar, || {
                format!(
                    "the bare walk over the same chunks is {walk_alone:.2} times as fast on {threads} threads, which share the \
                     machine's memory"
                )
            });
        }
        if threads == 1 {
            one_thread_walk_s = Some(bare.wall_s);
            section.say(shares(ours, bare, checked));
        }
        fastest = Some(ours);
    }
    if let Some(ours) = fastest {
        python(options, &path, &samples, (ours, bytes), &mut section, &mut table)?;
    }
    section.table(table);
    Ok(section)
}

/// Where armcal's time goes.
fn shares(ours: Spent, bare: Spent, checked: Spent) -> String {
    let percent = |wall_s: f64| 100.0 * wall_s / ours.wall_s;
    format!(
        "Of armcal's time on one thread, inflating and walking are {:.0} %, the CRC {:.0} %, and what is done with messages, \
         columns and clocks {:.0} %. The images are random bytes, which zstd stores as they are: inflating could hardly be \
         cheaper, so that everything else weighs most here.",
        percent(bare.wall_s),
        percent(checked.wall_s - bare.wall_s),
        percent(ours.wall_s - checked.wall_s),
    )
}

/// What a reader does beside the walk, and what a bar leaves for it, in CPU time.
fn beside_the_walk(
    ours: Spent,
    [bare, checked]: [Spent; 2],
    hashed_s: f64,
    (limit, rows): (f64, usize),
) -> String {
    let by_row_ns = |cpu_s: f64| cpu_s * 1e9 / rows as f64;
    let must_s = checked.cpu_s - bare.cpu_s + hashed_s;
    let must = if hashed_s > 0.0 { "the walk, the CRC and the hash" } else { "the walk and the CRC" };
    format!(
        "decoding, sorting and judging take {:.0} ns of CPU a row; the bar leaves them {:.0} ns beside {must}, without \
         which no reader says that it read what was written: these alone are {:.2}x",
        by_row_ns(ours.cpu_s - checked.cpu_s),
        by_row_ns((limit - 1.0) * bare.cpu_s - must_s).max(0.0),
        1.0 + must_s / bare.cpu_s,
    )
}

/// The [`READERS`], one after the other, [`ROUNDS`] times.
fn rounds(pool: &ThreadPool, path: &Path) -> Result<[Spent; 5]> {
    let one = |reader: usize| -> Result<()> {
        match reader {
            0 => _ = read(path, false)?,
            1 => _ = read(path, true)?,
            2 | 3 => _ = walk(path, reader == 3)?,
            _ => _ = sha256_of(path)?,
        }
        Ok(())
    };
    let mut times: [Vec<Spent>; 5] = Default::default();
    for _ in 0..ROUNDS {
        for (reader, times) in times.iter_mut().enumerate() {
            let (done, took) = spent(|| pool.install(|| one(reader)));
            done?;
            times.push(took);
        }
    }
    Ok(times.map(|times| median(&times)))
}

fn python(
    options: &Options,
    path: &Path,
    samples: &Samples,
    (ours, bytes): (Spent, u64),
    section: &mut Section,
    table: &mut Table,
) -> Result<()> {
    let Some(python) = Python::find(options)? else {
        section.skipped("the Python readers: no Python with `benches/peers/requirements.txt` could be made");
        return Ok(());
    };
    for (name, script) in
        [("Python: mcap + mcap_ros2", "read_mcap_ros2.py"), ("Python: rosbags", "read_rosbags.py")]
    {
        let said = python.run(script, path)?;
        same_columns(name, &said, samples)?;
        let took = Spent { wall_s: number(&said, "wall_s")?, cpu_s: number(&said, "cpu_s")? };
        row(table, name, 1, took, bytes, ours);
        let ratio = took.wall_s / ours.wall_s;
        section.bar(Bar {
            what: format!("reading faster than {name}"),
            limit: ">= 20".into(),
            measured: format!("{ratio:.0}"),
            met: ratio >= 20.0,
        });
    }
    section.say(
        "All readers returned the same columns: the same rows, and the same bits (SHA-256 over stamps, positions, efforts \
         and tip positions), asserted in the run."
            .to_owned(),
    );
    Ok(())
}

fn row(table: &mut Table, name: &str, threads: usize, it: Spent, bytes: u64, ours: Spent) {
    let rate = bytes as f64 * 1e-9 / it.wall_s;
    let ratio = it.wall_s / ours.wall_s;
    let cells = [name.to_owned(), threads.to_string(), seconds(it.wall_s), seconds(it.cpu_s)];
    table.row(cells.into_iter().chain([format!("{rate:.2}"), format!("{ratio:.2}")]));
}

/// The two streams as a pipeline reads them, alone or with what identifies the file.
pub fn read(path: &Path, identity: bool) -> Result<Samples> {
    let streams = Streams {
        joints: vec![JointStream {
            topic: JOINTS.to_owned(),
            names: JOINT_NAMES.map(str::to_owned).into(),
            ..JointStream::default()
        }],
        tip: Some(PoseStream { topic: TIP.to_owned(), ..PoseStream::default() }),
        ..Streams::default()
    };
    let recording = Recording::open(&[path.to_owned()])?;
    if identity {
        let (samples, _, _) = recording.read(&streams)?;
        recording.report();
        return Ok(samples);
    }
    Ok(recording.without_identity().read(&streams)?.0)
}

/// Fails where a peer read something else than armcal.
fn same_columns(peer: &str, said: &Value, samples: &Samples) -> Result<()> {
    let (joints, tip) = (&samples.joints, samples.tip.as_ref().ok_or("armcal read no tip")?);
    let effort = joints.effort_nm.as_ref().ok_or("armcal read no efforts")?;
    let turns = tip.orientation.as_ref().ok_or("armcal read no orientations")?;
    let mut hash = Sha256::new();
    joints.time_ns.iter().for_each(|t| hash.update(t.to_le_bytes()));
    joints.joint_rad.iter().chain(effort).flatten().for_each(|v| hash.update(v.to_le_bytes()));
    tip.time_ns.iter().for_each(|t| hash.update(t.to_le_bytes()));
    tip.position_m.iter().flat_map(|p| p.iter()).for_each(|v| hash.update(v.to_le_bytes()));
    let hash: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    let rows = [joints.len() as f64, tip.len() as f64];
    // armcal normalises quaternions, which moves their last bits.
    let sum: f64 = turns.iter().map(|q| q.coords.sum()).sum();
    let same = said["sha256"] == hash.as_str()
        && [number(said, "joint_rows")?, number(said, "tip_rows")?] == rows
        && (number(said, "quaternion_sum")? - sum).abs() <= 1e-9 * rows[1];
    if same {
        Ok(())
    } else {
        Err(format!("{peer} read other columns: {said}; armcal: {rows:?} rows, {hash}, {sum}").into())
    }
}
