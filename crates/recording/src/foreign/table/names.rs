//! What the name of a column says: which part of which pose it is, in which unit.

use std::f64::consts::PI;

/// A part of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Part {
    /// x, y, z.
    Position(u8),
    /// x, y, z, w.
    Quaternion(u8),
    /// A rotation vector; or a turn about x, y, z where its numbers are larger than such a vector can be.
    Vector(u8),
    /// Roll, pitch, yaw.
    Fixed(u8),
    /// KUKA's A, B, C: about z, then y, then x, each of the turned axes.
    Kuka(u8),
    /// Row and column of a matrix, from 0.
    Matrix(u8, u8),
}

/// What a number of a column stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Named {
    pub part: Part,
    /// Metres or radians of one, where the name says it.
    pub unit: Option<f64>,
}

/// Words that say of what kind x, y, z are.
const POSITION: [&str; 13] = [
    "pos",
    "position",
    "p",
    "t",
    "trans",
    "translation",
    "tvec",
    "point",
    "coord",
    "coordinate",
    "loc",
    "location",
    "pose",
];
const QUATERNION: [&str; 4] = ["q", "quat", "quaternion", "qt"];
const TURN: [&str; 9] =
    ["r", "rot", "rotation", "rotvec", "rvec", "ori", "orient", "orientation", "axisangle"];
const EULER: [&str; 3] = ["euler", "rpy", "angle"];
/// Of what is no pose, or not measured.
const OTHER: [&str; 38] = [
    "vel",
    "velocity",
    "speed",
    "twist",
    "linear",
    "angular",
    "acc",
    "acceleration",
    "force",
    "torque",
    "wrench",
    "moment",
    "std",
    "sigma",
    "cov",
    "variance",
    "err",
    "error",
    "residual",
    "noise",
    "cmd",
    "command",
    "commanded",
    "target",
    "desired",
    "goal",
    "nominal",
    "nom",
    "ref",
    "reference",
    "planned",
    "setpoint",
    "model",
    "predicted",
    "fk",
    "accel",
    "gyro",
    "mag",
];

/// Which pose a column is of, and what of it; `None` where it is no part of one.
pub(super) fn parse(name: &str) -> Option<(String, Named)> {
    let mut words = words_of(name);
    let unit = take_unit(&mut words);
    if words.iter().any(|word| OTHER.contains(&word.as_str())) {
        return None;
    }
    let has = |kinds: &[&str], words: &[String]| words.iter().any(|word| kinds.contains(&word.as_str()));
    let mut found = words.iter().enumerate().filter_map(|(at, word)| Some((at, component(word)?)));
    let (at, own) = found.next()?;
    if found.next().is_some() {
        return None;
    }
    words.remove(at);
    let part = match own {
        Part::Position(axis) if has(&QUATERNION, &words) => Part::Quaternion(axis),
        Part::Position(axis) if has(&EULER, &words) => Part::Fixed(axis),
        Part::Position(axis) if has(&TURN, &words) => Part::Vector(axis),
        own => own,
    };
    let kinds = [&POSITION[..], &QUATERNION, &TURN, &EULER];
    words.retain(|word| !kinds.iter().any(|kind| kind.contains(&word.as_str())));
    Some((words.join("_"), Named { part, unit }))
}

/// Words of a name in small letters; `posX` and `pos_x` have the same.
fn words_of(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let is_new = !c.is_alphanumeric() && c != '\u{b0}' || c.is_uppercase() && before.is_lowercase();
        if is_new && words.last().is_some_and(|word| !word.is_empty()) {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| c.is_alphanumeric() || c == '\u{b0}') {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Takes the unit off the end.
fn take_unit(words: &mut Vec<String>) -> Option<f64> {
    let unit = match words.last().filter(|_| words.len() > 1)?.as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" | "rad" | "radian" | "radians" => 1.0,
        "cm" => 1e-2,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 1e-3,
        "um" => 1e-6,
        "deg" | "degree" | "degrees" | "\u{b0}" => PI / 180.0,
        _ => return None,
    };
    words.pop();
    Some(unit)
}

/// What a word is by itself.
fn component(word: &str) -> Option<Part> {
    let axis = |letter: &str| ["x", "y", "z", "w"].iter().position(|a| *a == letter).map(|at| at as u8);
    let space = |letter: &str| axis(letter).filter(|at| *at < 3);
    let digit = |at: usize| word.as_bytes().get(at).filter(|c| c.is_ascii_digit()).map(|c| c - b'0');
    match word {
        "roll" => return Some(Part::Fixed(0)),
        "pitch" => return Some(Part::Fixed(1)),
        "yaw" => return Some(Part::Fixed(2)),
        "a" => return Some(Part::Kuka(0)),
        "b" => return Some(Part::Kuka(1)),
        "c" => return Some(Part::Kuka(2)),
        "w" => return Some(Part::Quaternion(3)),
        _ => {}
    }
    if let (3, Some(row), Some(column)) = (word.len(), digit(1), digit(2))
        && word.starts_with('r')
        && row < 4
        && column < 4
    {
        return Some(Part::Matrix(row, column));
    }
    if let Some(at) = space(word) {
        return Some(Part::Position(at));
    }
    let ends = |kinds: &[&str]| kinds.iter().find_map(|kind| word.strip_prefix(kind).and_then(axis));
    let found = ends(&QUATERNION).map(Part::Quaternion);
    let found = found.or_else(|| ends(&TURN).filter(|at| *at < 3).map(Part::Vector));
    found.or_else(|| ends(&POSITION).filter(|at| *at < 3).map(Part::Position))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_which_part_of_which_pose_a_column_is() {
        let of = |name: &str| parse(name).map(|(group, named)| (group, named.part, named.unit));
        for name in ["tip_x_mm", "Tip X [mm]", "tip.position.x (mm)", "tipPosX_mm", "x_tip/mm"] {
            assert_eq!(of(name), Some(("tip".into(), Part::Position(0), Some(1e-3))), "{name}");
        }
        for (name, part) in [
            ("z", Part::Position(2)),
            ("pz", Part::Position(2)),
            ("tz", Part::Position(2)),
            ("qz", Part::Quaternion(2)),
            ("quat_z", Part::Quaternion(2)),
            ("q_w", Part::Quaternion(3)),
            ("orientation.w", Part::Quaternion(3)),
            ("rz", Part::Vector(2)),
            ("rotvec_z", Part::Vector(2)),
            ("yaw", Part::Fixed(2)),
            ("euler_z", Part::Fixed(2)),
            ("C", Part::Kuka(2)),
            ("r12", Part::Matrix(1, 2)),
        ] {
            assert_eq!(of(name), Some((String::new(), part, None)), "{name}");
        }
        for name in
            ["q1", "joint_3", "vel_x", "target_x", "x_err", "elbow", "xy", "t", "temperature", "force_z"]
        {
            assert_eq!(of(name), None, "{name}");
        }
        assert_eq!(of("yaw_deg").and_then(|(.., unit)| unit), Some(PI / 180.0));
    }
}
