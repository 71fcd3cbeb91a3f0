//! From observations to corrected parameters: the fit, what it is worth, and how it does on points it never saw.
//!
//! One objective, each symbol with the module that owns it:
//!
//! ```text
//! min_p  sum_j rho(|L_j^-1 (y_j - f_j(p))| / s) + 1/2 sum_k ((p_k - nominal_k) / sigma_k)^2,   lower <= p <= upper
//! ```
//!
//! * `y - f` and its derivative: [`problem`], for a robot [`ModelProblem`]; `L`: whitening by measurement and
//!   encoder noise, evaluated at the start (`whitened`);
//! * `rho`: Huber on the norm of an observation (`loss`), `s`: its robust scale (`robust`);
//! * the minimum: `solver`; eq. 4 of the paper instead: `paper`;
//! * a fit with other priors begins where the one before it ended, a turn of the hold-out where the fit to all did: what the
//!   problem is there is `remembered`;
//! * covariance, intervals, rank, what the data cannot determine: `statistics`, `undetermined`, `words`;
//! * priors that nobody declared: `priors` learns how far lengths, angles and joint zeros of this arm are from nominal;
//! * start values of frames nobody knows: [`align_frames`], [`fit_frames`];
//! * hold-out and the whole calibration: [`HoldoutConfig`], [`calibrate`];
//! * what is seen in the errors: before against after on dwells that neither fit saw, `compare`, `held_out`, `sign_flips`; signs
//!   for very many sums at once, `signs`; probabilities of what is rare, [`tails`]; how visits to one pose repeat, `repeatability`;
//!   in which dwells errors are largest, `error_places`; what each dwell says about each joint, for the eye, `implied`;
//! * many recordings of one arm, each with parameters of its own ([`armcal_model::Model::with_own`]): their columns are eliminated
//!   recording by recording ([`problem::Problem::known`]), so that work and memory grow with the number of recordings;
//! * two arms whose tips are joined, each the other's reference: what their angles leave open, `joined`.

mod alignment;
mod alike;
mod calibration;
mod compare;
mod config;
mod covariance;
mod describe;
mod ended;
mod error;
mod error_places;
mod export;
mod fit;
mod fit_warnings;
mod frames;
mod held_out;
mod holdout;
mod implied;
mod joined;
mod linearise;
mod loss;
mod model_problem;
mod noise;
mod nominal;
mod outcome;
mod paired;
mod paper;
mod poses;
mod priors;
pub mod problem;
mod products;
mod remembered;
mod repeatability;
mod rigid_fit;
mod robust;
mod rows;
mod sign_flips;
mod signs;
mod solver;
mod statistics;
mod structure;
pub mod tails;
mod undetermined;
mod whitened;
mod wider;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and tell its numbers")]
mod tests;

pub use alike::AlikePoses;
pub use calibration::{calibrate, calibrate_beside, holdout_turns};
pub use compare::{compare_errors, compare_heldout, held_out_errors_m, mean_by_dwell};
pub use config::{FitConfig, HoldoutConfig, Objective, RecordingKey, Scale, Stop};
pub use covariance::Covariance;
pub use ended::{Ended, fitted_values};
pub use error::CalibrateError;
pub use error_places::{DwellError, ErrorPlace, error_places, single_dwells};
pub use export::{WhitenedProblem, whitened_problem};
pub use fit::{fit, fit_problem};
pub use fit_warnings::{ABOVE_FLOOR, ABOVE_NOISE, INADEQUATE, OUTLIERS};
pub use frames::{align_frames, fit_frames, fit_frames_from};
pub use held_out::HeldOut;
pub use implied::{BLURRED, ImpliedError, implied_joint_errors};
pub use linearise::{LinearAxis, LinearPose, Linearisation, linearise, linearise_more};
pub use model_problem::{ModelProblem, PositionNoise, position_covariance_m2};
pub use noise::expected_norm_m;
pub use outcome::*;
pub use paired::{MIN_CAVITIES, Pair, PairedDifference, grouped_ci95, independent_groups};
pub use poses::{SAME_POSE_RAD, measured_together};
pub use products::{gram, inner_product};
pub use repeatability::repeatability_m;
pub use sign_flips::SignFlips;
pub use signs::Signs;
