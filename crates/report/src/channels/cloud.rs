//! Errors as a point cloud, one a recording: every measured tip with its errors as fields, for viewers that colour by one.

use super::arrows::Drawing;
use super::shapes::unrotated_pose;
use super::{Messages, WORLD, start_ns, timestamp};
use armcal_result::proto::saturating_u32;
use armcal_result::{Point, RecordingRun};
use foxglove::messages as fox;
use foxglove::messages::packed_element_field::NumericType;
use nalgebra::Vector3;

/// Topic of the clouds.
pub(crate) const TOPIC: &str = "/armcal/errors";
/// Fields, each a 32-bit number: where the tip was [m], and its errors.
const FIELDS: [&str; 7] = ["x", "y", "z", "calibrated_mm", "nominal_mm", "after_mm", "expected_mm"];
/// Fields behind them, each a byte: the colour of the calibrated error, as its arrow has it.
const COLOUR: [&str; 4] = ["red", "green", "blue", "alpha"];
const BYTES: u32 = 4;

pub(super) fn put(recording: &RecordingRun, own: &[&Point], drawing: &Drawing, out: &mut Messages) {
    let start_ns = start_ns(recording);
    let seen = own.iter().filter(|p| p.measured_m.iter().all(|x| x.is_finite()));
    let bytes = |p: &&Point| {
        let colour = drawing.ramp(p.residual.fitted_m.norm()).map(|part| (255.0 * part).round() as u8);
        field_values(p).into_iter().flat_map(f32::to_le_bytes).chain(colour).collect::<Vec<u8>>()
    };
    let data: Vec<u8> = seen.flat_map(bytes).collect();
    if data.is_empty() {
        return;
    }
    let field = |(k, name): (u32, &&str)| fox::PackedElementField {
        name: (*name).to_owned(),
        offset: k * BYTES,
        r#type: NumericType::Float32 as i32,
    };
    let numbers = saturating_u32(FIELDS.len()) * BYTES;
    let part = |(k, name): (u32, &&str)| fox::PackedElementField {
        name: (*name).to_owned(),
        offset: numbers + k,
        r#type: NumericType::Uint8 as i32,
    };
    let cloud = fox::PointCloud {
        timestamp: Some(timestamp(start_ns)),
        frame_id: WORLD.into(),
        pose: Some(unrotated_pose(&Vector3::zeros())),
        point_stride: numbers + saturating_u32(COLOUR.len()),
        fields: (0..).zip(&FIELDS).map(field).chain((0..).zip(&COLOUR).map(part)).collect(),
        data: data.into(),
    };
    out.put(TOPIC, start_ns, &cloud);
}

/// In the order of [`FIELDS`]; without anything found, the error after it is that of the calibration.
fn field_values(p: &Point) -> [f32; 7] {
    let mm = |error: &Vector3<f64>| error.norm() * 1e3;
    let after = p.steps_m.last().unwrap_or(&p.residual.fitted_m);
    let m = &p.measured_m;
    let errors =
        [mm(&p.residual.fitted_m), mm(&p.residual.nominal_m), mm(after), p.residual.expected_norm_m * 1e3];
    [m.x, m.y, m.z, errors[0], errors[1], errors[2], errors[3]].map(|v| v as f32)
}
