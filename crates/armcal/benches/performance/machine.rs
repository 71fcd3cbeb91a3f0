//! On what, with what and when the numbers were taken.

use crate::Options;
use crate::peers::Python;
use std::path::Path;
use std::process::Command;

/// Of what commit, and when.
pub fn when() -> [String; 2] {
    [
        format!("date: {}", said("date", &["-u", "+%Y-%m-%d %H:%M UTC"])),
        format!("armcal: {}{}", said("git", &["rev-parse", "--short", "HEAD"]), changed()),
    ]
}

/// One line a fact.
pub fn facts(options: &Options) -> Vec<String> {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let cpu = field("/proc/cpuinfo", "model name").unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let memory = field("/proc/meminfo", "MemTotal").unwrap_or_default();
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.split_whitespace().next().unwrap_or("unknown").to_owned();
    let mut facts = vec![
        format!(
            "machine: {cpu}, {cores} cores, {memory}; load average {load} at the end (the bench itself is part of it)"
        ),
        format!("system: {}", said("uname", &["-sr"])),
    ];
    facts.extend(when());
    facts.extend([
        format!("compiler: {}", said("rustc", &["--version"])),
        format!("crates: {}", crates(&["mcap", "memmap2", "nalgebra", "num-dual", "rayon", "zstd"])),
    ]);
    if let Ok(Some(python)) = Python::find(options) {
        facts.extend(python.versions());
    }
    facts
}

/// Says when the numbers are of no commit.
fn changed() -> &'static str {
    let tracked = said(
        "git",
        &["status", "--porcelain", "--untracked-files=no", "--", "..", ":!../../docs/performance.md"],
    );
    if tracked.is_empty() { "" } else { ", with uncommitted changes" }
}

fn field(path: &str, key: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find(|line| line.starts_with(key))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn said(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    output.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned()).unwrap_or_default()
}

/// Versions of the crates that the numbers depend on.
fn crates(names: &[&str]) -> String {
    let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../Cargo.lock");
    let text = std::fs::read_to_string(lock).unwrap_or_default();
    let version = |name: &&str| {
        let (_, after) = text.split_once(&format!("\nname = \"{name}\"\nversion = \""))?;
        Some(format!("{name} {}", after.split('"').next()?))
    };
    names.iter().filter_map(version).collect::<Vec<_>>().join(", ")
}
