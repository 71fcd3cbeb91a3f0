//! The result channels of `run.mcap`: everything under `/armcal/`.
//!
//! | topic | schema | messages |
//! |---|---|---|
//! | `/armcal/scene` | `foxglove.SceneUpdate` | one a recording: board, points, scale of the arrows |
//! | `/armcal/arrows_nominal`, `_calibrated`, `_after` | `foxglove.SceneUpdate` | one a recording: error arrows; `after` \
//!   with everything found |
//! | `/armcal/board_map` | `foxglove.SceneUpdate` | one a run: all boards from above, side by side, with error arrows |
//! | `/armcal/nominal/robot_description`, `/armcal/calibrated/..`, `/armcal/board/..` | `std_msgs/msg/String` | one a run: \
//!   URDF whose links are frames of `/armcal/tf` |
//! | `/armcal/errors` | `foxglove.PointCloud` | one a recording: measured tips with their errors as fields |
//! | `/armcal/arms` | `foxglove.SceneUpdate` | one a dwell: nominal and calibrated arm, measured tip |
//! | `/armcal/story` | `armcal.Story` | one a run: what came out, what is missing, what to do next |
//! | `/armcal/tf` | `foxglove.FrameTransforms` | one a dwell: both arms link by link, the board; the frame of the map |
//! | `/armcal/path_measured`, `_nominal`, `_calibrated` | `foxglove.PosesInFrame` | one a recording |
//! | `/armcal/tip_measured` | `foxglove.PoseInFrame` | one an observation |
//! | `/armcal/dwells` | `armcal.Dwell` | one a dwell |
//! | `/armcal/assignments` | `armcal.Assignment` | one a dwell |
//! | `/armcal/residuals` | `armcal.Residual` | one an observation |
//! | `/armcal/parameters` | `armcal.Parameters` | one a run |
//! | `/armcal/parameter_table` | `armcal.ParameterTable` | one a run: the free ones as people read them |
//! | `/armcal/report` | `armcal.Calibration` | one a run |
//! | `/armcal/clock` | `armcal.ClockAlignment` | one a recording with a sensor clock |
//! | `/armcal/implied/joint1`, ... | `armcal.JointErrors` | one a run: error against angle, by direction of arrival |
//! | `/armcal/board/0`, ... | `armcal.BoardErrors` | one a recording with a board: error vectors on it |
//! | `/armcal/course` | `armcal.Course` | one a run: error over recorded time |
//! | `/armcal/steps` | `armcal.Steps` | one a run: the falling error |
//! | `/armcal/diagnosis`, `/armcal/candidates` | `armcal.Diagnosis`, `armcal.Candidates` | one a diagnosed run |
//! | `/armcal/effect_table` | `armcal.EffectTable` | one a diagnosed run: what was found and the candidates as people read them |
//! | `/armcal/unlisted/1`, ... | `armcal.ErrorCurve` | one an error without a name |
//! | `/armcal/quality` | `armcal.Quality` | one a run: clocks, occlusion, dwells not used |
//! | `/armcal/log` | `foxglove.Log` | warnings and milestones |
//!
//! A viewer that seeks shows the latest message of each topic and nothing before it. So every message
//! is complete by itself, which is why the standing scene and the moving arms are two topics.
//!
//! The log time is that of the dwell on the robot's clock, and what is true of a whole recording or
//! run is logged at its beginning. The publish time is the same, except where the position sensor saw
//! the tip: there it is the sensor's own stamp.

mod arrows;
pub(crate) mod board_grid;
pub(crate) mod board_map;
mod board_scale;
pub(crate) mod cloud;
mod facts;
mod findings;
mod frames;
mod log;
mod paths;
mod places;
pub(crate) mod robots;
mod scene;
mod shapes;

pub(crate) use findings::{curve_topic, implied_topic};
pub(crate) use places::places_m;

use crate::findings::Findings;
use armcal_core::Dwell;
use armcal_dwell::ClockAlignment;
use armcal_recording::RecordingReport;
use armcal_result::proto::saturating_u32;
use armcal_result::{Point, RecordingRun, Run};
use foxglove::messages::Timestamp;
use foxglove::{Encode, Schema};

/// The frame in which positions are measured.
pub(crate) const WORLD: &str = "world";

/// One message, ready to be written.
pub(crate) struct ResultMessage {
    pub topic: String,
    pub schema: Schema,
    pub message_encoding: String,
    pub log_ns: u64,
    pub publish_ns: u64,
    pub data: Vec<u8>,
}

/// All result messages in the order of their log times.
pub(crate) fn result_messages(run: &Run, points: &[Point], findings: &Findings) -> Vec<ResultMessage> {
    let mut out = Messages::default();
    log::put_milestones(run, findings, &mut out);
    facts::put(run, points, &mut out);
    findings::put(run, findings, &mut out);
    frames::put_standing(run, &mut out);
    robots::put(run, &mut out);
    board_map::put(run, findings, &mut out);
    let drawing = arrows::Drawing::of(run, points);
    for (index, recording) in run.recordings.iter().enumerate() {
        let of_recording: Vec<&Point> =
            points.iter().filter(|p| p.observation.dwell.recording == index).collect();
        paths::put(recording, &of_one_feature(&of_recording), &mut out);
        cloud::put(recording, &of_recording, &drawing, &mut out);
        scene::put_standing(run, index, &of_recording, &drawing, &mut out);
        arrows::put(run, index, &of_recording, &drawing, &mut out);
        let shown = || run.posed(recording);
        // A viewer draws nothing before the first message: until the first dwell the arm stands as in it.
        let first = shown().take(1).map(|dwell| (dwell, start_ns(recording)));
        for (dwell, time_ns) in first.chain(shown().map(|dwell| (dwell, dwell.mid_ns()))) {
            frames::put(run, index, dwell, time_ns, &mut out);
            scene::put_arms(run, dwell, &of_recording, time_ns, &mut out);
        }
    }
    out.messages.sort_by_key(|m| m.log_ns);
    out.messages
}

/// The points of the tip, of the first marker where the tip was not seen, against one place: a path is that of one of them.
fn of_one_feature<'p, 'r>(points: &[&'p Point<'r>]) -> Vec<&'p Point<'r>> {
    let first = points.iter().map(|p| p.observation.what()).min();
    points.iter().copied().filter(|p| Some(p.observation.what()) == first).collect()
}

/// When a recording begins [ns]: its first message or dwell, so that a viewer that opens the file has at once what is
/// true of all of it.
pub(crate) fn start_ns(recording: &RecordingRun) -> i64 {
    first_ns(&recording.report, &recording.dwells).unwrap_or(0)
}

/// The same of what was read and found of any recording; none where it is empty.
pub(crate) fn first_ns(report: &RecordingReport, dwells: &[Dwell]) -> Option<i64> {
    let messages = report.channels.iter().filter(|c| c.messages > 0).map(|c| c.first_ns);
    dwells.iter().map(|d| d.start_ns).chain(messages).min()
}

/// When the first recording begins [ns].
pub(crate) fn run_start_ns(run: &Run) -> i64 {
    run.recordings.iter().map(start_ns).min().unwrap_or(0)
}

/// When the last dwell of the run ends [ns].
pub(crate) fn run_end_ns(run: &Run) -> i64 {
    let ends = run.recordings.iter().flat_map(|r| &r.dwells).map(|d| d.end_ns);
    ends.max().unwrap_or_else(|| run_start_ns(run))
}

/// Collects messages.
#[derive(Default)]
struct Messages {
    messages: Vec<ResultMessage>,
}

impl Messages {
    fn put<T: Encode>(&mut self, topic: impl Into<String>, time_ns: i64, message: &T) {
        self.put_published(topic, time_ns, time_ns, message);
    }

    fn put_published<T: Encode>(
        &mut self,
        topic: impl Into<String>,
        log_ns: i64,
        publish_ns: i64,
        message: &T,
    ) {
        let mut data = Vec::with_capacity(message.encoded_len().unwrap_or(0));
        message.encode(&mut data).expect("a vector grows to any length");
        self.messages.push(ResultMessage {
            topic: topic.into(),
            schema: T::get_schema().expect("protobuf messages have a schema"),
            message_encoding: T::get_message_encoding(),
            log_ns: unsigned_ns(log_ns),
            publish_ns: unsigned_ns(publish_ns),
            data,
        });
    }

    /// Text as ROS 2 has it: a string in little-endian CDR (OMG DDS-XTypes 1.3, 7.4) behind its four bytes of header.
    fn put_text(&mut self, topic: &str, time_ns: i64, text: &str) {
        let length = saturating_u32(text.len() + 1).to_le_bytes();
        let data = [&[0, 1, 0, 0], &length[..], text.as_bytes(), &[0]].concat();
        self.messages.push(ResultMessage {
            topic: topic.into(),
            schema: Schema::new("std_msgs/msg/String", "ros2msg", b"string data\n".as_slice()),
            message_encoding: "cdr".into(),
            log_ns: unsigned_ns(time_ns),
            publish_ns: unsigned_ns(time_ns),
            data,
        });
    }
}

/// MCAP has no time before 1970.
fn unsigned_ns(time_ns: i64) -> u64 {
    u64::try_from(time_ns).unwrap_or(0)
}

/// The time as Foxglove's messages carry it.
fn timestamp(time_ns: i64) -> Timestamp {
    let time_ns = unsigned_ns(time_ns);
    let seconds = u32::try_from(time_ns / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (time_ns % 1_000_000_000) as u32)
}

/// Robot time -> sensor time [ns]: the inverse of [`ClockAlignment::to_robot_ns`].
fn to_sensor_ns(clock: &ClockAlignment, robot_ns: i64) -> i64 {
    let since_reference_s = robot_ns.saturating_sub(clock.reference_ns) as f64 * 1e-9;
    let offset_s = (clock.offset_s + clock.drift * since_reference_s) / (1.0 - clock.drift);
    robot_ns.saturating_add((offset_s * 1e9).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensor_time_inverts_robot_time() {
        let clock = ClockAlignment {
            offset_s: 0.0123,
            offset_sigma_s: 0.0,
            drift: 5e-5,
            drift_sigma: 0.0,
            reference_ns: 1_700_000_000_000_000_000,
            first_ns: 1_700_000_000_000_000_000,
            correlation: 1.0,
            displacement_ratio: 1.0,
            declared: false,
        };
        for sensor_ns in [1_700_000_000_000_000_000, 1_700_000_600_123_456_789, 1_699_999_000_000_000_000] {
            let there_and_back = to_sensor_ns(&clock, clock.to_robot_ns(sensor_ns));
            assert!((there_and_back - sensor_ns).abs() <= 1, "{there_and_back} {sensor_ns}");
        }
    }

    #[test]
    fn times_outside_the_formats_range_saturate() {
        assert_eq!(unsigned_ns(-5), 0);
        assert_eq!(timestamp(-5), Timestamp::new(0, 0));
        assert_eq!(timestamp(1_500_000_000), Timestamp::new(1, 500_000_000));
        assert_eq!(timestamp(i64::MAX).sec(), u32::MAX);
    }
}
