//! From dwells to a fit: association and calibration depend on each other, and take turns until both stay.

use crate::RunError;
use crate::associated::Associated;
use crate::declared::{Change, change_nominals};
use crate::frames;
use crate::measures::Measures;
use crate::observe::{self, Observed};
use crate::seen::RecordingData;
use armcal_calibrate::{Calibration, calibrate};
use armcal_config::Pipeline;
use armcal_core::{Dwell, Observation, Rejection};
use armcal_diagnose::Calibrated;
use armcal_model::{Chain, EffectSpec, Model, Session};
use armcal_table::{Association, Board, Place};

/// Everything that a calibration is made from, and in which a mistake of the setup could be.
#[derive(Clone)]
pub struct Inputs {
    /// The pipeline.
    pub pipeline: Pipeline,
    /// The nominal arm.
    pub chain: Chain,
    /// The calibration table, if there is one.
    pub board: Option<Board>,
    /// What each recording showed by itself.
    pub seen: Vec<RecordingData>,
    /// Changes to the nominal values of parameters, in order.
    pub changes: Vec<Change>,
    /// Rounds of association and fit at most.
    pub most_rounds: usize,
    /// Associations that need not be made again.
    pub known: Associated,
}

impl Inputs {
    /// Fits them: associates, starts the frames, calibrates.
    pub fn fit(&self) -> Result<Fitted, RunError> {
        fit_places(self, &mut ())
    }

    /// All dwells.
    pub fn dwells(&self) -> impl Iterator<Item = &Dwell> {
        self.seen.iter().flat_map(|s| &s.dwells)
    }

    /// Changes every dwell.
    pub fn each_dwell(&mut self, mut change: impl FnMut(&mut Dwell)) {
        self.seen.iter_mut().flat_map(|s| &mut s.dwells).for_each(&mut change);
    }
}

/// Inputs with every dwell in its place, calibrated.
pub struct Fitted {
    /// The nominal arm in its frames, without effects.
    pub geometry: Model,
    /// The same with the pipeline's effects: what was calibrated.
    pub model: Model,
    /// What the fit saw.
    pub observations: Vec<Observation>,
    /// What effects know of all of it together.
    pub session: Session,
    /// The calibration.
    pub calibration: Calibration,
    /// Where every dwell is on the table, by recording.
    pub places: Vec<Option<Association>>,
    /// Dwells that are none, and why.
    pub rejections: Vec<Rejection>,
    /// Rounds of association and fit.
    pub rounds: usize,
}

impl Fitted {
    /// Where the dwells turned out to be, where there is a table.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        self.places.iter().flatten().flat_map(|a| &a.assignments).map(|a| &a.place)
    }

    /// What a diagnosis asks of it.
    pub fn calibrated<'a>(&'a self, pipeline: &'a Pipeline) -> Calibrated<'a> {
        let Fitted { model, calibration, observations, session, .. } = self;
        let (fit, holdout) = (&pipeline.fit, &pipeline.holdout);
        Calibrated { model, calibration, observations, session, fit, holdout }
    }
}

/// Hears how rounds of association and fit go, and may end them before they settle.
pub trait Rounds {
    /// A round begins, the first with 1.
    fn begins(&mut self, _round: usize) {}
    /// Whether a fit to these is worth its time.
    fn is_worth_fitting(&mut self, _observations: &[Observation]) -> bool {
        true
    }
    /// Whether another round could be worth its time where this one ended so.
    fn goes_on(&mut self, _fitted: &Fitted) -> bool {
        true
    }
}

impl Rounds for () {}

/// Associates and calibrates in turn until every dwell stays in its place.
pub fn fit_places(inputs: &Inputs, heard: &mut dyn Rounds) -> Result<Fitted, RunError> {
    let Inputs { pipeline, chain, board, seen, changes, known, .. } = inputs;
    let board = board.as_ref();
    let mut geometry = frames::nominal_model(pipeline, chain, board, seen)?;
    change_nominals(&mut geometry, changes)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let mut places =
        observe::associate_all(pipeline, board, &geometry, &geometry.nominal(), false, (seen, known))?;
    let measures = Measures::of(pipeline, seen);
    let near = match measures.is_empty() {
        true => Vec::new(),
        false => {
            let sure = observe::build_observations(pipeline, board, seen, &places).observations;
            measures.near(&mut geometry, &sure)?
        }
    };
    let mut measured = near.clone();
    let mut rounds = 0;
    loop {
        rounds += 1;
        heard.begins(rounds);
        frames::start_frames(pipeline, &mut geometry, &places);
        let mut observed = observe::build_observations(pipeline, board, seen, &places);
        measures.add(&mut observed, &measured)?;
        let Observed { observations, rejections } = observed.not_empty()?;
        if !heard.is_worth_fitting(&observations) {
            return Err(RunError::GivenUp);
        }
        let model = with_effects(pipeline, &geometry, &effects, &observations)?;
        let calibration = calibrate(&model, &observations, &pipeline.fit, &pipeline.holdout)?;
        let session = frames::session(pipeline, &observations);
        let mut fitted =
            Fitted { geometry, model, observations, session, calibration, places, rejections, rounds };
        let again = match rounds < inputs.most_rounds && heard.goes_on(&fitted) {
            true => updated_places(inputs, &fitted, (&measures, &near, &measured))?,
            false => None,
        };
        match again {
            Some(again) => (geometry, (places, measured)) = (fitted.geometry, again),
            None => {
                let Fitted { rejections, model, calibration, .. } = &mut fitted;
                measures.explain(rejections, model, calibration);
                return Ok(fitted);
            }
        }
    }
}

/// Where dwells are on the table, by recording, and which measurements close.
type WhereAll = (Vec<Option<Association>>, Vec<bool>);

/// Where the dwells are by a fit, and what closes by it; none where both stay.
fn updated_places(
    inputs: &Inputs,
    fitted: &Fitted,
    (measures, near, measured): (&Measures<'_>, &[bool], &[bool]),
) -> Result<Option<WhereAll>, RunError> {
    let Inputs { pipeline, board, seen, known, .. } = inputs;
    let (model, calibration) = (&fitted.model, &fitted.calibration);
    let values = calibration.fit.values();
    let again = observe::associate_all(pipeline, board.as_ref(), model, &values, true, (seen, known))?;
    let closing = measures.closing(model, calibration, near);
    let stays = observe::same_places(&again, &fitted.places) && closing == measured;
    Ok((!stays).then_some((again, closing)))
}

/// The geometry with effects, or as it is without any.
pub fn with_effects(
    pipeline: &Pipeline,
    geometry: &Model,
    effects: &[EffectSpec],
    observations: &[Observation],
) -> Result<Model, RunError> {
    let session = frames::session(pipeline, observations);
    geometry.check_declared(&session)?;
    Ok(geometry.with_effects(effects, &session)?)
}
