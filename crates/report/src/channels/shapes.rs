//! Foxglove primitives from poses and points.

use super::WORLD;
use armcal_core::Pose;
use foxglove::messages as fox;
use nalgebra::{UnitQuaternion, Vector3};

/// Height of a line of a label on the screen [pixels].
const LABEL_PX: f64 = 14.0;

/// Red, green, blue, opacity, 0 to 1.
pub(super) type Rgba = [f64; 4];

pub(super) fn colour([r, g, b, a]: Rgba) -> fox::Color {
    fox::Color { r, g, b, a }
}

pub(super) fn vector(v: &Vector3<f64>) -> fox::Vector3 {
    fox::Vector3 { x: v.x, y: v.y, z: v.z }
}

pub(super) fn point(v: &Vector3<f64>) -> fox::Point3 {
    fox::Point3 { x: v.x, y: v.y, z: v.z }
}

pub(super) fn quaternion(q: &UnitQuaternion<f64>) -> fox::Quaternion {
    fox::Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}

pub(super) fn pose(p: &Pose) -> fox::Pose {
    fox::Pose { position: Some(vector(&p.translation.vector)), orientation: Some(quaternion(&p.rotation)) }
}

pub(super) fn unrotated_pose(position_m: &Vector3<f64>) -> fox::Pose {
    pose(&Pose::from_parts((*position_m).into(), UnitQuaternion::identity()))
}

pub(super) fn sphere(centre_m: &Vector3<f64>, diameter_m: f64, rgba: Rgba) -> fox::SpherePrimitive {
    fox::SpherePrimitive {
        pose: Some(unrotated_pose(centre_m)),
        size: Some(vector(&Vector3::repeat(diameter_m))),
        color: Some(colour(rgba)),
    }
}

pub(super) fn line_strip(points_m: &[Vector3<f64>], thickness_m: f64, rgba: Rgba) -> fox::LinePrimitive {
    fox::LinePrimitive {
        r#type: fox::line_primitive::Type::LineStrip as i32,
        pose: Some(unrotated_pose(&Vector3::zeros())),
        thickness: thickness_m,
        points: points_m.iter().map(point).collect(),
        color: Some(colour(rgba)),
        ..Default::default()
    }
}

/// A disc lying in the xy plane of `place`.
pub(super) fn disc(place: &Pose, diameter_m: f64, height_m: f64, rgba: Rgba) -> fox::CylinderPrimitive {
    fox::CylinderPrimitive {
        pose: Some(pose(place)),
        size: Some(vector(&Vector3::new(diameter_m, diameter_m, height_m))),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(colour(rgba)),
    }
}

/// A box about `centre`.
pub(super) fn plate(centre: &Pose, size_m: &Vector3<f64>, rgba: Rgba) -> fox::CubePrimitive {
    fox::CubePrimitive { pose: Some(pose(centre)), size: Some(vector(size_m)), color: Some(colour(rgba)) }
}

/// Text that turns towards the viewer; its height is in metres.
pub(super) fn billboard_text(
    position_m: &Vector3<f64>,
    height_m: f64,
    rgba: Rgba,
    words: String,
) -> fox::TextPrimitive {
    fox::TextPrimitive {
        pose: Some(unrotated_pose(position_m)),
        billboard: true,
        font_size: height_m,
        scale_invariant: false,
        color: Some(colour(rgba)),
        text: words,
    }
}

/// Text that is as large on the screen wherever the camera stands.
pub(super) fn label(position_m: &Vector3<f64>, rgba: Rgba, words: String) -> fox::TextPrimitive {
    fox::TextPrimitive { scale_invariant: true, ..billboard_text(position_m, LABEL_PX, rgba, words) }
}

/// An arrow with its tail at `tail_m` and the tip of its head at `tail_m + along_m`; `None` when that is nowhere.
pub(super) fn arrow(
    tail_m: &Vector3<f64>,
    along_m: &Vector3<f64>,
    thickness_m: f64,
    rgba: Rgba,
) -> Option<fox::ArrowPrimitive> {
    let length_m = along_m.norm();
    if !(length_m.is_finite() && length_m > 0.0 && tail_m.iter().all(|x| x.is_finite())) {
        return None;
    }
    // Opposite to x there is no unique rotation; half a turn about z is one.
    let rotation = UnitQuaternion::rotation_between(&Vector3::x(), along_m)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
    let head_m = (0.3 * length_m).min(4.0 * thickness_m);
    Some(fox::ArrowPrimitive {
        pose: Some(pose(&Pose::from_parts((*tail_m).into(), rotation))),
        shaft_length: length_m - head_m,
        shaft_diameter: thickness_m,
        head_length: head_m,
        head_diameter: 2.0 * thickness_m,
        color: Some(colour(rgba)),
    })
}

/// An entity in the world frame that stays until it is replaced.
pub(super) fn scene_entity(id: impl Into<String>, time_ns: i64) -> fox::SceneEntity {
    fox::SceneEntity {
        timestamp: Some(super::timestamp(time_ns)),
        frame_id: WORLD.into(),
        id: id.into(),
        lifetime: Some(fox::Duration::new(0, 0)),
        ..Default::default()
    }
}

pub(super) fn key_value(key: &str, value: impl ToString) -> fox::KeyValuePair {
    fox::KeyValuePair { key: key.into(), value: value.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_ends_where_it_should() {
        let tail = Vector3::new(0.3, -0.2, 0.1);
        for along in [
            Vector3::new(0.01, 0.02, -0.03),
            Vector3::new(-1.0, 0.0, 0.0),
            Vector3::new(-1.0, 1e-12, 0.0),
            Vector3::new(1e-9, 0.0, 0.0),
        ] {
            let arrow = arrow(&tail, &along, 0.002, [1.0; 4]).expect("it has a length");
            let q = arrow.pose.expect("pose").orientation.expect("orientation");
            let rotation = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q.w, q.x, q.y, q.z));
            let end = rotation * Vector3::x() * (arrow.shaft_length + arrow.head_length);
            assert!((end - along).norm() < 1e-9 * along.norm().max(1e-3), "{end} {along}");
            assert!(arrow.shaft_length >= 0.0 && arrow.head_length >= 0.0);
        }
    }

    #[test]
    fn no_arrow_without_length_or_place() {
        assert!(arrow(&Vector3::zeros(), &Vector3::zeros(), 0.002, [1.0; 4]).is_none());
        assert!(arrow(&Vector3::zeros(), &Vector3::repeat(f64::NAN), 0.002, [1.0; 4]).is_none());
        assert!(arrow(&Vector3::repeat(f64::INFINITY), &Vector3::x(), 0.002, [1.0; 4]).is_none());
    }
}
