//! Rows made independent of each other, and of one size: the inverse roots of what the noise may be.
//!
//! Each alternative is a covariance `(I + b^2 K) / (1 + b^2)` of the whitened rows. `K` is so structured that its inverse root
//! costs no more than walking the rows: groups that share one displacement (rank 3 a group), or a first-order
//! autoregression, whitened by its Kalman filter. Rows it touches are rescaled by `1 + b^2`: the correlated part is a
//! share of the declared noise, not an addition to it, so that pure correlated noise does not contradict the declared
//! size; a wandering sensor, a joint with slack and dwells that scatter more do so on top of what is declared. Everything else is then done in
//! the whitened rows, so that a noise-like term and a physical one compete on equal ground (formula 9, evaluated
//! exactly for all terms).

use crate::noise::Noise;
use crate::problem::{DwellRow, Part, Problem};
use armcal_calibrate::{gram, inner};
use armcal_core::{DwellId, Measured};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::ops::Range;

mod form;

pub(crate) use form::{Form, Shares};

/// Correlation length of the short memory [dwells].
const MEMORY_DWELLS: f64 = 3.0;

/// `((I + b^2 K) / (1 + b^2))^(-1/2)`, ready to be applied to columns.
#[derive(Debug, Clone)]
pub(crate) struct Whitener {
    kind: Kind,
    /// ln of the determinant of that covariance.
    pub ln_det: f64,
}

#[derive(Debug, Clone)]
enum Kind {
    /// A factor for each row.
    Rows(DVector<f64>),
    /// For each dwell its rows and p: `x - p p'x` is whitened.
    Dwells(Vec<(Range<usize>, DVector<f64>)>),
    /// A factor, and for each group its rows and P: `x - P P'x` times the factor is whitened.
    Groups(f64, Vec<(Vec<usize>, DMatrix<f64>)>),
    /// For each row: the row it remembers, decay to it, gain, and 1/sqrt of the innovation's variance.
    Memory(Vec<Filter>),
    /// One after the other; of none, nothing.
    Then(Vec<Kind>),
}

#[derive(Debug, Clone, Copy)]
struct Filter {
    row: usize,
    /// Axis of the state.
    axis: usize,
    /// Back from the declared noise to the row in which the state's share is `load`.
    scale: f64,
    decay: f64,
    /// How much of the state the row shows.
    load: f64,
    gain: f64,
    weight: f64,
}

impl Whitener {
    /// For noise of a kind with standard deviation `b` (declared noise = 1).
    pub fn new(noise: Noise, b: f64, problem: &Problem) -> Whitener {
        match noise {
            Noise::White => Whitener::then([]),
            Noise::Place => groups(problem, b, false),
            Noise::Visit => groups(problem, b, true),
            Noise::Memory => memory(problem, |_| Share::of_declared(b)),
            Noise::Sensor => memory(problem, sensor(b)),
            Noise::SensorAndPlace => sensor_and_place(problem, b),
            Noise::Slack(_) => {
                noise.direction(problem).map_or_else(|| Whitener::then([]), |v| slack(&v, problem, b))
            }
            Noise::Tracked => scaled(problem, 1.0 + b * b, |_, part| part.tracked),
            Noise::TrackedAndPlace => Whitener::then(
                [(Noise::Tracked, b), (Noise::Place, 1.0)].map(|(n, b)| Whitener::new(n, b, problem)),
            ),
            Noise::Seated => scaled(problem, 1.0 + b * b, |_, part| !part.tracked),
        }
    }

    /// One after the other.
    fn then<const N: usize>(all: [Whitener; N]) -> Whitener {
        let ln_det = all.iter().map(|one| one.ln_det).sum();
        Whitener { kind: Kind::Then(all.into_iter().map(|one| one.kind).collect()), ln_det }
    }

    /// Whitens columns in place.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        self.kind.apply(columns);
    }

    /// Columns times its transpose, in place.
    pub fn apply_transposed(&self, columns: &mut DMatrix<f64>) {
        self.kind.apply_transposed(columns);
    }

    /// Whether it leaves rows as they are.
    pub fn is_plain(&self) -> bool {
        matches!(&self.kind, Kind::Then(all) if all.is_empty())
    }
}

impl Kind {
    fn keeps_dwells_apart(&self) -> bool {
        match self {
            Kind::Rows(_) => true,
            Kind::Dwells(_) => true,
            Kind::Groups(..) | Kind::Memory(_) => false,
            Kind::Then(all) => all.iter().all(Kind::keeps_dwells_apart),
        }
    }

    fn apply(&self, columns: &mut DMatrix<f64>) {
        match self {
            Kind::Groups(unit, groups) => {
                for (rows, p) in groups {
                    let x = columns.select_rows(rows);
                    let change = p * inner(p, &x);
                    for (mut column, change) in columns.column_iter_mut().zip(change.column_iter()) {
                        rows.iter()
                            .zip(change.iter())
                            .for_each(|(r, c)| column[*r] = unit * (column[*r] - c));
                    }
                }
            }
            Kind::Then(all) => all.iter().for_each(|one| one.apply(columns)),
            Kind::Dwells(dwells) => {
                for mut column in columns.column_iter_mut() {
                    for (rows, p) in dwells {
                        let mut own = column.rows_mut(rows.start, rows.len());
                        let share = p.dot(&own);
                        own.axpy(-share, p, 1.0);
                    }
                }
            }
            Kind::Rows(factors) => {
                columns.column_iter_mut().for_each(|mut column| column.component_mul_assign(factors));
            }
            Kind::Memory(filters) => walked(filters.iter(), columns, |f, state, number| {
                let predicted = f.decay * *state;
                let innovation = f.scale * *number - f.load * predicted;
                *state = predicted + f.gain * innovation;
                *number = innovation * f.weight;
            }),
        }
    }

    /// Of those that are no filter the transpose is the same again.
    fn apply_transposed(&self, columns: &mut DMatrix<f64>) {
        match self {
            Kind::Groups(..) | Kind::Dwells(_) | Kind::Rows(_) => self.apply(columns),
            Kind::Then(all) => all.iter().rev().for_each(|one| one.apply_transposed(columns)),
            Kind::Memory(filters) => walked(filters.iter().rev(), columns, |f, state, number| {
                let innovation = f.weight * *number + f.gain * *state;
                *number = f.scale * innovation;
                *state = f.decay * (*state - f.load * innovation);
            }),
        }
    }
}

/// Columns that are walked side by side: each waits for the row before.
const ABREAST: usize = 8;

/// Walks filters over each column, with a state along each axis: `step` takes the state and the row's number on.
fn walked<'f>(
    filters: impl Iterator<Item = &'f Filter> + Clone,
    columns: &mut DMatrix<f64>,
    step: impl Fn(&Filter, &mut f64, &mut f64),
) {
    let axes = filters.clone().map(|f| f.axis + 1).max().unwrap_or(0);
    let rows = columns.nrows();
    let mut states = vec![[0.0; ABREAST]; axes];
    for some in columns.as_mut_slice().chunks_mut(ABREAST * rows.max(1)) {
        states.fill([0.0; ABREAST]);
        for f in filters.clone() {
            let numbers = some[f.row..].iter_mut().step_by(rows);
            states[f.axis].iter_mut().zip(numbers).for_each(|(state, number)| step(f, state, number));
        }
    }
}

/// `C = D (C_sensor + Z Z') D`: seated rows, half their variance the place's, are scaled back to the declared noise.
fn sensor_and_place(problem: &Problem, b: f64) -> Whitener {
    let memory = memory(problem, sensor(b));
    let held = |d: &DwellRow, part: &Part| !part.tracked && d.place.is_some();
    let is_held = |d: &&DwellRow| d.parts.iter().any(|part| held(d, part));
    let seated: Vec<&DwellRow> = problem.dwells.iter().filter(is_held).collect();
    let mut place: BTreeMap<&str, usize> = BTreeMap::new();
    for d in &seated {
        let next = place.len();
        place.entry(d.place.as_deref().unwrap_or_default()).or_insert(next);
    }
    let mut shared = DMatrix::zeros(problem.rows(), 3 * place.len());
    for d in &seated {
        let k = 3 * place[d.place.as_deref().unwrap_or_default()];
        shared.view_mut((d.first_row, k), (d.rows, 3)).copy_from(&d.seat);
    }
    memory.apply(&mut shared);
    let (p, ln_det) = shares(&shared, 1.0);
    let places = Whitener { kind: Kind::Groups(1.0, vec![((0..problem.rows()).collect(), p)]), ln_det };
    let halved = scaled(problem, 0.5, held);
    Whitener::then([halved, memory, places])
}

/// P with `(I - P P')^2 = (I + b^2 Z Z')^-1`, and ln of the determinant of `I + b^2 Z Z'`.
fn shares(z: &DMatrix<f64>, b: f64) -> (DMatrix<f64>, f64) {
    let eigen = gram(z).symmetric_eigen();
    let mut p = z * &eigen.eigenvectors;
    let mut ln_det = 0.0;
    for (k, w) in eigen.eigenvalues.iter().enumerate() {
        let grown = 1.0 + b * b * w.max(0.0);
        ln_det += grown.ln();
        let share = if *w > 1e-12 { ((1.0 - 1.0 / grown.sqrt()) / w).sqrt() } else { 0.0 };
        p.column_mut(k).scale_mut(share);
    }
    (p, ln_det)
}

/// This variance of some of what was measured, one of the rest.
fn scaled(problem: &Problem, variance: f64, those: impl Fn(&DwellRow, &Part) -> bool) -> Whitener {
    let mut factors = DVector::from_element(problem.rows(), 1.0);
    let mut ln_det = 0.0;
    for dwell in &problem.dwells {
        for (_, rows) in dwell.ranges().filter(|(part, _)| those(dwell, part)) {
            ln_det += rows.len() as f64 * variance.ln();
            factors.rows_mut(rows.start, rows.len()).fill(variance.sqrt().recip());
        }
    }
    Whitener { kind: Kind::Rows(factors), ln_det }
}

/// `I + b^2 v v'` in every dwell.
fn slack(v: &DVector<f64>, problem: &Problem, b: f64) -> Whitener {
    let mut ln_det = 0.0;
    let mut of = |dwell: &DwellRow| {
        let own = v.rows(dwell.first_row, dwell.rows).into_owned();
        let (p, grown) = shares(&DMatrix::from_column_slice(dwell.rows, 1, own.as_slice()), b);
        ln_det += grown;
        (dwell.range(), p.column(0).into_owned())
    };
    let dwells = problem.dwells.iter().map(&mut of).collect();
    Whitener { kind: Kind::Dwells(dwells), ln_det }
}

fn groups(problem: &Problem, b: f64, by_recording: bool) -> Whitener {
    let mut members: BTreeMap<(usize, &str), Vec<&DwellRow>> = BTreeMap::new();
    for dwell in &problem.dwells {
        if let Some(place) = &dwell.place {
            let recording = if by_recording { dwell.id.recording } else { 0 };
            members.entry((recording, place)).or_default().push(dwell);
        }
    }
    let mut ln_det = 0.0;
    let mut groups = Vec::new();
    for dwells in members.values() {
        let rows: Vec<usize> = dwells.iter().flat_map(|d| d.range()).collect();
        let mut z = DMatrix::zeros(rows.len(), 3);
        let mut at = 0;
        for d in dwells {
            z.rows_mut(at, d.rows).copy_from(&d.seat);
            at += d.rows;
        }
        let (p, grown) = shares(&z, b);
        ln_det += grown - rows.len() as f64 * (1.0 + b * b).ln();
        groups.push((rows, p));
    }
    Whitener { kind: Kind::Groups((1.0 + b * b).sqrt(), groups), ln_det }
}

/// State `x_i = phi^gap x_(i-1) + ...` of variance b^2 for each row of each measurement, seen with unit noise; reset at each
/// recording.
fn memory(problem: &Problem, shares: impl Fn(&Part) -> Share) -> Whitener {
    let mut order: Vec<usize> = (0..problem.dwells.len()).collect();
    order.sort_by_key(|i| problem.dwells[*i].id);
    let mut states: BTreeMap<(Measured, usize), State> = BTreeMap::new();
    let (mut filters, mut ln_det) = (Vec::new(), 0.0);
    for i in order {
        let dwell = &problem.dwells[i];
        for (part, rows) in dwell.ranges() {
            let Share { load, unit } = shares(part);
            for (axis, row) in rows.enumerate() {
                let next = states.len();
                let state = states.entry((part.what, axis)).or_insert(State::new(next));
                let decay = state.decay_to(dwell.id);
                let predicted = decay * decay * state.variance + (1.0 - decay * decay);
                let innovation = load * load * predicted + 1.0;
                let gain = load * predicted / innovation;
                state.variance = predicted * (1.0 - gain * load);
                state.last = Some(dwell.id);
                ln_det += (innovation / unit).ln();
                let (scale, weight) = (unit.sqrt(), innovation.sqrt().recip());
                filters.push(Filter { row, axis: state.axis, scale, decay, load, gain, weight });
            }
        }
    }
    Whitener { kind: Kind::Memory(filters), ln_det }
}

/// What is remembered along one axis.
struct State {
    axis: usize,
    variance: f64,
    /// The dwell that showed it last.
    last: Option<DwellId>,
}

impl State {
    fn new(axis: usize) -> State {
        State { axis, variance: 1.0, last: None }
    }

    /// The share that is left of it in a dwell.
    fn decay_to(&self, dwell: DwellId) -> f64 {
        let gap = match self.last {
            Some(last) if last.recording == dwell.recording => dwell.dwell.abs_diff(last.dwell) as f64,
            _ => f64::INFINITY,
        };
        (-gap / MEMORY_DWELLS).exp()
    }
}

/// Tracked dwells wander on top of what is declared for them; half the noise of seated ones remembers.
fn sensor(b: f64) -> impl Fn(&Part) -> Share {
    move |part| match part.tracked {
        true => Share { load: b, unit: 1.0 },
        false => Share::of_declared(1.0),
    }
}

/// How a dwell shows the state that remembers.
struct Share {
    /// Standard deviation of the state in the dwell (declared noise = 1).
    load: f64,
    /// Variance that is called one: `1 + load^2` where the state is a share of the declared noise, 1 where it adds to it.
    unit: f64,
}

impl Share {
    fn of_declared(load: f64) -> Share {
        Share { load, unit: 1.0 + load * load }
    }
}
