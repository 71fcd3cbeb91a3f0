//! Problems with effects and unlisted shapes in their base, each weighed once.

use crate::DiagnoseError;
use crate::bootstrap::Significance;
use crate::cells::Unlisted;
use crate::config::DiagnosisConfig;
use crate::judge::{Judged, independent_groups, judge, significance};
use crate::problem::{Candidate, Columns, Problem};
use crate::refit::Refit;
use crate::rivals::AfterRefit;
use crate::weigh::{Weighed, weigh};
use armcal_model::Toggle;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

/// Family of a shape that joins the base without a name.
const UNLISTED: &str = "unlisted";

/// A problem with some effects in its base, weighed; judgements are kept by entry.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    accepted: Vec<String>,
    /// The problem.
    pub problem: Problem,
    /// Weighed.
    pub weighed: Weighed,
    significance: OnceCell<Vec<Significance>>,
    judged: RefCell<BTreeMap<usize, Judged>>,
}

impl Room {
    fn new(accepted: Vec<String>, problem: Problem, weighed: Weighed) -> Room {
        Room { accepted, problem, weighed, significance: OnceCell::new(), judged: RefCell::default() }
    }

    /// Judges an entry, once.
    pub fn judge(&self, entry: usize, config: &DiagnosisConfig) -> Judged {
        if let Some(done) = self.judged.borrow().get(&entry) {
            return done.clone();
        }
        let significance =
            self.significance.get_or_init(|| significance(&self.problem, &self.weighed, config));
        let judged = judge(&self.problem, &self.weighed, significance, entry, config);
        self.judged.borrow_mut().insert(entry, judged.clone());
        judged
    }

    /// Whether columns help on groups the fit did not see.
    pub fn predicts_with(&self, columns: &Columns, config: &DiagnosisConfig) -> bool {
        let groups = independent_groups(&self.problem, &self.weighed);
        let effect = self.weighed.tamed(columns, &self.problem, config);
        let gain = self.weighed.gain(&self.problem, (columns, &effect), &groups, config);
        gain.p <= config.max_p_adjusted
    }
}

/// Gives rooms and remembers them: the same base is asked for more than once.
pub(crate) struct Rooms<'a> {
    refit: &'a mut dyn Refit,
    keep: Vec<bool>,
    config: &'a DiagnosisConfig,
    known: Vec<Rc<Room>>,
}

impl<'a> Rooms<'a> {
    /// `keep` masks dwells out of every problem; `first` is the problem without effects, weighed.
    pub fn new(
        refit: &'a mut dyn Refit,
        keep: Vec<bool>,
        first: (Problem, Weighed),
        config: &'a DiagnosisConfig,
    ) -> Rooms<'a> {
        let room = Rc::new(Room::new(Vec::new(), first.0, first.1));
        Rooms { refit, keep, config, known: vec![room] }
    }

    /// The room with these effects in the base.
    pub fn with(&mut self, accepted: &[Candidate]) -> Result<Rc<Room>, DiagnoseError> {
        let names: Vec<String> = accepted.iter().map(|c| c.spec.clone()).collect();
        if let Some(known) = self.known.iter().find(|r| r.accepted == names) {
            return Ok(known.clone());
        }
        let problem = self.bare(accepted)?;
        let weighed = weigh(&problem, self.config);
        let room = Rc::new(Room::new(names, problem, weighed));
        self.known.push(room.clone());
        Ok(room)
    }

    /// Whether a refit with a candidate changed what it would do: then all rooms are weighed anew.
    pub fn refine(&mut self, accepted: &[Candidate], candidate: &Candidate) -> Result<bool, DiagnoseError> {
        let named: Vec<Candidate> = accepted.iter().filter(|c| c.family != UNLISTED).cloned().collect();
        let changed = self.refit.refine(&named, candidate)?;
        if changed {
            self.known.clear();
        }
        Ok(changed)
    }

    /// What a refit with these effects leaves of the dwells that count.
    pub fn refitted(&mut self, accepted: &[Candidate]) -> Result<Option<AfterRefit>, DiagnoseError> {
        self.refit.refitted(accepted, &self.keep)
    }

    /// The problem alone.
    pub fn bare(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let (shapes, named): (Vec<Candidate>, Vec<Candidate>) =
            accepted.iter().cloned().partition(|c| c.family == UNLISTED);
        let mut problem = self.refit.problem(&named)?;
        problem.check()?;
        if !self.keep.iter().all(|k| *k) {
            problem = problem.without(&self.keep);
        }
        for shape in &shapes {
            // The dwells are the same in all rooms, so a shape's columns fit as they are.
            let columns = shape.columns.dense(&problem.dwells, 1.0);
            problem = problem.with_columns(&columns);
        }
        Ok(problem)
    }
}

/// An unlisted shape as something that can join the base, with the freedom these data give it.
pub(crate) fn as_candidate(cell: &Unlisted, room: &Room, config: &DiagnosisConfig) -> Candidate {
    let sized = room.weighed.sized(&cell.columns, &room.problem, config);
    Candidate {
        spec: cell.name.clone(),
        family: UNLISTED.to_string(),
        target: String::new(),
        aliases: Vec::new(),
        known: None,
        amplitudes: Vec::new(),
        toggle: Toggle::None,
        columns: Columns::Dense(Arc::new(sized)),
    }
}
