//! What a diagnosis sees: whitened residuals and the columns that could explain them. No model knowledge.

pub(crate) mod by_dwell;
pub(crate) mod columns;
pub(crate) mod grams;
pub(crate) mod places;
pub(crate) mod projection;

use crate::DiagnoseError;
use crate::enters::EntersAt;
pub use crate::problem::columns::Columns;
use crate::problem::columns::Cut;
use crate::problem::projection::{cholesky_upper, solve_cholesky};
use armcal_core::{DwellId, Measured, Unit};
use armcal_model::{EffectSpec, Toggle};
use nalgebra::{DMatrix, DVector, Matrix3xX};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Prior precision of an effect's amplitude while it is fitted: ten typical sizes.
pub(crate) const EFFECT_PRECISION: f64 = 0.01;

/// Rounds in which the size of the errors settles.
const SIGMA_ROUNDS: usize = 4;

/// A linearised calibration with everything that might be missing from it.
///
/// Rows are whitened by the declared noise: residual rows are N(0, 1) if the model is complete and the declaration
/// right. Residual = measured - predicted; all columns are d predicted / d something.
#[derive(Debug, Clone)]
pub struct Problem {
    /// One entry for each dwell, in the order of the rows.
    pub dwells: Vec<DwellRow>,
    /// Whitened residual at the fitted base model.
    pub residual: DVector<f64>,
    /// Whitened d predicted / d free parameter, each column scaled to the parameter's prior standard deviation.
    pub geometry: DMatrix<f64>,
    /// (fitted - prior mean) / prior standard deviation of each free parameter.
    pub geometry_offset: DVector<f64>,
    /// Prior precision of each free parameter in those units: 1 with a prior, less for a ridge.
    pub geometry_precision: DVector<f64>,
    /// The catalogue, one entry for each effect and target.
    pub candidates: Vec<Candidate>,
    /// Families with a shape to be searched (frequency, step time, time constant).
    pub scans: Vec<Scan>,
    /// Ways an unlisted effect may enter.
    pub channels: Vec<Channel>,
}

/// What is known about one dwell.
#[derive(Debug, Clone)]
pub struct DwellRow {
    /// Its name.
    pub id: DwellId,
    /// First row in the stacked residual.
    pub first_row: usize,
    /// Rows of all that was measured in it.
    pub rows: usize,
    /// What was measured, in the order of the rows.
    pub parts: Vec<Part>,
    /// Time since the start of the session [s].
    pub time_s: f64,
    /// Joint readings [rad].
    pub joint_rad: Vec<f64>,
    /// Arrival direction of each joint: +1, -1, or 0 when unknown.
    pub arrival: Vec<f64>,
    /// Gravity torque of each joint [N m]; empty when unknown.
    pub torque_nm: Vec<f64>,
    /// All loads on the arm together [kg].
    pub load_kg: f64,
    /// Temperature [degC].
    pub temperature_c: Option<f64>,
    /// Place that is visited again: the cavity, where there is one.
    pub place: Option<String>,
    /// Whitened rows of a displacement of all that was measured by 1 m along each axis of the world: `rows` x 3.
    pub displaced: DMatrix<f64>,
    /// Whitened rows of a displacement by one declared standard deviation along each axis of the board, or of the
    /// world where there is no board: `rows` x 3. What a cavity does not hold is not displaced beside what it does.
    pub seat: DMatrix<f64>,
}

/// One measurement of a dwell: of its tip, or of a marker.
#[derive(Debug, Clone)]
pub struct Part {
    /// Of what, and against what.
    pub what: Measured,
    /// Its rows: 3, or 6 with orientation.
    pub rows: usize,
    /// Whether the position sensor saw it, rather than a cavity holding it.
    pub tracked: bool,
    /// What it is off [m] = this x the whitened rows of its dwell: 3 x the dwell's rows.
    pub metres: Matrix3xX<f64>,
}

impl DwellRow {
    /// The rows it owns.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first_row..self.first_row + self.rows
    }

    /// Its parts, each with its rows.
    pub fn ranges(&self) -> impl Iterator<Item = (&Part, std::ops::Range<usize>)> {
        self.parts.iter().scan(self.first_row, |first, part| {
            let rows = *first..*first + part.rows;
            *first = rows.end;
            Some((part, rows))
        })
    }

    /// Declared variance of a coordinate [m^2], mean over what was measured.
    fn variance_m2(&self) -> f64 {
        // Of a distance one coordinate is known.
        let coordinates = self.parts.iter().map(|part| part.rows.min(3)).sum::<usize>();
        self.parts.iter().map(|part| part.metres.norm_squared()).sum::<f64>() / coordinates.max(1) as f64
    }

    /// About how far columns displace what was measured in it, squared [m^2]: the sum over the columns, mean over its parts.
    pub(crate) fn moved_m2(&self, columns: &DMatrix<f64>) -> f64 {
        let sigma_m = self.variance_m2().sqrt();
        columns.rows(self.first_row, self.rows).norm_squared() * sigma_m.powi(2)
            / self.parts.len().max(1) as f64
    }

    /// What whitened rows say that its parts are off [m].
    pub(crate) fn errors_m(&self, rows: &DVector<f64>) -> impl Iterator<Item = f64> {
        let own = rows.rows(self.first_row, self.rows);
        self.parts.iter().map(move |part| (&part.metres * own).norm())
    }

    /// How many of its first rows are of the same measurements as those of another dwell.
    pub(crate) fn rows_as_in(&self, other: &DwellRow) -> usize {
        let mut both = self.parts.iter().zip(&other.parts);
        let mut same = 0;
        while let Some((a, b)) = both.next().filter(|(a, b)| a.what == b.what) {
            same += a.rows.min(b.rows);
            if a.rows != b.rows {
                break;
            }
        }
        same
    }

    /// Whether the same was measured in another dwell, with as many rows each.
    pub(crate) fn measured_as(&self, other: &DwellRow) -> bool {
        self.rows == other.rows && self.rows_as_in(other) == self.rows
    }
}

/// One amplitude of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Amplitude {
    /// Its name: `width`.
    pub name: String,
    /// Unit of the SI value.
    pub unit: Unit,
    /// Typical size, SI: one unit of the column.
    pub typical: f64,
    /// Whether physics does not let it be negative.
    pub never_negative: bool,
}

/// Periods in a turn of a joint, of a periodic error.
pub(crate) fn per_turn(spec: &EffectSpec) -> Option<f64> {
    spec.shape.iter().find(|(name, _)| name == "frequency").map(|(_, frequency)| *frequency)
}

/// One effect on one target.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Its name as the pipeline writes it: `backlash:1`.
    pub spec: String,
    /// Kind: `backlash`.
    pub family: String,
    /// Target in words: `joint1`.
    pub target: String,
    /// Other mechanisms that are the same to the data.
    pub aliases: Vec<String>,
    /// Why the user knows that it acts, where he does.
    pub known: Option<String>,
    /// Amplitudes, one for each column.
    pub amplitudes: Vec<Amplitude>,
    /// Periods in a turn of its joint, of a periodic error.
    pub per_turn: Option<f64>,
    /// What drives it.
    pub toggle: Toggle,
    /// Columns at typical size.
    pub columns: Columns,
}

impl Candidate {
    /// Joins the specs of effects that are tried together.
    pub(crate) const AND: &'static str = "+";

    /// The specs of the effects it stands for: its own, or those of a group.
    pub(crate) fn members(&self) -> impl Iterator<Item = &str> {
        self.spec.split(Candidate::AND)
    }

    /// Whether it stands for several effects together.
    pub(crate) fn is_group(&self) -> bool {
        self.spec.contains(Candidate::AND)
    }
}

/// A family whose shape must be searched.
#[derive(Debug, Clone)]
pub struct Scan {
    /// Family and target without the shape: `periodic:1`.
    pub name: String,
    /// One candidate for each point of the grid.
    pub points: Vec<Candidate>,
    /// Points that were tried, those that promised too little to be here with them.
    pub tried: usize,
}

impl Scan {
    /// A grid with all of its points.
    pub fn of(name: impl Into<String>, points: Vec<Candidate>) -> Scan {
        Scan { name: name.into(), tried: points.len(), points }
    }
}

/// A way an effect may enter.
#[derive(Debug, Clone)]
pub struct Channel {
    /// Where it enters.
    pub enters: EntersAt,
    /// Unit of its columns' amplitude.
    pub unit: Unit,
    /// Name of each axis: what an expression effect acts on.
    pub axes: Vec<String>,
    /// Whitened rows of one SI unit along each of its axes.
    pub columns: Arc<DMatrix<f64>>,
}

impl Problem {
    /// Number of residual rows.
    pub fn rows(&self) -> usize {
        self.residual.len()
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.dwells.first().map_or(0, |d| d.joint_rad.len())
    }

    /// Standard deviation of what the fit leaves, in units of the declared noise: that at which priors weigh as they should
    /// beside errors of just this size, from above, so that it does not depend on what is declared.
    pub(crate) fn sigma(&self) -> f64 {
        let dof = self.rows().saturating_sub(self.geometry.ncols()).max(1) as f64;
        let of = |left: DVector<f64>| (left.norm_squared() / dof).sqrt();
        let normal = armcal_calibrate::gram(&self.geometry);
        let beside = |sigma: f64| of(&self.residual - &self.geometry * self.base_fit(&normal, sigma));
        (0..SIGMA_ROUNDS).fold(of(self.residual.clone()), |sigma, _| beside(sigma))
    }

    /// Penalised linear fit of the geometry alone, whose products are known, with noise of `scale` times the declared one.
    pub(crate) fn base_fit(&self, products: &DMatrix<f64>, scale: f64) -> DVector<f64> {
        let mut normal = products.clone();
        let mut right = self.geometry.tr_mul(&self.residual);
        for k in 0..right.len() {
            let precision = self.geometry_precision[k] * scale.powi(2);
            normal[(k, k)] += precision;
            right[k] -= precision * self.geometry_offset[k];
        }
        solve_cholesky(&cholesky_upper(normal), &right)
    }

    /// Checks that sizes agree and everything is finite.
    pub fn check(&self) -> Result<(), DiagnoseError> {
        let rows = self.rows();
        let same = |what: &str, found: usize, expected: usize| {
            if found == expected {
                return Ok(());
            }
            Err(DiagnoseError::Shape { what: what.to_string(), found, expected })
        };
        same("the dwells", self.dwells.iter().map(|d| d.rows).sum(), rows)?;
        same("the geometry", self.geometry.nrows(), rows)?;
        same("the geometry's offsets", self.geometry_offset.len(), self.geometry.ncols())?;
        same("the geometry's precisions", self.geometry_precision.len(), self.geometry.ncols())?;
        for c in self.candidates.iter().chain(self.scans.iter().flat_map(|s| &s.points)) {
            same(&format!("candidate {}", c.spec), c.columns.rows(), rows)?;
            same(&format!("the amplitudes of {}", c.spec), c.amplitudes.len(), c.columns.len())?;
        }
        for c in &self.channels {
            same(&format!("channel {}", c.enters), c.columns.nrows(), rows)?;
        }
        let mut at = 0;
        for d in &self.dwells {
            same("the first row of a dwell", d.first_row, at)?;
            same("the joints of a dwell", d.joint_rad.len(), self.joints())?;
            same("the arrival signs of a dwell", d.arrival.len(), self.joints())?;
            same("the seat rows of a dwell", d.seat.nrows(), d.rows)?;
            same("the displaced rows of a dwell", d.displaced.nrows(), d.rows)?;
            same("the rows of what was measured in a dwell", d.parts.iter().map(|p| p.rows).sum(), d.rows)?;
            at += d.rows;
        }
        let finite = self.residual.iter().chain(self.geometry.iter()).chain(self.geometry_offset.iter());
        if !finite.into_iter().all(|v| v.is_finite()) {
            return Err(DiagnoseError::NotFinite { what: "the residual or the geometry".to_string() });
        }
        if rows < 6 || self.dwells.len() < 4 {
            return Err(DiagnoseError::TooFew { rows, parameters: self.geometry.ncols() });
        }
        Ok(())
    }

    /// The same without what cannot be evaluated here, a derivative being no number; `dropped` are given its names.
    pub(crate) fn evaluable(mut self, dropped: &mut BTreeSet<String>) -> Problem {
        let mut keep = |c: &Candidate| {
            let evaluable = c.columns.is_finite();
            if !evaluable {
                dropped.insert(c.spec.clone());
            }
            evaluable
        };
        self.candidates.retain(&mut keep);
        self.scans.iter_mut().for_each(|scan| scan.points.retain(&mut keep));
        self.scans.retain(|scan| !scan.points.is_empty());
        self.channels.retain(|channel| channel.columns.iter().all(|v| v.is_finite()));
        self
    }

    /// The same problem with more columns among the geometry, each with the prior of an effect's amplitude.
    pub fn with_columns(mut self, columns: &DMatrix<f64>) -> Problem {
        let (from, m) = (self.geometry.ncols(), columns.ncols());
        let mut geometry = DMatrix::zeros(self.rows(), from + m);
        geometry.columns_mut(0, from).copy_from(&self.geometry);
        geometry.columns_mut(from, m).copy_from(columns);
        self.geometry = geometry;
        let extended = |v: &DVector<f64>, value: f64| {
            DVector::from_iterator(from + m, v.iter().copied().chain(std::iter::repeat_n(value, m)))
        };
        self.geometry_offset = extended(&self.geometry_offset, 0.0);
        self.geometry_precision = extended(&self.geometry_precision, EFFECT_PRECISION);
        self
    }

    /// The same problem without some dwells (`keep[i]` false).
    pub fn without(&self, keep: &[bool]) -> Problem {
        self.cut_to(keep, &mut Cut::default())
    }

    /// The same, sharing with other problems of these dwells what was cut for them.
    pub(crate) fn cut_to(&self, keep: &[bool], cut: &mut Cut) -> Problem {
        let kept: Vec<usize> = (0..self.dwells.len()).filter(|i| keep[*i]).collect();
        let rows: Vec<usize> = kept.iter().flat_map(|i| self.dwells[*i].range()).collect();
        let mut at = 0;
        let dwells = kept.iter().map(|i| {
            let dwell = DwellRow { first_row: at, ..self.dwells[*i].clone() };
            at += dwell.rows;
            dwell
        });
        let mut candidate =
            |c: &Candidate| Candidate { columns: c.columns.select(&kept, &rows, cut), ..c.clone() };
        let candidates = self.candidates.iter().map(&mut candidate).collect();
        let scan = |s: &Scan| Scan { points: s.points.iter().map(&mut candidate).collect(), ..s.clone() };
        let scans = self.scans.iter().map(scan).collect();
        let channels = self
            .channels
            .iter()
            .map(|c| Channel { columns: cut.of(&c.columns, &rows), ..c.clone() })
            .collect();
        Problem {
            dwells: dwells.collect(),
            residual: self.residual.select_rows(&rows),
            geometry: self.geometry.select_rows(&rows),
            geometry_offset: self.geometry_offset.clone(),
            geometry_precision: self.geometry_precision.clone(),
            candidates,
            scans,
            channels,
        }
    }
}
