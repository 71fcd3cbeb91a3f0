//! Set-points as a ROS 2 recording: `sensor_msgs/msg/JointState`, to play back or to look at.

use armcal_compensate::SetPoint;
use armcal_recording::output::McapOutput;
use armcal_recording::ros2::{self, Header};
use armcal_recording::{RecordingError, SET_POINTS_METADATA};
use std::collections::BTreeMap;
use std::path::Path;

/// Topics: corrected and nominal set-points.
const TOPICS: [&str; 2] = ["/joint_set_points", "/joint_set_points/nominal"];
/// Between two stops, which have no times of their own [ns].
const STOP_NS: i64 = 1_000_000_000;

/// Writes the recording. Times count from 1970: those of the path, or one second a stop.
pub fn write(path: &Path, joints: &[String], points: &[SetPoint]) -> Result<(), RecordingError> {
    let mut output = McapOutput::create(path, "ros2")?;
    let schema = (ros2::JOINT_STATE.name, ros2::SCHEMA_ENCODING, ros2::JOINT_STATE.text.as_bytes());
    let mut ids = [0; 2];
    for (id, topic) in ids.iter_mut().zip(TOPICS) {
        *id = output.add_channel(topic, Some(schema), ros2::MESSAGE_ENCODING, &BTreeMap::new())?;
    }
    let first_s = points.first().and_then(|p| p.target.time_s).unwrap_or(0.0);
    for (i, point) in points.iter().enumerate() {
        let stop_ns = i as i64 * STOP_NS;
        let stamp_ns = point.target.time_s.map_or(stop_ns, |t| ((t - first_s) * 1e9).round() as i64);
        for (id, position) in ids.iter().zip([&point.joint_rad, &point.nominal_rad]) {
            let data = ros2::joint_state(Header { stamp_ns, frame_id: "" }, joints, position, &[], &[]);
            let log_ns = stamp_ns.max(0) as u64;
            output.put(*id, i as u32, log_ns, log_ns, &data)?;
        }
    }
    let about = [("generator", "armcal compensate")].map(|(k, v)| (k.to_owned(), v.to_owned()));
    output.metadata(SET_POINTS_METADATA, &about.into_iter().collect())?;
    output.finish()
}
