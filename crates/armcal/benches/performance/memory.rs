//! Peak resident memory over the size of the recordings: a session of the lab with ever more camera images between its
//! messages, read and run by children of this program that tell their own high-water mark.

use crate::page::{Section, Table};
use crate::{Options, Result, recordings};
use armcal::cli::Cli;
use armcal::commands;
use armcal_lab::scenario::{Design, Scenario, seal};
use clap::Parser as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// First argument of a child: the rest is an armcal command line.
pub const CHILD: &str = "as-armcal";

/// Sizes of the recording [MB].
const SIZES_MB: [u64; 3] = [10, 100, 1000];

/// Runs armcal in this process and tells its high-water mark on stderr.
pub fn child(arguments: &[String]) -> Result<()> {
    let cli = Cli::try_parse_from([String::from("armcal")].iter().chain(arguments))?;
    commands::dispatch(&cli)?;
    let status = std::fs::read_to_string("/proc/self/status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("no VmHWM")?;
    eprintln!("VmHWM:{peak}");
    Ok(())
}

pub fn section(options: &Options) -> Result<Section> {
    let mut section = Section::new("Memory");
    section.say(
        "Peak resident set (VmHWM) of one process, one recording of 66 dwells whose joint and tracker messages are the same \
         at every size; the rest are camera images. `inspect` makes a full pass and hashes the file; `run` reads, calibrates, \
         diagnoses and writes every output, `run.mcap` with the streams included. Pages of the mapped file count as resident \
         although the system may take them back at any time.",
    );
    let mut table = Table::new(&["recording [MB]", "inspect [MiB]", "run [MiB]"]);
    let folder = options.data.join("memory");
    let lab = folder.join("lab");
    if !lab.join("pipeline.toml").exists() {
        seal(&Scenario::new("nothing", Design::OneTiltBothWays, 1), &lab, &folder.join("truth.json"))?;
    }
    for size_mb in SIZES_MB {
        let (recording, pipeline) = place(&lab, &folder, size_mb)?;
        let out = folder.join("out");
        let inspect = peak_mib(&["inspect".as_ref(), recording.as_os_str()])?;
        let run = peak_mib(&["run".as_ref(), pipeline.as_os_str(), "--out".as_ref(), out.as_os_str()])?;
        let megabytes = std::fs::metadata(&recording)?.len() as f64 * 1e-6;
        table.row([format!("{megabytes:.0}"), format!("{inspect:.0}"), format!("{run:.0}")]);
        // A gigabyte is quickly made again and long in the way.
        std::fs::remove_dir_all(&out)?;
        std::fs::remove_file(&recording)?;
    }
    section.table(table);
    Ok(section)
}

/// A folder with the session's pipeline and its recording grown to a size.
fn place(lab: &Path, folder: &Path, size_mb: u64) -> Result<(PathBuf, PathBuf)> {
    let place = folder.join(format!("{size_mb}mb"));
    std::fs::create_dir_all(&place)?;
    let mut recording = None;
    for entry in std::fs::read_dir(lab)? {
        let from = entry?.path();
        let to = place.join(from.file_name().ok_or("a file without a name")?);
        if from.extension().is_some_and(|e| e == "mcap") {
            recordings::with_camera(&from, &to, size_mb * 1_000_000, 1)?;
            recording = Some(to);
        } else {
            std::fs::copy(&from, &to)?;
        }
    }
    let recording = recording.ok_or("the lab left no recording")?;
    Ok((recording, place.join("pipeline.toml")))
}

fn peak_mib(arguments: &[&std::ffi::OsStr]) -> Result<f64> {
    let output = Command::new(std::env::current_exe()?).arg(CHILD).args(arguments).output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let peak = said.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = peak
        .and_then(|text| text.trim().strip_suffix(" kB"))
        .ok_or_else(|| format!("armcal {arguments:?} did not finish: {said}"))?;
    Ok(kib.trim().parse::<f64>()? / 1024.0)
}
