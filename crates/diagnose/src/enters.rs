//! Where an error enters and what it depends on, each spelt in one way.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Where an error enters.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum EntersAt {
    /// A joint, by its index: the first is `joint1`.
    Joint(usize),
    /// All lengths of the arm: `lengths`.
    Lengths,
    /// The tip, along any axis of the world: `world`.
    World,
    /// The tip, along one of them: `world.x`.
    WorldAxis(char),
    /// The tip, as a smooth function of what it depends on: `displacement`.
    Displacement,
    /// Anything else, by its name: `joint2.a`, `tilt of the base`.
    Part(String),
}

impl EntersAt {
    /// Index of the joint that errs over its own angle; none of anything else.
    pub fn own_angle(&self, driver: DependsOn) -> Option<usize> {
        match self {
            EntersAt::Joint(joint) if driver == DependsOn::Angle(*joint) => Some(*joint),
            _ => None,
        }
    }
}

impl fmt::Display for EntersAt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EntersAt::Joint(joint) => write!(f, "joint{}", joint + 1),
            EntersAt::Lengths => f.write_str("lengths"),
            EntersAt::World => f.write_str("world"),
            EntersAt::WorldAxis(axis) => write!(f, "world.{axis}"),
            EntersAt::Displacement => f.write_str("displacement"),
            EntersAt::Part(name) => f.write_str(name),
        }
    }
}

impl From<EntersAt> for String {
    fn from(at: EntersAt) -> String {
        at.to_string()
    }
}

impl From<String> for EntersAt {
    fn from(text: String) -> EntersAt {
        let places = [EntersAt::Lengths, EntersAt::World, EntersAt::Displacement];
        let axes = ['x', 'y', 'z'].map(EntersAt::WorldAxis);
        let mut known = joint_of(&text).map(EntersAt::Joint).into_iter().chain(places).chain(axes);
        known.find(|at| at.to_string() == text).unwrap_or(EntersAt::Part(text))
    }
}

/// What an error depends on, as formulas spell it where they have it. Joints are counted from 0, in the spelling from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum DependsOn {
    /// The angle of a joint: `q1`.
    Angle(usize),
    /// The sum of the angles of a joint and the next: `q1+q2`.
    AngleSum(usize),
    /// The direction in which a joint arrived: `s1`.
    Direction(usize),
    /// The angle of a joint, with opposite signs by its direction: `s1*q1`.
    AngleByDirection(usize),
    /// The gravity torque on a joint: `tau1`.
    Torque(usize),
    /// The time since the session began, in formulas: `t`.
    SessionTime,
    /// Time otherwise, that of the recordings alone or of no formula: `time`.
    Time,
    /// The temperature.
    Temperature,
    /// The load.
    Load,
    /// Which recording it is.
    Recording,
    /// All joints: `pose`.
    Pose,
    /// The directions of all joints: `arrival directions`.
    Directions,
}

impl fmt::Display for DependsOn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DependsOn::Angle(joint) => write!(f, "q{}", joint + 1),
            DependsOn::AngleSum(joint) => write!(f, "q{}+q{}", joint + 1, joint + 2),
            DependsOn::Direction(joint) => write!(f, "s{}", joint + 1),
            DependsOn::AngleByDirection(joint) => write!(f, "s{0}*q{0}", joint + 1),
            DependsOn::Torque(joint) => write!(f, "tau{}", joint + 1),
            DependsOn::SessionTime => f.write_str("t"),
            DependsOn::Time => f.write_str("time"),
            DependsOn::Temperature => f.write_str("temperature"),
            DependsOn::Load => f.write_str("load"),
            DependsOn::Recording => f.write_str("recording"),
            DependsOn::Pose => f.write_str("pose"),
            DependsOn::Directions => f.write_str("arrival directions"),
        }
    }
}

impl From<DependsOn> for String {
    fn from(driver: DependsOn) -> String {
        driver.to_string()
    }
}

impl TryFrom<String> for DependsOn {
    type Error = String;

    fn try_from(text: String) -> Result<DependsOn, String> {
        use DependsOn::*;
        let of_joint = [Angle, AngleSum, Direction, AngleByDirection, Torque];
        let of_joint = joint_of(&text).into_iter().flat_map(|joint| of_joint.map(|of| of(joint)));
        let whole = [SessionTime, Time, Temperature, Load, Recording, Pose, Directions];
        let found = of_joint.chain(whole).find(|driver| driver.to_string() == text);
        found.ok_or_else(|| format!("there is nothing called \"{text}\" that an error may depend on"))
    }
}

/// Index of the joint whose number comes first in a name.
fn joint_of(text: &str) -> Option<usize> {
    let mut numbers = text.split(|c: char| !c.is_ascii_digit());
    numbers.find_map(|number| number.parse::<u16>().ok())?.checked_sub(1).map(usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_what_was_written() {
        let read = |text: &str| EntersAt::from(text.to_owned());
        assert_eq!(
            ["joint12", "lengths", "world", "world.y", "displacement"].map(read),
            [
                EntersAt::Joint(11),
                EntersAt::Lengths,
                EntersAt::World,
                EntersAt::WorldAxis('y'),
                EntersAt::Displacement
            ]
        );
        for part in ["joint2.a", "joint2 with the direction of joint3 kept", "joint", "joint0", "joint02"] {
            assert_eq!(read(part), EntersAt::Part(part.to_owned()));
        }
        let drivers = "q2,q2+q3,s1,s12*q12,tau3,t,time,temperature,load,recording,pose,arrival directions";
        for text in drivers.split(',') {
            assert_eq!(DependsOn::try_from(text.to_owned()).expect("a driver").to_string(), text);
        }
        for text in ["", "q", "q0", "q02", "q1+q3", "s1*q2", "q99999", "humidity"] {
            assert!(DependsOn::try_from(text.to_owned()).is_err_and(|why| why.contains(text)), "{text}");
        }
    }

    #[test]
    fn a_joint_errs_over_its_own_angle_alone() {
        let own = |at: EntersAt, driver| at.own_angle(driver);
        assert_eq!(own(EntersAt::Joint(1), DependsOn::Angle(1)), Some(1));
        assert_eq!(own(EntersAt::Joint(1), DependsOn::Angle(0)), None);
        assert_eq!(own(EntersAt::Joint(1), DependsOn::AngleByDirection(1)), None);
        assert_eq!(own(EntersAt::Lengths, DependsOn::Angle(0)), None);
    }
}
