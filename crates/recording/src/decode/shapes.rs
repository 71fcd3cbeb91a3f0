//! The message shapes armcal reads, recognised by the fields a schema defines, never by its name.
//!
//! Adding one: an entry in [`SHAPES`]. The first shape that fits a schema decides its role.

use super::paths::{has_list, parent_of, spelled, step, unquoted};
use super::slot::Slot;
use super::types::{Field, Kind, Number, Repeat, Types};
use super::{DecodeError, Role};
use crate::error::nearest_name;

/// A message shape: the fields it must and may have, beside a stamp and of poses a frame, which any may have.
pub(super) struct Shape {
    /// What it is read as.
    pub(super) role: Role,
    /// Whether its positions are in millimetres by definition.
    pub(super) in_millimetres: bool,
    /// Whether the bodies of a list have no names but their places in it.
    pub(super) by_place: bool,
    /// The message that has stamp and frame.
    stamped: &'static str,
    parts: &'static [(Need, &'static str, Part)],
}

#[derive(Clone, Copy, PartialEq)]
enum Need {
    Must,
    May,
}
use Need::{May, Must};

/// What a path leads to. `[]` in a path marks a list.
#[derive(Clone, Copy)]
enum Part {
    /// One value, or a list of values where the path ends in `[]`.
    Value(Slot),
    /// A message with x, y, z.
    Point,
    /// A message with x, y, z, w.
    Quaternion,
    /// The stamp of the message at the path, wherever it keeps it.
    Stamp,
    /// The frame of the message at the path, wherever it keeps it.
    Frame,
}
use Part::{Frame, Point, Quaternion, Stamp, Value};

const fn joint_shape(parts: &'static [(Need, &'static str, Part)]) -> Shape {
    Shape { role: Role::Joints, in_millimetres: false, by_place: false, stamped: "", parts }
}

/// Poses of which the message at `stamped` has stamp and frame.
const fn stamped_pose_shape(stamped: &'static str, parts: &'static [(Need, &'static str, Part)]) -> Shape {
    Shape { role: Role::Pose, in_millimetres: false, by_place: false, stamped, parts }
}

const fn pose_shape(parts: &'static [(Need, &'static str, Part)]) -> Shape {
    stamped_pose_shape("", parts)
}

const fn scalar_shape(parts: &'static [(Need, &'static str, Part)]) -> Shape {
    Shape { role: Role::Scalar, in_millimetres: false, by_place: false, stamped: "", parts }
}

/// Every shape armcal reads.
pub(super) static SHAPES: &[Shape] = &[
    // sensor_msgs/JointState
    joint_shape(&[
        (Must, "name[]", Value(Slot::Joint)),
        (Must, "position[]", Value(Slot::Position)),
        (May, "effort[]", Value(Slot::Effort)),
    ]),
    // foxglove.JointStates
    joint_shape(&[
        (Must, "joints[].name", Value(Slot::Joint)),
        (Must, "joints[].position", Value(Slot::Position)),
        (May, "joints[].effort", Value(Slot::Effort)),
    ]),
    // control_msgs/DynamicJointState
    joint_shape(&[
        (Must, "joint_names[]", Value(Slot::Joint)),
        (Must, "interface_values[].interface_names[]", Value(Slot::Interface)),
        (Must, "interface_values[].values[]", Value(Slot::InterfaceValue)),
    ]),
    // control_msgs/JointTrajectoryControllerState since 2023
    joint_shape(&[
        (Must, "joint_names[]", Value(Slot::Joint)),
        (Must, "feedback.positions[]", Value(Slot::Position)),
        (May, "feedback.effort[]", Value(Slot::Effort)),
    ]),
    // control_msgs/JointTrajectoryControllerState before, and in ROS 1
    joint_shape(&[
        (Must, "joint_names[]", Value(Slot::Joint)),
        (Must, "actual.positions[]", Value(Slot::Position)),
        (May, "actual.effort[]", Value(Slot::Effort)),
    ]),
    // geometry_msgs/PoseStamped, foxglove.PoseInFrame
    pose_shape(&[(Must, "pose.position", Point), (Must, "pose.orientation", Quaternion)]),
    // geometry_msgs/PoseWithCovarianceStamped, nav_msgs/Odometry
    pose_shape(&[
        (Must, "pose.pose.position", Point),
        (Must, "pose.pose.orientation", Quaternion),
        (May, "child_frame_id", Value(Slot::Body)),
    ]),
    // geometry_msgs/PointStamped, foxglove.Point3InFrame
    pose_shape(&[(Must, "point", Point)]),
    // geometry_msgs/TransformStamped
    pose_shape(&[
        (Must, "transform.translation", Point),
        (Must, "transform.rotation", Quaternion),
        (Must, "child_frame_id", Value(Slot::Body)),
    ]),
    // tf2_msgs/TFMessage
    stamped_pose_shape(
        "transforms[]",
        &[
            (Must, "transforms[].transform.translation", Point),
            (Must, "transforms[].transform.rotation", Quaternion),
            (Must, "transforms[].child_frame_id", Value(Slot::Body)),
        ],
    ),
    // foxglove.FrameTransform
    pose_shape(&[
        (Must, "translation", Point),
        (Must, "rotation", Quaternion),
        (Must, "child_frame_id", Value(Slot::Body)),
    ]),
    // foxglove.FrameTransforms
    stamped_pose_shape(
        "transforms[]",
        &[
            (Must, "transforms[].translation", Point),
            (Must, "transforms[].rotation", Quaternion),
            (Must, "transforms[].child_frame_id", Value(Slot::Body)),
        ],
    ),
    // mocap4r2_msgs/RigidBodies, mocap_msgs/RigidBodies. The header of the list is the one its drivers fill.
    pose_shape(&[
        (Must, "rigidbodies[].pose.position", Point),
        (Must, "rigidbodies[].pose.orientation", Quaternion),
        (Must, "rigidbodies[].rigid_body_name", Value(Slot::Body)),
    ]),
    // motion_capture_tracking_interfaces/NamedPoseArray
    pose_shape(&[
        (Must, "poses[].pose.position", Point),
        (Must, "poses[].pose.orientation", Quaternion),
        (Must, "poses[].name", Value(Slot::Body)),
    ]),
    // geometry_msgs/PoseArray, foxglove.PosesInFrame
    Shape {
        role: Role::Pose,
        in_millimetres: false,
        by_place: true,
        stamped: "",
        parts: &[(Must, "poses[].position", Point), (Must, "poses[].orientation", Quaternion)],
    },
    // geometry_msgs/Pose
    pose_shape(&[(Must, "position", Point), (Must, "orientation", Quaternion)]),
    // vicon_bridge/Markers passes the millimetres of the Vicon SDK on
    // (vicon_bridge.cpp publishes `GetMarkerGlobalTranslation` unscaled).
    Shape {
        role: Role::Pose,
        in_millimetres: true,
        by_place: false,
        stamped: "",
        parts: &[
            (Must, "markers[].translation", Point),
            (Must, "markers[].marker_name", Value(Slot::Body)),
            (Must, "markers[].subject_name", Value(Slot::Subject)),
            (Must, "markers[].occluded", Value(Slot::Occluded)),
        ],
    },
    // mocap4r2_msgs/Markers
    pose_shape(&[
        (Must, "markers[].translation", Point),
        (Must, "markers[].marker_name", Value(Slot::Body)),
        (May, "markers[].marker_index", Value(Slot::BodyIndex)),
    ]),
    // mocap_msgs/Markers of 2021, numbered only
    pose_shape(&[(Must, "markers[].translation", Point), (Must, "markers[].index", Value(Slot::BodyIndex))]),
    // vicon_receiver/Position (before version 1), millimetres of the Vicon SDK
    Shape {
        role: Role::Pose,
        in_millimetres: true,
        by_place: false,
        stamped: "",
        parts: &[
            (Must, "x_trans", Value(Slot::X)),
            (Must, "y_trans", Value(Slot::Y)),
            (Must, "z_trans", Value(Slot::Z)),
            (Must, "x_rot", Value(Slot::Qx)),
            (Must, "y_rot", Value(Slot::Qy)),
            (Must, "z_rot", Value(Slot::Qz)),
            (Must, "w", Value(Slot::Qw)),
            (Must, "segment_name", Value(Slot::Body)),
            (May, "subject_name", Value(Slot::Subject)),
        ],
    },
    // sensor_msgs/Temperature
    scalar_shape(&[(Must, "temperature", Value(Slot::Value))]),
    // std_msgs/Float64 and its relatives
    scalar_shape(&[(Must, "data", Value(Slot::Value))]),
];

/// The fields to read out of a message, in the order of their definition.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Wanted {
    pub(super) fields: Vec<(usize, Want)>,
}

/// What to do with a field.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Want {
    /// Read its value, or all its values if it is a list.
    Value(Slot),
    /// Read fields inside it; a list of messages makes one item (a joint, a body) of each.
    Inside(Wanted),
}

impl Wanted {
    /// Whether any field inside is read into `slot`.
    pub(super) fn has(&self, slot: Slot) -> bool {
        self.fields.iter().any(|(_, want)| match want {
            Want::Value(s) => *s == slot,
            Want::Inside(inside) => inside.has(slot),
        })
    }

    fn insert(&mut self, index: usize, want: Want) {
        let at = self.fields.partition_point(|(i, _)| *i < index);
        self.fields.insert(at, (index, want));
    }
}

/// What a field is read as that the user names by its path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Names of joints.
    Names,
    /// Positions of joints.
    Positions,
    /// Efforts of joints.
    Efforts,
    /// Position of a body: a message with x, y, z.
    Position,
    /// Orientation of a body: a message with x, y, z, w.
    Orientation,
    /// The one number of an instrument or a thermometer.
    Value,
}

impl Place {
    fn part(self) -> Part {
        match self {
            Place::Names => Value(Slot::Joint),
            Place::Positions => Value(Slot::Position),
            Place::Efforts => Value(Slot::Effort),
            Place::Position => Point,
            Place::Orientation => Quaternion,
            Place::Value => Value(Slot::Value),
        }
    }

    /// What has to be there.
    fn needs(self) -> &'static str {
        match self {
            Place::Names => "texts",
            Place::Positions | Place::Efforts => "numbers",
            Place::Position => "message with x, y, z",
            Place::Orientation => "message with x, y, z, w",
            Place::Value => "number",
        }
    }
}

/// Where the values at these paths are, and the stamp and frame that belong to them.
pub(super) fn locate_fields(
    schema: &str,
    types: &Types,
    fields: &[(Place, &str)],
) -> Result<Wanted, DecodeError> {
    let mut wanted = Wanted::default();
    for &(place, path) in fields {
        let found = match path.strip_suffix('*').filter(|inside| inside.is_empty() || inside.ends_with('.')) {
            // One number is not a list of them.
            _ if place == Place::Value && has_list(path) => false,
            Some(inside) => add_all(types, &mut wanted, inside, place.part()),
            None => place.part().add(types, &mut wanted, path),
        };
        if !found {
            let present = fields_for(types, place, |_| true);
            return Err(DecodeError::NoField {
                schema: schema.to_owned(),
                path: path.to_owned(),
                needs: place.needs(),
                nearest: nearest_name(path, &present),
                present,
            });
        }
    }
    let path = fields.first().map_or("", |(_, path)| path);
    let dots: Vec<usize> = unquoted(path).filter(|(_, c)| *c == '.').map(|(at, _)| at).collect();
    let around = || dots.iter().rev().map(|end| &path[..*end]);
    _ = around().chain([""]).any(|inside| Frame.add(types, &mut wanted, inside));
    _ = [""].into_iter().chain(around()).any(|inside| Stamp.add(types, &mut wanted, inside));
    Ok(wanted)
}

/// Adds every field of the message at `inside` that fits, in the order of its definition.
fn add_all(types: &Types, wanted: &mut Wanted, inside: &str, part: Part) -> bool {
    let mut found = false;
    for path in readable_paths(types, part, |_| true) {
        let is_in = parent_of(&path) == inside.trim_end_matches('.') && !path.ends_with("[]");
        found |= is_in && part.add(types, wanted, &path);
    }
    found
}

/// Paths that are listed and searched, at most, and messages that they go into.
const MOST_PATHS: usize = 1000;
const DEEPEST: usize = 8;

/// The paths at which a part can be read.
fn readable_paths(types: &Types, part: Part, is_wanted: fn(&Field) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![(String::new(), 0, 0)];
    while let Some((inside, message, depth)) = open.pop() {
        let Some(message) = types.messages.get(message) else { continue };
        // The last is opened first: what it opens comes before its neighbours.
        for field in message.fields.iter().rev() {
            let list = if field.repeat == Repeat::Once { "" } else { "[]" };
            let path = format!("{inside}{}{list}", spelled(&field.name));
            if is_wanted(field) && part.add(types, &mut Wanted::default(), &path) {
                found.push(path.clone());
            }
            if let Kind::Message(inner) = field.kind
                && depth < DEEPEST
                && open.len() + found.len() < MOST_PATHS
            {
                open.push((path + ".", inner, depth + 1));
            }
        }
        if found.len() >= MOST_PATHS {
            break;
        }
    }
    found.sort();
    found
}

/// The paths at which a message of these types has what a place needs, in fields that are wanted.
fn fields_for(types: &Types, place: Place, is_wanted: fn(&Field) -> bool) -> Vec<String> {
    let mut found = readable_paths(types, place.part(), is_wanted);
    found.retain(|path| place != Place::Value || !has_list(path));
    found
}

/// The same where a measured quantity can be: not among whole numbers, which are counters, flags and pixels.
pub(super) fn quantities_for(types: &Types, place: Place) -> Vec<String> {
    fields_for(types, place, |field| {
        !matches!(field.kind, Kind::Number(Number::Unsigned(_) | Number::Signed(_)))
    })
}

/// The shape that fits these types, and where its values are.
pub(super) fn recognise(schema: &str, types: &Types) -> Result<(&'static Shape, Wanted), DecodeError> {
    SHAPES
        .iter()
        .find_map(|shape| shape.fit(types).map(|wanted| (shape, wanted)))
        .ok_or_else(|| DecodeError::Unknown { schema: schema.to_owned(), fields: types.field_names() })
}

impl Shape {
    /// Where the parts of this shape are in the message; `None` if one that must be there is not.
    fn fit(&self, types: &Types) -> Option<Wanted> {
        let mut wanted = Wanted::default();
        for &(need, path, part) in self.parts {
            let found = part.add(types, &mut wanted, path);
            if !found && need == Must {
                return None;
            }
        }
        if self.role == Role::Pose {
            Frame.add(types, &mut wanted, self.stamped);
        }
        Stamp.add(types, &mut wanted, self.stamped);
        Some(wanted)
    }
}

impl Part {
    /// Adds this part at `path` to what is wanted; false if the message does not have it.
    fn add(self, types: &Types, wanted: &mut Wanted, path: &str) -> bool {
        let under = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
        let all = |wanted: &mut Wanted, parts: &[(&str, Slot)]| {
            let mut with_all = wanted.clone();
            let found = parts.iter().all(|&(name, slot)| add_value(types, &mut with_all, &under(name), slot));
            if found {
                *wanted = with_all;
            }
            found
        };
        match self {
            Value(slot) => add_value(types, wanted, path, slot),
            Point => all(wanted, &[("x", Slot::X), ("y", Slot::Y), ("z", Slot::Z)]),
            Quaternion => all(wanted, &[("x", Slot::Qx), ("y", Slot::Qy), ("z", Slot::Qz), ("w", Slot::Qw)]),
            Frame => ["header.frame_id", "frame_id", "parent_frame_id"]
                .iter()
                .any(|name| add_value(types, wanted, &under(name), Slot::Frame)),
            Stamp => ["header.stamp", "timestamp", "stamp"].iter().any(|name| {
                // ROS 2; Foxglove JSON; protobuf; ROS 1's own `time` type.
                ["nanosec", "nsec", "nanos"].iter().any(|nanos| {
                    ["sec", "seconds"].iter().any(|seconds| {
                        let of = |part: &str| format!("{name}.{part}");
                        all(wanted, &[(&of(seconds), Slot::Seconds), (&of(nanos), Slot::Nanoseconds)])
                    })
                }) || add_value(types, wanted, &under(name), Slot::Time)
            }),
        }
    }
}

/// Adds the value at `path` to what is wanted; false if the path does not lead to a value that fits the slot.
fn add_value(types: &Types, wanted: &mut Wanted, path: &str, slot: Slot) -> bool {
    let Some(steps) = find_steps(types, 0, path, slot) else { return false };
    insert_path(wanted, &steps, slot);
    true
}

/// The fields that a path goes through, by their indices. A dot parts names where it can, before it is part of one.
fn find_steps(types: &Types, message: usize, path: &str, slot: Slot) -> Option<Vec<usize>> {
    let fields = || types.messages[message].fields.iter().enumerate();
    let (plain, dotted): (Vec<_>, Vec<_>) = fields().partition(|(_, field)| !field.name.contains('.'));
    plain.into_iter().chain(dotted).find_map(|(index, field)| match (step(path, field)?, field.kind) {
        ("", _) => fits_slot(field, slot).then(|| vec![index]),
        (rest, Kind::Message(inner)) => {
            let mut steps = find_steps(types, inner, rest, slot)?;
            steps.insert(0, index);
            Some(steps)
        }
        _ => None,
    })
}

/// Whether the values of a field can go into a slot.
fn fits_slot(field: &Field, slot: Slot) -> bool {
    match field.kind {
        Kind::Number(_) => !slot.is_text() && slot != Slot::Time,
        Kind::Text => slot.is_text(),
        Kind::Time => slot == Slot::Time,
        Kind::WideText | Kind::Message(_) | Kind::Other => false,
    }
}

fn insert_path(wanted: &mut Wanted, steps: &[usize], slot: Slot) {
    let [index, rest @ ..] = steps else { return };
    if rest.is_empty() {
        return wanted.insert(*index, Want::Value(slot));
    }
    let existing = wanted.fields.iter().position(|(i, _)| i == index);
    if existing.is_none() {
        wanted.insert(*index, Want::Inside(Wanted::default()));
    }
    if let Some((_, Want::Inside(inside))) = wanted.fields.iter_mut().find(|(i, _)| i == index) {
        insert_path(inside, rest, slot);
    }
}
