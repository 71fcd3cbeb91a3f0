//! What can be wrong with a model, and what to do about it.
//!
//! A `cause` is part of the message, not a source: nobody prints it twice.

use std::path::PathBuf;

/// Errors of reading, building and writing models.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum ModelError {
    /// The DH table is not what the format asks for.
    #[error("reading the DH table {}: {cause}", path.display())]
    DhToml { path: PathBuf, cause: Box<toml::de::Error> },
    /// A number is outside its range.
    #[error("{}: {key} = {value}; expected {expected}", path.display())]
    BadValue { path: PathBuf, key: String, value: f64, expected: &'static str },
    /// Two rows have one name.
    #[error("{}: there are two rows named \"{row}\"; every parameter needs a name of its own", path.display())]
    DuplicateRow { path: PathBuf, row: String },
    /// A row has no name.
    #[error("{}: row {index} (from 1) has an empty name; name it after its joint", path.display())]
    NamelessRow { path: PathBuf, index: usize },
    /// Arms that cannot be joined.
    #[error("two arms: {problem}")]
    BadArms { problem: String },
    /// A length that cannot be one.
    #[error("the length of {name} {problem}")]
    BadLength { name: String, problem: String },
    /// Something was measured against a place, or from a length, that the model does not have.
    #[error(
        "{dwell} was measured against {what} {index}, and the model has {known}: give it every place and length"
    )]
    NoPlace {
        dwell: armcal_core::DwellId,
        /// `place` or `length`.
        what: &'static str,
        index: usize,
        known: usize,
    },
    /// A measurement of a kind that this program does not have.
    #[error(
        "{dwell} was measured as \"{kind}\", which is no kind of measurement of this program: register it, or update armcal"
    )]
    UnknownMeasurement { dwell: armcal_core::DwellId, kind: String },
    /// A kind of effect or measurement that cannot be added.
    #[error("registering \"{name}\": {problem}")]
    NotRegistered { name: String, problem: &'static str },
    /// Nothing moves.
    #[error("{}: the chain has no moving joint; give at least one row joint = \"revolute\" or \"prismatic\"", path.display())]
    NoJoint { path: PathBuf },
    /// Masses are wanted of a file that has none.
    #[error(
        "{}: no link that moves has a mass, and masses = \"urdf\" asks for them: write <inertial><mass value=\"...\"/></inertial> \
         in its links, or leave `masses` out",
        path.display()
    )]
    NoMasses { path: PathBuf },
    /// The URDF is not well-formed XML.
    #[error("{}:{line}: the URDF is not well-formed XML: {cause}", path.display())]
    UrdfXml { path: PathBuf, line: u32, cause: roxmltree::Error },
    /// An element of the URDF cannot be used.
    #[error("{}:{line}: {subject}: {problem}", path.display())]
    Urdf { path: PathBuf, line: u32, subject: String, problem: String },
    /// A link is not in the URDF.
    #[error("{}: there is no link \"{link}\"{}", path.display(), did_you_mean(nearest))]
    UnknownLink { path: PathBuf, link: String, nearest: Option<String> },
    /// An observation is of a feature that the model does not have.
    #[error(
        "{dwell}: feature {feature} was measured or bears a load, and the model has {features}: give every marker its place on \
         the arm"
    )]
    NoFeature { dwell: armcal_core::DwellId, feature: usize, features: usize },
    /// A marker is on a link that the arm does not have.
    #[error("there is no link \"{link}\" among those of the arm{}", did_you_mean(nearest))]
    NoSuchLink { link: String, nearest: Option<String> },
    /// The tip does not hang on the base.
    #[error("{}: the link \"{tip}\" does not descend from \"{base}\"; its ancestors are: {ancestors}", path.display())]
    NoPath { path: PathBuf, base: String, tip: String, ancestors: String },
    /// The URDF to be edited is not the one the chain came from.
    #[error("{}: the joint \"{joint}\" of the model is not in this URDF; pass the file the model was read from", path.display())]
    ForeignUrdf { path: PathBuf, joint: String },
    /// The chain came from the other format.
    #[error("the model \"{model}\" was not read from a {format}, so it cannot be written as one")]
    WrongFormat {
        model: String,
        /// `DH table` or `URDF`.
        format: &'static str,
    },
    /// The frames and the chain use one name twice.
    #[error("two parameters are named \"{name}\"; rename the row or the recording behind it")]
    DuplicateParameter { name: String },
    /// A frame cannot be used.
    #[error("frame \"{frame}\": {problem}")]
    BadFrame { frame: String, problem: &'static str },
    /// No parameter has the name.
    #[error("no parameter matches \"{name}\"{}", did_you_mean(nearest))]
    UnknownParameter { name: String, nearest: Option<String> },
    /// The name is not a valid glob.
    #[error("\"{pattern}\" is not a parameter name or pattern: {cause}")]
    BadPattern { pattern: String, cause: glob::PatternError },
    /// An override left a parameter in a state that cannot be fitted.
    #[error("parameter \"{name}\": {problem}")]
    BadParameter { name: String, problem: &'static str },
    /// A parameter vector of the wrong length.
    #[error("{actual} parameter values were given to a model that has {expected}")]
    ParameterCount { actual: usize, expected: usize },
    /// An observation does not fit the chain.
    #[error(
        "{dwell}: {actual} joint readings for a chain of {expected} joints; mend the joint names of the pipeline, or the rows of the model file"
    )]
    JointCount { dwell: armcal_core::DwellId, actual: usize, expected: usize },
    /// No entry of the catalogue has the name.
    #[error("there is no effect \"{kind}\"{}; the effects are: {known}", did_you_mean(nearest))]
    UnknownEffect { kind: String, nearest: Option<String>, known: String },
    /// An effect cannot be read or placed.
    #[error("effect \"{effect}\": {problem}")]
    BadEffect { effect: String, problem: String },
    /// A seated observation whose recording has no board.
    #[error("{dwell}: the tip is seated in a cavity, but the model has no board frame for this recording")]
    NoBoard { dwell: armcal_core::DwellId },
    /// An observation of a recording that a model with recordings of its own does not have.
    #[error(
        "{dwell} is of none of the {recordings} recordings of the model: make the model with all recordings"
    )]
    NoRecording { dwell: armcal_core::DwellId, recordings: usize },
}

/// The candidate most similar to `name`, if any is similar at all.
pub(crate) fn most_similar<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    candidates
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}

/// The end of a sentence about a name that is not among the candidates.
pub(crate) fn similar_name_hint<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> String {
    did_you_mean(&most_similar(name, candidates))
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!("; did you mean \"{name}\"?")).unwrap_or_default()
}
