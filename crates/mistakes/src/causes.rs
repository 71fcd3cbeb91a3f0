//! Which reports name a cause: the one table by which answers are judged.
//!
//! Generous in wording, not in substance: a code counts when it contains one of the cause's codes, a sentence when it holds one
//! of its words, a physical effect only where it *is* the cause by another name (a knocked tool is a `tool_shift`). Causes that
//! no data can tell from each other are accepted for each other: a mirrored board and a mirrored arm, a conjugate and an inverse.

/// What counts as naming a cause.
#[derive(Debug, Clone, Copy)]
pub struct Cause {
    /// Its name.
    pub name: &'static str,
    /// Parts of the codes of findings and warnings.
    pub codes: &'static [&'static str],
    /// Words in their sentences, or in an error message; lower case.
    pub words: &'static [&'static str],
    /// Effects of the catalogue that are this cause.
    pub effects: &'static [&'static str],
}

/// The cause of a name.
pub fn cause(name: &str) -> Option<&'static Cause> {
    CAUSES.iter().find(|cause| cause.name == name)
}

const fn row(
    name: &'static str,
    codes: &'static [&'static str],
    words: &'static [&'static str],
    effects: &'static [&'static str],
) -> Cause {
    Cause { name, codes, words, effects }
}

const YIELDING: &[&str] = &[
    "undeclared_load",
    "compliance",
    "arm_compliance",
    "hardening_compliance",
    "effort_compliance",
    "belt_compliance",
    "link_bending",
    "base_compliance",
    "bearing_compliance",
];

/// The table.
pub const CAUSES: &[Cause] = &[
    // Joints.
    row(
        "joint-sign",
        &["joint-sign", "mirrored"],
        &[
            "sign reversed",
            "reversed sign",
            "'s sign",
            "sign of joint",
            "turns the other way",
            "joint direction",
            "mirror",
        ],
        &[],
    ),
    row(
        "joint-order",
        &["joint-order", "joints-swapped"],
        &[
            "joint order",
            "order of the joints",
            "joints swapped",
            "joints in another order",
            "joints exchanged",
        ],
        &[],
    ),
    row(
        "joint-unit",
        &["joint-unit", "joint-scale", "unit-doubtful"],
        &[
            "degrees",
            "radians",
            "counts per turn",
            "counts_per_turn",
            "looks like encoder counts",
            "looks like degrees",
            "unit of the joints",
            "unit of joint",
            "units of both streams",
        ],
        &["gear_ratio"],
    ),
    row(
        "joint-scale",
        &["joint-scale", "joint-unit", "gear"],
        &["gear ratio", "counts per turn", "counts_per_turn", "scale of joint"],
        &["gear_ratio"],
    ),
    row(
        "whole-turns",
        &["whole-turn", "joint-zero"],
        &["whole turn", "full turn", "turns of joint"],
        &["zero_slip"],
    ),
    row(
        "joint-zero-gross",
        &["joint-zero", "whole-turn"],
        &["zero of joint", "joint zero", "'s zero", "quarter turn", "half a turn", "half turn"],
        &[],
    ),
    row(
        "joint-zero-event",
        &["joint-zero", "zero-slip"],
        &["zero of joint", "'s zero", "zero slipped", "homed"],
        &["zero_slip"],
    ),
    row(
        "joint-coupling",
        &["joint-coupl"],
        &["coupled", "absolute angle", "relative to"],
        &["belt_coupling"],
    ),
    row(
        "wrong-field",
        &["wrong-field", "joint-stuck", "joint-unit", "no-dwells", "too-few"],
        &[
            "never moves",
            "does not move",
            "hardly moves",
            "no dwell",
            "speeds",
            "velocit",
            "too little motion",
        ],
        &[],
    ),
    // Encoders.
    row(
        "joint-stuck",
        &["stuck", "frozen"],
        &["never moves", "does not move", "never moved", "frozen", "stuck", "same reading"],
        &[],
    ),
    row(
        "setpoints-recorded",
        &["setpoint", "set-point"],
        &["set-point", "setpoint", "set point", "commanded"],
        &[],
    ),
    row(
        "encoder-wrap",
        &["wrap", "joint-jump", "joint-zero", "whole-turn"],
        &["wraps", "wrapped", "jumps by", "leaps"],
        &["zero_slip"],
    ),
    row("saturated-joint", &["saturat", "clipped", "stuck"], &["saturat", "clipped", "stuck at"], &[]),
    row(
        "quantised",
        &["quantis", "resolution", "coarse"],
        &["quantis", "resolution", "coarse", "steps of"],
        &[],
    ),
    row(
        "stale-encoder",
        &["stale", "latency", "filter", "low-rate", "creep"],
        &[
            "stale",
            "repeats the same",
            "repeated reading",
            "refresh",
            "lag",
            "late by",
            "creep",
            "updated every",
        ],
        &["unsettled_reading"],
    ),
    row(
        "filtered-encoder",
        &["filter", "latency", "stale", "creep"],
        &["filter", "lag", "late by", "creep", "has not settled"],
        &["unsettled_reading"],
    ),
    row(
        "outliers",
        &["outlier", "spike", "suspect-dwell", "jump"],
        &["outlier", "spike", "set aside", "jump", "swapped markers"],
        &[],
    ),
    row("non-finite", &["non-finite"], &["not finite", "nan", "not a number"], &[]),
    // Poses.
    row("quaternion-order", &["quaternion-order"], &["quaternion"], &[]),
    row(
        "quaternion-conjugate",
        &["quaternion-conjugate", "pose-inverted"],
        &["conjugate", "inverted", "inverse"],
        &[],
    ),
    row("quaternion-missing", &["orientation", "quaternion"], &["orientation", "quaternion"], &[]),
    row(
        "pose-inverted",
        &["pose-inverted", "quaternion-conjugate"],
        &["inverted", "inverse", "conjugate"],
        &[],
    ),
    row(
        "frames-swapped",
        &["frames-swapped", "streams-swapped", "streams-equal", "same-topic"],
        &["swapped", "mistaken for", "exchanged", "same topic", "same body"],
        &[],
    ),
    row(
        "streams-swapped",
        &["streams-swapped", "frames-swapped", "streams-equal", "same-topic", "still"],
        &[
            "swapped",
            "mistaken for",
            "exchanged",
            "same topic",
            "same body",
            "does not move with",
            "static body",
            "stands still",
            "does not move",
        ],
        &[],
    ),
    row("axis-mirrored", &["mirrored", "left-handed"], &["mirror", "left-handed"], &[]),
    row("axes-permuted", &["axes-permuted", "axes-swapped", "mirrored"], &["permut", "axes", "mirror"], &[]),
    row(
        "position-unit",
        &["position-unit", "unit-doubtful"],
        &["unit of the tip", "unit of the positions", "units of both streams", "millimet", "inch"],
        &["sensor_scale"],
    ),
    row(
        "position-scale",
        &["position-scale", "position-unit", "sensor-scale", "board-scale"],
        &["scale of"],
        &["sensor_scale", "board_scale"],
    ),
    row(
        "target-offset",
        &["target", "tip-offset", "tool", "frame-declared"],
        &["tracked point", "target's offset", "offset of the target", "tip frame", "tool point"],
        &[],
    ),
    // Board.
    row("board-mirrored", &["mirrored", "joint-sign"], &["mirror"], &[]),
    row(
        "board-turned",
        &["board-turned", "board-mirrored", "frame-declared"],
        &["board is turned", "turned about", "board turned", "turned by", "upside down"],
        &[],
    ),
    row(
        "board-scale",
        &["board-scale", "board-unit", "wrong-board", "position-unit", "position-scale"],
        &["larger than", "smaller than", "board's scale", "scale of"],
        &["board_scale", "sensor_scale"],
    ),
    row(
        "board-unit",
        &["board-unit", "board-scale", "wrong-board"],
        &["unit of the board", "inch", "metres", "scale of"],
        &["board_scale"],
    ),
    row(
        "wrong-board",
        &["wrong-board", "board-scale", "board-fits-loosely"],
        &["another board", "wrong board", "other board", "board file", "scale of"],
        &["board_scale"],
    ),
    row(
        "board-moved",
        &["board-moved", "board-turned", "table-bumped", "body-moved", "frame-moved", "frame-declared"],
        &["board moved", "board is moved", "board is shifted", "moved by", "beside"],
        &["frame_shift", "board_shift"],
    ),
    row(
        "seat-height",
        &["seat-height"],
        &["another height", "higher than", "deeper than", "lower than", "height"],
        &[],
    ),
    row("board-typo", &["cavity", "board", "suspect", "outlier"], &["cavity"], &["seat_offset"]),
    row("visiting-order", &["visiting-order"], &["visiting order", "visiting_order"], &[]),
    row("tilt-declared-wrong", &["tilt"], &["tilt"], &[]),
    // Model.
    row("dh-convention", &["dh-", "wrong-model", "convention"], &["convention", "modified"], &[]),
    row("dh-rows", &["dh-", "wrong-model", "joint-order"], &["rows", "another arm", "model file"], &[]),
    row(
        "length-unit",
        &["length-unit", "wrong-model", "link-length", "model-scale"],
        &["unit of the model", "model's lengths", "lengths of the model", "inch", "metres"],
        &[],
    ),
    row(
        "angle-unit",
        &["angle-unit", "wrong-model", "dh-"],
        &["unit of the model", "radians", "degrees"],
        &[],
    ),
    row(
        "dh-sign",
        &["dh-", "wrong-model", "link-length", "mirrored"],
        &["sign of", "other sign", "model file", "mirror"],
        &[],
    ),
    row(
        "link-length",
        &["link-length", "wrong-model", "tool-length", "parameter-bound"],
        &["length of", "link length", "model file"],
        &[],
    ),
    row(
        "tool-length",
        &["tool", "link-length", "wrong-model", "frame-declared"],
        &["tool length", "length of", "tool row", "model file"],
        &[],
    ),
    row(
        "wrong-model-file",
        &["wrong-model", "link-length", "length-unit", "dh-", "different-arm", "mirrored"],
        &[
            "another arm",
            "other arm",
            "model file",
            "number of joints",
            "joints of the model",
            "mirror",
            "scale of",
        ],
        &[],
    ),
    row("parameter-bound", &["parameter-bound", "at-bound", "prior"], &["bound", "prior"], &[]),
    row(
        "parameter-fixed",
        &["parameter-fixed", "parameter-bound"],
        &["fixed parameter", "are fixed", "is fixed", "held fixed"],
        &["axis_tilt"],
    ),
    row(
        "frame-declared-wrong",
        &["frame-declared"],
        &["from its declaration", "declared", "sigmas from"],
        &[],
    ),
    // The cell.
    row(
        "different-arm",
        &["different-arm", "different-tool"],
        &["different arm", "another arm", "other arm", "not the same arm"],
        &[],
    ),
    row("different-tool", &["different-tool", "tool"], &["tool"], &["tool_shift"]),
    row(
        "arm-rebased",
        &["arm-rebased", "frame-moved", "base-moved", "body-moved", "frame-declared"],
        &["base moved", "moved between", "bolted"],
        &["frame_shift"],
    ),
    row("base-moved", &["base-moved", "body-moved", "frame-moved"], &["moved"], &["frame_shift"]),
    row(
        "table-bumped",
        &["table-bumped", "board-moved", "body-moved", "frame-moved"],
        &["moved", "bumped"],
        &["frame_shift", "board_shift"],
    ),
    row(
        "camera-bumped",
        &["camera-bumped", "body-moved", "frame-moved", "base-moved", "board-moved", "arm-rebased"],
        &["moved", "bumped"],
        &["frame_shift"],
    ),
    row("load-undeclared", &["load"], &["load"], YIELDING),
    row("vertical-wrong", &["vertical"], &["vertical", "upright"], &[]),
    // Clocks.
    row("clock-set", &["clock", "stamps"], &["clock", "stamps"], &[]),
    row("clock-offset", &["clock"], &["clock", "max_offset_s"], &[]),
    row("clock-drift", &["clock"], &["clock", "drift"], &[]),
    row(
        "latency",
        &["clock", "latency", "filter", "stale"],
        &["latency", "late by", "lag", "clock", "filter"],
        &["clock_offset"],
    ),
    row("wrong-time-unit", &["time-unit", "stamps", "clock"], &["stamps", "clock", "time unit"], &[]),
    row("stamps-missing", &["stamps", "clock"], &["stamps", "clock"], &[]),
    // Recordings.
    row(
        "recording-twice",
        &["recording-twice", "twice"],
        &["twice", "same recording", "same file", "same bytes", "same messages"],
        &[],
    ),
    row(
        "truncated-file",
        &["recording-damaged", "truncated"],
        &["damaged", "truncated", "cut off", "incomplete", "is empty", "magic"],
        &[],
    ),
    row("damaged-file", &["recording-damaged"], &["damaged", "crc", "corrupt"], &[]),
    row("missing-file", &["missing-file"], &["no such file", "not found", "does not exist"], &[]),
    row("missing-topic", &["missing-topic"], &["topic", "channel"], &[]),
    row("missing-joint", &["missing-joint"], &["joint"], &[]),
    row(
        "dropped-messages",
        &["dropped", "gap", "low-rate", "irregular", "few-effective"],
        &[
            "gap",
            "lost",
            "missing messages",
            "irregular",
            "few readings",
            "independent readings",
            "messages per second",
            "hz",
        ],
        &[],
    ),
    row("duplicated-messages", &["duplicate"], &["duplicate", "twice", "same stamp"], &[]),
    row(
        "shuffled-order",
        &["backward", "order", "irregular"],
        &["out of order", "backward", "order of"],
        &[],
    ),
    row(
        "low-rate",
        &["low-rate", "gap", "few-effective"],
        &["rate", "gap", "hz", "readings", "samples"],
        &[],
    ),
    row(
        "too-few-dwells",
        &["too-few", "few-dwells"],
        &["too few", "few dwells", "more dwells", "at least", "not enough"],
        &[],
    ),
    row("no-dwells", &["no-dwells"], &["no dwell", "never still", "stands still", "standstill", "rest"], &[]),
    row(
        "stuck-sensor",
        &["stuck", "frozen", "zero-filled", "stale", "repeats"],
        &[
            "stuck",
            "frozen",
            "same pose",
            "repeats the same",
            "repeated pose",
            "all zero",
            "zeros",
            "does not move",
        ],
        &[],
    ),
    row("marker-swapped", &["marker", "suspect-dwell", "outlier"], &["marker", "set aside"], &["tool_shift"]),
    // Noise.
    row(
        "noise-underdeclared",
        &["noise", "scatter"],
        &["declared too small", "as much as declared", "than declared", "times the declared"],
        &[],
    ),
    row(
        "noise-overdeclared",
        &["noise"],
        &["declared too large", "less than declared", "smaller than declared"],
        &[],
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinds;

    #[test]
    fn every_kind_has_a_cause_and_every_cause_a_kind() {
        let kinds = kinds();
        for kind in &kinds {
            assert!(
                cause(kind.cause).is_some(),
                "{} is caused by {}, which is not in the table",
                kind.name,
                kind.cause
            );
        }
        for cause in CAUSES {
            assert!(kinds.iter().any(|kind| kind.cause == cause.name), "no kind is caused by {}", cause.name);
            let words = cause.words.iter().chain(cause.codes);
            words.for_each(|w| assert_eq!(w.to_lowercase(), **w, "{} would never be found", w));
        }
    }

    #[test]
    fn each_rig_has_eighty_kinds_of_mistakes_and_no_name_is_used_twice() {
        let kinds = kinds();
        for rig in crate::Rig::ALL {
            let n = kinds.iter().filter(|kind| kind.rigs.contains(&rig)).count();
            assert!(n >= 80, "{} has {n} kinds", rig.word());
        }
        let mut names: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
        names.sort_unstable();
        let all = names.len();
        names.dedup();
        assert_eq!(names.len(), all);
    }
}
