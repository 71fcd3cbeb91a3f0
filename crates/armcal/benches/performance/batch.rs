//! `armcal batch` over threads and over recordings, each time from nothing.

use crate::child::{Cost, armcal};
use crate::page::{Bar, Section, Table, seconds};
use crate::{Options, Result};
use armcal_lab::planted::seal;
use armcal_lab::scenario::{Design, Scenario};
use rayon::prelude::*;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Different recordings; more of them are the same files under other names, each calibrated by itself all the same.
const DIFFERENT: u64 = 20;
/// Recordings that threads are compared on.
const FOR_THREADS: usize = 100;
/// Numbers of recordings with all threads.
const RECORDINGS: [usize; 3] = [10, 100, 1000];
/// The most recordings may take this many times the memory of the fewest.
const FLAT: f64 = 1.1;
/// Time on a processor that a recording may take [s].
const CPU_S: f64 = 0.04;

pub fn section(options: &Options) -> Result<Section> {
    let mut section = Section::new("Batch");
    section.say(format!(
        "`armcal batch` of recordings of the paper's rig (33 dwells, one tilt), from an empty folder to the campaign's table \
         and page, the start of the process included. {DIFFERENT} recordings are different, the others are the same files \
         under other names and worked on in full. Efficiency is T(1) / (p T(p)); CPU over p T(p) says how busy the cores \
         were, so that an efficiency below it was lost to other programs or to memory, not to waiting.",
    ));
    threads(options, &mut section)?;
    recordings(options, &mut section)?;
    Ok(section)
}

fn threads(options: &Options, section: &mut Section) -> Result<()> {
    let all = std::thread::available_parallelism()?.get();
    let count = FOR_THREADS.min(options.recordings);
    let mut table =
        Table::new(&["threads", "recordings", "wall [s]", "CPU [s]", "per second", "efficiency", "busy"]);
    let mut one_s = None;
    let mut counts = vec![1, 2, all];
    counts.retain(|p| *p <= all);
    counts.dedup();
    for threads in counts {
        let cost = batch(options, count, threads)?;
        let wall_s = cost.spent.wall_s;
        let core_s = wall_s * threads as f64;
        let efficiency = *one_s.get_or_insert(wall_s) / core_s;
        table.row([
            threads.to_string(),
            count.to_string(),
            seconds(wall_s),
            seconds(cost.spent.cpu_s),
            format!("{:.2}", count as f64 / wall_s),
            format!("{:.0} %", 100.0 * efficiency),
            format!("{:.0} %", 100.0 * cost.spent.cpu_s / core_s),
        ]);
        if threads == 1 {
            let each_s = cost.spent.cpu_s / count as f64;
            let bar = Bar {
                what: format!("CPU time of a recording in a batch of {count}, one thread"),
                limit: format!("<= {CPU_S} s"),
                measured: format!("{each_s:.3} s"),
                met: each_s <= CPU_S,
            };
            section.bar_of(bar, || {
                "its stages and its floor are the first column of the table in \"Where the time goes\""
                    .to_owned()
            });
        }
        if threads == all {
            section.bar(Bar {
                what: format!("batch of {count} recordings, efficiency of {threads} threads"),
                limit: "> 90 %".into(),
                measured: format!("{:.0} %", 100.0 * efficiency),
                met: efficiency > 0.9,
            });
        }
    }
    section.table(table);
    Ok(())
}

fn recordings(options: &Options, section: &mut Section) -> Result<()> {
    let all = std::thread::available_parallelism()?.get();
    let mut table = Table::new(&["recordings", "threads", "wall [s]", "per second", "peak memory [MiB]"]);
    let mut peaks_mib = Vec::new();
    for count in RECORDINGS.into_iter().filter(|count| *count <= options.recordings) {
        let cost = batch(options, count, all)?;
        table.row([
            count.to_string(),
            all.to_string(),
            seconds(cost.spent.wall_s),
            format!("{:.2}", count as f64 / cost.spent.wall_s),
            format!("{:.0}", cost.peak_mib),
        ]);
        peaks_mib.push((count, cost.peak_mib));
    }
    section.table(table);
    if let [(few, first), .., (many, last)] = peaks_mib.as_slice() {
        let ratio = last / first;
        let bar = Bar {
            what: format!("memory of a batch of {many} recordings to one of {few}"),
            limit: format!("flat (<= {FLAT})"),
            measured: format!("{ratio:.2}"),
            met: ratio <= FLAT,
        };
        section.bar_of(bar, || {
            let each_kib = (last - first) * 1024.0 / (many - few) as f64;
            format!("each recording more takes {each_kib:.0} KiB: {first:.0} MiB of {few} became {last:.0} of {many}")
        });
    }
    Ok(())
}

/// One batch from nothing.
fn batch(options: &Options, count: usize, jobs: usize) -> Result<Cost> {
    let out = options.data.join("batch/campaign");
    if out.exists() {
        std::fs::remove_dir_all(&out)?;
    }
    let cost = armcal(arguments(options, count, jobs, &out)?)?;
    std::fs::remove_dir_all(&out)?;
    Ok(cost)
}

/// The command line of a batch of so many recordings, which are placed.
pub fn arguments(options: &Options, count: usize, jobs: usize, out: &Path) -> Result<Vec<OsString>> {
    let folder = options.data.join("batch");
    let (made, work) = (make(&folder)?, folder.join(format!("work-{count}")));
    if work.exists() {
        std::fs::remove_dir_all(&work)?;
    }
    std::fs::create_dir_all(&work)?;
    for i in 0..count {
        // No copies: a thousand recordings would fill the disk.
        std::fs::hard_link(&made[i % made.len()], work.join(format!("recording{i:04}.mcap")))?;
    }
    let (pattern, pipeline, jobs) = (work.join("*.mcap"), folder.join("1/pipeline.toml"), jobs.to_string());
    Ok(vec![
        "batch".into(),
        pattern.into(),
        "--pipeline".into(),
        pipeline.into(),
        "--jobs".into(),
        jobs.into(),
        "--out".into(),
        out.into(),
    ])
}

/// The pipeline of one of the recordings, which is made where it is not there.
pub fn one(options: &Options) -> Result<PathBuf> {
    let folder = options.data.join("batch");
    make(&folder)?;
    Ok(folder.join("1/pipeline.toml"))
}

/// The different recordings; all are of one pipeline, that of the first.
fn make(folder: &Path) -> Result<Vec<PathBuf>> {
    let one = |seed: u64| -> Result<PathBuf> {
        let place = folder.join(seed.to_string());
        if !place.join("pipeline.toml").exists() {
            let scenario = Scenario::new("nothing", Design::OneTiltOnePass, seed);
            seal(&scenario, &place, &folder.join(format!("truth-{seed}.json")))?;
        }
        let mut files = std::fs::read_dir(&place)?.flatten().map(|entry| entry.path());
        let recording = files.find(|path| path.extension().is_some_and(|e| e == "mcap"));
        recording.ok_or_else(|| "the lab left no recording".into())
    };
    (1..=DIFFERENT).into_par_iter().map(one).collect()
}
