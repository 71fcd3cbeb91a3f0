//! Why there is no set-point for a target.

/// Every variant names the target and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum CompensateError {
    /// No posture within the limits brings the tip there.
    #[error(
        "target `{target}`: the {arm} arm stays {left_mm:.2} mm{turn} away from it at joints {joint_deg}; {advice}",
        turn = if *left_deg > 0.0 { format!(" and {left_deg:.2} deg") } else { String::new() },
    )]
    Unreachable {
        target: String,
        /// `nominal` or `calibrated`.
        arm: &'static str,
        /// Distance left [mm].
        left_mm: f64,
        /// Rotation left [deg].
        left_deg: f64,
        joint_deg: String,
        advice: String,
    },
    /// A number of a target is missing or not finite.
    #[error("target `{target}`: {problem}")]
    BadTarget { target: String, problem: String },
    /// A joint vector of the wrong length, or limits the wrong way round.
    #[error("{what}: {problem}")]
    BadJoints {
        /// `start`, `limits`, ...
        what: &'static str,
        problem: String,
    },
    /// Nothing to compute.
    #[error("there is no target; give one a line, such as `0.40, 0.05, 0.12`")]
    NoTargets,
}
