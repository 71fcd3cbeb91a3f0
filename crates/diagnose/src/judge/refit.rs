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
