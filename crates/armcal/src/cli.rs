//! Everything a user can type.

use clap::{Parser, Subcommand};
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
    /// The main job: recordings to dwells, cavities, a calibration and an output MCAP.
    Run {
        /// Pipeline file.
        pipeline: PathBuf,
        /// Folder for the results; created if missing.
        #[arg(long, default_value = "out")]
        out: PathBuf,
        /// Print summary.json instead of the table.
        #[arg(long)]
        json: bool,
    },
    /// Channels, rates, gaps, clocks and occlusion of recordings, before a long run.
    Inspect {
        /// MCAP files (parts of one recording), or one pipeline file to inspect what it would use.
        #[arg(required = true)]
        inputs: Vec<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// The simulated rig: recordings with known errors, and their truth in a separate file.
    Simulate {
        /// LAB.toml.
        lab: PathBuf,
        /// Folder for recordings and truth; created if missing.
        #[arg(long, default_value = "lab")]
        out: PathBuf,
        /// Seed, instead of the file's own.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// The residual problem of a pipeline as JSON, to solve it with another tool.
    Export {
        /// Pipeline file.
        pipeline: PathBuf,
        /// File to write.
        #[arg(long, default_value = "problem.json")]
        out: PathBuf,
    },
}
