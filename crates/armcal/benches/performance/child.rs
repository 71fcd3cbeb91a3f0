//! armcal as a process of its own, which tells what it cost: this program again, called with an armcal command line.

use crate::clock::{self, Spent};
use crate::{Result, process};
use armcal::cli::Cli;
use clap::Parser as _;
use std::ffi::OsStr;
use std::process::Command;
use std::time::Instant;

/// First argument of a child: the rest is an armcal command line.
pub const CHILD: &str = "as-armcal";

/// What a command cost.
pub struct Cost {
    /// Its time, from start to end of the process.
    pub spent: Spent,
    /// High-water mark of its resident memory [MiB].
    pub peak_mib: f64,
}

/// The child's side: runs the command, and ends stderr with its high-water mark [MiB] and processor time [s].
pub fn run(arguments: &[String]) -> Result<()> {
    let cli = Cli::try_parse_from([String::from("armcal")].iter().chain(arguments))?;
    armcal::dispatch::dispatch(&cli)?;
    let peak_mib = process::high_water_mib("/proc/self/status").ok_or("no VmHWM")?;
    eprintln!("\n{CHILD} {peak_mib} {}", clock::process_cpu_s()?);
    Ok(())
}

/// Runs an armcal command in a child.
pub fn armcal<I: IntoIterator<Item = S>, S: AsRef<OsStr>>(arguments: I) -> Result<Cost> {
    told(Command::new(std::env::current_exe()?).arg(CHILD).args(arguments))
}

/// The same with one thread.
pub fn armcal_on_one<I: IntoIterator<Item = S>, S: AsRef<OsStr>>(arguments: I) -> Result<Cost> {
    told(Command::new(std::env::current_exe()?).arg(CHILD).args(arguments).env("RAYON_NUM_THREADS", "1"))
}

fn told(command: &mut Command) -> Result<Cost> {
    let began = Instant::now();
    let output = command.output()?;
    let wall_s = began.elapsed().as_secs_f64();
    let said = String::from_utf8_lossy(&output.stderr);
    let told = said.lines().last().and_then(|line| line.strip_prefix(CHILD)?.trim().split_once(' '));
    let Some((peak_mib, cpu_s)) = told.filter(|_| output.status.success()) else {
        return Err(format!("{command:?} did not finish: {said}").into());
    };
    Ok(Cost { spent: Spent { wall_s, cpu_s: cpu_s.parse()? }, peak_mib: peak_mib.parse()? })
}
