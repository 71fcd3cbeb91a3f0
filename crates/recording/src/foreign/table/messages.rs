//! The rows of a table as JSON messages: a topic of all columns, and one for each pose.

use super::poses::Track;
use super::times::Times;
use super::{ROW, TOPIC, Table, Values};
use crate::RecordingError;
use crate::foreign::copy::Copy;
use serde_json::{Map, Value, json};

/// A pose at rest is told so many times, so far from each other [ns]: a dwell of a second.
const HELD: u64 = 11;
const HELD_EVERY_NS: u64 = 100_000_000;

pub(super) fn write(
    table: &Table,
    tracks: &[Track],
    times: &Times,
    copy: &mut Copy,
) -> Result<(), RecordingError> {
    let of_row = json!({ ROW: { "type": "object", "properties": schema_of(table) } });
    let columns = channel(copy, TOPIC, &of_row)?;
    let with_channel = |track| Ok((track, channel(copy, &topic_of(track), &schema_of_track(track))?));
    let tracks: Vec<(&Track, u16)> =
        tracks.iter().map(with_channel).collect::<Result<_, RecordingError>>()?;
    let held = if times.at_rest { HELD } else { 1 };
    for (row, &time_ns) in times.ns.iter().enumerate() {
        let message = json!({ ROW: Value::Object(fields_of(table, row)) }).to_string();
        for k in 0..held {
            let at_ns = time_ns.saturating_add(k * HELD_EVERY_NS);
            copy.put_plain(columns, (row as u64 * held + k) as u32, at_ns, message.as_bytes())?;
            // What was seen there, once.
            for (track, channel) in tracks.iter().filter(|_| k == held / 2) {
                if let Some(message) = pose_of(track, row) {
                    copy.put_plain(*channel, row as u32, at_ns, message.to_string().as_bytes())?;
                }
            }
        }
    }
    Ok(())
}

fn channel(copy: &mut Copy, topic: &str, properties: &Value) -> Result<u16, RecordingError> {
    let schema = json!({ "type": "object", "properties": properties }).to_string();
    copy.add_channel(topic, Some(("armcal.Row", "jsonschema", schema.as_bytes())), "json")
}

fn topic_of(track: &Track) -> String {
    format!("{TOPIC}/{}", track.name)
}

fn schema_of(table: &Table) -> Value {
    let number = || json!({ "type": "number" });
    let of = |values: &Values| match values {
        Values::Numbers(_) => Some(number()),
        Values::Lists { names, .. } if names.is_empty() => {
            Some(json!({ "type": "array", "items": number() }))
        }
        Values::Lists { names, .. } => {
            let all: Map<String, Value> = names.iter().map(|name| (name.clone(), number())).collect();
            Some(json!({ "type": "object", "properties": all }))
        }
        Values::Texts(_) => None,
    };
    let columns = table.columns.iter().filter_map(|c| Some((c.name.clone(), of(&c.values)?)));
    Value::Object(columns.collect())
}

fn fields_of(table: &Table, row: usize) -> Map<String, Value> {
    let of = |values: &Values| match values {
        Values::Numbers(all) => Some(json!(all[row])),
        Values::Lists { length, names, flat } => {
            let own = &flat[row * length..(row + 1) * length];
            Some(match names.is_empty() {
                true => json!(own),
                false => Value::Object(names.iter().cloned().zip(own.iter().map(|x| json!(x))).collect()),
            })
        }
        Values::Texts(_) => None,
    };
    table.columns.iter().filter_map(|c| Some((c.name.clone(), of(&c.values)?))).collect()
}

fn schema_of_track(track: &Track) -> Value {
    let of = |names: &[&str]| {
        let all: Map<String, Value> =
            names.iter().map(|name| ((*name).to_owned(), json!({ "type": "number" }))).collect();
        json!({ "type": "object", "properties": all })
    };
    let point = of(&["x", "y", "z"]);
    match track.orientation {
        None => json!({ "point": point }),
        Some(_) => {
            let parts = json!({ "position": point, "orientation": of(&["x", "y", "z", "w"]) });
            json!({ "pose": { "type": "object", "properties": parts } })
        }
    }
}

/// A pose as a message; none where the row has no position.
fn pose_of(track: &Track, row: usize) -> Option<Value> {
    let is_known = |all: &[f64]| all.iter().all(|x| x.is_finite());
    let [x, y, z] = *track.position.get(row).filter(|p| is_known(&p[..]))?;
    let position = json!({ "x": x, "y": y, "z": z });
    let Some(all) = &track.orientation else { return Some(json!({ "point": position })) };
    Some(match all.get(row).filter(|q| is_known(&q[..])) {
        Some([x, y, z, w]) => {
            json!({ "pose": { "position": position, "orientation": { "x": x, "y": y, "z": z, "w": w } } })
        }
        None => json!({ "pose": { "position": position } }),
    })
}
