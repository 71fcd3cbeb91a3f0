//! Everything that could matter, read as columns, with the units that the numbers themselves show.

use super::arm::Arm;
use super::channels::Channels;
use super::files::Opened;
use super::frames;
use super::topics::{BodyTopic, JointTopic};
use crate::error::InitError;
use armcal_core::{Dwell, Mend, PoseSamples, Samples};
use armcal_dwell::{DwellConfig, detect_dwells};
use armcal_recording::{
    JointStream, JointUnit, LengthUnit, PoseStream, RecordingError, ScalarStream, StreamReport, Streams,
};
use armcal_stages::RunError;
use nalgebra::Matrix3;

/// More bodies than this are the frames of a simulation.
const MOST_BODIES: usize = 24;

/// One recording in columns.
pub struct Read {
    /// Its name.
    pub name: String,
    /// The columns; bodies by their [`body_key`].
    pub samples: Samples,
    /// Rates, clocks and losses.
    pub reports: Vec<StreamReport>,
    /// The pauses of the joints.
    pub dwells: Vec<Dwell>,
}

impl Read {
    /// What was seen of a body.
    pub fn body(&self, body: usize) -> Option<&PoseSamples> {
        self.samples.bodies.get(&body_key(body)).filter(|seen| !seen.is_empty())
    }

    /// What was said about the reading of a stream.
    pub fn report(&self, role: &str) -> Option<&StreamReport> {
        self.reports.iter().find(|r| r.role == role)
    }
}

/// The streams that were read, and of them the recordings.
pub struct AllRead {
    /// All that was read: joints, bodies, thermometer.
    pub streams: Streams,
    /// The bodies, by the number in their [`body_key`].
    pub bodies: Vec<BodyTopic>,
    /// The recordings, in their order.
    pub recordings: Vec<Read>,
    /// What is not read, and why.
    pub left: Vec<(String, String)>,
}

impl AllRead {
    /// Takes the stamps of a body for those of a clock that runs so many times as fast as time.
    pub fn set_clock_rate(&mut self, body: usize, rate: f64) {
        let key = body_key(body);
        self.streams.bodies.get_mut(&key).into_iter().for_each(|stream| stream.clock_rate = Some(rate));
        let seen = self.recordings.iter_mut().filter_map(|r| r.samples.bodies.get_mut(&key));
        seen.for_each(|seen| seen.slow_down(rate));
    }

    /// Takes the orientations of a body for those in axes that a turn carries onto those of its positions.
    pub fn set_orientation_axes(&mut self, body: usize, turn: &Matrix3<f64>) {
        let mut alone =
            Streams { tip: self.streams.bodies.get(&body_key(body)).cloned(), ..Streams::default() };
        if alone.mend(&Mend::OrientationAxes(*turn)) {
            self.streams.bodies.extend(alone.tip.map(|mended| (body_key(body), mended)));
        }
    }
}

/// The name of a body while nobody knows its role.
pub fn body_key(body: usize) -> String {
    format!("b{body:03}")
}

/// Reads all that may be used, with the keys of streams in which mistakes are undone.
pub fn read_recordings(
    arm: &Arm,
    channels: &Channels,
    opened: &[Opened],
    mended: Option<&Streams>,
) -> Result<AllRead, InitError> {
    let mut left = Vec::new();
    let mut bodies: Vec<BodyTopic> = Vec::new();
    for body in &channels.bodies {
        let of_controller = |j: &JointTopic| {
            j.topic == body.topic && j.field.as_ref().is_some_and(|f| f.values == arm.names.len())
        };
        if body.body.as_ref().is_some_and(|b| arm.links.contains(b)) {
            left.push((
                body.shown(),
                "a link of the robot's own description: computed, not measured".to_owned(),
            ));
        } else if channels.joints.iter().any(of_controller) {
            left.push((
                body.shown(),
                "in the message of the joints: computed from them, not measured".to_owned(),
            ));
        } else if bodies.len() == MOST_BODIES {
            left.push((body.shown(), format!("one of more than {MOST_BODIES} bodies")));
        } else {
            bodies.push(body.clone());
        }
    }
    frames::assign_root_frames(&mut bodies, opened, &mut left)?;
    let pose = |b: &BodyTopic| {
        let BodyTopic { topic, body, frame, position, orientation } = b.clone();
        PoseStream { topic, body, frame, position, orientation, ..PoseStream::default() }
    };
    let field = arm.source.field.as_ref();
    let thermometer = |topic: &String| ScalarStream { topic: topic.clone(), ..ScalarStream::default() };
    let mut streams = Streams {
        joints: vec![JointStream {
            topic: arm.source.topic.clone(),
            names: arm.names.clone(),
            position: field.map_or(Vec::new(), |f| f.positions.clone()),
            name: field.and_then(|f| f.name.clone()),
            unit: field.filter(|f| f.says_degrees()).map_or(JointUnit::Rad, |_| JointUnit::Deg),
            ..JointStream::default()
        }],
        bodies: bodies.iter().enumerate().map(|(at, body)| (body_key(at), pose(body))).collect(),
        temperature: channels.temperatures.first().map(thermometer),
        ..Streams::default()
    };
    mended.iter().for_each(|mended| take_mends(&mut streams, mended));
    left.extend(channels.temperatures.iter().skip(1).map(|t| (t.clone(), "another thermometer".to_owned())));
    let mut all = |streams: &mut Streams| -> Result<Vec<Read>, InitError> {
        opened.iter().map(|one| read_one(one, streams, &mut left)).collect()
    };
    let first = streams.clone();
    let mut recordings = all(&mut streams)?;
    // A unit that a later recording showed holds for all: the earlier ones are read with it.
    if streams != first && opened.len() > 1 {
        recordings = all(&mut streams)?;
    }
    Ok(AllRead { streams, bodies, recordings, left })
}

/// The keys that undo mistakes, of streams of the same topics and bodies.
fn take_mends(streams: &mut Streams, mended: &Streams) {
    for (own, mended) in streams.joints.iter_mut().zip(&mended.joints) {
        let JointStream { names, factors, zeros_deg, .. } = mended.clone();
        (own.names, own.factors, own.zeros_deg) = (names, factors, zeros_deg);
    }
    let still = [&mended.tip, &mended.base, &mended.table].into_iter().flatten();
    let all: Vec<&PoseStream> = still.chain(mended.bodies.values()).collect();
    for own in streams.bodies.values_mut() {
        let same = |m: &&&PoseStream| (&m.topic, &m.body, &m.frame) == (&own.topic, &own.body, &own.frame);
        if let Some(mended) = all.iter().find(same) {
            let PoseStream { axes, orientation_axes, invert, clock_rate, scale, .. } = **mended;
            (own.axes, own.orientation_axes, own.invert) = (axes, orientation_axes, invert);
            (own.clock_rate, own.scale) = (clock_rate, scale);
        }
    }
}

fn read_one(
    one: &Opened,
    streams: &mut Streams,
    left: &mut Vec<(String, String)>,
) -> Result<Read, InitError> {
    let name = one.entry.name();
    loop {
        match one.recording.read(streams) {
            Ok((samples, reports, _)) => {
                let alone = Samples { joints: samples.joints.clone(), ..Samples::default() };
                let found = detect_dwells(0, &alone, None, &DwellConfig::default());
                let (dwells, _) =
                    found.map_err(|source| RunError::Dwell { recording: name.clone(), source })?;
                return Ok(Read { name, samples, reports, dwells });
            }
            Err(source) => correct_streams(streams, &source, left)
                .ok_or(RunError::Recording { recording: name.clone(), source })?,
        }
    }
}

/// Reads on after an error that says which other unit it must be, or which body cannot be read.
fn correct_streams(
    streams: &mut Streams,
    error: &RecordingError,
    left: &mut Vec<(String, String)>,
) -> Option<()> {
    let joints = &mut streams.joints[0];
    match error {
        RecordingError::WrongUnit { role: "joints", likely: Some("deg"), .. } => {
            joints.unit = JointUnit::Deg;
            Some(())
        }
        RecordingError::WrongUnit { role: "bodies", topic, .. } => {
            let all = streams.bodies.values_mut().filter(|b| b.topic == *topic && b.unit == LengthUnit::M);
            let mended = all.map(|body| body.unit = LengthUnit::Mm).count();
            (mended > 0).then_some(()).or_else(|| drop_topic(streams, topic, error, left))
        }
        RecordingError::NotDecodable { role: "bodies", topic, .. }
        | RecordingError::Body { role: "bodies", topic, .. } => drop_topic(streams, topic, error, left),
        RecordingError::NotDecodable { role: "temperature", topic, .. }
        | RecordingError::NoRows { role: "temperature", topic, .. } => {
            left.push((topic.clone(), error.to_string()));
            streams.temperature.take().map(drop)
        }
        _ => None,
    }
}

fn drop_topic(
    streams: &mut Streams,
    topic: &str,
    error: &RecordingError,
    left: &mut Vec<(String, String)>,
) -> Option<()> {
    let before = streams.bodies.len();
    streams.bodies.retain(|_, body| body.topic != topic);
    left.push((topic.to_owned(), error.to_string()));
    (streams.bodies.len() < before).then_some(())
}
