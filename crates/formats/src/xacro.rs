//! The calibrated origins of a URDF's joints as a xacro file: a table of origins and a macro that puts one in its place.

use crate::element::Element;
use armcal_core::Pose;
use armcal_model::{roll_pitch_yaw_of, three_numbers};

/// How a description takes its origins from the file.
pub const HOW: [&str; 2] = [
    "In the robot's own xacro: <xacro:include filename=\"THIS FILE\"/> behind its first line, and in each joint below, in the \
     place of its <origin .../>:",
    "<xacro:calibrated_origin joint=\"NAME\"/>",
];

/// The file, of the joints and their origins.
pub fn xacro(origins: &[(&str, Pose)]) -> String {
    let entry = |(joint, pose): &(&str, Pose)| {
        let (xyz, rpy) = (three_numbers(&pose.translation.vector), three_numbers(&roll_pitch_yaw_of(pose)));
        format!("({}, ['{xyz}', '{rpy}'])", python_string(joint))
    };
    let table =
        format!("${{dict([\n    {}])}}", origins.iter().map(entry).collect::<Vec<_>>().join(",\n    "));
    let property = Element::new("xacro:property").with("name", "calibrated_origins").with("value", table);
    let of_joint = |at: usize| format!("${{calibrated_origins[joint][{at}]}}");
    let origin = Element::new("origin").with("xyz", of_joint(0)).with("rpy", of_joint(1));
    let with_parameter =
        Element::new("xacro:macro").with("name", "calibrated_origin").with("params", "joint");
    let root = Element::new("robot").with("xmlns:xacro", "http://www.ros.org/wiki/xacro");
    root.holding([property, with_parameter.holding([origin])])
        .document("xacro-origins/1", &HOW.map(str::to_owned))
}

/// A name as Python has it; a brace would end the expression.
fn python_string(name: &str) -> String {
    let mut text = String::from("'");
    for c in name.chars() {
        match c {
            '\'' | '\\' | '{' | '}' | '$' | '\0'..=' ' => text += &format!("\\x{:02x}", u32::from(c)),
            _ => text.push(c),
        }
    }
    text + "'"
}
