//! Everything that stops a command, in words that say what was being done and to what.

use std::path::PathBuf;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file of the pipeline could not be read.
    #[error("reading the {what} {}: {source}", path.display())]
    ReadFile {
        /// `pipeline`, `board`, `DH model`, ...
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file of the pipeline is not there, and the pipeline says where its data come from.
    #[error("{source}; the pipeline's data: {data}")]
    MissingData {
        /// Which file.
        source: Box<Error>,
        /// The pipeline's own sentence.
        data: String,
    },
    /// The pipeline file is not what it should be.
    #[error("pipeline {}: {source}", path.display())]
    PipelineSyntax {
        /// The file.
        path: PathBuf,
        /// The parser's message, with the line.
        source: Box<toml::de::Error>,
    },
    /// Something else where a file that people write belongs: a recording, a folder.
    #[error("{} is {found}, where a {wanted} belongs: {next}", path.display())]
    NotText {
        /// What was given.
        path: PathBuf,
        /// What it is.
        found: &'static str,
        /// What was wanted.
        wanted: &'static str,
        /// What to do.
        next: String,
    },
    /// A recording without a message.
    #[error(
        "recording `{recording}` holds no message: there is nothing to calibrate with; was anything recorded?"
    )]
    NoMessages {
        /// Its name.
        recording: String,
    },
    /// A name on the command line that means nothing.
    #[error(transparent)]
    Usage(Box<Error>),
    /// Two parts of the pipeline contradict each other.
    #[error("pipeline {}: `{key}` {problem}", path.display())]
    PipelineContradiction {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A stream that the pipeline relies on gave no rows.
    #[error(
        "recording `{recording}`: the {role} stream has no usable sample, so {consequence}; see `armcal inspect`"
    )]
    EmptyStream {
        /// Name of the recording.
        recording: String,
        /// `tip`, `table`, `base`.
        role: &'static str,
        /// What cannot be done.
        consequence: &'static str,
    },
    /// A body whose pose is needed is tracked by position only.
    #[error(
        "recording `{recording}`: the {role} stream has positions but no orientations; name a topic with poses in [streams.{role}]"
    )]
    NoOrientation {
        /// Name of the recording.
        recording: String,
        /// `table`, `base`.
        role: &'static str,
    },
    /// A joint of the model that none of several streams has.
    #[error(
        "recording `{recording}`: no [[streams.joints]] reads the joint `{joint}` of the model; several streams are put together by \
         the names of the model file: they read {read}"
    )]
    JointUnread {
        /// Name of the recording.
        recording: String,
        /// The joint.
        joint: String,
        /// What is read.
        read: String,
    },
    /// Another number of joints is read than the model has.
    #[error(
        "recording `{recording}`: {read} joints are read for a model of {expected}; mend `names` in [streams.joints], or the rows of the model file: the number of joints differs"
    )]
    JointCount {
        /// Name of the recording.
        recording: String,
        /// Joints read.
        read: usize,
        /// Joints of the model.
        expected: usize,
    },
    /// What a batch should work on.
    #[error("recordings `{what}`: {why}")]
    Manifest {
        /// The pattern or file.
        what: String,
        /// What is wrong, and what to do.
        why: String,
    },
    /// A file in a campaign's folder that is not what it should be.
    #[error("campaign {}: {why}", path.display())]
    Campaign {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, and what to do.
        why: String,
    },
    /// A share that is none.
    #[error("--shard: {0}")]
    Shard(String),
    /// No pipeline was named.
    #[error("no pipeline: give --pipeline FILE, or a manifest that begins with pipeline = \"FILE\"")]
    NoPipeline,
    /// The system gives no threads.
    #[error("starting worker threads: {why}")]
    Threads {
        /// What the system said.
        why: String,
    },
    /// A defect of armcal itself.
    #[error("recording `{recording}`: armcal itself failed ({why}); please report it with the recording")]
    Internal {
        /// Name of the recording.
        recording: String,
        /// The message.
        why: String,
    },
    /// No dwell became an observation.
    #[error("none of the {dwells} dwells became an observation; {hint}")]
    NoObservations {
        /// Dwells found.
        dwells: usize,
        /// What to look at.
        hint: String,
    },
    /// Reading a recording.
    #[error("recording `{recording}`: {source}")]
    Recording {
        /// Its name.
        recording: String,
        /// Why.
        source: armcal_recording::RecordingError,
    },
    /// Finding dwells.
    #[error("recording `{recording}`: {source}")]
    Dwell {
        /// Its name.
        recording: String,
        /// Why.
        source: armcal_dwell::DwellError,
    },
    /// The same readings in two recordings of a pipeline.
    #[error(
        "recordings `{first}` and `{second}` hold the same readings at the same times, {overlap_s:.1} s of them: counted \
         twice they would make the result look surer than it is; remove one of them from [[recordings]], or cut what both hold \
         out of one"
    )]
    RecordedTwice {
        /// The earlier one in the pipeline.
        first: String,
        /// The later one.
        second: String,
        /// How long they are alike [s].
        overlap_s: f64,
    },
    /// Associating dwells to cavities.
    #[error("recording `{recording}`: {source}")]
    Association {
        /// Its name.
        recording: String,
        /// Why.
        source: armcal_table::TableError,
    },
    /// A measurement that no dwell was.
    #[error("[[measure]] `{name}`: {problem}")]
    Measure {
        /// Its name.
        name: String,
        /// What was seen, and what to do.
        problem: String,
    },
    /// Joined tips that cannot be calibrated against each other.
    #[error("joined tips: {problem}")]
    TwoArms {
        /// What was seen, and what to do.
        problem: String,
    },
    /// The board file.
    #[error(transparent)]
    Board(#[from] armcal_table::TableError),
    /// The model.
    #[error(transparent)]
    Model(#[from] armcal_model::ModelError),
    /// The fit.
    #[error(transparent)]
    Calibrate(#[from] armcal_calibrate::CalibrateError),
    /// Writing results.
    #[error(transparent)]
    Report(#[from] armcal_report::ReportError),
    /// The simulated rig.
    #[error(transparent)]
    Lab(#[from] armcal_lab::LabError),
    /// Reading back the result of an earlier run.
    #[error(transparent)]
    PastRun(#[from] armcal_report::PastRunError),
    /// Two results of different recordings.
    #[error(
        "{} and {} have no dwell in common ({why}): compare results of the same recordings, and use `armcal verify` to judge a \
         result on others",
        before.display(),
        after.display()
    )]
    NothingInCommon {
        /// One result.
        before: PathBuf,
        /// The other.
        after: PathBuf,
        /// Recording by recording.
        why: String,
    },
    /// A folder without results to pool.
    #[error(
        "{} holds no observations.json, in none of its folders: name the results of `armcal run`, and run older ones again",
        folder.display()
    )]
    NoResults {
        /// The folder.
        folder: PathBuf,
    },
    /// A result that does not belong into the pool.
    #[error("{} cannot be pooled: {problem}", result.display())]
    Unpoolable {
        /// Its observations.
        result: PathBuf,
        /// How it contradicts the pipeline.
        problem: String,
    },
    /// The result lacks a parameter of the arm.
    #[error(
        "{} has no parameter {parameter}: its arm is not the one of this pipeline; name the [model] it was calibrated with",
        result.display()
    )]
    NotInResult {
        /// The result.
        result: PathBuf,
        /// The parameter.
        parameter: String,
    },
    /// The result calibrated another nominal arm.
    #[error(
        "{} calibrated an arm whose nominal {parameter} is {then}, this pipeline's is {now} (SI); name the [model] it was \
         calibrated with",
        result.display()
    )]
    OtherArm {
        /// The result.
        result: PathBuf,
        /// The parameter.
        parameter: String,
        /// Nominal value in the result.
        then: f64,
        /// Nominal value in the pipeline.
        now: f64,
    },
    /// Judging by ISO 9283.
    #[error("judging by ISO 9283: {0}")]
    Iso(#[from] armcal_iso9283::IsoError),
    /// Looking for the missing effect.
    #[error(transparent)]
    Diagnose(#[from] armcal_diagnose::DiagnoseError),
    /// A value of an option that cannot be used.
    #[error("{option} {value}: {problem}")]
    BadOption {
        /// The option.
        option: &'static str,
        /// What was given.
        value: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file of targets is not what it should be.
    #[error("targets {}: {problem}", path.display())]
    BadTargets {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// No set-point.
    #[error(transparent)]
    Compensate(#[from] armcal_compensate::CompensateError),
    /// Writing set-points as CSV.
    #[error("writing the set-points as CSV: {0}")]
    Csv(csv::Error),
    /// A sealed scenario's pipeline switches the diagnosis off.
    #[error("the pipeline asks for no diagnosis; remove `enabled = false` from [diagnosis]")]
    NotDiagnosed,
    /// Nothing can be calibrated, and a mistake of the setup explains it.
    #[error("{mistakes} (as it is: {source})")]
    Setup {
        /// What stopped the calibration.
        source: Box<Error>,
        /// What would undo it.
        mistakes: String,
    },
    /// A mistake of the setup stands before any diagnosis.
    #[error(
        "the setup of `{pipeline}` contradicts the data, so no physical effect is looked for [{code}]: {message}"
    )]
    SetupFirst {
        /// Name of the pipeline.
        pipeline: String,
        /// Stable name of the mistake.
        code: &'static str,
        /// What would undo it.
        message: String,
    },
    /// `armcal transfer` to a session that shows nothing.
    #[error("no dwell of `{pipeline}` has a place that anything could be judged by; see `armcal run` of it")]
    NothingToJudge {
        /// Name of the pipeline.
        pipeline: String,
    },
    /// `armcal add suggested` where nothing is, or nothing that holds elsewhere.
    #[error(
        "the diagnosis of `{pipeline}` suggests no effect{}; name one (see `armcal effects`)",
        of_this_session(left_out)
    )]
    NothingSuggested {
        /// Name of the pipeline.
        pipeline: String,
        /// What it suggests for this session alone.
        left_out: Vec<String>,
    },
    /// A folder of results does not say which pipeline made it.
    #[error(
        "{} does not say which pipeline made it (view.toml: {source}); name the pipeline file instead",
        folder.display()
    )]
    NoSource {
        /// The folder.
        folder: PathBuf,
        /// What is wrong with the note.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// An effect of the pipeline was switched off, which appending cannot express.
    #[error("{effect} is in {} itself; remove its [[effects]] table there by hand", path.display())]
    OwnEffect {
        /// The effect.
        effect: String,
        /// The pipeline.
        path: PathBuf,
    },
    /// Nothing was added to the pipeline.
    #[error("nothing to keep: {} has these effects already", path.display())]
    NothingToKeep {
        /// The pipeline.
        path: PathBuf,
    },
    /// The page cannot be served.
    #[error("{what} on 127.0.0.1, port {port}: {source}; choose another --port")]
    Serve {
        /// What was being done.
        what: &'static str,
        /// The port.
        port: u16,
        /// What the system said.
        source: std::io::Error,
    },
    /// A folder for results cannot be made.
    #[error("making the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// `armcal check` of a pipeline that limits nothing.
    #[error(
        "pipeline {}: there is no limit to check; add a [check] section, for instance `max_over_floor = 1.5`, \
         `max_holdout_mean_mm = 0.5` and `verdicts = [\"nothing_missing\"]` (docs/check.md lists them)",
        path.display()
    )]
    NoLimits {
        /// The file.
        path: PathBuf,
    },
    /// What `[check]` compares with is not a result.
    #[error(
        "check.reference: {} {problem}; name the summary.json, run.mcap or folder of an accepted `armcal run`",
        path.display()
    )]
    BadReference {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// Writing JUnit XML.
    #[error("writing the checks as JUnit XML: {0}")]
    Junit(Box<dyn std::error::Error + Send + Sync>),
    /// Reporting a failure failed too.
    #[error("{first}; and {second}")]
    Also {
        /// What failed.
        first: Box<Error>,
        /// What failed while saying so.
        second: Box<Error>,
    },
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

    /// Whether it is about a file of the pipeline that is not there.
    pub(crate) fn is_missing_file(&self) -> bool {
        let missing = |source: &std::io::Error| source.kind() == std::io::ErrorKind::NotFound;
        match self {
            Error::ReadFile { source, .. } => missing(source),
            Error::Recording { source: armcal_recording::RecordingError::Open { source, .. }, .. } => {
                missing(source)
            }
            _ => false,
        }
    }

    /// What the program exits with: 2 where the user asked for something that cannot be, 1 otherwise.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::NoLimits { .. }
            | Error::Usage(_)
            | Error::BadOption { .. }
            | Error::Shard(_)
            | Error::NoPipeline => 2,
            Error::Also { first, .. } => first.exit_code(),
            _ => 1,
        }
    }
}
