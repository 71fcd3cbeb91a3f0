//! Which streams of a recording the pipeline uses: the `[streams]` section of a pipeline file.

pub(crate) mod clean;
pub(crate) mod clock;
pub(crate) mod columns;
pub(crate) mod edges;
pub(crate) mod fingerprint;
pub(crate) mod gather;
pub(crate) mod joints;
pub(crate) mod mend;
pub(crate) mod occlusion;
pub(crate) mod poses;
pub(crate) mod publishers;
pub(crate) mod read;
pub(crate) mod reading;
pub(crate) mod request;
pub(crate) mod sensor_time;
pub(crate) mod temperature;
pub(crate) mod together;
pub(crate) mod transforms;

use crate::Clock;
use crate::decode::Place;
pub use mend::Axis;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{IntoDeserializer as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// The streams to read. Only `joints` is required.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Streams {
    /// Encoder readings: one stream, or several (`[[streams.joints]]`), which are read as one.
    #[serde(deserialize_with = "one_or_more_streams")]
    pub joints: Vec<JointStream>,
    /// What the controller asked of the joints; where it is recorded, paths are compared with what was planned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set_points: Option<JointStream>,
    /// The tip, or the marker body on the end effector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip: Option<PoseStream>,
    /// Markers on the arm, by the names that `[markers]` gives them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub bodies: BTreeMap<String, PoseStream>,
    /// The robot's base.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<PoseStream>,
    /// The calibration table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<PoseStream>,
    /// Temperature [degC].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<ScalarStream>,
    /// Instruments that read a length, by the names of the measurements ([`[[measure]]`]) that they make.
    #[serde(skip)]
    pub gauges: BTreeMap<String, GaugeStream>,
}

impl Streams {
    /// Topics of all streams, each once, in order.
    pub fn topics(&self) -> Vec<&str> {
        let poses = [&self.tip, &self.base, &self.table];
        let topics = self.joints.iter().chain(&self.set_points).map(|s| s.topic.as_str());
        let poses = poses.into_iter().flatten().chain(self.bodies.values());
        let gauges = self.gauges.values().map(|s| s.topic.as_str());
        let topics = topics.chain(poses.map(|s| s.topic.as_str())).chain(gauges);
        let mut topics: Vec<&str> = topics.chain(self.temperature.iter().map(|s| s.topic.as_str())).collect();
        topics.sort_unstable();
        topics.dedup();
        topics
    }
}

/// A stream of joint readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointStream {
    /// Topic, such as `/joint_states`.
    pub topic: String,
    /// Joints in the order of the model. Found by name in messages that name them; messages without names are read
    /// by index, their first `names.len()` values in this order.
    #[serde(default)]
    pub names: Vec<String>,
    /// Where the positions are in messages that armcal does not know, such as `measured_joint_state.position[]`: `[]` marks
    /// a list, `*` at the end all fields of a message. Several paths are one number each, in the order of `names`.
    #[serde(
        default,
        deserialize_with = "one_or_more_paths",
        serialize_with = "one_or_list",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub position: Vec<String>,
    /// With `position`: where the names of the joints are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// With `position`: where the efforts are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effort: Option<String>,
    /// Unit of the readings; default `rad`.
    #[serde(default)]
    pub unit: JointUnit,
    /// With `unit = "counts"`: one encoder a joint, in the order of `names`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub encoders: Vec<Encoder>,
    /// What each reading is multiplied by, -1 for an encoder that counts the other way; all 1 when absent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub factors: Vec<f64>,
    /// What is then added to each reading [deg]; all 0 when absent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zeros_deg: Vec<f64>,
    /// Clock; chosen automatically, with its reason recorded, when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<Clock>,
    /// Turns from zero beyond which the unit is taken to be wrong; default 2, raise it for joints that wind.
    #[serde(default = "default_max_turns")]
    pub max_turns: f64,
    /// The arm that it is of, where there are several: prefix of its joints' names.
    #[serde(skip)]
    pub arm: Option<String>,
}

impl JointStream {
    /// What it is called beside others.
    pub(crate) fn called(&self) -> &str {
        self.arm.as_deref().unwrap_or(&self.topic)
    }

    /// The fields that the pipeline names, by their paths; the positions come first.
    pub(crate) fn fields(&self) -> Vec<(Place, &str)> {
        let positions = self.position.iter().map(|path| (Place::Positions, path.as_str()));
        positions
            .chain(configured_paths([(Place::Names, &self.name), (Place::Efforts, &self.effort)]))
            .collect()
    }
}

impl Default for JointStream {
    fn default() -> JointStream {
        JointStream {
            topic: String::new(),
            names: Vec::new(),
            position: Vec::new(),
            name: None,
            effort: None,
            unit: JointUnit::Rad,
            encoders: Vec::new(),
            factors: Vec::new(),
            zeros_deg: Vec::new(),
            clock: None,
            max_turns: default_max_turns(),
            arm: None,
        }
    }
}

fn one_or_more_streams<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<JointStream>, D::Error> {
    let expected = "[streams.joints], or one [[streams.joints]] for each of several streams";
    deserializer.deserialize_any(OneOrMore(expected, PhantomData))
}

fn one_or_more_paths<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    deserializer
        .deserialize_any(OneOrMore("the path of a field, or a list of one for each joint", PhantomData))
}

fn one_or_list<S: Serializer>(paths: &[String], serializer: S) -> Result<S::Ok, S::Error> {
    match paths {
        [only] => only.serialize(serializer),
        several => several.serialize(serializer),
    }
}

/// A table or a text, or an array of them; and what is expected in words.
struct OneOrMore<T>(&'static str, PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for OneOrMore<T> {
    type Value = Vec<T>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        Ok(vec![T::deserialize(MapAccessDeserializer::new(map))?])
    }
    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
        Ok(vec![T::deserialize(text.into_deserializer())?])
    }
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(seq))
    }
}

fn default_max_turns() -> f64 {
    2.0
}

/// Unit of joint readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointUnit {
    /// Radians (metres for prismatic joints).
    #[default]
    Rad,
    /// Degrees.
    Deg,
    /// Raw encoder counts: `direction * 2 pi * (counts - zero_counts) / counts_per_turn`.
    Counts,
}

/// How one joint's encoder counts become an angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// Counts in one turn of the joint, gear ratio included.
    pub counts_per_turn: f64,
    /// +1 when counts grow with the joint angle, -1 when they fall; default +1.
    #[serde(default = "default_direction")]
    pub direction: i8,
    /// Count at joint angle zero; default 0.
    #[serde(default)]
    pub zero_counts: f64,
}

fn default_direction() -> i8 {
    1
}

impl Encoder {
    /// Angle [rad] of a count.
    pub fn to_rad(&self, counts: f64) -> f64 {
        f64::from(self.direction) * std::f64::consts::TAU * (counts - self.zero_counts) / self.counts_per_turn
    }
}

/// A stream of poses or positions of one body.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseStream {
    /// Topic, such as `/vicon/tip/tip`.
    pub topic: String,
    /// Body to read (`child_frame_id`, rigid body, marker or subject, place from 0 in a list of poses), required when
    /// messages hold several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Frame that the poses are expressed in (`header.frame_id`), required when the body comes in several, as on `/tf`; or one that
    /// transforms join to that, at most one of which changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<String>,
    /// Where the position is in messages that armcal does not know: the path of a message with x, y, z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<String>,
    /// With `position`: where the orientation is, a message with x, y, z, w.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<String>,
    /// Unit of the positions; default `m`.
    #[serde(default)]
    pub unit: LengthUnit,
    /// What positions are multiplied by, as of a fiducial that is smaller than was declared; 1 when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Which of the published axes, with its sign, is x, y and z of the position: `["x", "-z", "y"]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<[Axis; 3]>,
    /// The same of the frame that the orientation turns in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_axes: Option<[Axis; 3]>,
    /// Whether what is published is the pose of the sensor in the body, not of the body in the sensor's frame.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub invert: bool,
    /// How many times as fast as time its stamps run; 1 when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_rate: Option<f64>,
    /// Clock; chosen automatically, with its reason recorded, when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<Clock>,
}

impl PoseStream {
    /// The fields that the pipeline names, by their paths; the position comes first.
    pub(crate) fn fields(&self) -> Vec<(Place, &str)> {
        configured_paths([(Place::Position, &self.position), (Place::Orientation, &self.orientation)])
    }
}

fn configured_paths<const N: usize>(fields: [(Place, &Option<String>); N]) -> Vec<(Place, &str)> {
    fields.into_iter().filter_map(|(place, path)| Some((place, path.as_deref()?))).collect()
}

/// Unit of positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Metres.
    #[default]
    M,
    /// Millimetres.
    Mm,
}

impl LengthUnit {
    /// Metres in one of it.
    pub fn to_m(self) -> f64 {
        match self {
            LengthUnit::M => 1.0,
            LengthUnit::Mm => 1e-3,
        }
    }
}

/// A stream of one length, as of a ballbar or a dial gauge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaugeStream {
    /// Topic: a message of one number.
    pub topic: String,
    /// Where the number is in messages that armcal does not know.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<String>,
    /// Unit of the readings; default `mm`.
    #[serde(default = "millimetres")]
    pub unit: LengthUnit,
    /// +1 when readings grow with the length, -1 when they fall; default +1.
    #[serde(default = "default_direction")]
    pub direction: i8,
    /// Clock; chosen automatically, with its reason recorded, when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<Clock>,
}

/// The one field of a message of one number, if the pipeline names it.
pub(crate) fn field_of(value: &Option<String>) -> Vec<(Place, &str)> {
    configured_paths([(Place::Value, value)])
}

fn millimetres() -> LengthUnit {
    LengthUnit::Mm
}

/// A stream of one scalar, such as a temperature [degC].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalarStream {
    /// Topic.
    pub topic: String,
    /// Where the number is in messages that armcal does not know, such as `motor.temperature`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<String>,
    /// Clock; chosen automatically, with its reason recorded, when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<Clock>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_is_a_line_through_its_zero() {
        let e = Encoder { counts_per_turn: 4096.0, direction: -1, zero_counts: 1024.0 };
        assert_eq!(e.to_rad(1024.0), -0.0);
        assert!((e.to_rad(0.0) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((e.to_rad(1024.0 + 4096.0) + std::f64::consts::TAU).abs() < 1e-15);
    }

    #[test]
    fn a_position_is_a_path_or_one_for_each_joint() {
        let read = |position: &str| {
            toml::from_str::<JointStream>(&format!(
                "topic = \"/j\"\nnames = [\"a\", \"b\"]\nposition = {position}\n"
            ))
        };
        for (position, paths) in [("\"q[]\"", vec!["q[]"]), ("[\"'a.b'\", \"c\"]", vec!["'a.b'", "c"])] {
            let stream = read(position).expect("a stream");
            assert_eq!(stream.position, paths);
            let written = toml::to_string(&stream).expect("TOML");
            assert!(written.contains(&format!("position = {position}")), "{written}");
        }
        assert!(read("3").expect_err("a number").to_string().contains("path of a field"));
    }

    #[test]
    fn a_pipeline_section_reads_and_refuses_unknown_keys() {
        let text = "[joints]\ntopic = \"/joint_states\"\nnames = [\"a\"]\nunit = \"deg\"\n[tip]\ntopic = \"/t\"\nunit = \"mm\"\nclock = \"publish\"";
        let streams: Streams = toml::from_str(text).expect("a valid section");
        assert_eq!(streams.joints[0].unit, JointUnit::Deg);
        assert_eq!(streams.joints[0].max_turns, 2.0);
        let tip = streams.tip.expect("tip is there");
        assert_eq!((tip.unit, tip.clock), (LengthUnit::Mm, Some(Clock::Publish)));
        let error =
            toml::from_str::<Streams>("[joints]\ntopic = \"/j\"\nunits = \"deg\"").expect_err("unknown key");
        assert!(error.to_string().contains("units"), "{error}");
    }
}
