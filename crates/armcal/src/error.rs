//! Everything that stops a command, in words that say what was being done and to what.

use armcal_check::CheckError;
use armcal_held_out::HeldOutError;
use armcal_init::InitError;
use armcal_stages::RunError;
use std::path::PathBuf;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum Error {
    /// A run, or what it needs.
    #[error(transparent)]
    Run(#[from] RunError),
    /// No pipeline can be proposed.
    #[error(transparent)]
    Init(#[from] InitError),
    /// A name on the command line that means nothing.
    #[error(transparent)]
    Usage(Box<Error>),
    /// A whole archive.
    #[error(transparent)]
    Archive(#[from] armcal_archive::ArchiveError),
    /// A share that is none.
    #[error("--shard: {0}")]
    Shard(String),
    /// No pipeline was named.
    #[error("no pipeline: give --pipeline FILE, or a manifest that begins with pipeline = \"FILE\"")]
    NoPipeline,
    /// The system gives no threads.
    #[error("starting worker threads: {why}")]
    Threads { why: String },
    /// Writing results.
    #[error(transparent)]
    Report(#[from] armcal_report::ReportError),
    /// The simulated rig.
    #[error(transparent)]
    Lab(#[from] armcal_lab::LabError),
    /// Reading back the result of an earlier run, or one that cannot be used here.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
    /// Two results of different recordings.
    #[error(
        "{} and {} have no dwell in common ({why}): compare results of the same recordings, and use `armcal verify` to judge a \
         result on others",
        before.display(),
        after.display()
    )]
    NothingInCommon { before: PathBuf, after: PathBuf, why: String },
    /// A value of an option that cannot be used.
    #[error("{option} {value}: {problem}")]
    BadOption { option: &'static str, value: String, problem: String },
    /// No set-point.
    #[error(transparent)]
    Compensate(#[from] armcal_compensate::CompensateError),
    /// A result that cannot be put to use.
    #[error(transparent)]
    Deploy(#[from] armcal_deploy::DeployError),
    /// A pipeline that switches the diagnosis off, asked for what it would find.
    #[error("the pipeline asks for no diagnosis; remove `enabled = false` from [diagnosis]")]
    NotDiagnosed,
    /// A model that cannot be judged on other recordings.
    #[error(transparent)]
    HeldOut(#[from] HeldOutError),
    /// `armcal add suggested` where nothing is, or nothing that holds elsewhere.
    #[error(
        "the diagnosis of `{pipeline}` suggests no effect{}; name one (see `armcal effects`)",
        of_this_session(left_out)
    )]
    NothingSuggested { pipeline: String, left_out: Vec<String> },
    /// An effect of the pipeline was switched off, which appending cannot express.
    #[error("{effect} is in {} itself; remove its [[effects]] table there by hand", path.display())]
    OwnEffect { effect: String, path: PathBuf },
    /// Nothing was added to the pipeline.
    #[error("nothing to keep: {} has these effects already", path.display())]
    NothingToKeep { path: PathBuf },
    /// The page cannot be served.
    #[error("{what} on 127.0.0.1, port {port}: {source}; choose another --port")]
    Serve { what: &'static str, port: u16, source: std::io::Error },
    /// A folder for results cannot be made.
    #[error("making the folder {}: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// Results that cannot be pooled.
    #[error(transparent)]
    Pool(#[from] armcal_pipeline::PoolError),
    /// Limits that cannot be judged by.
    #[error(transparent)]
    Check(#[from] CheckError),
    /// Reporting a failure failed too.
    #[error("{first}; and {second}")]
    Also { first: Box<Error>, second: Box<Error> },
    /// Writing an effect as TOML.
    #[error("writing the effect as TOML: {0}")]
    Toml(toml::ser::Error),
    /// Printing a result as JSON.
    #[error("writing the result as JSON: {0}")]
    Json(serde_json::Error),
    /// Writing a result of a small command.
    #[error(transparent)]
    Output(armcal_recording::RecordingError),
    /// Printing a result.
    #[error("printing to stdout: {0}")]
    Stdout(std::io::Error),
}

armcal_stages::stopped_as_run!(
    Error:
    armcal_config::ConfigError,
    armcal_model::ModelError,
    armcal_calibrate::CalibrateError,
    armcal_diagnose::DiagnoseError
);

/// What is suggested and not added, inside a sentence.
fn of_this_session(left_out: &[String]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    format!(" that another session or recording does not contradict ({})", left_out.join("; "))
}

impl Error {
    /// The same, as a mistake on the command line.
    pub fn of_usage(error: impl Into<Error>) -> Error {
        Error::Usage(Box::new(error.into()))
    }

    /// What the program exits with: 2 where the user asked for something that cannot be, 1 otherwise.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Check(CheckError::NoLimits { .. })
            | Error::Usage(_)
            | Error::Init(InitError::Usage { .. })
            | Error::HeldOut(HeldOutError::Usage(_))
            | Error::BadOption { .. }
            | Error::Shard(_)
            | Error::NoPipeline => 2,
            Error::Also { first, .. } => first.exit_code(),
            _ => 1,
        }
    }
}
