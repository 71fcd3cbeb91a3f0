//! What a solver needs to know about a calibration, and nothing about robots: blocks of residual rows (one block an
//! observation), their exact derivatives, their covariance, and the parameters.

use crate::objective::rows::Kept;
use armcal_core::Parameter;
use armcal_model::Asked;
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;
use std::ops::Range;

/// Residual rows and their derivative, one column a parameter.
pub type Linearised = (DVector<f64>, DMatrix<f64>);

/// What is told of one block after the other: its number, and its rows.
pub type Told<'a> = dyn FnMut(usize, Cow<'_, Linearised>) + 'a;

/// A motion of the parameters that no observation of a problem can ever see.
#[derive(Debug, Clone, PartialEq)]
pub struct Symmetry {
    /// Change of every parameter along it, SI, in the order of the parameter vector.
    pub direction: Vec<f64>,
    /// What moves, and why nothing shows it.
    pub text: String,
}

/// Neighbouring blocks that know the same parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Known {
    /// The blocks.
    pub blocks: Range<usize>,
    /// The parameters, one for each column of [`Problem::linearised`], by their indices.
    pub parameters: Vec<usize>,
}

/// A weighted nonlinear least-squares problem in blocks.
///
/// Row order within a block: of one observation after the other three position rows [m], then, where used, three orientation
/// rows [rad].
pub trait Problem: Sync {
    /// All parameters, fixed ones included, in the order of every parameter vector.
    fn parameters(&self) -> &[Parameter];
    /// Number of blocks: what was measured in one dwell is one.
    fn blocks(&self) -> usize;
    /// Number of observations in a block.
    fn observations_of(&self, _block: usize) -> usize {
        1
    }
    /// The block of every observation, in order.
    fn block_of_each(&self) -> Vec<usize> {
        (0..self.blocks()).flat_map(|b| std::iter::repeat_n(b, self.observations_of(b))).collect()
    }
    /// The observation in words, for messages.
    fn name(&self, block: usize) -> String;
    /// Joint readings of the observation [rad], for messages; empty when there are none.
    fn joint_rad(&self, _block: usize) -> &[f64] {
        &[]
    }
    /// Measured minus predicted at parameters `p`.
    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64>;
    /// Calls `each` with the rows of [`Problem::residual`] of these blocks, in order.
    fn residual_each(&self, blocks: Range<usize>, p: &[f64], each: &mut dyn FnMut(usize, &[f64])) {
        blocks.for_each(|block| each(block, self.residual(block, p).as_slice()));
    }
    /// The same with its derivative, one column for each parameter that the block knows ([`Problem::known`]);
    /// fixed ones may be zero.
    fn linearised(&self, block: usize, p: &[f64]) -> Linearised;
    /// Calls `each` with [`Problem::linearised`] of these blocks, in order; columns that are not `asked` for may be zero.
    fn linearised_each(&self, blocks: Range<usize>, p: &[f64], _asked: &Asked<'_>, each: &mut Told<'_>) {
        blocks.for_each(|block| each(block, Cow::Owned(self.linearised(block, p))));
    }
    /// Covariance of the rows of a block at parameters `p`: measurement and propagated encoder noise.
    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64>;
    /// Whether the covariance depends on what is estimated by more than where the arm stands.
    fn noise_depends(&self) -> bool {
        false
    }
    /// Where the whitened derivative is kept, if it is taken for the same at all parameters.
    fn straight(&self) -> Option<&Kept> {
        None
    }
    /// Which blocks know which parameters, in the order of the blocks; all of them know all where nothing is said. What
    /// only one group knows is solved for within it, so that work and memory grow with the number of groups.
    fn known(&self) -> Vec<Known> {
        Vec::new()
    }
    /// What the problem is known to leave open at parameters `p`. One that the data do see after all (because a parameter
    /// in it is fixed) is dropped when what is undetermined is put into words.
    fn symmetries(&self, _p: &[f64]) -> Vec<Symmetry> {
        Vec::new()
    }
}

/// What a [`Problem`] that stands on another one takes from it as it is: all but parameters, rows and covariances.
macro_rules! as_beneath {
    ($self:ident => $beneath:expr) => {
        fn blocks(&$self) -> usize {
            $beneath.blocks()
        }

        fn observations_of(&$self, block: usize) -> usize {
            $beneath.observations_of(block)
        }

        fn name(&$self, block: usize) -> String {
            $beneath.name(block)
        }

        fn joint_rad(&$self, block: usize) -> &[f64] {
            $beneath.joint_rad(block)
        }

        fn residual(&$self, block: usize, p: &[f64]) -> nalgebra::DVector<f64> {
            $beneath.residual(block, p)
        }

        fn residual_each(
            &$self,
            blocks: std::ops::Range<usize>,
            p: &[f64],
            each: &mut dyn FnMut(usize, &[f64]),
        ) {
            $beneath.residual_each(blocks, p, each);
        }

        fn linearised(&$self, block: usize, p: &[f64]) -> $crate::objective::problem::Linearised {
            $beneath.linearised(block, p)
        }

        fn noise_depends(&$self) -> bool {
            $beneath.noise_depends()
        }

        fn known(&$self) -> Vec<$crate::objective::problem::Known> {
            $beneath.known()
        }

        fn symmetries(&$self, p: &[f64]) -> Vec<$crate::objective::problem::Symmetry> {
            $beneath.symmetries(p)
        }
    };
}
pub(crate) use as_beneath;

impl<P: Problem + ?Sized> Problem for &P {
    as_beneath!(self => (**self));

    fn parameters(&self) -> &[Parameter] {
        (**self).parameters()
    }

    fn linearised_each(&self, blocks: Range<usize>, p: &[f64], asked: &Asked<'_>, each: &mut Told<'_>) {
        (**self).linearised_each(blocks, p, asked, each);
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        (**self).covariance(block, p)
    }

    fn straight(&self) -> Option<&Kept> {
        (**self).straight()
    }
}
