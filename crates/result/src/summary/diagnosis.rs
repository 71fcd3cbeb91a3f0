//! The `diagnosis` of `summary.json`.

use armcal_core::Unit;
use armcal_diagnose::{
    BeforeAfter, FoundEffect, JudgedOn, Nested, NotTestable, Ripple, ShapePoint, Unexplained, Verdict,
};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Which effect the calibrated model is missing.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DiagnosisSummary<'a> {
    /// The answer.
    pub verdict: Verdict,
    /// Names, most probable first.
    pub names: &'a [String],
    /// Of the answer; `null` where it is no explanation.
    pub probability: Option<f64>,
    /// How often noise alone would look like it.
    pub p_adjusted: f64,
    /// What was weighed, best first.
    pub candidates: Vec<CandidateSummary<'a>>,
    /// The strongest unlisted shape.
    pub unknown: Option<UnlistedSummary<'a>>,
    /// All unlisted shapes, the strongest first.
    pub unlisted: Vec<UnlistedSummary<'a>>,
    /// Pairs that are the same to these data.
    pub cannot_tell_apart: &'a [[String; 2]],
    /// Effects of realistic size that would have gone unseen.
    pub not_testable: &'a [NotTestable],
    /// What to record next.
    pub record_next: &'a [String],
    /// Probability that nothing is missing.
    pub p_nothing: f64,
    /// Mean errors of the calibrations without and with what was found, on the points that `judged` names.
    pub holdout_mm: BeforeAfter,
    /// Mean error that the declared noise alone gives.
    pub floor_mm: f64,
    /// Mean difference of poses that were visited again; `null` where too few were.
    pub repeatability_mm: Option<f64>,
    /// Which points the errors are of.
    pub judged: JudgedOn,
    /// What is neither explained nor at the floor.
    pub unexplained: Option<&'a Unexplained>,
    /// How much the errors scatter more than declared.
    pub sigma_ratio: f64,
    /// What was found, with names.
    pub effects: &'a [FoundEffect],
    /// Each number in one sentence.
    pub explanations: Vec<Explanation>,
    /// The choice made again without each part of the hold-out; `null` where it was not.
    pub nested: Option<&'a Nested>,
}

/// A number of the verdict, in a plain sentence.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Explanation {
    /// Which number: `probability`, `p_adjusted`.
    pub number: String,
    /// What it says.
    pub sentence: String,
}

/// An explanation that was weighed.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CandidateSummary<'a> {
    /// Its kind.
    pub effect: &'a str,
    /// Where it acts.
    pub target: &'a str,
    /// How `armcal add` is told to add it.
    pub spec: &'a str,
    /// Its amplitudes by name.
    pub parameters: BTreeMap<&'a str, AmplitudeSummary>,
    /// How far it is behind the answer by the score; this and the next three `null` where it was not among the best.
    pub behind_nats: Option<f64>,
    /// Standard error of that.
    pub behind_se: Option<f64>,
    /// Its probability.
    pub probability: Option<f64>,
    /// Whether it is of the answer.
    pub in_answer: bool,
    /// How often noise alone would look like it.
    pub p_adjusted: f64,
    /// Of the linearised fit, each place left out in turn; `refits` has the calibrations.
    pub holdout_mm: Option<BeforeAfter>,
    /// Others that these data cannot tell from it.
    pub same_to_the_data: &'a [String],
    /// Share that the geometry takes, 0 to 1.
    pub absorbed: f64,
    /// Smallest size that would have been seen, in typical sizes.
    pub smallest_seen: f64,
}

/// An amplitude, in its SI unit.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct AmplitudeSummary {
    /// Its value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Its unit.
    pub unit: Unit,
}

/// Something missing that has no name.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct UnlistedSummary<'a> {
    /// Where it enters.
    pub channel: String,
    /// What it depends on.
    pub driver: String,
    /// Its shape as a formula; empty where none reaches it.
    pub expression: &'a str,
    /// What the formula acts on.
    pub acts_on: Option<&'a str>,
    /// The `[[effects]]` table to paste into the pipeline; empty where nothing offered reaches the shape.
    pub table: String,
    /// Its probability.
    pub probability: f64,
    /// Of the linearised fit, each place left out in turn.
    pub holdout_mm: BeforeAfter,
    /// Unit of its shape.
    pub unit: Unit,
    /// Its shape over the driver.
    pub shape: &'a [ShapePoint],
    /// What repeats in a joint's error over its own angle; `null` where nothing does.
    pub ripple: Option<&'a Ripple>,
    /// Other places or drivers that say nearly the same.
    pub rivals: &'a [String],
}
