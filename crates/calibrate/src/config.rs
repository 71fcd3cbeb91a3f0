//! The `[fit]` and `[holdout]` sections of a pipeline.

use crate::CalibrateError;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Objective {
    /// Huber loss on the norm of each whitened observation; the default.
    #[default]
    Robust,
    /// Plain weighted least squares.
    LeastSquares,
    /// Eq. 4 of the paper: the sum of distances within the bounds, and `E <= k a`.
    Paper,
}

/// Where the scale of the residuals, in units of the declared noise, comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Estimated robustly from the residuals, never below the declared noise; the default.
    #[default]
    Estimated,
    /// The declared noise is taken at its word.
    Declared,
}

/// How the parameters are fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FitConfig {
    /// `"robust"` (default), `"least-squares"` or `"paper"` (eq. 4).
    pub objective: Objective,
    /// Huber's constant for one dimension, 1.345 (default): 95 % efficient under Gaussian noise. For 3-vectors
    /// it is multiplied by 1.2104, for pose residuals of 6 rows by 1.3898, which keeps the 95 %.
    pub huber_c: f64,
    /// `"estimated"` (default) or `"declared"`: the residual scale at which the loss turns from square to linear.
    pub scale: Scale,
    /// Whether orientations of tracked observations are fitted too; default false: positions only.
    pub use_orientation: bool,
    /// Whether a parameter with finite bounds but no `prior_sigma` gets a prior of 0.8 times half the width of
    /// its bounds (4 mm for +-5 mm), centred on nominal; default true. It keeps what the data cannot determine
    /// at nominal; what they can determine it moves by far less than its interval. `"paper"` minimises without it and
    /// uses it for the intervals only.
    pub bounds_as_prior: bool,
    /// Whether the default prior of the robot's parameters, where the pipeline and the model declare none, narrows to
    /// what the data say about lengths, angles between axes and joint zeros; default true. Not for `"paper"`.
    pub learn_priors: bool,
    /// `a` of eq. 4, the average accuracy asked for [mm]; default: none, so that `E <= k a` is not asked.
    pub average_accuracy_mm: Option<f64>,
    /// Limit of iterations of one solve; default 200.
    pub max_iterations: usize,
    /// Mean error [m] of the nominal arm, its frames placed, above which a fit is given up; not set by files, default: none.
    #[serde(skip)]
    pub give_up_above_m: Option<f64>,
    /// Whether the last step of a fit is evaluated however small it is, and no derivative is taken from another fit. Not set by
    /// files, default: false.
    #[serde(skip)]
    pub every_step: bool,
    /// By which whoever asked says that nobody waits any more. Not set by files, default: never.
    #[serde(skip)]
    pub stop: Stop,
}

/// Says to a calibration under way that nobody waits for it any more.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Nobody waits any more: every fit with it ends at its next step.
    pub fn now(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// # Errors
    /// [`CalibrateError::Stopped`].
    pub fn check(&self) -> Result<(), CalibrateError> {
        if self.0.load(Ordering::Relaxed) { Err(CalibrateError::Stopped) } else { Ok(()) }
    }
}

/// Who may stop a fit says nothing of how it is done.
impl PartialEq for Stop {
    fn eq(&self, _: &Stop) -> bool {
        true
    }
}

impl Default for FitConfig {
    fn default() -> FitConfig {
        FitConfig {
            objective: Objective::Robust,
            huber_c: 1.345,
            scale: Scale::Estimated,
            use_orientation: false,
            bounds_as_prior: true,
            learn_priors: true,
            average_accuracy_mm: None,
            max_iterations: 200,
            give_up_above_m: None,
            every_step: false,
            stop: Stop::default(),
        }
    }
}

impl FitConfig {
    /// Refuses impossible values.
    pub fn check(&self) -> Result<(), CalibrateError> {
        let positive = |key, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            let why = "give a number above zero".to_string();
            Err(CalibrateError::BadConfig { key, value: value.to_string(), why })
        };
        positive("fit.huber_c", self.huber_c)?;
        positive("fit.max_iterations", self.max_iterations as f64)?;
        self.average_accuracy_mm.map_or(Ok(()), |a| positive("fit.average_accuracy_mm", a))
    }
}

/// A recording by its place in the pipeline or by the name of its board frame (`board.<name>`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum RecordingKey {
    /// Index in the order of the pipeline, from 0.
    Index(usize),
    /// Name, as in the model's frame `board.<name>`.
    Name(String),
}

impl std::fmt::Display for RecordingKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            RecordingKey::Index(index) => write!(f, "{index}"),
            RecordingKey::Name(name) => f.write_str(name),
        }
    }
}

/// Which observations the fit must not see, so that its error on them is honest.
///
/// ```toml
/// [holdout]
/// kind = "every-nth-cavity"
/// n = 4
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum HoldoutConfig {
    /// Nothing is held out; the default.
    #[default]
    None,
    /// All visits to the named cavities, in every recording.
    Cavities {
        /// Names as in the board file.
        names: Vec<String>,
    },
    /// All visits to every `n`-th cavity, cavities sorted by name (digits as numbers).
    EveryNthCavity {
        /// 2 or more.
        n: usize,
        /// Which of the first `n` is the first held out, from 0; default 0.
        #[serde(default)]
        offset: usize,
    },
    /// Whole recordings.
    Recordings {
        /// Names or indices.
        recordings: Vec<RecordingKey>,
    },
    /// Each recording in turn; the residuals of all turns are pooled.
    EachRecording,
    /// `k` groups of recordings, dealt out in their order, each group held out in turn.
    RecordingFolds {
        /// 2 or more.
        k: usize,
    },
    /// `k` groups of cavities, dealt out by hash, each held out in turn; tracked dwells are dealt by poses.
    CavityFolds {
        /// 2 or more.
        k: usize,
    },
    /// A share of the dwells, drawn pose by pose by a hash of seed and dwell: the same on every machine.
    Random {
        /// Between 0 and 1.
        share: f64,
        /// Any number; default 0.
        #[serde(default)]
        seed: u64,
    },
    /// Listed dwells, `[recording, dwell]` each.
    Dwells {
        /// Recording index and dwell index, both from 0.
        dwells: Vec<[usize; 2]>,
    },
}
