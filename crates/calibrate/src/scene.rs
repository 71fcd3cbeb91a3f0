//! What observations are predicted by: one model for all, or one for each recording of a pool.

use crate::problem::Known;
use crate::{CalibrateError, PooledModel};
use armcal_core::{Observation, Parameter};
use armcal_model::Model;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// One model for all observations, or a pool of recordings with parameters of their own.
#[derive(Debug, Clone, Copy)]
pub enum Scene<'a> {
    /// One model.
    Whole(&'a Model),
    /// A model for each recording, over one vector of parameters.
    Pooled(&'a PooledModel),
}

impl<'a> From<&'a Model> for Scene<'a> {
    fn from(model: &'a Model) -> Scene<'a> {
        Scene::Whole(model)
    }
}

impl<'a> From<&'a PooledModel> for Scene<'a> {
    fn from(pool: &'a PooledModel) -> Scene<'a> {
        Scene::Pooled(pool)
    }
}

impl<'a> Scene<'a> {
    /// The model with all boards.
    pub(crate) fn model(&self) -> &'a Model {
        match self {
            Scene::Whole(model) => model,
            Scene::Pooled(pool) => pool.model(),
        }
    }

    pub(crate) fn parameters(&self) -> &'a [Parameter] {
        match self {
            Scene::Whole(model) => model.parameters(),
            Scene::Pooled(pool) => pool.parameters(),
        }
    }

    pub(crate) fn nominal(&self) -> Vec<f64> {
        self.parameters().iter().map(|p| p.nominal).collect()
    }

    /// The model that predicts an observation, with its parameters out of `p`. An observation of no recording of the pool
    /// was refused by [`Scene::check`].
    pub(crate) fn seen<'p>(&self, o: &Observation, p: &'p [f64]) -> (&'a Model, Cow<'p, [f64]>) {
        let Scene::Pooled(pool) = self else { return (self.model(), Cow::Borrowed(p)) };
        match pool.in_recording(o.dwell.recording, p) {
            Some((model, own)) => (model, Cow::Owned(own)),
            None => (pool.model(), Cow::Borrowed(p)),
        }
    }

    /// Refuses an observation that the model cannot predict.
    pub(crate) fn check(&self, o: &Observation) -> Result<(), CalibrateError> {
        if let Scene::Pooled(pool) = self
            && o.dwell.recording >= pool.views().len()
        {
            let why = format!("there are {} recordings in the pool", pool.views().len());
            return Err(CalibrateError::Mismatch { observation: o.dwell.to_string(), why });
        }
        Ok(self.model().check(std::slice::from_ref(o))?)
    }

    /// Runs of observations that know the same parameters; none for one model.
    pub(crate) fn known(&self, observations: &[&Observation]) -> Vec<Known> {
        let Scene::Pooled(pool) = self else { return Vec::new() };
        let mut known: Vec<Known> = Vec::new();
        let mut end = 0;
        for run in self.alike(observations) {
            let blocks = end..end + run.len();
            end = blocks.end;
            let view = run.first().and_then(|o| pool.views().get(o.dwell.recording));
            known.extend(view.map(|view| Known { blocks, parameters: view.index.clone() }));
        }
        known
    }

    /// Runs of observations that are all seen by the same model and parameters.
    pub(crate) fn alike<'o>(
        &self,
        observations: &'o [&'o Observation],
    ) -> impl Iterator<Item = &'o [&'o Observation]> + use<'o> {
        let pooled = matches!(self, Scene::Pooled(_));
        observations.chunk_by(move |a, b| !pooled || a.dwell.recording == b.dwell.recording)
    }

    /// Names of the parts that only some recordings have (copies in a pool), for the recordings observed.
    pub(crate) fn own_parts(&self, observations: &[&Observation]) -> Vec<String> {
        let Scene::Pooled(pool) = self else { return Vec::new() };
        let observed: BTreeSet<usize> = observations.iter().map(|o| o.dwell.recording).collect();
        let mut parts: Vec<String> = Vec::new();
        for view in observed.iter().filter_map(|&recording| pool.views().get(recording)) {
            for &index in view.index.iter().filter(|&&index| pool.is_copy(index)) {
                let part = crate::frames::frame_of(&pool.parameters()[index]);
                if parts.last().is_none_or(|last| last != part) {
                    parts.push(part.to_owned());
                }
            }
        }
        parts
    }
}
