//! Where the next problem comes from once an effect is accepted.

use crate::DiagnoseError;
use crate::problem::{Candidate, Problem};

/// Gives the problem with some effects in its base model.
pub trait Refit {
    /// The problem whose geometry includes the accepted effects, linearised at the fit with them.
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError>;

    /// The same with nothing to weigh.
    fn base(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let problem = self.problem(accepted)?;
        Ok(Problem { candidates: Vec::new(), scans: Vec::new(), channels: Vec::new(), ..problem })
    }

    /// Refits with a candidate beside the accepted effects. Where it does not act in proportion to its size, every later
    /// problem has its columns as they are at the size found, instead of their derivative at zero; says whether any
    /// changed, which can happen once for each candidate.
    fn refine(&mut self, accepted: &[Candidate], candidate: &Candidate) -> Result<bool, DiagnoseError> {
        let _ = (accepted, candidate);
        Ok(false)
    }
}

/// Stays with one linearisation: accepted columns join the geometry.
#[derive(Debug, Clone)]
pub struct LinearRefit {
    base: Problem,
}

impl LinearRefit {
    /// Around a problem.
    pub fn new(base: Problem) -> LinearRefit {
        LinearRefit { base }
    }
}

impl Refit for LinearRefit {
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let mut problem = self.base.clone();
        for candidate in accepted {
            // By name: a candidate may come back with dwells cut out.
            let own = self.base.candidates.iter().chain(self.base.scans.iter().flat_map(|s| &s.points));
            let own = own.into_iter().find(|c| c.spec == candidate.spec).unwrap_or(candidate);
            let columns = own.columns.dense(&problem.dwells, 1.0);
            problem = problem.with_columns(&columns);
        }
        let taken = |c: &Candidate| accepted.iter().any(|a| a.spec == c.spec);
        problem.candidates.retain(|c| !taken(c));
        problem.scans.retain(|s| !s.points.iter().any(taken));
        Ok(problem)
    }
}
