//! The nominal and the calibrated robot, and the board, as URDF text on `std_msgs/String` topics, so that viewers that know
//! nothing of armcal draw them: links are called like the frames of `/armcal/tf`, which move them. The topics end in
//! `robot_description`, by which Rerun knows them.

use super::frames::{BOARD as BOARD_FRAME, Link, links};
use super::shapes::Rgba;
use super::{Messages, WORLD, run_start_ns, scene};
use armcal_core::Pose;
use armcal_model::Model;
use armcal_result::Run;
use armcal_table::Board;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use std::fmt::Write as _;

/// A cylinder between the origins of two frames is as thick [m].
const RADIUS_M: f64 = 0.012;
/// How far the joints are turned to see which of two frames a part of the arm belongs to [rad or m].
const TURNED: f64 = 0.3;
/// Height of the disc that stands for a cavity [m].
const DISC_M: f64 = 0.001;
const HEAD: &str = "<?xml version=\"1.0\"?>\n";
/// Lengths below are none [m].
const NOTHING_M: f64 = 1e-6;

/// Topics of the robots.
pub(crate) const NOMINAL: &str = "/armcal/nominal/robot_description";
pub(crate) const CALIBRATED: &str = "/armcal/calibrated/robot_description";
/// Topic of the board.
const BOARD: &str = "/armcal/board/robot_description";

pub(super) fn put(run: &Run, out: &mut Messages) {
    let mut say = |topic, text: String| out.put_text(topic, run_start_ns(run), &text);
    if let Some(board) = &run.board {
        say(BOARD, board_urdf(board));
    }
    let Some(dwell) = run.first_posed() else { return };
    let fitted = run.calibration.fit.values();
    let mut robot = |topic, prefix, p: &[f64], rgba| {
        say(topic, arm_urdf(&run.model, prefix, p, &dwell.joint_rad, rgba));
    };
    robot(NOMINAL, "nominal", &run.calibration.nominal_values, scene::GREY);
    robot(CALIBRATED, "calibrated", &fitted, scene::GREEN);
}

/// An arm, whose links are called like its frames under the prefix.
fn arm_urdf(model: &Model, prefix: &str, p: &[f64], joint_rad: &[f64], rgba: Rgba) -> String {
    let turned: Vec<f64> = joint_rad.iter().map(|q| q + TURNED).collect();
    let [stands, turned] = [joint_rad, &turned].map(|joint_rad| links(model, prefix, p, joint_rad));
    // Viewers make a path of it.
    links_urdf(&escape_xml(&prefix.replace('/', "_")), &stands, &turned, rgba)
}

/// Plate and cavities in the frame of the board.
fn board_urdf(board: &Board) -> String {
    let mut visual = String::new();
    if let Some((centre, size_m)) = scene::plate_of(&board.cavities) {
        let [x, y, z]: [f64; 3] = size_m.into();
        let _ = write!(
            visual,
            "<visual>{}<geometry><box size=\"{x} {y} {z}\"/></geometry>{}</visual>",
            origin_element(&centre),
            material_element("plate")
        );
    }
    for cavity in &board.cavities {
        let (place, radius_m) =
            (Pose::from(Translation3::from(cavity.in_board_m)), scene::CAVITY_DIAMETER_M / 2.0);
        let _ = write!(
            visual,
            "<visual>{}<geometry><cylinder radius=\"{radius_m}\" length=\"{DISC_M}\"/></geometry>{}</visual>",
            origin_element(&place),
            material_element("cavity")
        );
    }
    let materials = [("plate", scene::PLATE), ("cavity", scene::CAVITY)]
        .map(|(name, rgba)| material_definition(name, rgba))
        .concat();
    format!(
        "{HEAD}<robot name=\"board\">\n{materials}  <link name=\"{BOARD_FRAME}\">{visual}</link>\n</robot>\n"
    )
}

fn material_element(name: &str) -> String {
    format!("<material name=\"{name}\"/>")
}

fn material_definition(name: &str, [r, g, b, a]: Rgba) -> String {
    format!("  <material name=\"{name}\"><color rgba=\"{r} {g} {b} {a}\"/></material>\n")
}

/// Links in the pose `stands`; `turned` are the same with all joints turned. What is between two frames is drawn with the one
/// in which it does not move: the first for a URDF, the second for Denavit-Hartenberg rows.
fn links_urdf(prefix: &str, stands: &[Link], turned: &[Link], rgba: Rgba) -> String {
    let mut visuals = vec![String::new(); stands.len()];
    for (k, link) in stands.iter().enumerate() {
        let Some(parent) = link.parent else { continue };
        let (here, there) = (link.in_parent, turned[k].in_parent);
        let (along, moved) = (here.translation.vector, there.translation.vector);
        if (along - moved).norm() < NOTHING_M {
            visuals[parent] += &link_visual(&along, prefix);
        } else {
            visuals[k] += &link_visual(&here.inverse().translation.vector, prefix);
        }
    }
    let mut text = format!("{HEAD}<robot name=\"{prefix}\">\n{}", material_definition(prefix, rgba));
    // A robot has one root: of several arms the world.
    let arms = stands.iter().filter(|link| link.parent.is_none()).count();
    if arms > 1 {
        let _ = writeln!(text, "  <link name=\"{WORLD}\"/>");
    }
    for (link, visual) in stands.iter().zip(&visuals) {
        let _ = writeln!(text, "  <link name=\"{}\">{visual}</link>", escape_xml(&link.name));
    }
    for link in stands {
        let parent = link.parent.map_or(WORLD, |parent| stands[parent].name.as_str());
        if link.parent.is_none() && arms == 1 {
            continue;
        }
        let (name, parent) = (escape_xml(&link.name), escape_xml(parent));
        let _ = writeln!(
            text,
            "  <joint name=\"{name}/joint\" type=\"floating\"><parent link=\"{parent}\"/><child link=\"{name}\"/>{}</joint>",
            origin_element(&link.in_parent)
        );
    }
    text + "</robot>\n"
}

/// From the origin of a frame to a place in it; nothing where that is the origin.
fn link_visual(to_m: &Vector3<f64>, of: &str) -> String {
    let length_m = to_m.norm();
    if !(length_m.is_finite() && length_m > NOTHING_M) {
        return String::new();
    }
    // Opposite to z there is no unique rotation; half a turn about x is one.
    let rotation = UnitQuaternion::rotation_between(&Vector3::z(), to_m)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let middle = Pose::from_parts((to_m / 2.0).into(), rotation);
    let shape = format!("<cylinder radius=\"{RADIUS_M}\" length=\"{length_m}\"/>");
    format!(
        "<visual>{}<geometry>{shape}</geometry>{}</visual>",
        origin_element(&middle),
        material_element(of)
    )
}

fn origin_element(pose: &Pose) -> String {
    let ([x, y, z], (roll, pitch, yaw)) = (pose.translation.vector.into(), pose.rotation.euler_angles());
    format!("<origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>")
}

fn escape_xml(name: &str) -> String {
    quick_xml::escape::escape(name.replace(char::is_control, "_")).into_owned()
}
