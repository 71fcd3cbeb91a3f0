//! The formats by name.

use std::fmt;

/// A format that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// URDF.
    Urdf,
    /// Joint origins as a xacro file.
    Xacro,
    /// Kinematics YAML of Universal Robots.
    UrYaml,
    /// Offsets of the joints alone.
    JointZeros,
    /// MuJoCo.
    Mjcf,
    /// SDFormat.
    Sdf,
    /// Rows of a DH table.
    DhCsv,
}

impl Format {
    /// All of them, with name, usual file name and who reads it.
    const TABLE: [(Format, &str, &str, &str); 7] = [
        (Format::Urdf, "urdf", "calibrated.urdf", "ROS, MoveIt, Pinocchio, Drake, MuJoCo and most planners"),
        (
            Format::Xacro,
            "xacro",
            "calibrated-origins.xacro",
            "xacro, included by the robot's own description",
        ),
        (
            Format::UrYaml,
            "ur-yaml",
            "ur-kinematics.yaml",
            "ur_description and the drivers of Universal Robots",
        ),
        (Format::JointZeros, "joint-zeros", "joint-zeros.yaml", "controllers that take nothing but offsets"),
        (Format::Mjcf, "mjcf", "calibrated.mjcf.xml", "MuJoCo"),
        (Format::Sdf, "sdf", "calibrated.sdf", "Gazebo and Drake"),
        (Format::DhCsv, "dh-csv", "dh.csv", "tools that import DH rows"),
    ];

    /// The names of all, as a user types them.
    pub fn names() -> [&'static str; 7] {
        Format::TABLE.map(|(_, name, ..)| name)
    }

    /// The format of that name.
    pub fn named(name: &str) -> Option<Format> {
        Format::TABLE.iter().find(|(_, own, ..)| *own == name).map(|(format, ..)| *format)
    }

    fn row(self) -> (&'static str, &'static str, &'static str) {
        let row = Format::TABLE.iter().find(|(format, ..)| *format == self);
        row.map_or(("", "", ""), |(_, name, file, readers)| (name, file, readers))
    }

    /// The file it is written to where nobody says.
    pub fn file_name(self) -> &'static str {
        self.row().1
    }

    /// Who reads it.
    pub fn readers(self) -> &'static str {
        self.row().2
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.row().0)
    }
}
