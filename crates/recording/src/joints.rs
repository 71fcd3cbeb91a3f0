//! Joint rows to columns in the order of the model: selection by name, units, quantisation.

use crate::clean::quantisation_step;
use crate::decode::JointRows;
use crate::error::nearest;
use crate::{JointStream, JointUnit, RecordingError};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

const ROLE: &str = "joints";

/// Readings of the wanted joints, row after row.
#[derive(Debug, Default)]
pub(crate) struct JointTable {
    /// Positions in the unit of the message; row `i` is `[i * joints .. (i + 1) * joints]`.
    pub position: Vec<f64>,
    /// Efforts alike, NaN where a row has none.
    pub effort: Vec<f64>,
    /// Messages that hold only other joints, or only some of the wanted ones.
    pub other: u64,
    /// Joint names seen; empty when no message names any.
    pub present: BTreeSet<String>,
    /// Fewest values seen in a message without names.
    pub unnamed: Option<usize>,
}

impl JointTable {
    /// Takes the wanted joints out of decoded rows, and returns which rows have them all.
    pub fn select(rows: &JointRows, wanted: &[String]) -> (JointTable, Vec<usize>) {
        let mut table = JointTable::default();
        for list in rows.name_lists() {
            table.present.extend(list.iter().cloned());
        }
        let mut kept = Vec::with_capacity(rows.len());
        table.position.reserve(rows.len() * wanted.len());
        table.effort.reserve(rows.len() * wanted.len());
        // The names of the row before, and where the wanted joints are in them.
        let mut last_names: Option<&Arc<[String]>> = None;
        let mut last_columns: Option<Vec<usize>> = None;
        for (i, row) in rows.rows().enumerate() {
            if row.names.is_empty() {
                table.unnamed = Some(table.unnamed.map_or(row.position.len(), |n| n.min(row.position.len())));
            }
            if last_names.is_none_or(|names| !Arc::ptr_eq(names, row.names)) {
                (last_names, last_columns) = (Some(row.names), columns(row.names, wanted));
            }
            let Some(columns) = last_columns.as_ref().filter(|c| c.iter().all(|k| *k < row.position.len()))
            else {
                table.other += 1;
                continue;
            };
            table.position.extend(columns.iter().map(|k| row.position[*k]));
            table.effort.extend(columns.iter().map(|k| row.effort.get(*k).copied().unwrap_or(f64::NAN)));
            kept.push(i);
        }
        (table, kept)
    }

    /// Adds the rows of a later block.
    pub fn append(&mut self, mut later: JointTable) {
        self.position.append(&mut later.position);
        self.effort.append(&mut later.effort);
        self.other += later.other;
        self.present.append(&mut later.present);
        self.unnamed = self.unnamed.into_iter().chain(later.unnamed).min();
    }

    /// Why not a single row had all the wanted joints.
    pub fn none_selected(&self, stream: &JointStream, messages: u64) -> RecordingError {
        let missing = stream.names.iter().find(|name| !self.present.contains(*name));
        let wanted = stream.names.len();
        let why = match (missing, self.unnamed) {
            (_, Some(values)) if self.present.is_empty() => format!(
                "its messages name no joints and hold {values} values, {wanted} joints are wanted: correct `names`"
            ),
            (Some(joint), _) => {
                return RecordingError::JointMissing {
                    topic: stream.topic.clone(),
                    joint: joint.clone(),
                    nearest: nearest(joint, &self.present),
                    present: self.present.iter().cloned().collect(),
                };
            }
            (None, _) => "the wanted joints never come together in one message".to_owned(),
        };
        RecordingError::NoRows { role: ROLE, topic: stream.topic.clone(), messages, why }
    }
}

/// Where each wanted joint is; the first values in order when the message names none; `None` when one is missing.
fn columns(names: &[String], wanted: &[String]) -> Option<Vec<usize>> {
    if names.is_empty() {
        return Some((0..wanted.len()).collect());
    }
    wanted.iter().map(|w| names.iter().position(|n| n == w)).collect()
}

/// Checks what can be checked before reading.
pub(crate) fn check_config(stream: &JointStream) -> Result<(), RecordingError> {
    let wrong = |why: String| Err(RecordingError::Config { role: ROLE, why });
    let distinct: BTreeSet<&String> = stream.names.iter().collect();
    if stream.names.is_empty() {
        return wrong("`names` is empty: list the joints in the order of the model".into());
    }
    if distinct.len() != stream.names.len() {
        return wrong(format!("`names` lists a joint twice: {:?}", stream.names));
    }
    if !(stream.max_turns.is_finite() && stream.max_turns > 0.0) {
        return wrong(format!("`max_turns` must be positive, not {}", stream.max_turns));
    }
    if stream.unit != JointUnit::Counts {
        return match stream.encoders.is_empty() {
            true => Ok(()),
            false => wrong("`encoders` are given: set unit = \"counts\" or remove them".into()),
        };
    }
    if stream.encoders.len() != stream.names.len() {
        let (encoders, joints) = (stream.encoders.len(), stream.names.len());
        return wrong(format!(
            "unit = \"counts\" needs one entry of `encoders` a joint: {encoders} for {joints} joints"
        ));
    }
    for (name, e) in stream.names.iter().zip(&stream.encoders) {
        if !(e.counts_per_turn.is_finite() && e.counts_per_turn > 0.0 && e.zero_counts.is_finite()) {
            return wrong(format!(
                "encoder of {name}: `counts_per_turn` must be positive, `zero_counts` finite"
            ));
        }
        if e.direction.abs() != 1 {
            return wrong(format!("encoder of {name}: `direction` must be 1 or -1, not {}", e.direction));
        }
    }
    Ok(())
}

/// One column a joint [rad], from the given rows of the table.
pub(crate) fn to_rad(table: &JointTable, rows: &[usize], stream: &JointStream) -> Vec<Vec<f64>> {
    let joints = stream.names.len();
    let convert = |j: usize, x: f64| match stream.unit {
        JointUnit::Rad => x,
        JointUnit::Deg => x.to_radians(),
        JointUnit::Counts => stream.encoders.get(j).map_or(f64::NAN, |e| e.to_rad(x)),
    };
    let column = |j: usize| rows.iter().map(|i| convert(j, table.position[i * joints + j])).collect();
    (0..joints).into_par_iter().map(column).collect()
}

/// One column of efforts a joint [N m], NaN where a row has none; `None` where no row has any.
pub(crate) fn effort(table: &JointTable, rows: &[usize], joints: usize) -> Option<Vec<Vec<f64>>> {
    let column = |j: usize| rows.iter().map(|i| table.effort[i * joints + j]).collect::<Vec<f64>>();
    let columns: Vec<Vec<f64>> = (0..joints).map(column).collect();
    columns.iter().flatten().any(|e| e.is_finite()).then_some(columns)
}

/// Refuses readings that cannot be in the declared unit.
pub(crate) fn check_unit(joint_rad: &[Vec<f64>], stream: &JointStream) -> Result<(), RecordingError> {
    let limit_rad = stream.max_turns * TAU;
    let reach = |column: &Vec<f64>| {
        let mut magnitude: Vec<f64> = column.iter().map(|q| q.abs()).collect();
        if magnitude.is_empty() {
            return 0.0;
        }
        // One wild reading is not a unit; a twentieth of them is.
        let k = (magnitude.len() - 1) * 19 / 20;
        *magnitude.select_nth_unstable_by(k, f64::total_cmp).1
    };
    let worst = joint_rad.iter().map(reach).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((j, reach_rad)) = worst.filter(|(_, reach_rad)| *reach_rad > limit_rad) else { return Ok(()) };
    let name = &stream.names[j];
    let otherwise = "or raise `max_turns` if the joint really winds that far";
    let why = match stream.unit {
        JointUnit::Rad if reach_rad > 1000.0 => {
            format!(
                "joint {name} reaches {reach_rad:.0} rad, which looks like encoder counts: set unit = \"counts\" with `encoders`"
            )
        }
        JointUnit::Rad => {
            format!(
                "joint {name} reaches {reach_rad:.1} rad, which looks like degrees, or like a motor before its gear: set unit = \
                 \"deg\", divide by the gear ratio, {otherwise}"
            )
        }
        JointUnit::Deg => {
            let deg = reach_rad.to_degrees();
            format!(
                "joint {name} reaches {deg:.0} deg, which looks like encoder counts: set unit = \"counts\" with `encoders`, {otherwise}"
            )
        }
        JointUnit::Counts => {
            let turns = reach_rad / TAU;
            format!(
                "joint {name} reaches {turns:.1} turns: correct `counts_per_turn` or `zero_counts`, {otherwise}"
            )
        }
    };
    Err(RecordingError::WrongUnit { role: ROLE, topic: stream.topic.clone(), why })
}

/// Whether the readings of row `i` are ones that a joint can have; a flipped bit gives the others.
pub(crate) fn is_possible(joint_rad: &[Vec<f64>], i: usize, stream: &JointStream) -> bool {
    joint_rad.iter().all(|column| column[i].abs() <= 10.0 * stream.max_turns * TAU)
}

/// What makes degrees look like radians, if they do: every joint stays within a turn's worth of radians.
pub(crate) fn looks_like_radians(joint_rad: &[Vec<f64>], stream: &JointStream) -> Option<String> {
    let largest_deg = joint_rad.iter().flatten().map(|q| q.to_degrees().abs()).fold(0.0, f64::max);
    (stream.unit == JointUnit::Deg && largest_deg < TAU).then(|| {
        format!("no joint leaves {largest_deg:.2} deg around zero; if the readings are radians, set unit = \"rad\"")
    })
}

/// Step of the grid each joint's readings lie on [rad].
pub(crate) fn quantisation_rad(joint_rad: &[Vec<f64>]) -> Vec<Option<f64>> {
    joint_rad.par_iter().map(|column| quantisation_step(column)).collect()
}
