//! The arm's table: of another arm, in another convention, in other units.

use super::{ALL, BOARD, Kind, POSES, whole};
use crate::Draw;
use crate::rigs::Rig;
use crate::session::Session;
use toml::{Table, Value};

pub const KINDS: &[Kind] = &[
    whole("modified-dh-for-standard", "dh-convention", ALL, declared_modified),
    whole("rows-in-modified-convention", "dh-convention", ALL, rows_modified),
    whole("rows-swapped", "dh-rows", ALL, |s, _| {
        s.rows().swap(1, 2);
        keep_names(s);
    }),
    whole("a-and-d-columns-swapped", "dh-rows", ALL, columns_swapped),
    whole("lengths-in-metres", "length-unit", ALL, |s, _| scale_lengths(s, 1e-3)),
    whole("lengths-in-inches", "length-unit", ALL, |s, _| scale_lengths(s, 1.0 / 25.4)),
    whole("twists-in-radians", "angle-unit", ALL, twists_in_radians),
    whole("one-twist-of-the-other-sign", "dh-sign", ALL, |s, d| change_one_entry(s, d, "alpha_deg", |v| -v)),
    whole("one-offset-of-the-other-sign", "dh-sign", ALL, |s, d| change_one_entry(s, d, "d_mm", |v| -v)),
    whole("one-length-of-the-other-sign", "dh-sign", ALL, |s, d| change_one_entry(s, d, "a_mm", |v| -v)),
    whole("link-length-wrong-by-a-lot", "link-length", ALL, link_length),
    whole("tool-length-wrong-by-a-lot", "tool-length", ALL, tool_length),
    whole("tool-left-out", "tool-length", BOARD, tool_left_out),
    whole("quarter-turn-of-a-zero-left-out", "joint-zero-gross", ALL, zero_left_out),
    whole("arm-of-the-other-hand", "wrong-model-file", BOARD, other_hand),
    whole("model-of-a-smaller-arm", "wrong-model-file", ALL, smaller_arm),
    whole("row-missing", "wrong-model-file", ALL, |s, _| {
        s.rows().remove(0);
    }),
    whole("bounds-too-tight", "parameter-bound", ALL, |s, _| set_deviation(s, [0.1, 0.02, 0.08, 0.016])),
    whole("priors-too-tight", "parameter-bound", ALL, |s, _| set_deviation(s, [5.0, 2.0, 0.02, 0.004])),
    whole("wrong-entries-fixed", "parameter-fixed", ALL, fix_entries),
    whole("target-offset-given-wrong", "frame-declared-wrong", POSES, target_given),
];

fn declared_modified(session: &mut Session, _: &mut Draw) {
    session.arm.insert("convention".into(), "modified".into());
}

/// Twist and length stand a row later, as Craig writes them; the file still says `standard`.
fn rows_modified(session: &mut Session, _: &mut Draw) {
    let mut before = [0.0; 2];
    session.entries_of_rows(|_, key, value| match key {
        "a_mm" => std::mem::swap(value, &mut before[0]),
        "alpha_deg" => std::mem::swap(value, &mut before[1]),
        _ => {}
    });
}

/// Names stay in the order of the joints: the numbers beside them are another joint's.
fn keep_names(session: &mut Session) {
    let names = session.joint_names();
    for (row, name) in session.rows().iter_mut().filter_map(Value::as_table_mut).zip(names) {
        row.insert("name".into(), name.into());
    }
}

fn columns_swapped(session: &mut Session, _: &mut Draw) {
    let mut d = Vec::new();
    session.entries_of_rows(|_, key, value| {
        if key == "d_mm" {
            d.push(*value);
        }
    });
    let mut a = Vec::new();
    session.entries_of_rows(|row, key, value| {
        if key == "a_mm" {
            a.push(std::mem::replace(value, d[row]));
        }
    });
    session.entries_of_rows(|row, key, value| {
        if key == "d_mm" {
            *value = a[row];
        }
    });
}

fn scale_lengths(session: &mut Session, factor: f64) {
    session.entries_of_rows(|_, key, value| {
        if key.ends_with("_mm") {
            *value *= factor;
        }
    });
}

fn twists_in_radians(session: &mut Session, _: &mut Draw) {
    session.entries_of_rows(|_, key, value| {
        if key.ends_with("_deg") {
            *value = value.to_radians();
        }
    });
}

/// Changes one entry of those that are not near zero; an arm has few.
fn change_one_entry(session: &mut Session, draw: &mut Draw, wanted: &str, change: impl Fn(f64) -> f64) {
    let mut found = Vec::new();
    session.entries_of_rows(|row, key, value| {
        if key == wanted && value.abs() > 1.0 {
            found.push(row);
        }
    });
    let chosen = found.get(draw.pick(found.len())).copied();
    session.entries_of_rows(|row, key, value| {
        if Some(row) == chosen && key == wanted {
            *value = change(*value);
        }
    });
}

fn link_length(session: &mut Session, draw: &mut Draw) {
    let error = draw.signed(40.0, 120.0);
    change_one_entry(session, draw, "a_mm", |v| v + error);
}

fn tool_length(session: &mut Session, draw: &mut Draw) {
    let error = draw.signed(40.0, 120.0);
    let last = session.rows().len() - 1;
    session.entries_of_rows(|row, key, value| {
        if row == last && key == "d_mm" {
            *value += error;
        }
    });
}

fn tool_left_out(session: &mut Session, _: &mut Draw) {
    session.rows().pop();
}

fn zero_left_out(session: &mut Session, _: &mut Draw) {
    let other = if session.rig == Rig::Poses { 90.0 } else { 0.0 };
    session.entries_of_rows(|row, key, value| {
        if row == 1 && key == "theta_deg" {
            *value = other;
        }
    });
}

/// Both arms of a rig have a file; this is the mirrored one.
fn other_hand(session: &mut Session, _: &mut Draw) {
    session.entries_of_rows(|row, key, value| match (row, key) {
        (2, "d_mm") | (3, "alpha_deg") => *value = -*value,
        _ => {}
    });
    session.joints(|_, q| q[0] = -q[0]);
}

/// The next smaller arm of the same make: of a UR10 the UR5.
fn smaller_arm(session: &mut Session, draw: &mut Draw) {
    let factor = draw.uniform(0.65, 0.8);
    let small =
        [("d_mm", [89.159, 0.0, 0.0, 109.15, 94.65, 82.3]), ("a_mm", [0.0, -425.0, -392.25, 0.0, 0.0, 0.0])];
    let six = session.rig == Rig::Poses;
    session.entries_of_rows(|row, key, value| {
        if six {
            small.iter().filter(|(name, _)| *name == key).for_each(|(_, column)| *value = column[row]);
        } else if key.ends_with("_mm") {
            *value *= factor;
        }
    });
}

fn set_deviation(session: &mut Session, [bound_mm, bound_deg, prior_mm, prior_deg]: [f64; 4]) {
    let keys = [
        ("bound_mm", bound_mm),
        ("bound_deg", bound_deg),
        ("prior_sigma_mm", prior_mm),
        ("prior_sigma_deg", prior_deg),
    ];
    let table: Table = keys.into_iter().map(|(k, v)| (k.to_owned(), Value::Float(v))).collect();
    session.arm.insert("deviation".into(), table.into());
}

/// Only the zeros may move: lengths and twists are taken from the drawing.
fn fix_entries(session: &mut Session, _: &mut Draw) {
    let entry = |name: &str| {
        let keys = [("name", Value::String(name.to_owned())), ("free", Value::Boolean(false))];
        Value::Table(keys.into_iter().map(|(k, v)| (k.to_owned(), v)).collect())
    };
    let fixed: Vec<Value> = ["*.alpha", "*.a", "*.d"].map(entry).to_vec();
    session.set(&["parameters"], fixed);
}

fn target_given(session: &mut Session, draw: &mut Draw) {
    let xyz: Vec<Value> =
        [draw.signed(0.005, 0.02), 0.0, 0.109 + draw.signed(0.01, 0.04)].map(Value::Float).to_vec();
    session.set(&["frames", "tip", "pose"], "given");
    session.set(&["frames", "tip", "at", "xyz_m"], xyz);
}
