//! What can go wrong between observations and parameters.

use armcal_model::ModelError;
use thiserror::Error;

/// Why a calibration could not be done. Every variant names the observation, parameter or config key.
#[derive(Debug, Error)]
pub enum CalibrateError {
    /// There is nothing to fit.
    #[error(
        "no observation to fit{context}: check that dwells were found and associated, and that the hold-out leaves some"
    )]
    NoObservations {
        /// Which set is empty, such as ` outside the hold-out`.
        context: String,
    },
    /// More unknowns than equations, with nothing known about them beforehand.
    #[error(
        "{rows} equations from {observations} dwells cannot give {unknown} free parameters about which nothing is known \
         beforehand ({names}): record at least {needed} dwells, fix some of them, or give them a prior_sigma or bounds"
    )]
    TooFewObservations {
        /// Scalar equations.
        rows: usize,
        /// Observations.
        observations: usize,
        /// Free parameters without prior or bounds.
        unknown: usize,
        /// Their names.
        names: String,
        /// Dwells that would give as many equations as unknowns.
        needed: usize,
    },
    /// No parameter may change.
    #[error("every parameter is fixed: free at least one under [model] before asking for a fit")]
    NothingFree,
    /// A residual or derivative is NaN or infinite.
    #[error(
        "{observation}: {what} is not finite{parameter} (joint readings {joint_rad:?} rad): check this dwell for missing \
         readings and the model for overflowing values"
    )]
    NotFinite {
        /// The observation.
        observation: String,
        /// Residual or derivative.
        what: &'static str,
        /// ` with respect to ...`, for a derivative.
        parameter: String,
        /// Joint readings of the observation [rad]; empty when the problem has none.
        joint_rad: Vec<f64>,
    },
    /// The nominal arm is further off than a fit was asked to mend.
    #[error("the nominal arm errs by {mean_m:.3} m on average, too much for this fit to begin")]
    GivenUp {
        /// Mean error, frames placed [m].
        mean_m: f64,
    },
    /// The covariance cannot whiten the observation.
    #[error(
        "{observation}: its covariance is not positive definite: declare a position noise above zero for this sensor or \
         board (cavity_sigma_mm, seat_sigma_mm)"
    )]
    BadCovariance {
        /// The observation.
        observation: String,
    },
    /// Observations and model do not fit together.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An observation is not complete.
    #[error("{observation}: {why}")]
    Mismatch {
        /// The observation.
        observation: String,
        /// What does not match and what to do.
        why: String,
    },
    /// Bounds that cannot be met.
    #[error("parameter `{name}`: {why}")]
    BadParameter {
        /// The parameter.
        name: String,
        /// What is wrong and what to do.
        why: String,
    },
    /// A key of the `[fit]` or `[holdout]` section has an impossible value.
    #[error("{key} = {value}: {why}")]
    BadConfig {
        /// The key, with its section.
        key: &'static str,
        /// The value given.
        value: String,
        /// What is possible.
        why: String,
    },
    /// The hold-out names something that is not there.
    #[error("holdout: no observation of {kind} `{name}`{hint}")]
    UnknownHoldout {
        /// Cavity, recording or dwell.
        kind: &'static str,
        /// The name given.
        name: String,
        /// `; did you mean ...` or what is present.
        hint: String,
    },
    /// The convex subproblem of eq. 4 failed.
    #[error(
        "sum of distances (eq. 4): the convex subproblem of iteration {iteration} ended with {status}: use objective = \
         \"robust\", or bounds that leave the parameters some room"
    )]
    Subproblem {
        /// Iteration of the sequential convex programming.
        iteration: usize,
        /// Status of the solver.
        status: String,
    },
    /// Whoever asked wants no answer any more.
    #[error("nobody waits for this calibration any more, so it was stopped")]
    Stopped,
    /// A linear system that should be positive definite is not.
    #[error(
        "{doing}: the normal equations are not positive definite; give `{worst}` a smaller prior_sigma or fix it"
    )]
    Singular {
        /// What was being computed.
        doing: &'static str,
        /// Parameter with the weakest diagonal.
        worst: String,
    },
}
