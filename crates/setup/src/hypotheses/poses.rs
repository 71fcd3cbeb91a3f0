//! What the sensor says of tip, base and table: units, handedness, order of axes and of quaternions, inverted poses,
//! bodies taken for each other.

use super::Hypothesis;
use armcal_core::{Code, Mend, Pose, axis_turns, in_axes};
use armcal_dwell::MeanPose;
use armcal_stages::Inputs;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

const STREAMS: &str = "mend the [streams] of the bodies or what publishes them";

const CAMERAS: &str = "calibrate the cameras anew, or mend what scales their positions";
/// Scales of the sensor that are tried, the first and the last only as neighbours; cameras that are calibrated at all are off
/// by one in a hundred at most.
const SCALES: [f64; 9] = [0.8, 0.9, 0.95, 0.98, 1.0, 1.02, 1.05, 1.1, 1.2];
const FAR_SCALE: f64 = 0.012;
/// The same of a fiducial whose size was declared wrongly.
const SIZES: [f64; 11] = [0.2, 0.33, 0.5, 0.7, 0.8, 1.0, 1.2, 1.45, 2.0, 3.0, 5.0];

/// One of the bodies that stand still.
#[derive(Clone, Copy)]
enum Body {
    Base,
    Table,
}

pub fn hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let tip_seen = inputs.dwells().any(|d| d.tip.is_some());
    let oriented =
        inputs.pipeline.fit.use_orientation && inputs.dwells().any(|d| tip_orientation(d).is_some());
    let base = inputs.seen.iter().any(|s| s.base.is_some());
    let table = inputs.seen.iter().any(|s| s.table.is_some());
    let mut all = Vec::new();
    if tip_seen {
        for (factor, words) in
            [(1e-3, "millimetres"), (1e3, "kilometres"), (1e-2, "centimetres"), (0.0254, "inches")]
        {
            let change = format!("positions read as {words}");
            all.push(Hypothesis::new(Code::PositionUnit, "positions", change, STREAMS, move |i| {
                map_positions(i, Matrix3::identity() * factor, false);
            }));
        }
        all.extend(Hypothesis::of_each(&SCALES, 1.0, FAR_SCALE, scaled_positions));
        for (matrix, words, code) in axis_maps() {
            let change = format!("the sensor's {words}");
            let map = move |i: &mut Inputs| map_positions(i, matrix, false);
            let hypothesis = Hypothesis::new(code, "the sensor's axes", change, STREAMS, map);
            all.push(hypothesis.mended_by(Mend::Axes(matrix)));
            if base || table {
                let change = format!("the {words} in the stream of the tip");
                let map = move |i: &mut Inputs| map_tips(i, matrix, false);
                let hypothesis = Hypothesis::new(code, "the tip", change, STREAMS, map);
                all.push(hypothesis.mended_by(Mend::AxesOfArm(matrix)));
            }
        }
        if oriented || base || table {
            let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
            let change = "the sensor's frame mirrored, orientations too";
            all.push(Hypothesis::new(Code::AxisMirrored, "the sensor's axes", change, STREAMS, move |i| {
                map_positions(i, mirror, true);
            }));
        }
    }
    for (turned, words, code) in quaternion_maps() {
        for (body, present, name) in [(Body::Base, base, "the base"), (Body::Table, table, "the table")] {
            if present {
                let change = format!("the quaternion of {name} {words}");
                all.push(Hypothesis::new(code, name, change, STREAMS, move |i| {
                    map_bodies(i, body, |p| p.pose.rotation = turned(p.pose.rotation));
                }));
            }
        }
        if base && table {
            let change = format!("every quaternion {words}");
            all.push(Hypothesis::new(code, "base and table", change, STREAMS, move |i| {
                for body in [Body::Base, Body::Table] {
                    map_bodies(i, body, |p| p.pose.rotation = turned(p.pose.rotation));
                }
            }));
        }
        if oriented {
            let change = format!("the quaternion of the tip {words}");
            let turn = move |i: &mut Inputs| turn_tips(i, turned);
            all.push(Hypothesis::new(code, "the tip", change, STREAMS, turn));
        }
    }
    // The first turns nothing.
    for turn in axis_turns().into_iter().skip(1).filter(|_| oriented) {
        let change = "the orientation of the tip taken in other axes than its position";
        let take = move |i: &mut Inputs| turn_tips(i, |q| in_axes(&turn, &q));
        let hypothesis = Hypothesis::new(Code::AxesPermuted, "the tip", change, STREAMS, take);
        all.push(hypothesis.mended_by(Mend::OrientationAxes(turn)));
    }
    for (body, present, name) in [(Body::Base, base, "the base"), (Body::Table, table, "the table")] {
        for (turn, words) in [(FRAC_PI_2, "y up"), (-FRAC_PI_2, "y down")].into_iter().filter(|_| present) {
            let change = format!("the pose of {name} taken from a frame with {words} instead of z");
            all.push(Hypothesis::new(Code::AxesPermuted, name, change, STREAMS, move |i| {
                let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn);
                map_bodies(i, body, |p| p.pose = Pose::from_parts(Vector3::zeros().into(), turned) * p.pose);
            }));
        }
        if present {
            let change = format!("the pose of {name} inverted");
            all.push(Hypothesis::new(Code::PoseInverted, name, change, STREAMS, move |i| {
                map_bodies(i, body, |p| p.pose = p.pose.inverse());
            }));
        }
    }
    if inputs.dwells().any(|d| tip_orientation(d).is_some()) {
        let change = "the pose of the tip inverted";
        let hypothesis = Hypothesis::new(Code::PoseInverted, "the tip", change, STREAMS, invert_tips);
        all.push(hypothesis.mended_by(Mend::TipInverted));
        if base || table {
            let change = "the pose of every body inverted";
            let invert = |i: &mut Inputs| {
                invert_tips(i);
                for body in [Body::Base, Body::Table] {
                    map_bodies(i, body, |p| p.pose = p.pose.inverse());
                }
            };
            let hypothesis = Hypothesis::new(Code::PoseInverted, "every body", change, STREAMS, invert);
            all.push(hypothesis.mended_by(Mend::Inverted));
        }
    }
    if base && table {
        all.push(Hypothesis::new(
            Code::StreamsSwapped,
            "base and table",
            "the streams of base and table exchanged",
            STREAMS,
            |i| i.seen.iter_mut().for_each(|s| std::mem::swap(&mut s.base, &mut s.table)),
        ));
    }
    all
}

/// Lengths of the sensor that are far from metres, as of a fiducial of another size. Rarer.
pub fn other_sizes(inputs: &Inputs) -> Vec<Hypothesis> {
    let seen = inputs.dwells().any(|d| d.tip.is_some());
    let all = Hypothesis::of_each(&SIZES, 1.0, FAR_SCALE, scaled_positions);
    all.into_iter().filter(|_| seen).collect()
}

fn scaled_positions(scale: f64) -> Hypothesis {
    let change = format!("the sensor's lengths {scale:.4} times as large");
    let take = move |i: &mut Inputs| map_positions(i, Matrix3::identity() * scale, false);
    Hypothesis::new(Code::PositionScale, "positions", change, CAMERAS, take).mended_by(Mend::Scale(scale))
}

fn tip_orientation(d: &armcal_core::Dwell) -> Option<UnitQuaternion<f64>> {
    d.tip.as_ref().and_then(|t| t.orientation)
}

/// Axes mirrored, exchanged, or named a place off, positions only.
fn axis_maps() -> Vec<(Matrix3<f64>, &'static str, Code)> {
    let rows = |a: [f64; 9]| Matrix3::from_row_slice(&a);
    vec![
        (rows([-1., 0., 0., 0., 1., 0., 0., 0., 1.]), "x axis reversed", Code::AxisMirrored),
        (rows([1., 0., 0., 0., -1., 0., 0., 0., 1.]), "y axis reversed", Code::AxisMirrored),
        (rows([1., 0., 0., 0., 1., 0., 0., 0., -1.]), "z axis reversed", Code::AxisMirrored),
        (rows([0., 1., 0., 1., 0., 0., 0., 0., 1.]), "x and y exchanged", Code::AxesPermuted),
        (rows([0., 0., 1., 0., 1., 0., 1., 0., 0.]), "x and z exchanged", Code::AxesPermuted),
        (rows([1., 0., 0., 0., 0., 1., 0., 1., 0.]), "y and z exchanged", Code::AxesPermuted),
        (rows([0., 1., 0., 0., 0., 1., 1., 0., 0.]), "axes read as y, z, x", Code::AxesPermuted),
        (rows([0., 0., 1., 1., 0., 0., 0., 1., 0.]), "axes read as z, x, y", Code::AxesPermuted),
    ]
}

type Turned = fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>;

/// Components in another order, or the inverse. A mean of quaternions taken in one order is the mean of the others.
fn quaternion_maps() -> [(Turned, &'static str, Code); 3] {
    [
        (
            |q| quaternion_from_wxyz([q.k, q.w, q.i, q.j]),
            "taken as x, y, z, w instead of w, x, y, z",
            Code::QuaternionOrder,
        ),
        (
            |q| quaternion_from_wxyz([q.i, q.j, q.k, q.w]),
            "taken as w, x, y, z instead of x, y, z, w",
            Code::QuaternionOrder,
        ),
        (|q| q.conjugate(), "conjugated", Code::QuaternionConjugate),
    ]
}

/// From w, x, y, z.
fn quaternion_from_wxyz([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn map_bodies(inputs: &mut Inputs, body: Body, change: impl Fn(&mut MeanPose)) {
    for seen in &mut inputs.seen {
        let pose = match body {
            Body::Base => &mut seen.base,
            Body::Table => &mut seen.table,
        };
        pose.iter_mut().for_each(&change);
    }
}

/// The sensor as the tip sees it.
fn invert_tips(inputs: &mut Inputs) {
    inputs.each_dwell(|d| {
        if let Some(t) = d.tip.as_mut()
            && let Some(q) = t.orientation
        {
            let inverse = Pose::from_parts(t.position_m.into(), q).inverse();
            t.position_m = inverse.translation.vector;
            t.orientation = Some(inverse.rotation);
        }
    });
}

/// Orientations of the tip, each turned.
fn turn_tips(inputs: &mut Inputs, turned: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>) {
    inputs.each_dwell(|d| {
        if let Some(q) = d.tip.as_mut().and_then(|t| t.orientation.as_mut()) {
            *q = turned(*q);
        }
    });
}

/// Maps what the sensor saw of the arm.
fn map_tips(inputs: &mut Inputs, matrix: Matrix3<f64>, orientations: bool) {
    inputs.each_dwell(|d| {
        for tip in d.tip.iter_mut().chain(d.markers.values_mut()) {
            tip.position_m = matrix * tip.position_m;
            tip.covariance_m2 = matrix * tip.covariance_m2 * matrix.transpose();
            if orientations {
                tip.orientation = tip.orientation.map(|q| in_axes(&matrix, &q));
            }
        }
    });
}

/// Maps the positions of all bodies; orientations too where the sensor's frame itself is another.
fn map_positions(inputs: &mut Inputs, matrix: Matrix3<f64>, orientations: bool) {
    map_tips(inputs, matrix, orientations);
    for body in [Body::Base, Body::Table] {
        map_bodies(inputs, body, |p| {
            p.pose.translation.vector = matrix * p.pose.translation.vector;
            if orientations {
                p.pose.rotation = in_axes(&matrix, &p.pose.rotation);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_order_of_a_quaternion_undoes_the_other() {
        let right = UnitQuaternion::from_euler_angles(0.3, -1.1, 2.0);
        // Written w, x, y, z into fields that are read as x, y, z, w.
        let wrong = quaternion_from_wxyz([right.k, right.w, right.i, right.j]);
        let [_, (second, ..), _] = quaternion_maps();
        assert!(second(wrong).angle_to(&right) < 1e-12);
        let wrong = quaternion_from_wxyz([right.i, right.j, right.k, right.w]);
        let [(first, ..), ..] = quaternion_maps();
        assert!(first(wrong).angle_to(&right) < 1e-12);
    }
}
