//! A run on the workbench: every question of the page is a refit of its observations.

use super::requests::{Choices, Wanted};
use super::source::Given;
use super::texts::Texts;
use crate::error::Error;
use crate::extended::extend_pipeline;
use armcal_calibrate::{FitConfig, HoldoutConfig, Stop, calibrate};
use armcal_config::Pipeline;
use armcal_diagnose::Diagnosis;
use armcal_model::{EffectSpec, Model, catalogue};
use armcal_pipeline::Pooled;
use armcal_recording::atomic;
use armcal_report::refit_json;
use armcal_result::sensitivity::Basis;
use armcal_result::{Refit, Run};
use armcal_stages::{Steps, frames};
use std::path::PathBuf;
use std::time::Instant;

/// A finished run, ready to be refitted.
pub struct RefitSession {
    pipeline: Pipeline,
    path: PathBuf,
    /// The arm without effects.
    geometry: Model,
    /// The pipeline's own effects.
    own: Vec<EffectSpec>,
    run: Run,
    basis: Basis,
}

impl RefitSession {
    /// Runs a pipeline, or pools `results` with it; what comes of it stays in memory, and what it says in words.
    pub fn of(given: &Given, progress: &dyn Steps) -> Result<(RefitSession, Texts), Error> {
        let Given { pipeline: path, results, concluded, run } = given;
        let (pipeline, geometry, run, texts) = match &results[..] {
            [] => {
                let pipeline = Pipeline::load(path)?;
                let mut settled = armcal_pipeline::settle_again(&pipeline, concluded.clone(), progress)?;
                let geometry = settled.fitted.geometry.clone();
                let earlier = run.as_deref().filter(|_| settled.concluded.is_some());
                let texts = earlier.map(Texts::read).transpose()?.flatten();
                let run = if texts.is_some() {
                    // What was concluded from just this calibration was also fitted and written.
                    let diagnosis = settled.concluded.take().map(|concluded| concluded.diagnosis);
                    Run { diagnosis, ..settled.into_run(&pipeline).0 }
                } else {
                    let (mut run, _) = settled.diagnosed(&pipeline, progress);
                    armcal_pipeline::add_refits(&mut run, &pipeline, progress)?;
                    run
                };
                (pipeline, geometry, run, texts)
            }
            results => {
                let pipeline = Pipeline::load_for_others(path)?;
                let Pooled { run, geometry } =
                    armcal_pipeline::calibrate_jointly(&pipeline, results, progress)?;
                (pipeline, geometry, run, None)
            }
        };
        let own = frames::effect_specs(&pipeline, &geometry)?;
        let basis = Basis::of(&run);
        let texts = texts.map_or_else(|| Texts::of(&run, &basis), Ok)?;
        Ok((RefitSession { pipeline, path: path.clone(), geometry, own, run, basis }, texts))
    }

    /// What can be chosen.
    pub(super) fn choices(&self) -> Choices {
        let mut holdouts = vec![("as in the pipeline".to_owned(), self.pipeline.holdout.clone())];
        let several = self.run.recordings.len() > 1;
        if several {
            holdouts.push(("each recording in turn".into(), HoldoutConfig::EachRecording));
        }
        holdouts.push(("places, in 5 turns".into(), HoldoutConfig::CavityFolds { k: 5 }));
        holdouts.push(("a fifth of the dwells".into(), HoldoutConfig::Random { share: 0.2, seed: 0 }));
        for (index, recording) in self.run.recordings.iter().enumerate().filter(|_| several) {
            let recordings = vec![armcal_calibrate::RecordingKey::Index(index)];
            holdouts
                .push((format!("recording {}", recording.name), HoldoutConfig::Recordings { recordings }));
        }
        holdouts.push(("nothing".into(), HoldoutConfig::None));
        let offered = self.geometry.candidates(&self.run.session);
        let mut effects: Vec<String> = offered.iter().map(EffectSpec::to_string).collect();
        effects.extend(
            catalogue()
                .iter()
                .map(|k| k.name.to_owned())
                .filter(|n| !effects.iter().any(|e| e.starts_with(n)))
                .collect::<Vec<_>>(),
        );
        Choices { effects, holdouts }
    }

    /// Refits with what is wanted: the answer as the page reads it.
    ///
    /// # Errors
    /// What cannot be fitted, and `stop`.
    pub(super) fn refit(&self, wanted: &Wanted, stop: &Stop) -> Result<String, Error> {
        let begun = Instant::now();
        stop.check()?;
        let specs = self.specs(wanted)?;
        let model = self.geometry.with_effects(&specs, &self.run.session)?;
        let holdout = wanted.holdout.as_ref().unwrap_or(&self.pipeline.holdout);
        let fit = FitConfig { stop: stop.clone(), ..self.pipeline.fit.clone() };
        let calibration = calibrate(&model, &self.run.observations, &fit, holdout)?;
        stop.check()?;
        let added = specs.iter().filter(|s| !self.own.contains(s)).map(EffectSpec::to_string).collect();
        let refit = Refit { effects: added, model, calibration };
        let shown = refit_json(&self.run, &self.basis, &refit)?;
        let milliseconds = begun.elapsed().as_secs_f64() * 1e3;
        Ok(format!("{{\"milliseconds\":{milliseconds:.1},\"shown\":{shown}}}"))
    }

    /// Writes the pipeline with what is wanted, beside the original, as `armcal add` would.
    pub(super) fn keep(&self, wanted: &Wanted) -> Result<PathBuf, Error> {
        let specs = self.specs(wanted)?;
        if let Some(gone) = self.own.iter().find(|own| !specs.contains(own)) {
            return Err(Error::OwnEffect { effect: gone.to_string(), path: self.path.clone() });
        }
        let new: Vec<EffectSpec> = specs.into_iter().filter(|s| !self.own.contains(s)).collect();
        if new.is_empty() {
            return Err(Error::NothingToKeep { path: self.path.clone() });
        }
        let sets = self.run.diagnosis.as_ref().map_or_else(Vec::new, Diagnosis::sets);
        let extended = extend_pipeline(&self.pipeline, &self.path, None, (&new, &sets))?;
        atomic::write(&extended.path, extended.pipeline.text.as_bytes()).map_err(Error::Output)?;
        Ok(extended.path)
    }

    /// The effects by name: the pipeline's own as it has them, others from the catalogue, then formulas.
    fn specs(&self, wanted: &Wanted) -> Result<Vec<EffectSpec>, Error> {
        let named = wanted.effects.iter().map(|name| {
            let own = self.own.iter().find(|own| own.to_string() == *name).cloned();
            own.map_or_else(|| self.geometry.effect(name), Ok)
        });
        let joints = self.geometry.chain().joint_names();
        let formulas = wanted.expressions.iter().map(|e| e.table().spec(joints));
        Ok(named.chain(formulas).collect::<Result<Vec<_>, _>>()?)
    }
}
