//! The tip from observation to observation: measured, and as both robots predict it.

use super::shapes::{pose, unrotated_pose};
use super::{Messages, WORLD, start_ns, timestamp, to_sensor_ns};
use armcal_core::Pose;
use armcal_result::{Point, RecordingRun};
use foxglove::messages as fox;
use nalgebra::Vector3;

pub(super) fn put(recording: &RecordingRun, points: &[&Point], out: &mut Messages) {
    if points.is_empty() {
        return;
    }
    let mut in_time: Vec<&Point> = points.to_vec();
    in_time.sort_by_key(|p| p.observation.time_ns);
    let start_ns = start_ns(recording);
    let mut path = |topic, position_m: fn(&Point) -> Vector3<f64>| {
        let poses = in_time.iter().map(|p| unrotated_pose(&position_m(p))).collect();
        let message =
            fox::PosesInFrame { timestamp: Some(timestamp(start_ns)), frame_id: WORLD.into(), poses };
        out.put(topic, start_ns, &message);
    };
    path("/armcal/path_measured", |p| p.measured_m);
    path("/armcal/path_nominal", |p| p.nominal_predicted_m);
    path("/armcal/path_calibrated", |p| p.predicted_m);
    for point in in_time {
        put_tip(recording, point, out);
    }
}

/// The measured tip; published when the sensor says it saw it.
fn put_tip(recording: &RecordingRun, point: &Point, out: &mut Messages) {
    let time_ns = point.observation.time_ns;
    let (publish_ns, tip) = match point.observation.is_tracked() {
        true => {
            let stamp_ns = recording.clock.as_ref().map_or(time_ns, |clock| to_sensor_ns(clock, time_ns));
            let rotation = point.observation.seen_orientation().map(|(seen, _)| *seen).unwrap_or_default();
            (stamp_ns, pose(&Pose::from_parts(point.measured_m.into(), rotation)))
        }
        false => (time_ns, unrotated_pose(&point.measured_m)),
    };
    let message =
        fox::PoseInFrame { timestamp: Some(timestamp(time_ns)), frame_id: WORLD.into(), pose: Some(tip) };
    out.put_published("/armcal/tip_measured", time_ns, publish_ns, &message);
}
