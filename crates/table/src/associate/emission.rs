//! How likely an aligned tip is to be seated in a cavity, hovering above one, or neither.
//!
//! Densities in 1/m^3, comparable with each other: seated is normal about the cavity in all three axes;
//! hovering is normal beside the normal and uniform in height; neither is uniform over a volume, and a
//! hundred times less likely below a cavity, where the board is solid.

use super::problem::Problem;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// What a dwell may be. Cavities are indices into the layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum State {
    Seat(usize),
    Hover(usize),
    Out,
}

impl State {
    pub fn cavity(self) -> Option<usize> {
        match self {
            State::Seat(k) | State::Hover(k) => Some(k),
            State::Out => None,
        }
    }
}

const SEAT_SHARE: f64 = 0.55;
const HOVER_SHARE: f64 = 0.25;
const OUT_SHARE: f64 = 0.20;
const BELOW_SHARE: f64 = 0.01;
/// A state this much less likely than the best (as a logarithm) is not considered.
const NEGLIGIBLE_LN: f64 = 20.0;
/// Hovering is by hand: beside the cavity by this much more than seating, per axis [m].
const HOVER_SCATTER_M: f64 = 0.002;

pub(super) struct Emission<'a> {
    problem: &'a Problem<'a>,
    sigma_m: f64,
    /// Of a tip that scatters as those that the sensor saw: nearly all do.
    usual: Scatter,
    hover_m: std::ops::Range<f64>,
    with_hover: bool,
    ln_out: f64,
}

/// How a tip scatters about its cavity, per axis [m], and the logarithms of the densities where it does not.
#[derive(Clone, Copy)]
pub(super) struct Scatter {
    pub seat_m: f64,
    pub hover_m: f64,
    ln_seat: f64,
    ln_hover: f64,
}

impl Scatter {
    fn of(sigma_m: f64, extra_sigma_m: f64, range_m: f64) -> Scatter {
        let seat_m = sigma_m.hypot(extra_sigma_m);
        let hover_m = seat_m.hypot(HOVER_SCATTER_M);
        let ln_seat = SEAT_SHARE.ln() - 1.5 * TAU.ln() - 3.0 * seat_m.ln();
        let ln_hover = HOVER_SHARE.ln() - TAU.ln() - 2.0 * hover_m.ln() - range_m.ln();
        Scatter { seat_m, hover_m, ln_seat, ln_hover }
    }
}

impl<'a> Emission<'a> {
    /// `with_hover` is false where the board's normal is not determined.
    pub fn new(problem: &'a Problem<'a>, sigma_m: f64, with_hover: bool) -> Emission<'a> {
        let hover_m = problem.config.hover_min_mm * 1e-3..problem.config.hover_max_mm * 1e-3;
        let ln_out = (OUT_SHARE / problem.layout.volume_m3).ln();
        let usual = Scatter::of(sigma_m, 0.0, hover_m.end - hover_m.start);
        Emission { problem, sigma_m, usual, with_hover, ln_out, hover_m }
    }

    /// Scatter of dwell `i` about its cavity when it is seated, and when it hovers.
    pub fn scatter(&self, i: usize) -> Scatter {
        match self.problem.extra_sigma_m[i] {
            0.0 => self.usual,
            extra => Scatter::of(self.sigma_m, extra, self.hover_m.end - self.hover_m.start),
        }
    }

    /// Fills `states` with what the tip of dwell `i` may be and the logarithm of its density, shares
    /// included, the choice among cavities not. `Out` is always the last; states that no order of visits
    /// could rescue are left out.
    pub fn at(&self, i: usize, aligned_m: &Vector3<f64>, states: &mut Vec<(State, f64)>) {
        states.clear();
        let Scatter { seat_m: sigma_m, hover_m: hover_sigma_m, ln_seat, ln_hover } = self.scatter(i);
        let mut below = false;
        for &k in self.problem.layout.near(aligned_m) {
            let k = k as usize;
            let gap = aligned_m - self.problem.layout.points_m[k];
            let beside = gap.x * gap.x + gap.y * gap.y;
            let square = beside + gap.z * gap.z;
            states.push((State::Seat(k), ln_seat - 0.5 * square / (sigma_m * sigma_m)));
            let share = if self.with_hover { hover_share(gap.z, &self.hover_m) } else { 0.0 };
            if share > 0.0 {
                let ln = ln_hover - 0.5 * beside / (hover_sigma_m * hover_sigma_m);
                // Of most that hover the share is all, and its logarithm nothing.
                let ln_share = if share < 1.0 { share.ln() } else { 0.0 };
                states.push((State::Hover(k), ln + ln_share));
            }
            let half = 0.5 * self.problem.layout.spacing_m;
            below |= self.with_hover && gap.z < -self.hover_m.start && beside < half * half;
        }
        states.push((State::Out, self.ln_out + if below { BELOW_SHARE.ln() } else { 0.0 }));
        let top = states.iter().map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
        states.retain(|s| s.1 > top - NEGLIGIBLE_LN || s.0 == State::Out);
    }
}

/// How common hovering is at a height, relative to well within its range: rising from nothing at half of the
/// lowest height, so that no single dwell falls off a cliff between seated and hovering.
pub(super) fn hover_share(height_m: f64, range_m: &std::ops::Range<f64>) -> f64 {
    if height_m > range_m.end { 0.0 } else { (2.0 * height_m / range_m.start - 1.0).clamp(0.0, 1.0) }
}
