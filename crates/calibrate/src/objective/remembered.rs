//! A problem that remembers where it was looked at last: a fit with other priors begins where the one before it ended, and a
//! fit without some observations where that of all did. Of many observations that one's derivative serves all the way.

use crate::objective::problem::{Linearised, Problem, Told, as_beneath};
use crate::objective::rows::Kept;
use crate::objective::whitened::Whitened;
use crate::{CalibrateError, FitConfig};
use armcal_core::Parameter;
use armcal_model::Asked;
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What a problem is at some parameters, block by block as far as anybody asked.
#[derive(Debug, Clone)]
pub(crate) struct Looked {
    p: Vec<f64>,
    blocks: Vec<OnceLock<Arc<Block>>>,
    covariances: Vec<OnceLock<Arc<DMatrix<f64>>>>,
}

/// Rows of a block, and which columns of their derivative were asked for.
#[derive(Debug)]
struct Block {
    linearised: Linearised,
    asked: Arc<Vec<bool>>,
}

impl Looked {
    fn nothing_yet(p: &[f64], blocks: usize) -> Looked {
        let unknown = |_| OnceLock::new();
        Looked {
            p: p.to_vec(),
            blocks: (0..blocks).map(unknown).collect(),
            covariances: (0..blocks).map(|_| OnceLock::new()).collect(),
        }
    }

    /// The same of some of the blocks.
    pub fn of(&self, blocks: &[usize]) -> Looked {
        Looked {
            p: self.p.clone(),
            blocks: blocks.iter().map(|block| self.blocks[*block].clone()).collect(),
            covariances: blocks.iter().map(|block| self.covariances[*block].clone()).collect(),
        }
    }
}

/// A problem with what it was at the parameters that were asked for last.
pub(crate) struct Remembered<'a> {
    problem: &'a dyn Problem,
    last: Mutex<Arc<Looked>>,
    about: Option<About>,
}

/// Where a problem is known, whose derivative, and noise that is not estimated, stand for those nearby.
struct About {
    looked: Arc<Looked>,
    blocks: Vec<Arc<Block>>,
    kept: Kept,
}

/// From so many blocks on a fit without some of them ends so near that of all that the derivative stays.
const MANY_BLOCKS: usize = 1_000;
/// The derivative stays where it changes by less than this share of itself: the fit then ends within about that many of its
/// standard deviations.
const STRAIGHT: f64 = 1e-4;

/// Whether a problem has so many blocks that the derivative stays in fits without some of them.
pub(crate) fn keeps_derivative(problem: &dyn Problem) -> bool {
    problem.blocks() >= MANY_BLOCKS
}

/// A problem at these parameters, as fits of the parameters `free` will ask of it.
pub(crate) fn evaluate_problem(
    problem: &dyn Problem,
    p: &[f64],
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Arc<Looked>, CalibrateError> {
    let remembered = Remembered::new(problem, None);
    let white = Whitened::new(Box::new(&remembered), p, free, config)?;
    white.at(white.start())?;
    Ok(remembered.at(&white.start))
}

impl<'a> Remembered<'a> {
    pub fn new(problem: &'a dyn Problem, looked: Option<Looked>) -> Remembered<'a> {
        let looked = looked.filter(|looked| looked.blocks.len() == problem.blocks());
        let looked = looked.unwrap_or_else(|| Looked::nothing_yet(&[], problem.blocks()));
        Remembered { problem, last: Mutex::new(Arc::new(looked)), about: None }
    }

    /// A problem of many blocks near parameters at which it is known, by all columns that will be asked for: there its derivative
    /// stays, while residuals are exact everywhere. Whether that was right where a fit ended is for [`Remembered::is_straight_to`] to say.
    pub fn about(problem: &'a dyn Problem, looked: &Looked) -> Option<Remembered<'a>> {
        let blocks: Vec<Arc<Block>> =
            looked.blocks.iter().map(|block| block.get().cloned()).collect::<Option<_>>()?;
        let mut remembered = Remembered::new(problem, Some(looked.clone()));
        let looked = remembered.at(&looked.p);
        let many = keeps_derivative(problem) && blocks.len() == problem.blocks();
        many.then(|| {
            let kept = Kept::of(problem.known().len().max(1));
            remembered.about = Some(About { looked, blocks, kept });
            remembered
        })
    }

    /// Whether the derivative hardly changes on the way to these parameters, by twice what the residuals differ from their
    /// linearisation over what this has them move.
    pub fn is_straight_to(&self, p: &[f64]) -> bool {
        let Some(About { looked, blocks, .. }) = &self.about else { return true };
        let step: Vec<f64> = p.iter().zip(&looked.p).map(|(to, from)| to - from).collect();
        let groups = self.problem.known();
        let (mut beside, mut along) = (0.0, 0.0);
        self.problem.residual_each(0..blocks.len(), p, &mut |block, now| {
            let (residual, derivative) = &blocks[block].linearised;
            let own = match groups.iter().find(|group| group.blocks.contains(&block)) {
                Some(group) => group.parameters.iter().map(|k| step[*k]).collect(),
                None => step.clone(),
            };
            let moved = derivative * DVector::from_vec(own);
            let both = now.iter().zip(residual.iter()).zip(moved.iter());
            beside += both.map(|((now, then), moved)| (now - then - moved).powi(2)).sum::<f64>();
            along += moved.norm_squared();
        });
        2.0 * beside.sqrt() <= STRAIGHT * along.sqrt()
    }

    /// What is known of the problem at these parameters.
    fn at(&self, p: &[f64]) -> Arc<Looked> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.p != p {
            *last = Arc::new(Looked::nothing_yet(p, self.problem.blocks()));
        }
        last.clone()
    }
}

impl Problem for Remembered<'_> {
    as_beneath!(self => self.problem);

    fn parameters(&self) -> &[Parameter] {
        self.problem.parameters()
    }

    fn linearised_each(&self, blocks: Range<usize>, p: &[f64], asked: &Asked<'_>, each: &mut Told<'_>) {
        if let Some(about) = self.about.as_ref().filter(|about| about.looked.p != p) {
            self.problem.residual_each(blocks, p, &mut |block, rows| {
                let derivative = about.blocks[block].linearised.1.clone();
                each(block, Cow::Owned((DVector::from_column_slice(rows), derivative)));
            });
            return;
        }
        let looked = self.at(p);
        let known = &looked.blocks[blocks.clone()];
        let columns = known.iter().find_map(|known| Some(known.get()?.asked.len()));
        let wanted: Vec<bool> = (0..columns.unwrap_or(0)).map(asked).collect();
        let serves = |had: &Block| {
            had.asked.len() == wanted.len()
                && had.asked.iter().zip(&wanted).all(|(had, wanted)| *had || !wanted)
        };
        if known.iter().all(|known| known.get().is_some_and(|had| serves(had))) {
            for (block, known) in blocks.zip(known) {
                known.get().into_iter().for_each(|had| each(block, Cow::Borrowed(&had.linearised)));
            }
            return;
        }
        let mut shared: Option<Arc<Vec<bool>>> = None;
        self.problem.linearised_each(blocks, p, asked, &mut |block, linearised| {
            let linearised = linearised.into_owned();
            let columns = linearised.1.ncols();
            let of_columns = || Arc::new((0..columns).map(asked).collect());
            let asked = shared.get_or_insert_with(of_columns).clone();
            each(block, Cow::Borrowed(&linearised));
            // Where less was asked for before, that stays.
            let _ = looked.blocks[block].set(Arc::new(Block { linearised, asked }));
        });
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        let about = self.about.as_ref().filter(|_| !self.problem.noise_depends());
        let looked = about.map_or_else(|| self.at(p), |about| about.looked.clone());
        let own = looked.covariances[block].get_or_init(|| Arc::new(self.problem.covariance(block, p)));
        own.as_ref().clone()
    }

    fn straight(&self) -> Option<&Kept> {
        self.about.as_ref().filter(|_| !self.problem.noise_depends()).map(|about| &about.kept)
    }
}

#[cfg(test)]
#[path = "../tests/remembered.rs"]
mod tests;
