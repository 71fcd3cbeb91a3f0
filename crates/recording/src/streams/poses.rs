//! Pose rows to columns: body, frame, unit, occlusion, orientation.

use crate::decode::PoseRow;
use crate::error::nearest_name;
use crate::streams::clean::Kept;
use crate::streams::columns::concat_parts;
use crate::streams::occlusion::Seen;
use crate::streams::request::Request;
use crate::{LengthUnit, PoseStream, RecordingError};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeSet;

/// Positions beyond this are no laboratory [m].
const ROOM_M: f64 = 100.0;

/// Poses of one stream, row after row.
#[derive(Debug, Default)]
pub(crate) struct PoseTable {
    pub seen: Vec<Seen>,
    /// Frames the rows are expressed in.
    pub frames: BTreeSet<String>,
    /// Bodies of the rows.
    pub bodies: BTreeSet<String>,
    /// Frames of poses that were left out, because another was asked for.
    pub other_frames: BTreeSet<String>,
}

impl PoseTable {
    /// Adds a row with `to_m` metres in its unit.
    pub fn take(&mut self, row: &PoseRow<'_>, to_m: f64) {
        self.seen.push(Seen::of(row, to_m));
        for (texts, text) in [(&mut self.frames, row.frame_id), (&mut self.bodies, row.body)] {
            // A search compares nothing with nothing by `memcmp`, which may read from a dangling address: 100 ns on AVX-512.
            let nothing = text.is_empty() && texts.first().is_some_and(String::is_empty);
            if !nothing && !texts.contains(text) {
                texts.insert(text.to_owned());
            }
        }
    }

    /// The rows of part after part.
    pub fn of(parts: Vec<PoseTable>) -> PoseTable {
        let mut whole = PoseTable::default();
        let each = parts.into_iter().map(|mut part| {
            whole.frames.append(&mut part.frames);
            whole.bodies.append(&mut part.bodies);
            whole.other_frames.append(&mut part.other_frames);
            part.seen
        });
        let seen = concat_parts(each.collect());
        PoseTable { seen, ..whole }
    }

    /// Whether all numbers of row `i` are finite.
    pub fn is_finite(&self, i: usize) -> bool {
        let s = &self.seen[i];
        s.position_m.iter().chain(s.quaternion_xyzw.iter().flatten()).all(|x| x.is_finite())
    }
}

/// Checks what can be checked before reading.
pub(crate) fn check_config((role, stream): (&'static str, &PoseStream)) -> Result<(), RecordingError> {
    let why = match stream.orientation.is_some() && stream.position.is_none() {
        true => Err("`orientation` is the path of a field beside `position`: give both".to_owned()),
        false => stream.check_mends(),
    };
    why.map_err(|why| RecordingError::Config { role, why })
}

/// Refuses a stream that mixes bodies.
pub(crate) fn check_body(
    role: &'static str,
    stream: &PoseStream,
    table: &PoseTable,
) -> Result<(), RecordingError> {
    if stream.body.is_some() || table.bodies.len() < 2 {
        return Ok(());
    }
    Err(RecordingError::Body {
        role,
        topic: stream.topic.clone(),
        why: "holds several bodies: set `body`".to_owned(),
        nearest: None,
        present: table.bodies.iter().cloned().collect(),
    })
}

/// The error for a body that no message holds.
pub(crate) fn body_missing(
    role: &'static str,
    stream: &PoseStream,
    present: &BTreeSet<String>,
) -> RecordingError {
    let wanted = stream.body.as_deref().unwrap_or_default();
    body_error((role, stream), wanted, format!("never shows body {wanted:?}"), present)
}

/// The error for a frame that no pose is in.
pub(crate) fn frame_missing(
    role: &'static str,
    stream: &PoseStream,
    present: &BTreeSet<String>,
) -> RecordingError {
    let wanted = stream.frame.as_deref().unwrap_or_default();
    let why =
        format!("never has that body in frame {wanted:?}, and no transform joins that frame to another");
    body_error((role, stream), wanted, why, present)
}

/// The error for a frame that no transforms lead to.
pub(crate) fn no_chain(request: &Request<'_>, why: String) -> RecordingError {
    RecordingError::NotDecodable {
        role: request.role,
        topic: request.topic.to_owned(),
        why: format!("it {why}"),
    }
}

fn body_error(
    (role, stream): (&'static str, &PoseStream),
    wanted: &str,
    why: String,
    present: &BTreeSet<String>,
) -> RecordingError {
    RecordingError::Body {
        role,
        topic: stream.topic.clone(),
        why,
        nearest: nearest_name(wanted, present),
        present: present.iter().cloned().collect(),
    }
}

/// Refuses metres that cannot be metres.
pub(crate) fn check_unit(
    role: &'static str,
    stream: &PoseStream,
    table: &PoseTable,
    rows: &Kept,
) -> Result<(), RecordingError> {
    let reaches = rows.file_rows().map(|i| Vector3::from(table.seen[i].position_m).norm());
    if reaches.clone().all(|reach_m| reach_m <= ROOM_M) {
        return Ok(());
    }
    // Rows of exactly zero are occluded, and in every unit.
    let mut reach_m: Vec<f64> = reaches.filter(|r| *r > 0.0).collect();
    if reach_m.is_empty() {
        return Ok(());
    }
    let k = reach_m.len() / 2;
    let reach_m = *reach_m.select_nth_unstable_by(k, f64::total_cmp).1;
    if reach_m <= ROOM_M {
        return Ok(());
    }
    let why = match stream.unit {
        LengthUnit::M => {
            format!(
                "the body is {reach_m:.0} m from the origin, which looks like millimetres: set unit = \"mm\""
            )
        }
        LengthUnit::Mm => {
            format!("the body is {reach_m:.0} m from the origin even as millimetres: not a position")
        }
    };
    let likely = (stream.unit == LengthUnit::M).then_some("mm");
    Err(RecordingError::WrongUnit { role, topic: stream.topic.clone(), likely, why })
}

/// Whether a position is one that a laboratory can hold; a flipped bit gives the others.
pub(crate) fn is_possible(pose: &Seen) -> bool {
    Vector3::from(pose.position_m).norm() <= 10.0 * ROOM_M
}

/// What makes millimetres look like metres, if they do.
pub(crate) fn looks_like_metres(stream: &PoseStream, position_m: &[Vector3<f64>]) -> Option<String> {
    if stream.unit != LengthUnit::Mm {
        return None;
    }
    let reach_m = position_m.iter().map(|p| p.norm()).fold(0.0, f64::max);
    (reach_m < 0.01 && reach_m > 0.0).then(|| {
        format!(
            "the body stays within {:.3} mm of the origin; if that is metres, set unit = \"m\"",
            reach_m * 1e3
        )
    })
}

/// Positions [m] of the given rows.
pub(crate) fn positions_m(table: &PoseTable, rows: &Kept) -> Vec<Vector3<f64>> {
    rows.file_rows().map(|i| Vector3::from(table.seen[i].position_m)).collect()
}

/// Orientations of the given rows, all of which have a quaternion of about unit length.
pub(crate) fn orientations(table: &PoseTable, rows: &Kept) -> Option<Vec<UnitQuaternion<f64>>> {
    let unit = |i: usize| {
        let [x, y, z, w] = table.seen[i].quaternion_xyzw?;
        Some(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
    };
    rows.file_rows().map(unit).collect()
}
