//! Problems with effects and unlisted shapes in their base, each weighed once.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::judge::bootstrap::Significance;
use crate::judge::judged::Judged;
use crate::judge::refit::Refit;
use crate::judge::score::{Exam, Score};
use crate::problem::columns::Cut;
use crate::problem::{Candidate, Columns, Problem};
use crate::weigh::cells::{Dependences, Unlisted};
use crate::weigh::crossval::{by_place, by_stretch, left_out};
use crate::weigh::scatter::Scatter;
use crate::weigh::{Outside, Weighed, weigh_among};
use armcal_model::Toggle;
use nalgebra::DMatrix;
use std::cell::{OnceCell, RefCell};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::rc::{Rc, Weak};
use std::sync::Arc;

/// Family of a shape that joins the base without a name.
const UNLISTED: &str = "unlisted";
/// Entries, and unlisted explanations, that are scored, those that the weighing likes best.
const LEADING: usize = 8;
const UNLISTED_SCORED: usize = 3;
/// Dwells of all conditioned problems together that are kept for whoever asks next; and of how many conditioned problems at least and at most.
const LAST_DWELLS: usize = 4000;
const LAST_ROOMS: [usize; 2] = [2, 8];

/// A problem with some effects in its base, weighed; judgements are kept by entry.
#[derive(Debug, Clone)]
pub(crate) struct ConditionedProblem {
    /// The problem.
    pub problem: Problem,
    /// Weighed.
    pub weighed: Weighed,
    /// How errors scatter beside what explains most.
    pub scatter: Scatter,
    exam: OnceCell<Exam>,
    nothing: OnceCell<Score>,
    /// Of the entries that somebody asked about.
    scores: RefCell<BTreeMap<usize, Score>>,
    /// The best that is not listed, as it stands among all.
    unlisted: OnceCell<Option<(usize, Score)>>,
    pub(super) significance: OnceCell<Vec<Significance>>,
    pub(super) judged: RefCell<BTreeMap<usize, Judged>>,
}

impl ConditionedProblem {
    fn new(problem: Problem, weighed: Weighed, config: &DiagnosisConfig) -> ConditionedProblem {
        let scatter = weighed.scatter(&problem, config);
        let (exam, nothing, scores, unlisted, significance, judged) = Default::default();
        ConditionedProblem {
            problem,
            weighed,
            scatter,
            exam,
            nothing,
            scores,
            unlisted,
            significance,
            judged,
        }
    }

    /// What is left out in turn: places, or stretches of time where the noise remembers (neighbours in time would tell).
    pub fn exam(&self) -> &Exam {
        let of = |problem| match self.scatter.remembers() {
            true => Exam::by_time(problem, by_stretch(problem)),
            false => Exam::by_pose(problem, by_place(problem)),
        };
        self.exam.get_or_init(|| of(&self.problem))
    }

    /// The score of the base alone.
    pub fn nothing(&self) -> &Score {
        self.nothing.get_or_init(|| self.scored(None))
    }

    /// The score with columns in the linearised model, in the units of the problem.
    pub fn score_with(&self, columns: &DMatrix<f64>) -> Score {
        self.scored(Some(columns))
    }

    /// The score with an entry, once.
    pub fn score_of(&self, entry: usize) -> Score {
        if let Some(known) = self.scores.borrow().get(&entry) {
            return known.clone();
        }
        let columns = self.weighed.entries[entry].candidate.columns.dense(&self.problem.dwells, 1.0);
        let score = self.score_with(&columns);
        self.scores.borrow_mut().insert(entry, score.clone());
        score
    }

    /// Entries that the weighing likes best, each name once, with their scores: those first that are worth most.
    pub fn leading_entries(&self, config: &DiagnosisConfig) -> Vec<(usize, Score)> {
        let weighed = &self.weighed;
        let mut names: Vec<usize> = Vec::new();
        for k in weighed.ranking() {
            let new = names.iter().all(|n| !weighed.one_name(*n, k));
            names.extend((new && names.len() < LEADING).then_some(k));
        }
        let mut scored: Vec<(usize, Score)> = names.into_iter().map(|k| (k, self.score_of(k))).collect();
        let worth =
            |(k, score): &(usize, Score)| score.worth(config.margin_nats * weighed.amplitudes(*k) as f64);
        scored.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        scored
    }

    /// Of what is not listed, with the freedom these data give it, that which says most of dwells the fit did not see: of
    /// those that the weighing likes best; and its score.
    pub fn best_unlisted(&self, config: &DiagnosisConfig) -> Option<(&Outside, Score)> {
        let unlisted = &self.weighed.unlisted;
        let find = || {
            let mut order: Vec<usize> =
                (0..unlisted.len()).filter(|k| unlisted[*k].ln_evidence > 0.0).collect();
            order.sort_by(|a, b| unlisted[*b].ln_evidence.total_cmp(&unlisted[*a].ln_evidence));
            let score = |k: usize| {
                let columns = self.weighed.regularised(&unlisted[k].what.columns, &self.problem, config);
                (k, self.score_with(&columns))
            };
            let scored = order.into_iter().take(UNLISTED_SCORED).map(score);
            scored.reduce(|a, b| if b.1.above(&a.1).nats > 0.0 { b } else { a })
        };
        let best = self.unlisted.get_or_init(find).as_ref()?;
        Some((&unlisted[best.0], best.1.clone()))
    }

    fn scored(&self, columns: Option<&DMatrix<f64>>) -> Score {
        let left = left_out(&self.problem, columns, &self.exam().folds, self.weighed.scale);
        Score::of(&self.problem, &left, self.exam())
    }

    /// What the score with an entry is to be.
    #[cfg(test)]
    pub fn suppose(&self, entry: usize, score: Score) {
        self.scores.borrow_mut().insert(entry, score);
    }
}

/// Gives conditioned problems and remembers them: the same base is asked for more than once.
pub(crate) struct ConditionedProblems<'a> {
    refit: &'a mut dyn Refit,
    keep: Vec<bool>,
    /// What problems of these dwells share.
    cut: Cut,
    config: &'a DiagnosisConfig,
    /// The dwells are the same in all.
    dependences: Arc<Dependences>,
    /// Those that may be asked for again. A conditioned problem of thousands of poses is tens of megabytes: but for the last ones they live
    /// as long as somebody else needs them, and are made again otherwise.
    known: Vec<(Vec<String>, Weak<ConditionedProblem>)>,
    last: VecDeque<Rc<ConditionedProblem>>,
    /// Scores of refits, by what was in the model and whether the noise was taken to remember.
    scores: BTreeMap<(Vec<String>, bool), Option<Score>>,
    /// Candidates that could not be evaluated, or not be fitted.
    pub dropped: BTreeSet<String>,
}

impl<'a> ConditionedProblems<'a> {
    /// `keep` masks dwells out of every problem; `first` is the problem without effects, weighed.
    pub fn new(
        refit: &'a mut dyn Refit,
        keep: Vec<bool>,
        first: (Problem, Weighed),
        config: &'a DiagnosisConfig,
    ) -> ConditionedProblems<'a> {
        let conditioned = Rc::new(ConditionedProblem::new(first.0, first.1, config));
        let dependences = conditioned.weighed.dependences.clone();
        let (cut, known, last, scores, dropped) = Default::default();
        let mut conditioned_problems =
            ConditionedProblems { refit, keep, cut, config, dependences, known, last, scores, dropped };
        conditioned_problems.remember(Vec::new(), &conditioned);
        conditioned_problems
    }

    /// The conditioned problem with these effects in the base.
    pub fn with(&mut self, accepted: &[Candidate]) -> Result<Rc<ConditionedProblem>, DiagnoseError> {
        let names = sorted_specs(accepted);
        if let Some(conditioned) = self.known(&names) {
            return Ok(conditioned);
        }
        let problem = self.bare(accepted)?;
        let weighed = weigh_among(&problem, self.dependences.clone(), self.config);
        let conditioned = Rc::new(ConditionedProblem::new(problem, weighed, self.config));
        self.known.retain(|(_, conditioned)| conditioned.strong_count() > 0);
        self.remember(names, &conditioned);
        Ok(conditioned)
    }

    /// The conditioned problem with effects of these names, if it still is.
    fn known(&self, names: &[String]) -> Option<Rc<ConditionedProblem>> {
        self.known
            .iter()
            .find(|(accepted, _)| accepted == names)
            .and_then(|(_, conditioned)| conditioned.upgrade())
    }

    fn remember(&mut self, accepted: Vec<String>, conditioned: &Rc<ConditionedProblem>) {
        self.known.push((accepted, Rc::downgrade(conditioned)));
        self.last.push_back(conditioned.clone());
        let [fewest, most] = LAST_ROOMS;
        let kept = (LAST_DWELLS / conditioned.problem.dwells.len().max(1)).clamp(fewest, most);
        while self.last.len() > kept {
            self.last.pop_front();
        }
    }

    /// Whether a refit with a candidate changed what it would do: then all conditioned problems are weighed anew.
    pub fn refine(&mut self, accepted: &[Candidate], candidate: &Candidate) -> Result<bool, DiagnoseError> {
        let named: Vec<Candidate> = accepted.iter().filter(|c| c.family != UNLISTED).cloned().collect();
        let changed = self.refit.refine(&named, candidate)?;
        if changed {
            self.known.clear();
            self.last.clear();
        }
        Ok(changed)
    }

    /// The score of a refit with these effects, in the exam of a conditioned problem; none where they cannot be fitted.
    pub fn score(&mut self, accepted: &[Candidate], conditioned: &ConditionedProblem) -> Option<Score> {
        let key = (sorted_specs(accepted), conditioned.scatter.remembers());
        if let Some(known) = self.scores.get(&key) {
            return known.clone();
        }
        let score = self.base(accepted).ok().map(|problem| {
            let left = left_out(&problem, None, &conditioned.exam().folds, problem.sigma());
            Score::of(&problem, &left, conditioned.exam())
        });
        if score.is_none() {
            self.dropped.extend(accepted.last().map(|candidate| candidate.spec.clone()));
        }
        self.scores.insert(key, score.clone());
        score
    }

    /// What a refit with these effects is to have scored.
    #[cfg(test)]
    pub fn suppose(
        &mut self,
        accepted: &[Candidate],
        conditioned: &ConditionedProblem,
        score: Option<Score>,
    ) {
        self.scores.insert((sorted_specs(accepted), conditioned.scatter.remembers()), score);
    }

    /// A problem without the dwells that do not count.
    fn kept(&mut self, problem: Problem) -> Result<Problem, DiagnoseError> {
        problem.check()?;
        let problem = problem.evaluable(&mut self.dropped);
        if self.keep.iter().all(|k| *k) {
            return Ok(problem);
        }
        self.cut.of_another_fit();
        Ok(problem.cut_to(&self.keep, &mut self.cut))
    }

    /// The problem with nothing to weigh.
    fn base(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let (shapes, named): (Vec<Candidate>, Vec<Candidate>) =
            accepted.iter().cloned().partition(|c| c.family == UNLISTED);
        let problem = self.refit.base(&named)?;
        Ok(with_shapes(self.kept(problem)?, &shapes))
    }

    /// The problem alone.
    fn bare(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let (shapes, named): (Vec<Candidate>, Vec<Candidate>) =
            accepted.iter().cloned().partition(|c| c.family == UNLISTED);
        let problem = match self.known(&sorted_specs(&named)) {
            Some(conditioned) => conditioned.problem.clone(),
            None => {
                let problem = self.refit.problem(&named)?;
                self.kept(problem)?
            }
        };
        Ok(with_shapes(problem, &shapes))
    }
}

/// A problem with unlisted shapes in its base. The dwells are the same in all conditioned problems, so a shape's columns fit as they are.
fn with_shapes(problem: Problem, shapes: &[Candidate]) -> Problem {
    shapes.iter().fold(problem, |problem, shape| {
        let columns = shape.columns.dense(&problem.dwells, 1.0);
        problem.with_columns(&columns)
    })
}

/// What a base with these is known by, in whatever order they came.
fn sorted_specs(accepted: &[Candidate]) -> Vec<String> {
    let mut names: Vec<String> = accepted.iter().map(|c| c.spec.clone()).collect();
    names.sort_unstable();
    names
}

/// An unlisted shape as something that can join the base, with the freedom these data give it.
pub(crate) fn as_candidate(
    cell: &Unlisted,
    conditioned: &ConditionedProblem,
    config: &DiagnosisConfig,
) -> Candidate {
    let sized = conditioned.weighed.sized(&cell.columns, &conditioned.problem, config);
    Candidate {
        spec: cell.name(),
        family: UNLISTED.to_string(),
        target: String::new(),
        aliases: Vec::new(),
        known: None,
        amplitudes: Vec::new(),
        per_turn: None,
        toggle: Toggle::None,
        columns: Columns::Dense(Arc::new(sized)),
    }
}
