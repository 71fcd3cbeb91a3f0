//! What can be wrong with a model, and what to do about it.
//!
//! A `cause` is part of the message, not a source: nobody prints it twice.

use std::path::PathBuf;

/// Errors of reading, building and writing models.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The DH table is not what the format asks for.
    #[error("reading the DH table {}: {cause}", path.display())]
    DhToml {
        /// The file.
        path: PathBuf,
        /// Where and what, with the line.
        cause: Box<toml::de::Error>,
    },
    /// A number is outside its range.
    #[error("{}: {key} = {value}; expected {expected}", path.display())]
    BadValue {
        /// The file.
        path: PathBuf,
        /// The key, with its row.
        key: String,
        /// What stands there.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Two rows have one name.
    #[error("{}: there are two rows named \"{row}\"; every parameter needs a name of its own", path.display())]
    DuplicateRow {
        /// The file.
        path: PathBuf,
        /// The name.
        row: String,
    },
    /// A row has no name.
    #[error("{}: row {index} (from 1) has an empty name; name it after its joint", path.display())]
    NamelessRow {
        /// The file.
        path: PathBuf,
        /// Position of the row, from 1.
        index: usize,
    },
    /// Arms that cannot be joined.
    #[error("two arms: {problem}")]
    BadArms {
        /// What is wrong, and what would be right.
        problem: String,
    },
    /// A length that cannot be one.
    #[error("the length of {name} {problem}")]
    BadLength {
        /// What has it.
        name: String,
        /// What is wrong, and what would be right.
        problem: String,
    },
    /// Something was measured against a place, or from a length, that the model does not have.
    #[error(
        "{dwell} was measured against {what} {index}, and the model has {known}: give it every place and length"
    )]
    NoPlace {
        /// The dwell.
        dwell: armcal_core::DwellId,
        /// `place` or `length`.
        what: &'static str,
        /// Which one.
        index: usize,
        /// How many the model has.
        known: usize,
    },
    /// Nothing moves.
    #[error("{}: the chain has no moving joint; give at least one row joint = \"revolute\" or \"prismatic\"", path.display())]
    NoJoint {
        /// The file.
        path: PathBuf,
    },
    /// Masses are wanted of a file that has none.
    #[error(
        "{}: no link that moves has a mass, and masses = \"urdf\" asks for them: write <inertial><mass value=\"...\"/></inertial> \
         in its links, or leave `masses` out",
        path.display()
    )]
    NoMasses {
        /// The file.
        path: PathBuf,
    },
    /// The URDF is not well-formed XML.
    #[error("{}:{line}: the URDF is not well-formed XML: {cause}", path.display())]
    UrdfXml {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u32,
        /// What the parser says.
        cause: roxmltree::Error,
    },
    /// An element of the URDF cannot be used.
    #[error("{}:{line}: {subject}: {problem}", path.display())]
    Urdf {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u32,
        /// Which element.
        subject: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// A link is not in the URDF.
    #[error("{}: there is no link \"{link}\"{}", path.display(), did_you_mean(nearest))]
    UnknownLink {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        link: String,
        /// The most similar link.
        nearest: Option<String>,
    },
    /// An observation is of a feature that the model does not have.
    #[error(
        "{dwell}: feature {feature} was measured or bears a load, and the model has {features}: give every marker its place on \
         the arm"
    )]
    NoFeature {
        /// The observation.
        dwell: armcal_core::DwellId,
        /// What it is of.
        feature: usize,
        /// How many the model has.
        features: usize,
    },
    /// A marker is on a link that the arm does not have.
    #[error("there is no link \"{link}\" among those of the arm{}", did_you_mean(nearest))]
    NoSuchLink {
        /// What was asked for.
        link: String,
        /// The most similar link.
        nearest: Option<String>,
    },
    /// The tip does not hang on the base.
    #[error("{}: the link \"{tip}\" does not descend from \"{base}\"; its ancestors are: {ancestors}", path.display())]
    NoPath {
        /// The file.
        path: PathBuf,
        /// Where the chain should begin.
        base: String,
        /// Where it should end.
        tip: String,
        /// The links above the tip, nearest first.
        ancestors: String,
    },
    /// The URDF to be edited is not the one the chain came from.
    #[error("{}: the joint \"{joint}\" of the model is not in this URDF; pass the file the model was read from", path.display())]
    ForeignUrdf {
        /// The file.
        path: PathBuf,
        /// The joint that is missing.
        joint: String,
    },
    /// The chain came from the other format.
    #[error("the model \"{model}\" was not read from a {format}, so it cannot be written as one")]
    WrongFormat {
        /// Name of the model.
        model: String,
        /// `DH table` or `URDF`.
        format: &'static str,
    },
    /// The frames and the chain use one name twice.
    #[error("two parameters are named \"{name}\"; rename the row or the recording behind it")]
    DuplicateParameter {
        /// The name.
        name: String,
    },
    /// A frame cannot be used.
    #[error("frame \"{frame}\": {problem}")]
    BadFrame {
        /// The frame.
        frame: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// No parameter has the name.
    #[error("no parameter matches \"{name}\"{}", did_you_mean(nearest))]
    UnknownParameter {
        /// Name or glob.
        name: String,
        /// The most similar parameter.
        nearest: Option<String>,
    },
    /// The name is not a valid glob.
    #[error("\"{pattern}\" is not a parameter name or pattern: {cause}")]
    BadPattern {
        /// The pattern.
        pattern: String,
        /// Why.
        cause: glob::PatternError,
    },
    /// An override left a parameter in a state that cannot be fitted.
    #[error("parameter \"{name}\": {problem}")]
    BadParameter {
        /// The parameter.
        name: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// A parameter vector of the wrong length.
    #[error("{actual} parameter values were given to a model that has {expected}")]
    ParameterCount {
        /// Given.
        actual: usize,
        /// Needed.
        expected: usize,
    },
    /// An observation does not fit the chain.
    #[error(
        "{dwell}: {actual} joint readings for a chain of {expected} joints; mend the joint names of the pipeline, or the rows of the model file"
    )]
    JointCount {
        /// The dwell.
        dwell: armcal_core::DwellId,
        /// Readings.
        actual: usize,
        /// Joints of the chain.
        expected: usize,
    },
    /// No entry of the catalogue has the name.
    #[error("there is no effect \"{kind}\"{}; the effects are: {known}", did_you_mean(nearest))]
    UnknownEffect {
        /// What was asked for.
        kind: String,
        /// The most similar entry.
        nearest: Option<String>,
        /// All of them.
        known: String,
    },
    /// An effect cannot be read or placed.
    #[error("effect \"{effect}\": {problem}")]
    BadEffect {
        /// Its spec.
        effect: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// A seated observation whose recording has no board.
    #[error("{dwell}: the tip is seated in a cavity, but the model has no board frame for this recording")]
    NoBoard {
        /// The dwell.
        dwell: armcal_core::DwellId,
    },
    /// An observation of a recording that a model with recordings of its own does not have.
    #[error(
        "{dwell} is of none of the {recordings} recordings of the model: make the model with all recordings"
    )]
    NoRecording {
        /// The dwell.
        dwell: armcal_core::DwellId,
        /// How many the model has.
        recordings: usize,
    },
}

/// The candidate most similar to `name`, if any is similar at all.
pub(crate) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    candidates
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!("; did you mean \"{name}\"?")).unwrap_or_default()
}
