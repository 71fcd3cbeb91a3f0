//! A calibration inside another program: recordings and a URDF in, errors and what the model is missing out.
//!
//! `cargo run --release --example embed -- pipelines/mukca-panda4.toml`

use armcal_config::Pipeline;
use armcal_pipeline::run;
use armcal_stages::Silent;
use std::path::Path;

/// What another program wants to know.
pub struct Answer {
    /// Mean error on points that the fit did not see, of the nominal and of the calibrated arm [mm].
    pub error_mm: [f64; 2],
    /// Effects that the model is missing, all that are one answer beside each other.
    pub missing: Vec<Vec<String>>,
    /// The error with them [mm].
    pub with_them_mm: f64,
}

/// Calibrates what a pipeline file names; nothing is printed or written.
pub fn calibrate(path: &Path) -> Result<Answer, Box<dyn std::error::Error>> {
    let pipeline = Pipeline::load(path)?;
    let (run, _recordings) = run(&pipeline, &Silent)?;
    let judged = run.calibration.judged();
    let error_mm = [judged.nominal.mean_m, judged.fitted.mean_m].map(|m| m * 1e3);
    let Some(diagnosis) = run.diagnosis else {
        return Ok(Answer { error_mm, missing: Vec::new(), with_them_mm: error_mm[1] });
    };
    let missing = diagnosis.effects.iter().map(|effect| effect.set.clone()).collect();
    Ok(Answer { error_mm, missing, with_them_mm: diagnosis.holdout_mm.after })
}

#[allow(clippy::print_stdout, reason = "an example prints")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("which pipeline?")?;
    let answer = calibrate(Path::new(&path))?;
    println!("{:.3} -> {:.3} mm", answer.error_mm[0], answer.error_mm[1]);
    println!("missing: {:?}, {:.3} mm with them", answer.missing, answer.with_them_mm);
    Ok(())
}
