//! The kinds of warnings and findings, each with its name in files and what it says: the list that docs/warnings.md is made from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

macro_rules! codes {
    ($($(#[doc = $meaning:literal])+ $name:ident = $text:literal,)+) => {
        /// What a warning or a finding is, by a name that stays.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum Code {
            $($(#[doc = $meaning])+ #[serde(rename = $text)] $name,)+
        }

        impl Code {
            /// All of them, by the stage that says them.
            pub const ALL: &[Code] = &[$(Code::$name,)+];

            /// Its name in files: `kebab-case`.
            pub fn as_str(self) -> &'static str {
                match self {
                    $(Code::$name => $text,)+
                }
            }

            /// What it says, in a sentence.
            pub fn meaning(self) -> &'static str {
                match self {
                    $(Code::$name => concat!($($meaning,)+).trim_start(),)+
                }
            }
        }
    };
}

codes! {
    /// Bytes of a recording are damaged or could not be read, and what they held is missing.
    RecordingDamaged = "recording-damaged",
    /// Something about a recording's file is not as it should be, and nothing is missing for it.
    RecordingIrregular = "recording-irregular",
    /// What a table that is read as a recording does not say, and what is assumed of it.
    TableRead = "table-read",
    /// Messages are read by another definition than the one that the file has of them, if it has any.
    DefinitionSubstituted = "definition-substituted",
    /// A recording of which no dwell became an observation is left out.
    RecordingLeftOut = "recording-left-out",
    /// The numbers of a stream look like those of another unit.
    UnitDoubtful = "unit-doubtful",
    /// Poses of a stream come in several frames, and are read as if in one.
    SeveralFrames = "several-frames",
    /// Quaternions are not of unit length, and positions alone are read.
    OrientationUnusable = "orientation-unusable",
    /// A body's pose is put together over several transforms.
    TransformChain = "transform-chain",
    /// A marker is in no message of its topic.
    MarkerUnseen = "marker-unseen",
    /// A temperature is no number, and is not used.
    TemperatureUnusable = "temperature-unusable",
    /// A temperature was taken for kelvin.
    TemperatureKelvin = "temperature-kelvin",
    /// A temperature was taken for degrees Fahrenheit.
    TemperatureFahrenheit = "temperature-fahrenheit",
    /// Messages have no stamp of their own, and another time is taken.
    NoStamp = "no-stamp",
    /// Header stamps do not go on evenly with log time.
    HeaderClock = "header-clock",
    /// Rows were stamped when they arrived, many at once, and are spread over the time between.
    StampsInBursts = "stamps-in-bursts",
    /// Messages could not be decoded.
    Undecodable = "undecodable",
    /// Rows with impossible values were dropped.
    Impossible = "impossible",
    /// Rows without a stamp were dropped.
    Unstamped = "unstamped",
    /// Rows with NaN or infinite values were dropped.
    NonFinite = "non-finite",
    /// Rows whose stamp is far from all others were dropped.
    StrayStamps = "stray-stamps",
    /// Rows with the stamp of the row before were dropped.
    DuplicateStamps = "duplicate-stamps",
    /// Rows with stamps going backwards were sorted into place.
    BackwardStamps = "backward-stamps",
    /// Two publishers speak on one topic, and one of them is left out.
    TwoPublishers = "two-publishers",
    /// Messages without all wanted joints were skipped.
    OtherJoints = "other-joints",
    /// Poses were rejected as occluded.
    Occluded = "occluded",
    /// Messages of a channel cannot be read.
    ChannelUnreadable = "channel-unreadable",
    /// A joint's readings leap from one to the next.
    JointJump = "joint-jump",
    /// Readings repeat the one before them.
    StaleReadings = "stale-readings",
    /// What two recordings have in common counts once.
    CountedOnce = "counted-once",
    /// A recording to verify on was calibrated on too.
    NotHeldOut = "not-held-out",
    /// Several clock offsets fit as well.
    ClockAmbiguous = "clock-ambiguous",
    /// The clock offset is known badly.
    ClockUncertain = "clock-uncertain",
    /// One offset and one drift do not fit the clocks.
    ClockNotLinear = "clock-not-linear",
    /// The drift of the clocks cannot be told.
    ClockDriftUnknown = "clock-drift-unknown",
    /// The drift of the clocks is at its limit.
    ClockDriftLimited = "clock-drift-limited",
    /// Tip and joints do not move in proportion.
    ClockDisplacementRatio = "clock-displacement-ratio",
    /// A declared clock offset is not that of the data.
    ClockContradicted = "clock-contradicted",
    /// A declared clock offset cannot be checked.
    ClockUnchecked = "clock-unchecked",
    /// The tip was seen about once a pause: one measurement each, with the noise that is declared.
    OneAStop = "one-a-stop",
    /// No dwell was found.
    NoDwells = "no-dwells",
    /// Many pauses are shorter than a dwell must be.
    ShortPauses = "short-pauses",
    /// Dwells have few samples that are independent.
    FewEffectiveSamples = "few-effective-samples",
    /// Dwells have no pose of the tip.
    DwellWithoutTip = "dwell-without-tip",
    /// Dwells have no pose of a marker.
    DwellWithoutMarker = "dwell-without-marker",
    /// Readings creep while the arm rests.
    DwellCreeps = "dwell-creeps",
    /// A gap in the data parts one dwell in two.
    DwellSplitByGap = "dwell-split-by-gap",
    /// A body that should stand still moved.
    BodyMoved = "body-moved",
    /// An effect needs joint efforts that dwells do not have.
    EffortUnknown = "effort-unknown",
    /// Some dwells have no joint effort.
    EffortIncomplete = "effort-incomplete",
    /// How the points of a file were matched with dwells.
    PointsFile = "points-file",
    /// A marker that disagrees with the others of its link is not used.
    MarkerRejected = "marker-rejected",
    /// Two markers of one link are not at their distance, and nothing tells which moved.
    MarkerDistance = "marker-distance",
    /// The cavities that dwells were in can be told in several ways.
    AssociationAmbiguous = "association-ambiguous",
    /// Dwells change their cavities with every fit.
    AssociationUnsettled = "association-unsettled",
    /// Too few dwells are surely in cavities.
    TooFewSeated = "too-few-seated",
    /// Dwells are in no cavity.
    DwellsUnassigned = "dwells-unassigned",
    /// Tips scatter about the cavities.
    BoardFitsLoosely = "board-fits-loosely",
    /// A mistake of the setup that would leave no trace in these data.
    SetupNotTestable = "setup-not-testable",
    /// The board is turned on its mount.
    BoardTurned = "board-turned",
    /// The board is mirrored.
    BoardMirrored = "board-mirrored",
    /// The board is larger or smaller than its file.
    BoardScale = "board-scale",
    /// The board is elsewhere.
    BoardPose = "board-pose",
    /// Seats are higher or lower than the board's file.
    SeatHeight = "seat-height",
    /// The declared tilt of the board is not that of the data.
    TiltDeclared = "tilt-declared",
    /// The declared frame of a stream is not that of the data.
    FrameDeclared = "frame-declared",
    /// A frame moved between recordings.
    FrameMoved = "frame-moved",
    /// The table's markers are on another part of it.
    MarkersOn = "markers-on",
    /// Joints are in another order.
    JointOrder = "joint-order",
    /// A joint turns the other way.
    JointSign = "joint-sign",
    /// Joint readings are in another unit.
    JointUnit = "joint-unit",
    /// A joint's ratio is another one.
    JointScale = "joint-scale",
    /// A joint's zero is elsewhere.
    JointZero = "joint-zero",
    /// A joint's reading holds that of another.
    JointCoupling = "joint-coupling",
    /// A joint's reading stays while others move.
    JointStuck = "joint-stuck",
    /// A joint's reading ends at a limit.
    JointSaturated = "joint-saturated",
    /// Set-points were recorded as readings.
    SetpointsRecorded = "setpoints-recorded",
    /// The field that is read holds something else.
    WrongField = "wrong-field",
    /// A joint's axis in the model is another one.
    ModelAxis = "model-axis",
    /// Stamps are not when things happened.
    StampsWrong = "stamps-wrong",
    /// Two streams have each other's names.
    StreamsSwapped = "streams-swapped",
    /// Two streams hold the same.
    StreamsEqual = "streams-equal",
    /// Positions are in another unit.
    PositionUnit = "position-unit",
    /// Positions are scaled.
    PositionScale = "position-scale",
    /// Poses are inverted.
    PoseInverted = "pose-inverted",
    /// An axis of the sensor is reversed.
    AxisMirrored = "axis-mirrored",
    /// Axes of the sensor are exchanged.
    AxesPermuted = "axes-permuted",
    /// Orientations of a body are not filled in.
    QuaternionMissing = "quaternion-missing",
    /// Quaternions are in another order.
    QuaternionOrder = "quaternion-order",
    /// Quaternions are conjugated.
    QuaternionConjugate = "quaternion-conjugate",
    /// Readings of an instrument are in another unit.
    ReadingUnit = "reading-unit",
    /// Readings of an instrument are reversed.
    ReadingSign = "reading-sign",
    /// The base is elsewhere.
    BaseFrame = "base-frame",
    /// The tool is elsewhere.
    ToolFrame = "tool-frame",
    /// The tool is longer or shorter.
    ToolLength = "tool-length",
    /// The target is not at the tip.
    TargetOffset = "target-offset",
    /// A recording disagrees with the others.
    RecordingsDisagree = "recordings-disagree",
    /// A parameter that is fixed is not nominal.
    ParameterFixed = "parameter-fixed",
    /// A parameter is beyond its bounds.
    ParameterBound = "parameter-bound",
    /// A link is longer or shorter.
    LinkLength = "link-length",
    /// A number of the model has the other sign.
    ModelSign = "model-sign",
    /// An angle of the model is off by quarter turns.
    ModelAngle = "model-angle",
    /// Numbers of the model are in another unit.
    ModelUnit = "model-unit",
    /// The model is mirrored.
    ModelMirrored = "model-mirrored",
    /// Columns of the DH table are exchanged.
    DhColumns = "dh-columns",
    /// The DH table is of the other convention.
    DhConvention = "dh-convention",
    /// Rows of the DH table are shifted.
    DhRows = "dh-rows",
    /// There are fewer equations than free parameters.
    TooFewDwells = "too-few-dwells",
    /// The fit did not converge.
    NotConverged = "not-converged",
    /// Eq. 4 has no solution within its limit.
    PaperInfeasible = "paper-infeasible",
    /// Parameters ended on their bounds.
    AtBound = "at-bound",
    /// Assumed bounds were widened.
    BoundWidened = "bound-widened",
    /// How far the arm may be from nominal was learnt.
    PriorsLearnt = "priors-learnt",
    /// Residuals scatter more than the declared noise.
    ResidualsAboveNoise = "residuals-above-noise",
    /// The mean error is above what the declared noise gives.
    ErrorsAboveFloor = "errors-above-floor",
    /// The mean error is above what is wanted.
    ErrorsAboveWanted = "errors-above-wanted",
    /// Observations weigh little in the fit.
    Outliers = "outliers",
    /// Frames that only held-out dwells show were fitted to them.
    FrameFittedOnHoldout = "frame-fitted-on-holdout",
    /// Frames that only the verification shows were fitted to it.
    FrameFittedOnVerification = "frame-fitted-on-verification",
    /// One pose is fitted and held out.
    PoseOnBothSides = "pose-on-both-sides",
    /// Held-out errors are larger than nominal ones.
    HoldoutWorse = "holdout-worse",
    /// The tip stays where the calibration had it.
    TipKept = "tip-kept",
    /// The calibrated tip has no place in the URDF.
    TipNotInUrdf = "tip-not-in-urdf",
    /// The tips of two arms do not meet.
    TipsOpen = "tips-open",
    /// A link of the URDF has no mass.
    LinkWithoutMass = "link-without-mass",
    /// An effect that was found cannot be fitted.
    StepNotFitted = "step-not-fitted",
    /// Poses are beyond those of the calibration.
    BeyondCalibratedRange = "beyond-calibrated-range",
    /// An event in a recording of the calibration is left out here.
    EventNotCarriedOver = "event-not-carried-over",
    /// A drift is continued beyond the calibration.
    DriftExtrapolated = "drift-extrapolated",
    /// The diagnosis could not be made.
    DiagnosisFailed = "diagnosis-failed",
    /// Errors remain that nothing listed explains.
    Unexplained = "unexplained",
    /// What was found predicts other dwells, and not those of this hold-out.
    HoldoutErrsMore = "holdout-errs-more",
    /// Effects could not be evaluated.
    NotEvaluated = "not-evaluated",
    /// What is known of the arm leaves effects out.
    NotTried = "not-tried",
    /// A joint rests in another place of its play in every dwell, which counts as noise.
    RestsInPlay = "rests-in-play",
    /// Dwells were set aside as accidents.
    SuspectDwell = "suspect-dwell",
    /// Errors scatter more than declared.
    ScatterLarger = "scatter-larger",
    /// Errors scatter less than declared.
    NoiseOverdeclared = "noise-overdeclared",
    /// Errors are alike that should be independent.
    ScatterCorrelated = "scatter-correlated",
    /// Several effects tell of one moment.
    OneEvent = "one-event",
    /// What is known of the arm tells apart what the data do not.
    NamedAsKnown = "named-as-known",
    /// An effect has a size that it cannot have.
    NegativeSize = "negative-size",
    /// The position sensor alone saw an event, which may be its own.
    EventOrSensor = "event-or-sensor",
    /// Something changed between dwells: perhaps a load or a tool that is not declared.
    EventOrLoad = "event-or-load",
    /// Dwells fit better with their direction of arrival turned over.
    SuspectDirection = "suspect-direction",
    /// Messages of earlier results in a recording are left out.
    EarlierResultsLeftOut = "earlier-results-left-out",
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_files_are_those_that_are_printed_and_no_two_are_alike() {
        for code in Code::ALL {
            let text = serde_json::to_string(code).expect("JSON");
            assert_eq!(text, format!("\"{code}\""));
            assert_eq!(serde_json::from_str::<Code>(&text).expect("a code"), *code);
            let kebab = |c: char| c.is_ascii_lowercase() || c == '-';
            assert!(code.as_str().chars().all(kebab) && code.meaning().ends_with('.'), "{code}");
        }
        let names: std::collections::BTreeSet<&str> = Code::ALL.iter().map(|c| c.as_str()).collect();
        assert_eq!(names.len(), Code::ALL.len());
    }
}
