//! Kinematics of a Universal Robots arm, as the YAML that ur_description and the drivers read.
//!
//! ```text
//! base = O_1 Rz(q1) O_2 Rz(q2) ... O_6 Rz(q6) = tool0,      O_i = T(x, y, z) Rz(yaw) Ry(pitch) Rx(roll)
//! ```
//!
//! (ur_description, `ur_macro.xacro`: the joints from `base_link_inertia`, which is the controller's `base`, to `wrist_3_link`,
//! with which `tool0` coincides.) A row `Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta)` of a DH table turns and shifts along its
//! own axis first, `Z = Rz(theta) Tz(d)`, which may as well stand before its joint: `O_1 = Z_1`, `O_i = Tx(a) Rx(alpha) Ry(beta)
//! Z_i` with the rest of row `i - 1`. What is left of the last row, its `a`, `alpha` and `beta`, has no place there: it belongs to
//! the tool.

use crate::{Format, FormatError};
use armcal_core::Pose;
use armcal_model::{Bone, Motion, Place, Skeleton, roll_pitch_yaw_of};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// The sections of the file, in the order of the joints, and the turn about x at which each joint is on every UR [rad].
const JOINTS: [(&str, f64); 6] = [
    ("shoulder", 0.0),
    ("upper_arm", FRAC_PI_2),
    ("forearm", 0.0),
    ("wrist_1", 0.0),
    ("wrist_2", FRAC_PI_2),
    ("wrist_3", -FRAC_PI_2),
];
/// An arm whose axes lie further from those of a UR is none [rad].
const FURTHEST_RAD: f64 = 0.1;

/// An arm in the form of a UR.
#[derive(Debug, Clone, PartialEq)]
pub struct UrKinematics {
    /// The joints' origins, `O_1` to `O_6`.
    pub origins: [Pose; 6],
    /// The tip in `tool0`: what is to be entered as the tool.
    pub tip_in_tool0: Pose,
    /// What the last row has behind its joint, in `tool0`; none of an arm from a URDF.
    pub end_in_tool0: Pose,
}

impl UrKinematics {
    /// The form of the arm on the way to its tip. `by_rows` says that it came from a DH table, whose frames lie otherwise.
    ///
    /// # Errors
    /// An arm that is no UR: not six joints that turn, or axes that lie otherwise.
    pub fn of(skeleton: &Skeleton, tip: &Place, by_rows: bool) -> Result<UrKinematics, FormatError> {
        let joints = six_joints(skeleton, tip)?;
        let mut origins = [Pose::identity(); 6];
        // What stands before the joint of a row, in the frame of the row; of a URDF that turns the joint's axis to z.
        let mut shifts = [Pose::identity(); 6];
        let next = |k: usize| joints.get(k + 1).map_or(tip.link_end, |(_, between)| *between);
        for (k, (bone, between)) in joints.iter().enumerate() {
            let axis = bone.moves.as_ref().map_or_else(Vector3::z, |moving| moving.axis);
            shifts[k] = if by_rows { along_axis(&next(k)) } else { turned_to(&axis) };
            let before = if k == 0 { Pose::identity() } else { shifts[k - 1] };
            origins[k] = before.inverse() * between * shifts[k];
        }
        for ((origin, (section, turn_rad)), (bone, _)) in origins.iter().zip(JOINTS).zip(&joints) {
            let off =
                origin.rotation.angle_to(&UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn_rad));
            if off > FURTHEST_RAD {
                let problem = format!(
                    "joint `{}` would be its {section}, and lies {:.0} deg from where a UR has it",
                    bone.name,
                    off.to_degrees()
                );
                return Err(cannot_hold(problem));
            }
        }
        let back = shifts[5].inverse();
        Ok(UrKinematics { origins, tip_in_tool0: back * tip.at, end_in_tool0: back * tip.link_end })
    }

    /// The file, with the hash of the arm's own kinematics.
    pub fn yaml(&self, name: &str, hash: &str) -> String {
        let [at, turn] = [self.tip_in_tool0.translation.vector, self.tip_in_tool0.rotation.scaled_axis()];
        let mut text = format!(
            "# armcal.ur-kinematics/1\n# Kinematics of \"{}\" as calibrated: kinematics_params of ur_description, [m], [rad].\n\
             # The tip is not in it. As tool centre point on the pendant, in mm and rad (rotation vector):\n\
             #   X {:.4}, Y {:.4}, Z {:.4}, RX {:.6}, RY {:.6}, RZ {:.6}\nkinematics:\n",
            name.replace(char::is_control, "_"),
            at.x * 1e3,
            at.y * 1e3,
            at.z * 1e3,
            turn.x,
            turn.y,
            turn.z
        );
        for ((section, _), origin) in JOINTS.iter().zip(&self.origins) {
            text += &format!("  {section}:\n");
            let (xyz, rpy) = (origin.translation.vector, roll_pitch_yaw_of(origin));
            let names = ["x", "y", "z", "roll", "pitch", "yaw"];
            for (key, value) in names.iter().zip(xyz.iter().chain(&rpy)) {
                text += &format!("    {key}: {}\n", yaml_number(*value));
            }
        }
        text + &format!("  hash: {hash}\n")
    }
}

/// The hash in a kinematics file of the arm.
///
/// # Errors
/// None, several, or one that is no word.
pub fn hash_in(text: &str) -> Result<String, FormatError> {
    let bad = |problem: &str| {
        let next = "take the file that `ros2 launch ur_calibration calibration_correction.launch.py` makes of the arm";
        Err(FormatError::Hash(format!("{problem}; {next}")))
    };
    let mut found = text.lines().filter_map(|line| line.trim_start().strip_prefix("hash:"));
    let (Some(value), None) = (found.next(), found.next()) else {
        return bad("the file has not one line `hash: ...` under `kinematics:`");
    };
    let value = value.split(" #").next().unwrap_or_default().trim().trim_matches(['"', '\'']);
    match !value.is_empty() && value.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
        true => Ok(value.to_owned()),
        false => bad("the value of `hash:` is no word of letters, digits, - and _"),
    }
}

/// A number that every YAML reader takes for one: version 1.1 wants a point before an exponent.
pub(crate) fn yaml_number(value: f64) -> String {
    let text = format!("{:?}", value + 0.0);
    match (text.contains('.'), text.split_once('e')) {
        (false, Some((digits, exponent))) => format!("{digits}.0e{exponent}"),
        _ => text,
    }
}

/// The six joints on the way to the tip, each with the constant between it and the joint before; the first as it is in the link
/// that it hangs on.
fn six_joints<'s>(skeleton: &'s Skeleton, tip: &Place) -> Result<Vec<(&'s Bone, Pose)>, FormatError> {
    let mut way: Vec<usize> = std::iter::successors(tip.on, |at| skeleton.joints[*at].parent).collect();
    way.reverse();
    let mut joints: Vec<(&Bone, Pose)> = Vec::new();
    let mut between = Pose::identity();
    for bone in way.into_iter().map(|at| &skeleton.joints[at]) {
        let Some(moving) = &bone.moves else {
            // What is fixed before the first joint is in the description of the robot already.
            between = if joints.is_empty() { Pose::identity() } else { between * bone.origin };
            continue;
        };
        if moving.motion == Motion::Prismatic || moving.follows.is_some() {
            let how = if moving.follows.is_some() { "follows another joint" } else { "slides" };
            return Err(cannot_hold(format!("joint `{}` {how}, and the six joints of a UR turn", bone.name)));
        }
        joints.push((bone, between * bone.origin));
        between = Pose::identity();
    }
    match joints.len() {
        6 => Ok(joints),
        n => Err(cannot_hold(format!("{n} joints lead to its tip, and a UR has six"))),
    }
}

fn cannot_hold(problem: String) -> FormatError {
    let problem = format!("{problem}; urdf, mjcf and sdf hold any arm");
    FormatError::CannotHold { format: Format::UrYaml, problem }
}

/// The turn about and the shift along z with which a constant begins.
fn along_axis(constant: &Pose) -> Pose {
    let x = constant.rotation * Vector3::x();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), x.y.atan2(x.x));
    Pose::from_parts(Translation3::new(0.0, 0.0, constant.translation.z), turn)
}

/// The rotation that brings z to an axis.
fn turned_to(axis: &Vector3<f64>) -> Pose {
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), axis).unwrap_or(half_turn);
    Pose::from_parts(Translation3::identity(), turn)
}
