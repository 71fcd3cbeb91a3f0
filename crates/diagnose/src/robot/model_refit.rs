//! A model refitted with effects, each set of them once: what a diagnosis asks of it becomes a [`Problem`].

use crate::problem::{Candidate, Problem};
use crate::robot::knowledge::Knowledge;
use crate::robot::view::View;
use crate::{DiagnoseError, Refit};
use armcal_calibrate::{Ended, FitConfig, ModelProblem, fitted_values};
use armcal_core::{Observation, Parameter};
use armcal_model::{Model, Session};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Refits the model with accepted effects, each set of effects once: all observations fit, some of them weigh.
pub(crate) struct ModelRefit<'a> {
    model: &'a Model,
    values: Vec<f64>,
    seen: Seen<'a>,
    session: &'a Session,
    fit: &'a FitConfig,
    /// Every set of effects fitted so far.
    fits: BTreeMap<Vec<String>, Rc<Fitted>>,
    /// Size at which a candidate was refitted; `None` where it acts in proportion to its size.
    sizes: BTreeMap<String, Option<f64>>,
    pub knowledge: Knowledge,
    products: RefCell<BTreeMap<String, Candidate>>,
}

/// What a model is fitted to.
pub(crate) struct Seen<'a> {
    /// All of it.
    pub observations: &'a [Observation],
    /// Those that weigh explanations.
    pub weighed: &'a [Observation],
    /// Of very many those with which a fit to all of them begins.
    pub few: &'a [&'a Observation],
    /// The place of each pose of those that weigh.
    pub places: &'a [Option<String>],
}

/// A model with effects, and its parameters fitted to all observations.
struct Fitted {
    model: Model,
    values: Vec<f64>,
    /// Where the fit ended; none of the model without effects.
    ended: Option<Ended>,
}

impl Fitted {
    /// Where a fit of a model with some of its effects would end as this one's curvature has it; none where one of the others does
    /// something at nominal.
    fn without_others(&self, model: &Model) -> Option<Vec<f64>> {
        let others =
            self.model.effects().iter().filter(|e| model.effects().iter().all(|own| own.spec != e.spec));
        let mut held = Vec::new();
        for effect in others {
            let at = effect.parameters.clone().zip(&self.model.parameters()[effect.parameters.clone()]);
            let at: Vec<(usize, f64)> = at.map(|(k, p)| (k, p.nominal)).collect();
            if at[..effect.amplitudes].iter().any(|(_, nominal)| *nominal != 0.0) {
                return None;
            }
            held.extend(at);
        }
        let all = self.ended.as_ref()?.with_held(&held)?;
        let value = |p: &Parameter| Some(all[self.model.index(&p.name)?]);
        model.parameters().iter().map(value).collect()
    }
}

impl<'a> ModelRefit<'a> {
    /// Of a model and the parameters of its fit.
    pub fn new(
        (model, values): (&'a Model, Vec<f64>),
        seen: Seen<'a>,
        session: &'a Session,
        fit: &'a FitConfig,
        knowledge: Knowledge,
    ) -> ModelRefit<'a> {
        let (fits, sizes, products) = Default::default();
        ModelRefit { model, values, seen, session, fit, fits, sizes, knowledge, products }
    }

    /// Takes over at which sizes another refit of the same model found that effects act otherwise than at zero.
    pub fn take_sizes(&mut self, other: ModelRefit<'_>) {
        self.sizes = other.sizes;
    }

    fn model_with(&self, names: &[String]) -> Result<Model, DiagnoseError> {
        let specs = names.iter().map(|name| self.model.effect(name)).collect::<Result<Vec<_>, _>>()?;
        Ok(self.model.with_effects(&specs, self.session)?)
    }

    /// The model with effects, and its parameters fitted to all observations.
    fn fitted(&mut self, names: &[String]) -> Result<Rc<Fitted>, DiagnoseError> {
        if let Some(fit) = self.fits.get(names) {
            return Ok(fit.clone());
        }
        let model = self.model_with(names)?;
        let mut values = self.of_fewer(names, &model);
        let mut ended = None;
        if !names.is_empty() {
            let fitted = |some: &[&Observation], start: &[f64], sigma_scale: Option<f64>| {
                let problem = ModelProblem::new(&model, some.iter().copied(), self.fit)?;
                fitted_values(&problem, start, sigma_scale, self.fit)
            };
            let mut sigma_scale = None;
            if let Some((near, scale)) = self.near_more(names, &model) {
                (values, sigma_scale) = (near, Some(scale));
            } else if !self.seen.few.is_empty() {
                let ended = fitted(self.seen.few, &values, None)?;
                (values, sigma_scale) = (ended.values, Some(ended.sigma_scale));
            }
            let all: Vec<&Observation> = self.seen.observations.iter().collect();
            let of_all = fitted(&all, &values, sigma_scale)?;
            values.clone_from(&of_all.values);
            ended = Some(of_all);
        }
        let fitted = Rc::new(Fitted { model, values, ended });
        self.fits.insert(names.to_vec(), fitted.clone());
        Ok(fitted)
    }

    /// Where the largest fit with some of these effects ended, what it does not have as it is nominally: far from there a fit may
    /// end in another minimum.
    fn of_fewer(&self, names: &[String], model: &Model) -> Vec<f64> {
        let mut values = self.values.clone();
        values.extend(&model.nominal()[values.len()..]);
        let is_part = |(of, _): &(&Vec<String>, &Rc<Fitted>)| of.iter().all(|name| names.contains(name));
        if let Some((_, fewer)) = self.fits.iter().filter(is_part).max_by_key(|(of, _)| of.len()) {
            for (parameter, value) in fewer.model.parameters().iter().zip(&fewer.values) {
                model.index(&parameter.name).into_iter().for_each(|k| values[k] = *value);
            }
        }
        values
    }

    /// Where a fit with these effects nearly ends, from the smallest one with more, and the scale of the residuals there.
    fn near_more(&self, names: &[String], model: &Model) -> Option<(Vec<f64>, f64)> {
        let has_all = |of: &&Vec<String>| names.iter().all(|name| of.contains(name));
        let more = self.fits.keys().filter(has_all).min_by_key(|of| of.len())?;
        let more = &self.fits[more];
        Some((more.without_others(model)?, more.ended.as_ref()?.sigma_scale))
    }

    fn view<'v>(&'v self, model: &'v Model, values: &'v [f64]) -> View<'v> {
        View {
            model,
            values,
            observations: self.seen.weighed,
            session: self.session,
            fit: self.fit,
            sizes: &self.sizes,
            knowledge: &self.knowledge,
            places: self.seen.places,
            products: &self.products,
        }
    }
}

impl Refit for ModelRefit<'_> {
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let fitted = self.fitted(&member_specs(accepted))?;
        self.view(&fitted.model, &fitted.values).problem()
    }

    fn base(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let fitted = self.fitted(&member_specs(accepted))?;
        self.view(&fitted.model, &fitted.values).problem_at()
    }

    fn refine(&mut self, accepted: &[Candidate], candidate: &Candidate) -> Result<bool, DiagnoseError> {
        let [_] = candidate.amplitudes.as_slice() else { return Ok(false) };
        if candidate.is_group() || self.sizes.contains_key(&candidate.spec) {
            return Ok(false);
        }
        let base = member_specs(accepted);
        let fitted = self.fitted(&base)?;
        let with = self.fitted(&member_specs(&[accepted, std::slice::from_ref(candidate)].concat()))?;
        let own = with.model.effects().iter().find(|e| e.spec.to_string() == candidate.spec);
        let size = own.map_or(0.0, |e| with.values[e.parameters.start]);
        let spec = self.model.effect(&candidate.spec)?;
        let changed = size != 0.0 && self.view(&fitted.model, &fitted.values).bends(&spec, size)?;
        self.sizes.insert(candidate.spec.clone(), changed.then_some(size));
        Ok(changed)
    }
}

/// Names of the effects, members of groups each for itself, in order.
fn member_specs(accepted: &[Candidate]) -> Vec<String> {
    let mut names: Vec<String> = accepted.iter().flat_map(|c| c.members()).map(str::to_owned).collect();
    names.sort();
    names.dedup();
    names
}
