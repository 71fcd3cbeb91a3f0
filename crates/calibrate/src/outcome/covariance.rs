//! Covariance of many parameters, without the blocks that follow from others.
//!
//! Where recordings have parameters of their own (x_k) beside shared ones (s), the posterior is that of a chain
//! `x_k <- s -> x_l`: given s, recordings know nothing of each other. So the whole covariance is held by
//!
//! | | |
//! |---|---|
//! | `C` | covariance of s |
//! | `G_k = d x_k / d s` | how x_k follows s |
//! | `K_k` | covariance of x_k given s |
//!
//! with `cov(x_k, s) = G_k C` and `cov(x_k, x_l) = G_k C G_l' + [k = l] K_k`: memory grows with the number of
//! recordings, not with its square. Without own parameters it is the dense matrix.

use nalgebra::{DMatrix, DVector, RowDVector};

/// A covariance of parameters, SI; rows of fixed parameters are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    shared: Vec<usize>,
    of_shared: DMatrix<f64>,
    own: Vec<Own>,
    /// Where each parameter is kept; `None` for a fixed one.
    place: Vec<Option<Place>>,
}

/// What one recording alone knows about.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Own {
    pub index: Vec<usize>,
    /// Covariance given the shared parameters.
    pub conditional: DMatrix<f64>,
    /// d own / d shared.
    pub gain: DMatrix<f64>,
}

/// Group (`None` for the shared parameters) and position in it.
type Place = (Option<usize>, usize);

impl Covariance {
    /// Of `count` parameters, the shared ones and each recording's own at the given indices.
    pub(crate) fn new(
        count: usize,
        shared: Vec<usize>,
        of_shared: DMatrix<f64>,
        own: Vec<Own>,
    ) -> Covariance {
        let mut place = vec![None; count];
        for (at, &index) in shared.iter().enumerate() {
            place[index] = Some((None, at));
        }
        for (group, own) in own.iter().enumerate() {
            own.index.iter().enumerate().for_each(|(at, &index)| place[index] = Some((Some(group), at)));
        }
        Covariance { shared, of_shared, own, place }
    }

    /// Number of parameters, fixed ones included.
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Whether there is no parameter.
    pub fn is_empty(&self) -> bool {
        self.place.is_empty()
    }

    /// Covariance of two parameters, by their indices.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let (Some(a), Some(b)) = (self.place[i], self.place[j]) else { return 0.0 };
        let conditional = match (a, b) {
            ((Some(group), at), (Some(other), to)) if group == other => self.own[group].conditional[(at, to)],
            _ => 0.0,
        };
        match (a, b) {
            ((None, at), (None, to)) => self.of_shared[(at, to)],
            _ => conditional + (self.follows(a) * &self.of_shared * self.follows(b).transpose())[0],
        }
    }

    /// Variance of every parameter.
    pub fn variances(&self) -> DVector<f64> {
        DVector::from_fn(self.len(), |i, _| self.get(i, i))
    }

    /// The block of some parameters.
    pub fn block(&self, index: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(index.len(), index.len(), |r, c| self.get(index[r], index[c]))
    }

    /// All of it: as many rows and columns as there are parameters.
    pub fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.len(), self.len(), |r, c| self.get(r, c))
    }

    /// The same in other units and another vector of `count` parameters: entry `k` becomes `to(k)`, (index, unit).
    pub(crate) fn rescaled(&self, count: usize, to: &dyn Fn(usize) -> (usize, f64)) -> Covariance {
        let units = |index: &[usize]| DVector::from_iterator(index.len(), index.iter().map(|&k| to(k).1));
        let moved = |index: &[usize]| -> Vec<usize> { index.iter().map(|&k| to(k).0).collect() };
        let of_shared = units(&self.shared);
        let own = self.own.iter().map(|own| {
            let of_own = units(&own.index);
            Own {
                index: moved(&own.index),
                conditional: scale_entries(&own.conditional, &of_own, &of_own),
                gain: scale_entries(&own.gain, &of_own, &of_shared.map(f64::recip)),
            }
        });
        let covariance = scale_entries(&self.of_shared, &of_shared, &of_shared);
        Covariance::new(count, moved(&self.shared), covariance, own.collect())
    }

    /// Takes over what another fit, with everything else frozen, says about parameters that were fixed here.
    pub(crate) fn adopt(&mut self, frozen: &Covariance) {
        let groups = frozen.own.iter().map(|own| &own.index).chain([&frozen.shared]);
        for index in groups.filter(|index| !index.is_empty()) {
            let group = self.own.len();
            index.iter().enumerate().for_each(|(at, &index)| self.place[index] = Some((Some(group), at)));
            self.own.push(Own {
                index: index.clone(),
                conditional: frozen.block(index),
                gain: DMatrix::zeros(index.len(), self.shared.len()),
            });
        }
    }

    /// Derivative of a parameter by the shared ones.
    fn follows(&self, place: Place) -> RowDVector<f64> {
        match place {
            (Some(group), at) => self.own[group].gain.row(at).into_owned(),
            (None, at) => RowDVector::from_fn(self.shared.len(), |_, c| f64::from(u8::from(c == at))),
        }
    }
}

impl From<DMatrix<f64>> for Covariance {
    /// A dense covariance of all parameters.
    fn from(of_shared: DMatrix<f64>) -> Covariance {
        let count = of_shared.nrows();
        Covariance::new(count, (0..count).collect(), of_shared, Vec::new())
    }
}

fn scale_entries(m: &DMatrix<f64>, rows: &DVector<f64>, columns: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(m.nrows(), m.ncols(), |r, c| rows[r] * columns[c] * m[(r, c)])
}
