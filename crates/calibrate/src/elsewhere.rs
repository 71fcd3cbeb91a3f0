//! Observations that are not at hand: shards hold them, and are asked for the sums that a fit needs of each recording.
//!
//! A fit is a function of the answers to its questions. Where one is missing, the fit ends with
//! [`CalibrateError::Unanswered`] and the question is known; asked again once it is answered, the fit comes further, to the same
//! numbers. What the sums of a recording are does not depend on where they were made, and they are put together in the order of
//! the recordings: the result is that of one process, to the last bit.

use crate::calibration::Predicted;
use crate::model_problem::ModelProblem;
use crate::robust::RobustCost;
use crate::structure::Structure;
use crate::whitened::{Axis, Whitened};
use crate::{CalibrateError, FitConfig};
use armcal_core::Observation;
use armcal_model::Model;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A question about observations, to be answered recording by recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// The observations it is about: runs of their places among all.
    pub of: Vec<Range<usize>>,
    question: Question,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Question {
    /// The cost and its second-order model.
    Sums(Evaluation),
    /// The error of each observation.
    Errors { values: Vec<f64>, nominal_values: Vec<f64> },
}

/// Where, over which parameters, and by which loss a cost is evaluated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Evaluation {
    /// All parameters, SI.
    at: Vec<f64>,
    /// Those at which the noise is taken.
    whitened_at: Vec<f64>,
    /// Index and unit of each free parameter.
    axes: Vec<(usize, f64)>,
    /// The axes that recordings share.
    shared: Vec<usize>,
    dense: bool,
    /// Without it only the norms are asked for.
    weighting: Option<Weighting>,
}

/// How residuals weigh in the second-order model of the cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Weighting {
    pub huber_c: Option<f64>,
    pub sigma_scale: f64,
    pub exact_curvature: bool,
}

impl Weighting {
    /// All rows alike: the squares of the derivative.
    pub const PLAIN: Weighting = Weighting { huber_c: None, sigma_scale: 1.0, exact_curvature: false };
}

/// What one recording answers.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Answer(Result<Numbers, String>);

#[derive(Debug, Clone, Serialize, Deserialize)]
enum Numbers {
    Sums(Sums),
    Errors(Vec<Predicted>),
}

/// What the observations of one recording add to a cost.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Sums {
    /// Norm of the whitened residual of each block.
    norms: Vec<f64>,
    part: Option<Part>,
}

/// What they add to its second-order model, over the columns of the group.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Part {
    pub gradient: DVector<f64>,
    /// Diagonal of the curvature, without what outliers take from it.
    pub squares: DVector<f64>,
    /// The matrix itself where the structure is dense, otherwise the triangle that has it as its square.
    #[serde(with = "upper")]
    pub curvature: DMatrix<f64>,
}

impl Part {
    /// Whether it is over so many columns.
    fn is_over(&self, columns: usize) -> bool {
        [self.gradient.len(), self.squares.len(), self.curvature.ncols()] == [columns; 3]
    }
}

/// Whoever asks the shards.
pub trait Elsewhere: Sync {
    /// The answers of the recordings that have any of the observations, in their order.
    ///
    /// # Errors
    /// [`CalibrateError::Unanswered`] where there are none yet; then it is asked.
    fn ask(&self, request: &Request) -> Result<Vec<Answer>, CalibrateError>;
    /// What was found before under this key.
    fn found(&self, key: &[u8]) -> Option<Vec<f64>>;
    /// Keeps what took many questions, so that these need not be asked again.
    fn keep(&self, key: Vec<u8>, found: &[f64]);
}

/// Observations of a problem that are elsewhere.
pub struct Away<'a> {
    who: &'a dyn Elsewhere,
    of: Vec<Range<usize>>,
    /// Rows of each block.
    pub(crate) rows: Vec<usize>,
}

impl<'a> Away<'a> {
    /// Observations at these places in rising order, in blocks with so many rows.
    pub(crate) fn new(who: &'a dyn Elsewhere, places: &[usize], rows: Vec<usize>) -> Away<'a> {
        Away { who, of: runs(places), rows }
    }

    /// Norms of all blocks and, where a weighting is given, the part of each group that has blocks.
    pub(crate) fn sums(
        &self,
        white: &Whitened<'_>,
        at: Vec<f64>,
        weighting: Option<Weighting>,
    ) -> Result<(Vec<f64>, Vec<Part>), CalibrateError> {
        let evaluation = Evaluation {
            at,
            whitened_at: white.start.clone(),
            axes: white.axes.iter().map(|a| (a.index, a.scale)).collect(),
            shared: white.structure.shared.clone(),
            dense: white.structure.is_dense(),
            weighting,
        };
        let request = Request { of: self.of.clone(), question: Question::Sums(evaluation) };
        let (mut norms, mut parts) = (Vec::with_capacity(white.blocks()), Vec::new());
        for answer in self.who.ask(&request)? {
            let Numbers::Sums(sums) = answer.0.map_err(CalibrateError::Elsewhere)? else {
                return Err(strange());
            };
            norms.extend(sums.norms);
            parts.extend(sums.part);
        }
        let groups = white.structure.groups.iter().filter(|g| weighting.is_some() && !g.blocks.is_empty());
        let widths: Vec<usize> = groups.map(|g| g.columns.len()).collect();
        let as_asked = parts.len() == widths.len() && parts.iter().zip(widths).all(|(p, n)| p.is_over(n));
        if norms.len() != white.blocks() || !as_asked {
            return Err(strange());
        }
        Ok((norms, parts))
    }

    /// A name for the answer to something that is worked out of these observations and `numbers`.
    pub(crate) fn key(&self, what: &str, numbers: &[&[f64]]) -> Vec<u8> {
        let of = self.of.iter().flat_map(|run| [run.start, run.end]).flat_map(usize::to_le_bytes);
        let lengths = numbers.iter().flat_map(|part| part.len().to_le_bytes());
        let bits = numbers.iter().flat_map(|part| part.iter()).flat_map(|v| v.to_le_bytes());
        what.bytes().chain([0]).chain(of).chain(lengths).chain(bits).collect()
    }

    pub(crate) fn found(&self, key: &[u8]) -> Option<Vec<f64>> {
        self.who.found(key)
    }

    pub(crate) fn keep(&self, key: Vec<u8>, found: &[f64]) {
        self.who.keep(key, found);
    }
}

/// The errors of observations at these places in rising order.
pub(crate) fn errors(
    who: &dyn Elsewhere,
    places: &[usize],
    values: &[f64],
    nominal_values: &[f64],
) -> Result<Vec<Predicted>, CalibrateError> {
    if places.is_empty() {
        return Ok(Vec::new());
    }
    let question = Question::Errors { values: values.to_vec(), nominal_values: nominal_values.to_vec() };
    let mut all = Vec::with_capacity(places.len());
    for answer in who.ask(&Request { of: runs(places), question })? {
        let Numbers::Errors(errors) = answer.0.map_err(CalibrateError::Elsewhere)? else {
            return Err(strange());
        };
        all.extend(errors);
    }
    if all.len() == places.len() { Ok(all) } else { Err(strange()) }
}

/// What one recording, whose observations are those from place `first` on, answers to a request; `None` where it is not about any
/// of them.
pub fn answer(
    model: &Model,
    first: usize,
    observations: &[Observation],
    config: &FitConfig,
    request: &Request,
) -> Option<Answer> {
    let end = first + observations.len();
    let own = request.of.iter().flat_map(|run| run.start.max(first)..run.end.min(end));
    let own: Vec<&Observation> = own.map(|place| &observations[place - first]).collect();
    if own.is_empty() {
        return None;
    }
    let told = match &request.question {
        Question::Sums(evaluation) => evaluation.sums(model, &own, config).map(Numbers::Sums),
        Question::Errors { values, nominal_values } => {
            Predicted::all(model, &own, values, nominal_values).map(Numbers::Errors)
        }
    };
    Some(Answer(told.map_err(|e| e.to_string())))
}

impl Evaluation {
    fn sums(
        &self,
        model: &Model,
        observations: &[&Observation],
        config: &FitConfig,
    ) -> Result<Sums, CalibrateError> {
        let problem = ModelProblem::new(model, observations.iter().copied(), config)?;
        let axes: Vec<Axis> = self.axes.iter().map(|&(index, scale)| Axis::scaled(index, scale)).collect();
        let known = crate::problem::Problem::known(&problem);
        let structure = Structure::over(known, &axes, self.shared.clone(), self.dense);
        let white = Whitened::over(Box::new(problem), axes, self.whitened_at.clone(), structure)?;
        let at = white.at_parameters(DVector::zeros(0), &self.at)?;
        let part = self.weighting.map(|weighting| {
            let cost = RobustCost::weighted(&white, weighting);
            cost.part(0, &at.groups[0])
        });
        Ok(Sums { norms: at.norms, part })
    }
}

fn strange() -> CalibrateError {
    CalibrateError::Unreachable("a shard answered something else than it was asked".into())
}

/// Numbers in rising order as runs.
fn runs(places: &[usize]) -> Vec<Range<usize>> {
    places.chunk_by(|a, b| a + 1 == *b).map(|run| run[0]..run[run.len() - 1] + 1).collect()
}

/// A matrix of which only what stands on and above the diagonal says anything: a triangle, or one that is symmetric.
mod upper {
    use nalgebra::DMatrix;
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer, de::Error as _};

    pub fn serialize<S: Serializer>(m: &DMatrix<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        let symmetric = m.is_square() && (0..m.ncols()).any(|c| (c + 1..m.nrows()).any(|r| m[(r, c)] != 0.0));
        let values: Vec<f64> = m
            .column_iter()
            .enumerate()
            .flat_map(|(c, column)| column.iter().take(c + 1).copied().collect::<Vec<_>>())
            .collect();
        (m.nrows(), m.ncols(), symmetric, values).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DMatrix<f64>, D::Error> {
        let (rows, columns, symmetric, values) = <(usize, usize, bool, Vec<f64>)>::deserialize(deserializer)?;
        // A damaged file may say any size.
        let bounded = rows <= columns && (columns <= values.len() || rows == 0);
        let expected = || (0..columns).map(|c| rows.min(c + 1)).sum::<usize>();
        if !bounded || (symmetric && rows != columns) || (rows > 0 && expected() != values.len()) {
            return Err(D::Error::custom("a matrix whose size its values contradict"));
        }
        let mut left = values.into_iter();
        let mut m = DMatrix::zeros(rows, columns);
        for c in 0..columns {
            for r in 0..rows.min(c + 1) {
                m[(r, c)] = left.next().ok_or_else(|| D::Error::custom("a matrix with too few values"))?;
            }
        }
        if symmetric {
            m.fill_lower_triangle_with_upper_triangle();
        }
        Ok(m)
    }
}
