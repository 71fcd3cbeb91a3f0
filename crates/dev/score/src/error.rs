//! Why a scenario has no answer.

use armcal_stages::RunError;

/// Why a scenario cannot be scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// The calibration of what was simulated, or its diagnosis.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The simulated rig.
    #[error(transparent)]
    Lab(#[from] armcal_lab::LabError),
    /// A sealed scenario's pipeline switches the diagnosis off.
    #[error("the pipeline asks for no diagnosis; remove `enabled = false` from [diagnosis]")]
    NotDiagnosed,
    /// Reading the truth.
    #[error("writing the result as JSON: {0}")]
    Json(serde_json::Error),
}

armcal_stages::stopped_as_run!(
    ScoreError:
    armcal_config::ConfigError,
    armcal_model::ModelError,
    armcal_calibrate::CalibrateError,
    armcal_diagnose::DiagnoseError
);
