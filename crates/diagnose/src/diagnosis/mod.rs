//! What a diagnosis returns. Every type serialises as the summary shows it.

pub(crate) mod combination;
pub(crate) mod ripple;

use crate::diagnosis::combination::Combination;
use crate::diagnosis::ripple::{Peak, Ripple};
use crate::enters::{DependsOn, EntersAt};
use crate::judge::contrasts::Contrast;
use crate::weigh::scatter::Scatter;
use armcal_calibrate::{Calibration, ErrorPlace, HeldOut};
use armcal_core::{DwellId, Unit, Warning};
use armcal_model::{EffectSpec, Model};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Stands in a set where an explanation outside the catalogue cannot be excluded.
pub const NOT_LISTED: &str = "something not listed";

/// The answer in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is missing that these data can show.
    NothingMissing,
    /// Every missing effect has one name.
    Identified,
    /// Something listed is missing, and these data leave more than one name for it.
    Ambiguous,
    /// Something is missing that no listed effect explains, and an unlisted shape predicts.
    Unknown,
    /// The errors do not agree with the declared noise, and nothing that was tried predicts them.
    Unexplained,
}

impl Verdict {
    /// Every verdict.
    pub const ALL: [Verdict; 5] = [
        Verdict::NothingMissing,
        Verdict::Identified,
        Verdict::Ambiguous,
        Verdict::Unknown,
        Verdict::Unexplained,
    ];

    /// As the pipeline and `summary.json` spell it.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::NothingMissing => "nothing_missing",
            Verdict::Identified => "identified",
            Verdict::Ambiguous => "ambiguous",
            Verdict::Unknown => "unknown",
            Verdict::Unexplained => "unexplained",
        }
    }
}

/// The whole diagnosis.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Diagnosis {
    /// The answer.
    pub verdict: Verdict,
    /// Names, most probable first: one for each effect when identified, all members of the sets when ambiguous.
    pub names: Vec<String>,
    /// Probability of the answer among all that was scored; none where it is that nothing explains the errors.
    pub probability: Option<f64>,
    /// Largest family-wise p-value of the effects named; of the best candidate when none is.
    pub p_adjusted: f64,
    /// Effects that belong in the model, in the order in which they were found.
    pub effects: Vec<FoundEffect>,
    /// Effects that show only once the unlisted shape is in the model too; not named, worth a look.
    pub tentative: Vec<FoundEffect>,
    /// The catalogue against the calibrated model as it came, best first.
    pub candidates: Vec<CandidateReport>,
    /// What no name explains: the answer when unknown, what is left over otherwise.
    pub unknown: Option<UnknownReport>,
    /// All of it, the strongest first: several joints may err over their own angles at once.
    pub unlisted: Vec<UnknownReport>,
    /// Pairs whose signatures are the same to these data.
    pub cannot_tell_apart: Vec<[String; 2]>,
    /// Effects these data could not have shown at a realistic size.
    pub not_testable: Vec<NotTestable>,
    /// What to record next, in words.
    pub record_next: Vec<String>,
    /// The noise as found.
    pub noise: Scatter,
    /// Probability that nothing is missing, before any effect was added.
    pub p_nothing: f64,
    /// Unlisted shapes that were weighed.
    pub tried_unlisted: usize,
    /// Whether what is left over is so small a part of an effect that was found that it may be that effect's shape.
    pub rest_may_be_shape: bool,
    /// Mean position error before and after what was found [mm]: of the calibrations with and without it, on the
    /// points by which they are judged (see `judged`).
    pub holdout_mm: BeforeAfter,
    /// Mean error that the declared noise alone would give on those points [mm].
    pub floor_mm: f64,
    /// Mean error that repeatability alone gives, from poses that were revisited [mm]; none where too few were.
    pub repeatability_mm: Option<f64>,
    /// What the errors of `holdout_mm` are.
    pub judged: JudgedOn,
    /// What is neither explained nor at the floor; also beside effects that explain a part.
    pub unexplained: Option<Unexplained>,
    /// Dwells set aside as suspect.
    pub set_aside: Vec<DwellId>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// What the gate asked of a name.
    pub gate: SignificanceTest,
    /// What the choice is worth on points that had no part in it, where it was made again ([`crate::nested_validation`]).
    pub nested: Option<Nested>,
    /// Why that was not asked, where a user should know.
    pub not_chosen_again: Option<String>,
    /// The calibration with everything that was found; none where nothing was, or where it cannot be fitted.
    #[serde(skip)]
    pub refitted: Option<Box<Refitted>>,
}

impl Diagnosis {
    /// Takes verdict, names and their probability from the effects that were found, if any.
    pub(crate) fn name_again(&mut self) {
        let of = |number: fn(&FoundEffect) -> f64| self.effects.iter().map(number);
        let (probability, p_adjusted) =
            (of(|e| e.probability).product(), of(|e| e.p_adjusted).fold(0.0, f64::max));
        let single = self.effects.iter().all(|e| e.set.len() == 1);
        self.names = match single {
            true => self.effects.iter().map(|e| e.name.clone()).collect(),
            false => self.effects.iter().flat_map(|e| e.set.iter().cloned()).collect(),
        };
        if !self.effects.is_empty() {
            self.verdict = if single { Verdict::Identified } else { Verdict::Ambiguous };
            (self.probability, self.p_adjusted) = (Some(probability), p_adjusted);
        }
    }
}

/// The bootstrap that a name must pass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SignificanceTest {
    /// Sign-flipped copies of the data.
    pub resamplings: usize,
    /// The largest family-wise p-value of a name.
    pub max_p_adjusted: f64,
}

/// Which errors a number is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JudgedOn {
    /// Points held out of the fit, predicted by a fit that never saw them.
    HeldOut,
    /// The points the fit saw: nothing was held out.
    Fitted,
    /// Places left out in turn of the linearised fit: no calibration was at hand.
    Linearised,
}

impl JudgedOn {
    /// For people: what stands before "error".
    pub fn words(self) -> &'static str {
        match self {
            JudgedOn::HeldOut => "held-out",
            JudgedOn::Fitted => "fitted",
            JudgedOn::Linearised => "left-out (linearised)",
        }
    }
}

/// Errors that nothing explains.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unexplained {
    /// Mean error with everything found in the model [mm].
    pub error_mm: f64,
    /// Mean error that the declared noise alone would give [mm].
    pub floor_mm: f64,
    /// Mean error that repeatability alone gives, from poses that were revisited [mm]; none where too few were.
    pub repeatability_mm: Option<f64>,
    /// The error over what the declared noise gives; `null` in JSON where none is declared.
    pub times_floor: f64,
    /// Share of the squared error beyond the declared noise that what was found explains.
    pub explained_share: f64,
    /// In which dwells it is largest, the clearest first; empty where it is alike everywhere.
    pub places: Vec<ErrorPlace>,
    /// What errs alike, where that is beyond doubt: `visits to a place err alike (correlation 0.82): ..`.
    pub scatter: Option<String>,
    /// What was tried and did not explain it.
    pub tried: Tried,
}

/// What a diagnosis tried.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Tried {
    /// Effects of the catalogue, each at every target.
    pub listed: usize,
    /// Shapes outside the catalogue: where something may enter, over what it may depend.
    pub unlisted: usize,
}

/// The model with what was found in it, calibrated anew.
#[derive(Debug, Clone)]
pub struct Refitted {
    /// What was added.
    pub effects: Vec<EffectSpec>,
    /// The model with it.
    pub model: Model,
    /// Its calibration, on the observations and the hold-out of the one without.
    pub calibration: Calibration,
    /// What the user should know of it.
    pub warnings: Vec<Warning>,
}

/// An error before and after [mm].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BeforeAfter {
    /// Without.
    pub before: f64,
    /// With.
    pub after: f64,
}

/// One effect that belongs in the model.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct FoundEffect {
    /// Its most probable name.
    pub name: String,
    /// All names that are the same answer, the most probable first.
    pub set: Vec<String>,
    /// Probability of the set, of unlisted explanations with the shape of its best too.
    pub probability: f64,
    /// Family-wise p-value.
    pub p_adjusted: f64,
    /// By how much the score with it is more than without it, the other effects in the model, and the standard error of that
    /// [nats].
    pub gain_nats: f64,
    /// Standard error of it.
    pub gain_se: f64,
    /// By how much that score is more than with the best unlisted explanation in its place [nats]; none where there is none.
    pub above_unlisted_nats: Option<f64>,
    /// Size: of one step, or of the refit with it where a report made one.
    pub parameters: Vec<ParameterReport>,
    /// What the data determine of several amplitudes, where they do not determine each.
    pub combination: Option<Combination>,
    /// Errors on places the fit did not see, with the other effects in the model.
    pub places: HeldOut,
    /// Errors on recordings it did not see.
    pub recordings: Option<HeldOut>,
    /// Pairs of visits that differ in its driver.
    pub contrast: Option<Contrast>,
    /// The best listed explanation that is not one of its names; none where no other explains anything.
    pub rival: Option<Rival>,
}

/// What a found effect is preferred to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rival {
    /// Its name.
    pub name: String,
    /// By how much the score is less with it instead, and the standard error of that [nats].
    pub behind_nats: f64,
    /// Standard error of it.
    pub behind_se: f64,
    /// Errors with it instead, on places the linearised fit did not see.
    pub places: HeldOut,
}

/// One amplitude with its interval, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterReport {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: Unit,
    /// Value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Not larger than this with 95 % confidence.
    pub upper_limit95: f64,
    /// Typical size.
    pub typical: f64,
}

/// One entry of the catalogue, before it is added.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CandidateReport {
    /// Name as the pipeline writes it.
    pub spec: String,
    /// Kind.
    pub effect: String,
    /// Target.
    pub target: String,
    /// One-step estimates, or those of the refit with it where a report made one.
    pub parameters: Vec<ParameterReport>,
    /// How it stands against the answer; none where it was not among the best.
    pub standing: Option<Standing>,
    /// Bootstrap p-value against the best of all candidates.
    pub p_adjusted: f64,
    /// Mean error on places the linearised fit did not see [mm]; the best few only.
    pub holdout_mm: Option<BeforeAfter>,
    /// Share of its signature that the fitted geometry takes over.
    pub absorbed: f64,
    /// Smallest size seen with 80 % power, in typical sizes.
    pub smallest_seen: f64,
    /// Mechanisms and entries that are the same to these data.
    pub same_to_the_data: Vec<String>,
}

/// How an explanation stands against the answer, or, where none has a name, against the best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// By how much its score is less: the ln predictive density of dwells that its fit did not see [nats]. Negative where it is
    /// more, by no more than chance.
    pub behind_nats: f64,
    /// Standard error of that over groups of dwells.
    pub behind_se: f64,
    /// Probability among all that was scored, nothing and what is not listed among it.
    pub probability: f64,
    /// Whether it is of the answer.
    pub in_answer: bool,
}

/// An effect the data could not have shown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NotTestable {
    /// Its name.
    pub effect: String,
    /// Smallest size that would have been seen, with its unit.
    pub smallest_seen: String,
    /// Typical size, with its unit.
    pub typical: String,
    /// Why.
    pub why: String,
}

/// Structure without a listed cause.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct UnknownReport {
    /// Where it enters.
    pub channel: EntersAt,
    /// What it depends on.
    pub driver: DependsOn,
    /// Probability that it is this, or something like it, among nothing and the best listed explanation.
    pub probability: f64,
    /// By how much the score with it is more than with nothing [nats].
    pub gain_nats: f64,
    /// Unit of the shape.
    pub unit: Unit,
    /// The shape along the driver, with its band.
    pub shape: Vec<ShapePoint>,
    /// What repeats in it, of a joint's error over its own angle.
    pub ripple: Option<Ripple>,
    /// Its strongest period, whether or not that is a ripple.
    #[serde(skip)]
    pub(crate) peak: Option<Peak>,
    /// The Fourier series that follows it, of a joint's error over its own angle.
    #[serde(skip)]
    pub series: Option<Series>,
    /// The expression effect to paste.
    pub expression: Option<Expression>,
    /// Errors on places the fit did not see, with this shape in the model.
    pub places: HeldOut,
    /// Other places and drivers that explain it within 3 nats.
    pub rivals: Vec<String>,
}

/// A Fourier series over a joint's turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series {
    /// Harmonics of the turn that the poses resolve.
    pub harmonics: u32,
    /// Standard deviation of the curve beside its slow part [rad], two digits.
    pub typical_rad: f64,
}

/// A point of a shape, SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapePoint {
    /// Driver.
    pub at: f64,
    /// Shape.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// An expression effect, ready to paste.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expression {
    /// Formula over q1.., s1.., tau1.., t, load, temperature and its own parameters.
    pub formula: String,
    /// What it is added to: the channel.
    pub acts_on: String,
    /// Unit of its value.
    pub unit: Unit,
    /// Parameters: name, start value, bound on the size.
    pub parameters: Vec<ExpressionParameter>,
    /// Share of what the free shape removes that the formula removes too.
    pub share_of_shape: f64,
}

/// One parameter of an expression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExpressionParameter {
    /// Name.
    pub name: String,
    /// Value found.
    pub found: f64,
    /// Standard deviation of its prior: its size as found.
    pub prior: f64,
    /// Bound on its size, either sign.
    pub bound: f64,
}

/// Errors on held-out points with effects that were chosen without them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Nested {
    /// Without any effect, and with those chosen without these points.
    pub held_out: HeldOut,
    /// Mean error there with the effects chosen on all points [mm]: what it is less is the worth of having chosen on them.
    pub chosen_on_all_mm: f64,
    /// What was chosen in each turn, as a pipeline spells it.
    pub chosen: Vec<Vec<String>>,
}
