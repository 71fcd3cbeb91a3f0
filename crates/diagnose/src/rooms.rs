//! Problems with effects and unlisted shapes in their base, each weighed once.

use crate::DiagnoseError;
use crate::bootstrap::Significance;
use crate::cells::{Dependences, Unlisted};
use crate::columns::Cut;
use crate::config::DiagnosisConfig;
use crate::evidence::Metric;
use crate::judge::{Judged, independent_groups, judge, significance};
use crate::noise::Noise;
use crate::problem::{Candidate, Columns, Problem};
use crate::refit::Refit;
use crate::rivals::AfterRefit;
use crate::weigh::{Weighed, weigh_among};
use armcal_model::Toggle;
use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeMap, VecDeque};
use std::rc::{Rc, Weak};
use std::sync::Arc;

/// Family of a shape that joins the base without a name.
const UNLISTED: &str = "unlisted";
/// Dwells of all rooms together that are kept for whoever asks next; and of how many rooms at least and at most.
const LAST_DWELLS: usize = 4000;
const LAST_ROOMS: [usize; 2] = [2, 8];

/// A problem with some effects in its base, weighed; judgements are kept by entry.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    /// The problem.
    pub problem: Problem,
    /// Weighed.
    pub weighed: Weighed,
    significance: OnceCell<Vec<Significance>>,
    judged: RefCell<BTreeMap<usize, Judged>>,
}

impl Room {
    fn new(problem: Problem, weighed: Weighed) -> Room {
        Room { problem, weighed, significance: OnceCell::new(), judged: RefCell::default() }
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
    /// What problems of these dwells share.
    cut: Cut,
    config: &'a DiagnosisConfig,
    /// The dwells are the same in all.
    dependences: Arc<Dependences>,
    /// Those that may be asked for again. A room of thousands of poses is tens of megabytes: but for the last ones they live
    /// as long as somebody else needs them, and are made again otherwise.
    known: Vec<(Vec<String>, Weak<Room>)>,
    last: VecDeque<Rc<Room>>,
}

impl<'a> Rooms<'a> {
    /// `keep` masks dwells out of every problem; `first` is the problem without effects, weighed.
    pub fn new(
        refit: &'a mut dyn Refit,
        keep: Vec<bool>,
        first: (Problem, Weighed),
        config: &'a DiagnosisConfig,
    ) -> Rooms<'a> {
        let room = Rc::new(Room::new(first.0, first.1));
        let dependences = room.weighed.dependences.clone();
        let (cut, known, last) = Default::default();
        let mut rooms = Rooms { refit, keep, cut, config, dependences, known, last };
        rooms.remember(Vec::new(), &room);
        rooms
    }

    /// The room with these effects in the base.
    pub fn with(&mut self, accepted: &[Candidate]) -> Result<Rc<Room>, DiagnoseError> {
        let names = names(accepted);
        if let Some(room) = self.known(&names) {
            return Ok(room);
        }
        let problem = self.bare(accepted)?;
        let weighed = weigh_among(&problem, self.dependences.clone(), self.config);
        let room = Rc::new(Room::new(problem, weighed));
        self.known.retain(|(_, room)| room.strong_count() > 0);
        self.remember(names, &room);
        Ok(room)
    }

    /// The room with effects of these names, if it still is.
    fn known(&self, names: &[String]) -> Option<Rc<Room>> {
        self.known.iter().find(|(accepted, _)| accepted == names).and_then(|(_, room)| room.upgrade())
    }

    fn remember(&mut self, accepted: Vec<String>, room: &Rc<Room>) {
        self.known.push((accepted, Rc::downgrade(room)));
        self.last.push_back(room.clone());
        let [fewest, most] = LAST_ROOMS;
        let kept = (LAST_DWELLS / room.problem.dwells.len().max(1)).clamp(fewest, most);
        while self.last.len() > kept {
            self.last.pop_front();
        }
    }

    /// Whether a refit with a candidate changed what it would do: then all rooms are weighed anew.
    pub fn refine(&mut self, accepted: &[Candidate], candidate: &Candidate) -> Result<bool, DiagnoseError> {
        let named: Vec<Candidate> = accepted.iter().filter(|c| c.family != UNLISTED).cloned().collect();
        let changed = self.refit.refine(&named, candidate)?;
        if changed {
            self.known.clear();
            self.last.clear();
        }
        Ok(changed)
    }

    /// What a refit with these effects leaves of the dwells that count.
    pub fn refitted(&mut self, accepted: &[Candidate]) -> Result<Option<AfterRefit>, DiagnoseError> {
        self.refit.refitted(accepted, &self.keep)
    }

    /// What speaks for a candidate beside others, under white noise alone: its ln Bayes factor; none where the problem without
    /// it does not have it.
    pub fn ln_bayes(&mut self, others: &[Candidate], own: &Candidate) -> Result<Option<f64>, DiagnoseError> {
        let problem = self.refit.problem_of(others, own)?;
        let problem = self.kept(problem)?;
        let Some(own) = problem.candidates.first() else { return Ok(None) };
        let white = Metric::new(Noise::White, 0.0, &problem, 1.0);
        let gram = white.gram(&own.columns.dense(&problem.dwells, 1.0));
        Ok(Some(white.ln_bayes(&gram, self.config)))
    }

    /// ln evidence of the model with these effects under white noise alone, to compare it with that of others.
    pub fn ln_evidence(&mut self, accepted: &[Candidate]) -> Result<f64, DiagnoseError> {
        let known = self.known(&names(accepted));
        let problem = match &known {
            Some(room) => &room.problem,
            None => &self.bare(accepted)?,
        };
        Ok(Metric::new(Noise::White, 0.0, problem, 1.0).ln_evidence(self.config))
    }

    /// A problem without the dwells that do not count.
    fn kept(&mut self, problem: Problem) -> Result<Problem, DiagnoseError> {
        problem.check()?;
        if self.keep.iter().all(|k| *k) {
            return Ok(problem);
        }
        self.cut.of_another_fit();
        Ok(problem.cut_to(&self.keep, &mut self.cut))
    }

    /// The problem alone.
    fn bare(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let (shapes, named): (Vec<Candidate>, Vec<Candidate>) =
            accepted.iter().cloned().partition(|c| c.family == UNLISTED);
        let mut problem = match self.known(&names(&named)) {
            Some(room) => room.problem.clone(),
            None => {
                let problem = self.refit.problem(&named)?;
                self.kept(problem)?
            }
        };
        for shape in &shapes {
            // The dwells are the same in all rooms, so a shape's columns fit as they are.
            let columns = shape.columns.dense(&problem.dwells, 1.0);
            problem = problem.with_columns(&columns);
        }
        Ok(problem)
    }
}

/// What a base with these is known by, in whatever order they came.
fn names(accepted: &[Candidate]) -> Vec<String> {
    let mut names: Vec<String> = accepted.iter().map(|c| c.spec.clone()).collect();
    names.sort_unstable();
    names
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
