//! A program run to its end, and what that took.

use crate::Result;
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often the high-water mark of a process is looked at.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// Field of proc(5)'s stat where the times of all ended children begin.
const OF_CHILDREN: usize = 16;

/// What a program said and took.
pub struct Ended {
    pub output: Output,
    /// Processor time of it and its children, user and system [s].
    pub cpu_s: f64,
    /// High-water mark of its resident memory [MiB], as last seen before it ended.
    pub peak_mib: f64,
}

/// Runs a program that nothing else runs beside.
pub fn run(command: &mut Command) -> Result<Ended> {
    let began_s = stat_cpu_s(OF_CHILDREN)?;
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let status = format!("/proc/{}/status", child.id());
    let (ended, ends) = channel::<()>();
    let watch = std::thread::spawn(move || {
        let mut peak_mib = 0.0;
        while ends.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
            peak_mib = f64::max(peak_mib, high_water_mib(&status).unwrap_or(0.0));
        }
        peak_mib
    });
    let output = child.wait_with_output();
    drop(ended);
    let peak_mib = watch.join().map_err(|_| "looking at a program's memory failed")?;
    Ok(Ended { output: output?, cpu_s: stat_cpu_s(OF_CHILDREN)? - began_s, peak_mib })
}

/// The high-water mark in a status of proc(5) [MiB]; none of a process that has ended.
pub fn high_water_mib(status: &str) -> Option<f64> {
    let text = std::fs::read_to_string(status).ok()?;
    let kib = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.trim().strip_suffix(" kB")?;
    Some(kib.parse::<f64>().ok()? / 1024.0)
}

/// Two times of this process's stat in proc(5), user and system, from field `first` on, together [s].
pub fn stat_cpu_s(first: usize) -> Result<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    // Behind the name of the program, which is field 2 and may hold spaces; in ticks of 10 ms.
    let (_, fields) = stat.rsplit_once(')').ok_or("/proc/self/stat has no name")?;
    let ticks = fields.split_whitespace().skip(first - 3).take(2).map(str::parse::<f64>);
    Ok(ticks.sum::<std::result::Result<f64, _>>()? * 0.01)
}
