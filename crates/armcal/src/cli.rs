//! Everything a user can type.

use crate::commands::{add, check, compensate, extract, init, plan, write};
use clap::{Parser, Subcommand};
use clap_complete::Shell;
use std::path::PathBuf;

/// Calibrates a robot arm from MCAP recordings.
///
/// Results go to stdout, diagnostics to stderr. Exit codes: 0 done, 1 failed, 2 usage, 3 finished but
/// data were lost or the model is inadequate.
#[derive(Debug, Parser)]
#[command(version, about, long_about)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Proposes a pipeline for recordings: what they show of joints, tracked bodies, clocks, arm and table, each line with its
    /// reason.
    ///
    /// Exit code 3 when a first calibration with it fails, or contradicts itself.
    Init(init::Request),
    /// The main job: recordings to dwells, cavities, a calibration and an output MCAP.
    Run {
        /// Pipeline file.
        pipeline: PathBuf,
        /// Folder for the results; created if missing.
        #[arg(long, default_value = "out")]
        out: PathBuf,
        /// Print every parameter and every notice, not only what decides.
        #[arg(long, short)]
        verbose: bool,
        /// Print summary.json instead.
        #[arg(long, conflicts_with = "verbose")]
        json: bool,
    },
    /// Channels, rates, gaps, clocks and occlusion of recordings, before a long run.
    Inspect {
        /// Recordings (parts of one: .mcap, .db3, also compressed), a folder of them or s3://BUCKET/KEY, or one pipeline file
        /// to inspect what it would use.
        #[arg(required = true)]
        inputs: Vec<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Where the model fails, which physical effect is missing, what to record next.
    Diagnose {
        /// Pipeline file, or the result of an earlier run (run.mcap or its folder).
        input: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Adds effects to a pipeline: refits, compares on held-out points, diagnoses what remains, writes the new pipeline.
    Add(add::Request),
    /// Which dwells to record next, to tell apart what the diagnosis leaves open; or which sensor, where no motion will.
    Plan(plan::Request),
    /// One calibration of many recordings: pools what earlier runs observed, each recording with parameters of its own.
    Pool {
        /// Pipeline file: model, frames, effects, fit, hold-out, [pool].
        pipeline: PathBuf,
        /// Folders with results of `armcal run`, searched for observations.json in all their folders.
        #[arg(required = true)]
        results: Vec<PathBuf>,
        /// Folder for the results; created if missing.
        #[arg(long, default_value = "pool")]
        out: PathBuf,
        /// Print every parameter and every notice, not only what decides.
        #[arg(long, short)]
        verbose: bool,
        /// Print pool.json instead.
        #[arg(long, conflicts_with = "verbose")]
        json: bool,
    },
    /// The catalogue of physical effects: meaning, equation, signature, confusions, source.
    Effects {
        /// One of them.
        name: Option<String>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// For CI: whether the result keeps the limits in the pipeline's [check]; what broke one, and why.
    ///
    /// Exit codes: 0 every limit holds, 1 one is broken or the run failed, 2 usage (or no limit is given), 3 every
    /// limit holds, but data were lost or the model is inadequate, and max_warnings does not say how much of it is accepted.
    Check(check::Request),
    /// Calibrates every recording of an archive by itself, and shows what changed over months.
    ///
    /// Results that are there already, made from the same file, pipeline and version, are kept: after a kill at any moment
    /// the same command goes on. Exit codes: 0 done, 1 failed, 2 usage, 3 some recordings failed or are doubtful.
    Batch {
        /// Patterns such as 'lab/**/*.mcap', recordings (.mcap, .db3), folders of split bags; or one manifest (TOML with
        /// [[recordings]], or a path a line).
        #[arg(required = true)]
        inputs: Vec<String>,
        /// Pipeline file, whose own recordings do not count; the manifest's when absent.
        #[arg(long, value_name = "FILE")]
        pipeline: Option<PathBuf>,
        /// Folder of the campaign; created if missing.
        #[arg(long, default_value = "campaign", value_name = "DIR")]
        out: PathBuf,
        /// Write everything for each recording that `armcal run` does, page and MCAP included.
        #[arg(long)]
        full: bool,
        /// Recordings worked on at a time; all cores when absent.
        #[arg(long, value_name = "N")]
        jobs: Option<usize>,
        /// Print campaign.json instead of the tables.
        #[arg(long)]
        json: bool,
    },
    /// One share of a batch, for a cluster: any number of them, on any machines that see the folder; then `armcal reduce`.
    Map {
        /// Manifest file: TOML with [[recordings]], or a path a line.
        #[arg(long, value_name = "FILE")]
        manifest: PathBuf,
        /// Which share, such as 2/17; from the environment of a Slurm job array when absent.
        #[arg(long, value_name = "I/N")]
        shard: Option<String>,
        /// Pipeline file; the manifest's when absent.
        #[arg(long, value_name = "FILE")]
        pipeline: Option<PathBuf>,
        /// Folder of the campaign, the same for all shares.
        #[arg(long, default_value = "campaign", value_name = "DIR")]
        out: PathBuf,
        /// Write everything for each recording that `armcal run` does.
        #[arg(long)]
        full: bool,
        /// Recordings worked on at a time; all cores when absent.
        #[arg(long, value_name = "N")]
        jobs: Option<usize>,
    },
    /// Puts the shares of `armcal map` together, to the bytes that `armcal batch` writes; missing shares fail by name.
    Reduce {
        /// Folder of the campaign.
        #[arg(default_value = "campaign")]
        out: PathBuf,
        /// Print campaign.json instead of the tables.
        #[arg(long)]
        json: bool,
    },
    /// Two results on the same dwells, paired: what got better, what got worse, what moved.
    Compare {
        /// Result before: a run.mcap or the folder it is in.
        before: PathBuf,
        /// Result after.
        after: PathBuf,
        /// Write a page too.
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// A calibrated model on recordings it never saw: errors at points and along paths, before and after, with intervals.
    Verify {
        /// Result of `armcal run`: a run.mcap or the folder it is in.
        result: PathBuf,
        /// Pipeline file of the new recordings, with the same nominal arm.
        pipeline: PathBuf,
        /// Folder for verification.html, verification.json and paths.parquet.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Does what one session taught help in another? The first is calibrated, the second judges, effect by effect.
    ///
    /// Exit code 3 when something that was learnt does harm there, by more than chance.
    Transfer {
        /// Pipeline file of the session that teaches.
        from: PathBuf,
        /// Pipeline file of the session that judges: the same nominal arm.
        to: PathBuf,
        /// Effects beside those of the first pipeline, such as backlash:1. With none at all, those that its diagnosis
        /// suggests.
        effects: Vec<String>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Set-points that bring the calibrated arm to Cartesian targets: its model with all effects, inverted.
    Compensate(compensate::Request),
    /// The calibrated arm in what robots, planners and simulators read: what a format cannot carry, and how far off that is.
    Write(write::Request),
    /// The report of a run, served to this machine's browser only: any combination of effects and any hold-out is
    /// refitted as you choose it.
    View {
        /// Results of `armcal run` or `armcal add` (their folder), or a pipeline file.
        input: PathBuf,
        /// Port on 127.0.0.1; any free one when 0.
        #[arg(long, default_value_t = 0)]
        port: u16,
    },
    /// The simulated rig: recordings with known errors, and their truth in a separate file.
    Simulate {
        /// LAB.toml: a rig described by hand.
        #[arg(required_unless_present = "hide")]
        lab: Option<PathBuf>,
        /// Instead of a file: a rig drawn by the seed that hides this family, with a pipeline to calibrate it; several
        /// joined by +, `nothing` for none. The truth goes to OUT-truth.json.
        #[arg(long, value_name = "FAMILY", conflicts_with = "lab")]
        hide: Option<String>,
        /// Design of motion of such a rig.
        #[arg(long, default_value = "free-poses", requires = "hide")]
        design: String,
        /// Size of what it hides: small, medium, large, drawn.
        #[arg(long, default_value = "drawn", requires = "hide")]
        size: String,
        /// Folder for recordings and truth; created if missing.
        #[arg(long, default_value = "lab")]
        out: PathBuf,
        /// Seed, instead of the file's own.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// Thin recordings for repeated work: the wanted channels only, untouched, whatever else the files hold left out.
    ///
    /// Exit code 3 when the input was damaged: what is lost is said.
    Extract(extract::Request),
    /// The residual problem of a pipeline as JSON, to solve it with another tool.
    Export {
        /// Pipeline file.
        pipeline: PathBuf,
        /// File to write.
        #[arg(long, default_value = "problem.json")]
        out: PathBuf,
    },
    /// What a shell needs to complete commands and options: a script, printed.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// The help of every command as man pages.
    Man {
        /// Folder for them; created if missing.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}
