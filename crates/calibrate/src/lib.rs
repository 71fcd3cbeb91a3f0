//! From observations to corrected parameters: the fit, what it is worth, and how it does on points it never saw.
//!
//! One objective, each symbol with the module that owns it:
//!
//! ```text
//! min_p  sum_j rho(|L_j^-1 (y_j - f_j(p))| / s) + 1/2 sum_k ((p_k - nominal_k) / sigma_k)^2,   lower <= p <= upper
//! ```
//!
//! * `objective`: `y - f` and its derivative, [`problem`], for a robot [`ModelProblem`]; `L`, whitening by measurement and encoder
//!   noise, evaluated at the start (`whitened`); `rho`, Huber on the norm of an observation (`loss`), `s`, its robust scale
//!   (`robust`); the minimum (`solver`). What a problem is where another fit ended is `remembered`. Of many recordings of one arm,
//!   each with parameters of its own ([`armcal_model::Model::with_own`]), columns are eliminated recording by recording
//!   ([`problem::Problem::known`]), so that work and memory grow with the number of recordings;
//! * `precision`: covariance, intervals, rank, what the data cannot determine (`statistics`, `undetermined`, `describe`);
//! * `fit`: start values of frames nobody knows, [`align_frames`], [`fit_frames`]; then everything, with priors that nobody
//!   declared as wide as this arm needs (`priors`); eq. 4 of the paper instead: `paper`;
//! * `holdout`: what a fit does not see, [`HoldoutConfig`], and the whole calibration, [`calibrate`];
//! * `errors`: what is seen in them: before against after on dwells that neither fit saw (`compare`, `held_out`, `sign_flips`);
//!   probabilities of what is rare, [`tails`]; how visits to one pose repeat (`repeatability`); where errors are largest
//!   (`error_places`); what each dwell says about each joint, for the eye (`implied`).

mod config;
mod error;
mod errors;
mod fit;
mod holdout;
mod objective;
mod outcome;
mod precision;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and tell its numbers")]
mod tests;

pub use config::{FitConfig, HoldoutConfig, Objective, RecordingKey, Scale, Stop};
pub use error::CalibrateError;
pub use errors::compare::{compare_errors, compare_heldout, held_out_errors_m, mean_by_dwell};
pub use errors::error_places::{DwellError, ErrorPlace, error_places, single_dwells};
pub use errors::held_out::HeldOut;
pub use errors::implied::{BLURRED, ImpliedError, implied_joint_errors};
pub use errors::paired::{MIN_CAVITIES, Pair, PairedDifference, grouped_ci95, independent_groups};
pub use errors::repeatability::repeatability_m;
pub use errors::sign_flips::SignFlips;
pub use errors::signs::Signs;
pub use errors::tails;
pub use fit::ended::{Ended, fitted_values};
pub use fit::export::{WhitenedProblem, whitened_problem};
pub use fit::fit;
pub use fit::fit_problem::fit_problem;
pub use fit::fit_warnings::INADEQUATE;
pub use fit::frames::{align_frames, fit_frames, fit_frames_from};
pub use holdout::calibration::{calibrate, calibrate_beside, holdout_turns};
pub use objective::alike::AlikePoses;
pub use objective::linearise::{LinearAxis, LinearPose, Linearisation, linearise, linearise_more};
pub use objective::model_problem::{ModelProblem, PositionNoise, position_covariance_m2};
pub use objective::noise::expected_norm_m;
pub use objective::poses::{SAME_POSE_RAD, measured_together};
pub use objective::problem;
pub use objective::products::{gram, inner_product};
pub use outcome::covariance::Covariance;
pub use outcome::*;
