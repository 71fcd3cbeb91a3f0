//! Everything a user can type.

use crate::commands::CompensateRequest;
use clap::{Args, Parser, Subcommand};
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
        /// Print every parameter and every notice, not only what decides.
        #[arg(long, short)]
        verbose: bool,
        /// Print summary.json instead.
        #[arg(long, conflicts_with = "verbose")]
        json: bool,
    },
    /// Channels, rates, gaps, clocks and occlusion of recordings, before a long run.
    Inspect {
        /// MCAP files (parts of one recording) or s3://BUCKET/KEY, or one pipeline file to inspect what it would use.
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
    Add {
        /// Effects such as backlash:1 (see `armcal effects`), or `suggested` for what the diagnosis found.
        #[arg(required = true)]
        effects: Vec<String>,
        /// Pipeline file to extend.
        pipeline: PathBuf,
        /// File for the extended pipeline; beside the original when absent.
        #[arg(long)]
        write: Option<PathBuf>,
        /// Folder for the results of the extended pipeline.
        #[arg(long, default_value = "out")]
        out: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Which dwells to record next, to tell apart what the diagnosis leaves open; or which sensor, where no motion will.
    Plan {
        /// Pipeline file.
        pipeline: PathBuf,
        /// Most dwells to propose.
        #[arg(long, default_value_t = 6)]
        dwells: usize,
        /// Effects to tell apart, such as compliance:2,belt_coupling; one alone is told from nothing. What the diagnosis
        /// leaves open when absent.
        #[arg(long)]
        effects: Option<String>,
        /// A load at hand [kg]; may be given again.
        #[arg(long = "load", value_name = "KG")]
        loads: Vec<f64>,
        /// How far free poses may go beyond the recorded range of a joint [deg].
        #[arg(long, default_value_t = 30.0, value_name = "DEG")]
        margin: f64,
        /// Range of one joint instead of that, such as 2=-75..20 [deg]; may be given again.
        #[arg(long = "range", value_name = "JOINT=LOW..HIGH", allow_hyphen_values = true)]
        ranges: Vec<String>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
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
    Check {
        /// Pipeline file with a [check] section.
        pipeline: PathBuf,
        /// Write JUnit XML: a suite with a case for each limit, or an error where the run failed.
        #[arg(long, value_name = "FILE")]
        junit: Option<PathBuf>,
        /// Write Markdown, for the summary page of a job.
        #[arg(long, value_name = "FILE")]
        markdown: Option<PathBuf>,
        /// Write all results of the run to this folder too, as `armcal run` does.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Calibrates every recording of an archive by itself, and shows what changed over months.
    ///
    /// Results that are there already, made from the same file, pipeline and version, are kept: after a kill at any moment
    /// the same command goes on. Exit codes: 0 done, 1 failed, 2 usage, 3 some recordings failed or are doubtful.
    Batch {
        /// Patterns such as 'lab/**/*.mcap', MCAP files, folders of split bags; or one manifest (TOML with [[recordings]], or
        /// a path a line).
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
    Compensate(Compensate),
    /// The report of a run, served to this machine's browser only: any combination of effects and any hold-out is
    /// refitted as you choose it.
    View {
        /// Results of `armcal run` or `armcal add` (their folder), or a pipeline file.
        input: PathBuf,
        /// Port on 127.0.0.1; any free one when 0.
        #[arg(long, default_value_t = 0)]
        port: u16,
    },
    /// How often the diagnosis is right: sealed scenarios, diagnosed without their truth, then judged by it.
    Score {
        /// Families, or `catalogue`, `nothing`, `outside`, `pairs`; several hidden at once are joined by +.
        #[arg(default_values = ["catalogue", "nothing", "outside"])]
        families: Vec<String>,
        /// Designs of motion.
        #[arg(long = "design", default_values = ["free-poses"])]
        designs: Vec<String>,
        /// Size of what is hidden: small, medium, large, drawn.
        #[arg(long, default_value = "drawn")]
        size: String,
        /// Seeds for each family and design.
        #[arg(long, default_value_t = 10)]
        seeds: u64,
        /// First seed.
        #[arg(long, default_value_t = 1)]
        from: u64,
        /// Write recordings to disk and run the whole pipeline on them, instead of handing over observations.
        #[arg(long)]
        sealed: bool,
        /// Write the tables, with intervals and every miss, as Markdown: docs/confusion.md.
        #[arg(long, value_name = "FILE")]
        page: Option<PathBuf>,
        /// For the page: so many of the seeds of what is in the catalogue also the whole way, as recordings on disk.
        #[arg(long, default_value_t = 0, requires = "page", conflicts_with = "sealed")]
        sealed_seeds: u64,
        /// Print JSON, every scenario with its answer.
        #[arg(long)]
        json: bool,
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
    Extract {
        /// MCAP files (parts of one recording), or s3://BUCKET/KEY.
        #[arg(required = true)]
        inputs: Vec<PathBuf>,
        /// File for the thin recording.
        #[arg(long)]
        out: PathBuf,
        /// Keep the channels that this pipeline reads.
        #[arg(long, required_unless_present = "topics")]
        pipeline: Option<PathBuf>,
        /// Keep this topic; `*` stands for any characters. May be given again.
        #[arg(long = "topic", value_name = "TOPIC")]
        topics: Vec<String>,
        /// Keep attachments too.
        #[arg(long)]
        attachments: bool,
        /// Print JSON.
        #[arg(long)]
        json: bool,
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

/// What `armcal compensate` takes.
#[derive(Debug, Args)]
pub struct Compensate {
    /// Results of `armcal run` or `armcal add`: their folder, run.mcap or model.json.
    result: PathBuf,
    /// CSV with a header (x_m, y_m, z_m; name, qx, qy, qz, qw, t_s where wanted) or TOML with [[targets]]. With t_s in
    /// every row it is a path, otherwise the arm stops at each.
    targets: PathBuf,
    /// CSV for the set-points.
    #[arg(long, default_value = "set-points.csv")]
    out: PathBuf,
    /// MCAP for the set-points as sensor_msgs/JointState.
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// Which tip, of several: the name of an arm, or of a marker; the tip when absent, of one robot.
    #[arg(long, value_name = "NAME")]
    tip: Option<String>,
    /// Frame of the targets: world, base, or board.RECORDING.
    #[arg(long, default_value = "world")]
    frame: String,
    /// Joints where the arm waits before the first target [deg], such as 0,-30,10: decides from where each arrives.
    #[arg(long, value_name = "DEG,..", allow_hyphen_values = true)]
    from: Option<String>,
    /// The recording as in which the arm is: its load, temperature, board, what has happened until then. The last when
    /// absent.
    #[arg(long, value_name = "RECORDING")]
    as_in: Option<String>,
    /// Load at the tip [kg], instead of that recording's.
    #[arg(long, value_name = "KG")]
    load: Option<f64>,
    /// Temperature [degC], instead of that recording's.
    #[arg(long, value_name = "DEGC", allow_hyphen_values = true)]
    temperature: Option<f64>,
    /// Come to every stop from a point this far before it, all joints in their direction of travel [deg].
    #[arg(long, default_value_t = 0.0, value_name = "DEG")]
    approach: f64,
    /// Time in which a joint that turns back on a path crosses its gap [s]; 0 for a leap.
    #[arg(long, default_value_t = 0.4, value_name = "S")]
    crossing: f64,
    /// Points a second of a path, by cubic splines through the targets; the targets themselves when absent.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// What a joint can do, such as 2=-75..20 [deg]; may be given again.
    #[arg(long = "range", value_name = "JOINT=LOW..HIGH", allow_hyphen_values = true)]
    ranges: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Compensate {
    /// What the command is asked to do.
    pub(crate) fn request(&self) -> CompensateRequest<'_> {
        CompensateRequest {
            result: &self.result,
            targets: &self.targets,
            out: &self.out,
            mcap: self.mcap.as_deref(),
            tip: self.tip.as_deref(),
            frame: &self.frame,
            start: self.from.as_deref(),
            recording: self.as_in.as_deref(),
            load_kg: self.load,
            temperature_c: self.temperature,
            approach_deg: self.approach,
            crossing_s: self.crossing,
            rate_hz: self.rate,
            ranges: &self.ranges,
            json: self.json,
        }
    }
}
