//! The same commands by this program and by that of an older commit, in turn: what became of the cost.

use crate::campaign::Weighed;
use crate::page::{Section, Table, seconds};
use crate::process::{self, Ended};
use crate::{Options, Result, batch, campaign, reading, revision};
use armcal_lab::planted::seal;
use armcal_lab::scenario::{Design, Scenario};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A session with something unlisted takes a diagnosis longest.
const HIDDEN: &str = "outside:cable_drag";

/// A command by its name and its arguments.
struct Case {
    what: String,
    threads: usize,
    arguments: Vec<OsString>,
}

pub fn section(options: &Options) -> Result<Section> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize()?;
    let mut section = Section::new("Beside an older commit");
    let older = &options.older;
    let Ok(commit) = revision::commit(&root, older) else {
        section
            .skipped(format!("the history here has no commit `{older}`; `--older REVISION` names another"));
        return Ok(section);
    };
    section.say(format!(
        "The program of {}, built from its own commit in the same run, and this one, each command by one and then by the other, \
         as processes with one thread where nothing else is said. The older one is the last before cost was looked at, unless \
         `--older` names another. CPU is user and system time of the process, peak its largest resident set.",
        &commit[..7]
    ));
    let programs =
        [revision::built(&root, &root.join("target/before"), older)?, env!("CARGO_BIN_EXE_armcal").into()];
    let mut table = Table::new(&[
        "command",
        "before: CPU [s]",
        "peak [MiB]",
        "now: CPU [s]",
        "peak [MiB]",
        "CPU, before to now",
    ]);
    for case in cases(options)? {
        eprintln!("{}", case.what);
        let [before, now] = [case.run(&programs[0], options)?, case.run(&programs[1], options)?];
        table.row([
            case.what,
            seconds(before.cpu_s),
            format!("{:.0}", before.peak_mib),
            seconds(now.cpu_s),
            format!("{:.0}", now.peak_mib),
            format!("{:.1}", before.cpu_s / now.cpu_s),
        ]);
    }
    section.table(table);
    Ok(section)
}

/// What is run, on recordings of the other parts.
fn cases(options: &Options) -> Result<Vec<Case>> {
    let (mut cases, out) = (Vec::new(), out(options));
    let mut run = |what: String, pipeline: PathBuf| {
        let arguments = vec!["run".into(), pipeline.into(), "--out".into(), out.clone().into()];
        cases.push(Case { what, threads: 1, arguments });
    };
    for (poses, weighed) in [(2_000, Weighed::All), (16_811, Weighed::None)] {
        if poses <= options.poses {
            run(format!("run, {poses} poses, {}", weighed.word()), campaign::place(options, poses, weighed)?);
        }
    }
    for (design, word) in [(Design::ThreeTiltsBothWays, "three tilts"), (Design::FreePoses, "free poses")] {
        let folder = options.data.join(format!("older-{design:?}"));
        let (rig, pipeline) = (folder.join("rig"), folder.join("rig/pipeline.toml"));
        if !pipeline.exists() {
            seal(&Scenario::new(HIDDEN, design, 1), &rig, &folder.join("truth.json"))?;
        }
        run(format!("run, a session of {word} that hides something unlisted"), pipeline);
    }
    let recording = reading::placed(options)?;
    let arguments = vec!["inspect".into(), recording.into()];
    cases.push(Case { what: format!("inspect, {} MB", options.size_mb), threads: 1, arguments });
    for (count, threads) in [(100, 1), (10, 2), (1000, 2)] {
        if count <= options.recordings {
            let plural = if threads == 1 { "" } else { "s" };
            let what = format!("batch of {count} recordings, {threads} thread{plural}");
            cases.push(Case { what, threads, arguments: batch::arguments(options, count, threads, &out)? });
        }
    }
    Ok(cases)
}

/// Where commands write that do.
fn out(options: &Options) -> PathBuf {
    options.data.join("older-out")
}

impl Case {
    /// From nothing to its outputs, which are not kept.
    fn run(&self, program: &Path, options: &Options) -> Result<Ended> {
        let mut command = Command::new(program);
        command.args(&self.arguments).env("RAYON_NUM_THREADS", self.threads.to_string());
        let ended = process::run(&mut command)?;
        let out = out(options);
        if out.exists() {
            std::fs::remove_dir_all(&out)?;
        }
        // 3: an adequate answer could not be given, which is one of the answers.
        match ended.output.status.code() {
            Some(0 | 3) => Ok(ended),
            _ => Err(format!("{command:?}: {}", String::from_utf8_lossy(&ended.output.stderr)).into()),
        }
    }
}
