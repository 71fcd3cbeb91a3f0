//! What a run found, worked out once as the messages that say it: channels write them, layouts point at them.
//!
//! All of it is about the whole run or a whole recording, so each is one message; arrays in one message are parallel,
//! ready for a scatter plot.

mod boards;
mod course;
mod curves;
mod diagnosis;
mod joints;
mod quality;
mod steps;

pub(crate) use boards::round_factor;
pub(crate) use curves::error_curve;
pub(crate) use joints::{feels_gravity, moves_tip};

use crate::points::Point;
use crate::proto;
use crate::run::{Run, Undiagnosed};
use crate::story::Story;
use armcal_diagnose::{Diagnosis, UnknownReport, Verdict};
use joints::torques_nm;

/// What is less probable than this is not drawn as if it were there.
const IMPROBABLE: f64 = 0.05;

/// Everything a run found.
pub(crate) struct Findings {
    /// One entry a joint of the model.
    pub joints: Vec<proto::JointErrors>,
    /// Whether each joint's errors are drawn over its gravity torque.
    pub feels_gravity: Vec<bool>,
    /// One entry a recording with a board that was visited.
    pub boards: Vec<proto::BoardErrors>,
    /// Errors over recorded time.
    pub course: proto::Course,
    /// The falling error.
    pub steps: proto::Steps,
    /// The verdict (or that the setup comes first), and what it was weighed against; `None` when nobody asked.
    pub diagnosis: Option<(proto::Diagnosis, proto::Candidates)>,
    /// What was found and the candidates as people read them; empty where nothing was looked for.
    pub effects: proto::EffectTable,
    /// What no name explains, unless that anything does not have one is improbable.
    pub curves: Vec<proto::ErrorCurve>,
    /// Steps of what to do next, and entries of what was found, in words.
    pub next: usize,
    pub told_found: usize,
    /// What the data are like.
    pub quality: proto::Quality,
}

impl Findings {
    /// Works everything out. `points` are those of the run.
    pub fn of(run: &Run, points: &[Point]) -> Findings {
        let in_time = in_time(points);
        let story = Story::of(run);
        let torques_nm = torques_nm(run);
        Findings {
            joints: joints::joint_errors(run, points, &in_time, &torques_nm),
            feels_gravity: feels_gravity(&torques_nm),
            boards: boards::board_errors(run, points, &in_time),
            course: course::course(run, points, &in_time),
            steps: steps::steps(run),
            diagnosis: match &run.diagnosis {
                Some(d) => Some((diagnosis::diagnosis(run, d), diagnosis::candidates(run, d))),
                None if run.undiagnosed == Some(Undiagnosed::NotAsked) => None,
                None => Some((diagnosis::none(run.answer()), proto::Candidates::default())),
            },
            effects: run.diagnosis.as_ref().map(|d| diagnosis::table(run, d)).unwrap_or_default(),
            curves: unlisted_curves(run),
            next: story.next.len(),
            told_found: story.found.len(),
            quality: quality::quality(run),
        }
    }
}

/// What no name explains, as people are told it and shown it: where it is the answer, and unless that anything does not have a
/// name is improbable.
pub(crate) fn shown_unlisted(d: &Diagnosis) -> impl Iterator<Item = &UnknownReport> {
    d.unlisted.iter().filter(|u| d.verdict == Verdict::Unknown || u.probability >= IMPROBABLE)
}

/// The same as curves.
pub(crate) fn unlisted_curves(run: &Run) -> Vec<proto::ErrorCurve> {
    let shown = run.diagnosis.iter().flat_map(shown_unlisted);
    shown.map(|u| error_curve(u, run.model.chain())).collect()
}

/// Indices of the points in the order of time.
fn in_time(points: &[Point]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&i| (points[i].observation.time_ns, points[i].observation.dwell));
    order
}

/// A number that is one.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Four significant digits, whole numbers at least: tables of viewers show every digit a number has. By its decimal digits,
/// because powers of ten above 22 are no floating-point numbers.
fn short(value: f64) -> f64 {
    let exponent = value.abs().log10().floor();
    if !exponent.is_finite() {
        return value;
    }
    let places = usize::try_from(3 - exponent as i32).unwrap_or(0);
    format!("{value:.places$}").parse().unwrap_or(value)
}

/// Zero for what is not a number, in fields that cannot be absent.
fn or_zero(value: f64) -> f64 {
    finite(value).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_tables_have_four_digits() {
        let shown = [24.342_778_184, 0.131_249_9, -20.892_246, 123_456.7, 1e-7 / 3.0, 0.0].map(short);
        assert_eq!(shown, [24.34, 0.1312, -20.89, 123_457.0, 3.333e-8, 0.0]);
        assert!(short(f64::NAN).is_nan() && short(f64::INFINITY).is_infinite());
    }
}
