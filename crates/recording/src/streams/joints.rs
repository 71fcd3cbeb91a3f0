//! Joint rows to columns in the order of the model: selection by name, units, quantisation.

use crate::decode::{JointRow, has_list};
use crate::error::nearest_name;
use crate::streams::clean::quantisation_step;
use crate::streams::columns::concat_parts;
use crate::{JointStream, JointUnit, RecordingError};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

const ROLE: &str = "joints";
/// Above this no reading is an angle in degrees by its likely size: it is an encoder's count.
const COUNTS_RAD: f64 = 1000.0;

/// Readings of the wanted joints.
#[derive(Debug, Default)]
pub(crate) struct JointTable {
    /// One column a joint, in the unit of the message.
    pub position: Vec<Vec<f64>>,
    /// Efforts alike, NaN where a row has none.
    pub effort: Vec<Vec<f64>>,
    /// Messages that hold only other joints, or only some of the wanted ones.
    pub other: u64,
    /// Joint names seen; empty when no message names any.
    pub present: BTreeSet<String>,
    /// Fewest values seen in a message without names.
    pub unnamed: Option<usize>,
    /// The names of the row before, and where the wanted joints are in them.
    last_names: Option<Arc<[String]>>,
    last_columns: Option<Vec<usize>>,
}

impl JointTable {
    /// Takes the wanted joints out of a row; `false` if it does not have them all.
    pub fn take(&mut self, row: &JointRow<'_>, wanted: &[String]) -> bool {
        if row.names.is_empty() {
            self.unnamed = Some(self.unnamed.map_or(row.position.len(), |n| n.min(row.position.len())));
        }
        if self.last_names.as_ref().is_none_or(|names| !Arc::ptr_eq(names, row.names)) {
            self.present.extend(row.names.iter().cloned());
            self.last_names = Some(Arc::clone(row.names));
            self.last_columns = joint_columns(row.names, wanted);
        }
        let at = self.last_columns.as_ref();
        let Some(at) = at.filter(|at| at.iter().all(|k| *k < row.position.len())) else {
            self.other += 1;
            return false;
        };
        for ((k, position), effort) in at.iter().zip(&mut self.position).zip(&mut self.effort) {
            position.push(row.position[*k]);
            effort.push(row.effort.get(*k).copied().unwrap_or(f64::NAN));
        }
        true
    }

    /// Makes the columns, with room for rows where it can be had.
    pub fn make_room(&mut self, rows: usize, joints: usize) {
        for columns in [&mut self.position, &mut self.effort] {
            columns.resize_with(joints, Vec::new);
            columns.iter_mut().for_each(|column| _ = column.try_reserve_exact(rows));
        }
    }

    /// The rows of part after part.
    pub fn of(mut parts: Vec<JointTable>) -> JointTable {
        let mut whole = JointTable::default();
        for part in &mut parts {
            whole.other += part.other;
            whole.present.append(&mut part.present);
            whole.unnamed = whole.unnamed.into_iter().chain(part.unnamed).min();
        }
        let joints = parts.first().map_or(0, |part| part.position.len());
        let mut column = |pick: fn(&mut JointTable) -> &mut Vec<Vec<f64>>| -> Vec<Vec<Vec<f64>>> {
            (0..joints)
                .map(|j| parts.iter_mut().map(|part| std::mem::take(&mut pick(part)[j])).collect())
                .collect()
        };
        let (position, effort) = (column(|t| &mut t.position), column(|t| &mut t.effort));
        whole.position = position.into_par_iter().map(concat_parts).collect();
        whole.effort = effort.into_par_iter().map(concat_parts).collect();
        whole
    }

    /// Why not a single row had all the wanted joints.
    pub fn none_selected(&self, stream: &JointStream, messages: u64) -> RecordingError {
        let missing = stream.names.iter().find(|name| !self.present.contains(*name));
        let wanted = stream.names.len();
        let why = match (missing, self.unnamed) {
            (_, Some(values)) if self.present.is_empty() => format!(
                "its messages name no joints and hold {values} values, {wanted} joints are wanted: correct `names`, or give \
                 `position` a path for each"
            ),
            (Some(joint), _) => {
                return RecordingError::JointMissing {
                    topic: stream.topic.clone(),
                    joint: joint.clone(),
                    nearest: nearest_name(joint, &self.present),
                    present: self.present.iter().cloned().collect(),
                };
            }
            (None, _) => "the wanted joints never come together in one message".to_owned(),
        };
        RecordingError::NoRows { role: ROLE, topic: stream.topic.clone(), messages, why }
    }
}

/// Where each wanted joint is; the first values in order when the message names none; `None` when one is missing.
fn joint_columns(names: &[String], wanted: &[String]) -> Option<Vec<usize>> {
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
    check_paths(stream)?;
    if !(stream.max_turns.is_finite() && stream.max_turns > 0.0) {
        return wrong(format!("`max_turns` must be positive, not {}", stream.max_turns));
    }
    stream.check_mends().or_else(wrong)?;
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

impl JointStream {
    /// How much of its unit a radian is; of counts, of the finest encoder.
    pub(crate) fn unit_per_rad(&self) -> f64 {
        match self.unit {
            JointUnit::Rad => 1.0,
            JointUnit::Deg => 1.0_f64.to_degrees(),
            JointUnit::Counts => self.encoders.iter().map(|e| e.counts_per_turn / TAU).fold(1.0, f64::max),
        }
    }
}

fn check_paths(stream: &JointStream) -> Result<(), RecordingError> {
    let wrong = |why: String| Err(RecordingError::Config { role: ROLE, why });
    let (paths, joints) = (stream.position.len(), stream.names.len());
    let has_more = stream.name.is_some() || stream.effort.is_some();
    match stream.position.iter().find(|path| has_list(path)) {
        _ if paths == 0 && has_more => {
            wrong("`name` and `effort` are paths of fields beside `position`: give it too".into())
        }
        _ if paths < 2 => Ok(()),
        _ if has_more => {
            wrong("`position` has a path for each joint: `name` and `effort` are read beside one list".into())
        }
        Some(list) => {
            wrong(format!("`position` has several paths, each of one number, and {list} is a list"))
        }
        None if paths != joints => wrong(format!(
            "`position` has {paths} paths for {joints} joints: give one each, in the order of `names`"
        )),
        None => Ok(()),
    }
}

/// Readings of joint after joint in radians.
pub(crate) fn to_rad(joints: &mut [Vec<f64>], stream: &JointStream) {
    joints.par_iter_mut().enumerate().for_each(|(j, column)| match (stream.unit, stream.encoders.get(j)) {
        (JointUnit::Rad, _) => {}
        (JointUnit::Deg, _) => column.iter_mut().for_each(|x| *x = x.to_radians()),
        (JointUnit::Counts, Some(encoder)) => column.iter_mut().for_each(|x| *x = encoder.to_rad(*x)),
        (JointUnit::Counts, None) => column.fill(f64::NAN),
    });
}

/// The efforts [N m] of joint after joint; `None` where no row has any.
pub(crate) fn recorded_effort(columns: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    columns.iter().flatten().any(|e| e.is_finite()).then_some(columns)
}

/// Refuses readings that cannot be in the declared unit.
pub(crate) fn check_unit(joint_rad: &[Vec<f64>], stream: &JointStream) -> Result<(), RecordingError> {
    let limit_rad = stream.max_turns * TAU;
    if joint_rad.iter().flatten().all(|q| q.abs() <= limit_rad) {
        return Ok(());
    }
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
        JointUnit::Rad if reach_rad > COUNTS_RAD => {
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
    let likely = match stream.unit {
        JointUnit::Rad if reach_rad <= COUNTS_RAD => Some("deg"),
        JointUnit::Rad | JointUnit::Deg => Some("counts"),
        JointUnit::Counts => None,
    };
    Err(RecordingError::WrongUnit { role: ROLE, topic: stream.topic.clone(), likely, why })
}

/// Whether the readings of each row are ones that a joint can have; a flipped bit gives the others. `None` where all are.
pub(crate) fn possible_row_mask(joint_rad: &[Vec<f64>], stream: &JointStream) -> Option<Vec<bool>> {
    let possible = |q: &f64| q.abs() <= 10.0 * stream.max_turns * TAU;
    let rows = joint_rad.first().map_or(0, Vec::len);
    let row = |i: usize| joint_rad.iter().all(|column| possible(&column[i]));
    (!joint_rad.iter().flatten().all(possible)).then(|| (0..rows).map(row).collect())
}

/// What makes degrees look like radians, if they do: every joint stays within a turn's worth of radians.
pub(crate) fn looks_like_radians(joint_rad: &[Vec<f64>], stream: &JointStream) -> Option<String> {
    if stream.unit != JointUnit::Deg {
        return None;
    }
    let largest_deg = joint_rad.iter().flatten().map(|q| q.to_degrees().abs()).fold(0.0, f64::max);
    (largest_deg < TAU).then(|| {
        format!("no joint leaves {largest_deg:.2} deg around zero; if the readings are radians, set unit = \"rad\"")
    })
}

/// Step of the grid each joint's readings lie on [rad].
pub(crate) fn quantisation_rad(joint_rad: &[Vec<f64>]) -> Vec<Option<f64>> {
    joint_rad.par_iter().map(|column| quantisation_step(column)).collect()
}
