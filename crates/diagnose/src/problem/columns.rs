//! Whitened columns of what might be missing: stored, or as products that are cheap to keep and to weigh.
//!
//! A product is a base, a few columns of rows, times functions known at the dwells: a joint's column times functions of an
//! angle, an effect's columns where it acts. What is asked of it dwell by dwell costs the base once and then a number or
//! two a dwell and function, never the rows.

use crate::problem::DwellRow;
use nalgebra::{DMatrix, DMatrixViewMut};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Columns are a product where no more than this share of their length is not.
const PROPORTIONAL: f64 = 1e-9;

/// Functions at the dwells: dwells x m.
pub(crate) type Functions<'c> = Cow<'c, DMatrix<f64>>;

/// Whitened columns.
#[derive(Debug, Clone)]
pub enum Columns {
    /// As they are: rows x m.
    Dense(Arc<DMatrix<f64>>),
    /// Every column of `base` (rows x c) times every column of `basis` (dwells x m) at the row's dwell.
    Product {
        /// Unit columns.
        base: Arc<DMatrix<f64>>,
        /// Values at the dwells.
        basis: Arc<DMatrix<f64>>,
        /// Times this.
        size: f64,
    },
    /// Every column of `base` times the sine and the cosine of an angle's multiple.
    Wave {
        /// Unit columns.
        base: Arc<DMatrix<f64>>,
        /// The angle at each dwell [rad].
        angle_rad: Arc<Vec<f64>>,
        /// Periods in a turn of it.
        per_turn: f64,
        /// Size of the sine and of the cosine.
        sizes: [f64; 2],
    },
    /// `base` in some of the dwells, as they follow each other, and nothing in the others.
    Within {
        /// The columns.
        base: Arc<DMatrix<f64>>,
        /// The place of each dwell in the order of time.
        places: Arc<Vec<usize>>,
        /// The places of those in which it acts.
        on: Range<usize>,
    },
    /// Those of several, side by side.
    Together(Vec<Columns>),
}

impl Columns {
    /// Number of columns.
    pub fn len(&self) -> usize {
        match self {
            Columns::Dense(m) => m.ncols(),
            Columns::Product { base, basis, .. } => base.ncols() * basis.ncols(),
            Columns::Wave { base, .. } => 2 * base.ncols(),
            Columns::Within { base, .. } => base.ncols(),
            Columns::Together(parts) => parts.iter().map(Columns::len).sum(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        match self {
            Columns::Dense(base)
            | Columns::Product { base, .. }
            | Columns::Wave { base, .. }
            | Columns::Within { base, .. } => base.nrows(),
            Columns::Together(parts) => parts.first().map_or(0, Columns::rows),
        }
    }

    /// The base of a product.
    pub(crate) fn base(&self) -> Option<&Arc<DMatrix<f64>>> {
        match self {
            Columns::Dense(_) | Columns::Together(_) => None,
            Columns::Product { base, .. } | Columns::Wave { base, .. } | Columns::Within { base, .. } => {
                Some(base)
            }
        }
    }

    /// Of a product its base, and the functions at the dwells (dwells x m).
    pub(crate) fn factors(&self) -> Option<(&Arc<DMatrix<f64>>, Functions<'_>)> {
        match self {
            Columns::Dense(_) | Columns::Together(_) => None,
            Columns::Product { base, basis, size } if *size == 1.0 => Some((base, Cow::Borrowed(basis))),
            Columns::Product { base, basis, size } => Some((base, Cow::Owned(basis.as_ref() * *size))),
            Columns::Wave { base, angle_rad, per_turn, sizes } => {
                Some((base, Cow::Owned(Turning::new(angle_rad, *per_turn).sized(sizes))))
            }
            Columns::Within { base, places, on } => {
                let on = places.iter().map(|place| f64::from(on.contains(place)));
                Some((base, Cow::Owned(DMatrix::from_iterator(places.len(), 1, on))))
            }
        }
    }

    /// The same as a product with `base`, one column, where each of these is that times something in every dwell (`rows`).
    pub(crate) fn factored(&self, base: &Arc<DMatrix<f64>>, rows: &[Range<usize>]) -> Option<Columns> {
        let (Columns::Dense(own), 1) = (self, base.ncols()) else { return None };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let base_rows = base.as_slice();
        let mut basis = DMatrix::zeros(rows.len(), own.ncols());
        for (k, column) in own.as_slice().chunks_exact(own.nrows().max(1)).enumerate() {
            let mut left = 0.0;
            for (i, rows) in rows.iter().enumerate() {
                let (x, b) = (&column[rows.clone()], &base_rows[rows.clone()]);
                let square = dot(b, b);
                let times = if square > 0.0 { dot(x, b) / square } else { 0.0 };
                left += x.iter().zip(b).map(|(x, b)| (x - times * b).powi(2)).sum::<f64>();
                basis[(i, k)] = times;
            }
            if left > (PROPORTIONAL * PROPORTIONAL) * dot(column, column) {
                return None;
            }
        }
        Some(Columns::Product { base: base.clone(), basis: basis.into(), size: 1.0 })
    }

    /// The functions of many terms, those that have any. Of waves over one angle at even steps each is the one before it
    /// turned by the step, which costs no sine.
    pub(crate) fn functions<'c>(terms: impl Iterator<Item = &'c Columns>) -> Vec<Functions<'c>> {
        let mut all = Vec::new();
        let mut turning: Option<Turning<'c>> = None;
        for term in terms {
            match (term, turning.as_mut()) {
                (Columns::Wave { angle_rad, per_turn, sizes, .. }, Some(wave))
                    if Arc::ptr_eq(angle_rad, wave.angle_rad) =>
                {
                    wave.turn(*per_turn);
                    all.push(Cow::Owned(wave.sized(sizes)));
                }
                (Columns::Wave { angle_rad, per_turn, sizes, .. }, _) => {
                    let wave = Turning::new(angle_rad, *per_turn);
                    all.push(Cow::Owned(wave.sized(sizes)));
                    turning = Some(wave);
                }
                _ => all.extend(term.factors().map(|(_, functions)| functions)),
            }
        }
        all
    }

    /// The columns, times `factor`. Products are ordered base column by base column.
    pub fn dense(&self, dwells: &[DwellRow], factor: f64) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.rows(), self.len());
        self.write(dwells, factor, out.as_view_mut());
        out
    }

    /// The same into a place of zeros.
    pub(crate) fn write(&self, dwells: &[DwellRow], factor: f64, mut out: DMatrixViewMut<'_, f64>) {
        if let Columns::Dense(own) = self {
            out.zip_apply(own.as_ref(), |to, from| *to = from * factor);
        }
        if let Columns::Together(parts) = self {
            let mut at = 0;
            for part in parts {
                part.write(dwells, factor, out.columns_mut(at, part.len()));
                at += part.len();
            }
        }
        let Some((base, basis)) = self.factors() else { return };
        for c in 0..base.ncols() {
            for b in 0..basis.ncols() {
                let mut column = out.column_mut(c * basis.ncols() + b);
                let values = basis.column(b).into_iter().map(|value| value * factor);
                write_product(base.column(c).as_slice(), dwells.iter().zip(values), column.as_mut_slice());
            }
        }
    }

    /// Whether every number in them is finite.
    pub(crate) fn is_finite(&self) -> bool {
        let finite = |m: &DMatrix<f64>| m.iter().all(|v| v.is_finite());
        match (self, self.factors()) {
            (Columns::Dense(m), _) => finite(m),
            (Columns::Together(parts), _) => parts.iter().all(Columns::is_finite),
            (_, Some((base, basis))) => finite(base) && finite(&basis),
            (_, None) => true,
        }
    }

    /// The same without some dwells: those `kept`, and their `rows`. `cut` remembers what bases, which products share, were
    /// cut to.
    pub(crate) fn select(&self, kept: &[usize], rows: &[usize], cut: &mut Cut) -> Columns {
        match self {
            Columns::Dense(m) => Columns::Dense(Arc::new(m.select_rows(rows))),
            Columns::Product { base, basis, size } => {
                Columns::Product { base: cut.of(base, rows), basis: cut.functions(basis, kept), size: *size }
            }
            Columns::Wave { base, angle_rad, per_turn, sizes } => Columns::Wave {
                base: cut.of(base, rows),
                angle_rad: cut.numbers(angle_rad, kept),
                per_turn: *per_turn,
                sizes: *sizes,
            },
            Columns::Within { base, places, on } => {
                Columns::Within { base: cut.of(base, rows), places: cut.places(places, kept), on: on.clone() }
            }
            Columns::Together(parts) => {
                Columns::Together(parts.iter().map(|part| part.select(kept, rows, cut)).collect())
            }
        }
    }
}

/// A column of a base times a value in each dwell, into a place of zeros.
pub(crate) fn write_product<'d>(
    base: &[f64],
    values: impl Iterator<Item = (&'d DwellRow, f64)>,
    to: &mut [f64],
) {
    for (dwell, value) in values.filter(|(_, value)| *value != 0.0) {
        let rows = dwell.range();
        to[rows.clone()].iter_mut().zip(&base[rows]).for_each(|(to, own)| *to = own * value);
    }
}

/// Sine and cosine of the multiples of an angle, one multiple after the other.
struct Turning<'c> {
    angle_rad: &'c Arc<Vec<f64>>,
    per_turn: f64,
    now: Vec<[f64; 2]>,
    /// The last step, and what it turns each dwell by.
    step: (f64, Vec<[f64; 2]>),
}

impl<'c> Turning<'c> {
    fn new(angle_rad: &'c Arc<Vec<f64>>, per_turn: f64) -> Turning<'c> {
        Turning { angle_rad, per_turn, now: sin_cos_pairs(angle_rad, per_turn), step: (0.0, Vec::new()) }
    }

    /// On to another multiple.
    fn turn(&mut self, per_turn: f64) {
        let step = per_turn - self.per_turn;
        if self.step.0 != step {
            self.step = (step, sin_cos_pairs(self.angle_rad, step));
        }
        for (now, [sine, cosine]) in self.now.iter_mut().zip(&self.step.1) {
            *now = [now[0] * cosine + now[1] * sine, now[1] * cosine - now[0] * sine];
        }
        self.per_turn = per_turn;
    }

    fn sized(&self, sizes: &[f64; 2]) -> DMatrix<f64> {
        DMatrix::from_fn(self.now.len(), 2, |i, k| sizes[k] * self.now[i][k])
    }
}

fn sin_cos_pairs(angle_rad: &[f64], per_turn: f64) -> Vec<[f64; 2]> {
    angle_rad.iter().map(|angle| <[f64; 2]>::from((per_turn * angle).sin_cos())).collect()
}

/// What is shared by many columns, each with what it was cut to.
#[derive(Default)]
pub(crate) struct Cut {
    bases: Vec<[Arc<DMatrix<f64>>; 2]>,
    functions: Vec<[Arc<DMatrix<f64>>; 2]>,
    numbers: Vec<[Arc<Vec<f64>>; 2]>,
    places: Vec<[Arc<Vec<usize>>; 2]>,
}

impl Cut {
    /// Forgets all but functions at the dwells that somebody else still has: another fit of the same dwells shares them.
    pub fn of_another_fit(&mut self) {
        let mut functions = std::mem::take(&mut self.functions);
        functions.retain(|[all, _]| Arc::strong_count(all) > 1);
        *self = Cut { functions, ..Cut::default() };
    }

    fn functions(&mut self, all: &Arc<DMatrix<f64>>, kept: &[usize]) -> Arc<DMatrix<f64>> {
        get_or_make(&mut self.functions, all, |m| m.select_rows(kept))
    }

    /// A base with these rows alone.
    pub fn of(&mut self, base: &Arc<DMatrix<f64>>, rows: &[usize]) -> Arc<DMatrix<f64>> {
        get_or_make(&mut self.bases, base, |m| m.select_rows(rows))
    }

    fn numbers(&mut self, all: &Arc<Vec<f64>>, kept: &[usize]) -> Arc<Vec<f64>> {
        get_or_make(&mut self.numbers, all, |v| kept.iter().map(|i| v[*i]).collect())
    }

    fn places(&mut self, all: &Arc<Vec<usize>>, kept: &[usize]) -> Arc<Vec<usize>> {
        get_or_make(&mut self.places, all, |v| kept.iter().map(|i| v[*i]).collect())
    }
}

/// What `make` makes of something shared, made once.
fn get_or_make<T>(known: &mut Vec<[Arc<T>; 2]>, of: &Arc<T>, make: impl FnOnce(&T) -> T) -> Arc<T> {
    if let Some([_, done]) = known.iter().find(|[from, _]| Arc::ptr_eq(from, of)) {
        return done.clone();
    }
    let done = Arc::new(make(of));
    known.push([of.clone(), done.clone()]);
    done
}
