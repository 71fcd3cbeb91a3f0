//! Where a value of a message belongs in a row.

/// Where a value of a message belongs in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Slot {
    /// The stamp as one field of ROS 1's own `time` type; filled as seconds and nanoseconds.
    Time,
    /// Seconds of the stamp.
    Seconds,
    /// Nanoseconds of the stamp.
    Nanoseconds,
    /// Frame the pose is expressed in.
    Frame,
    /// Name of the tracked body.
    Body,
    /// Number of the tracked body, which names it where it has no name.
    BodyIndex,
    /// What the body is part of, as in `subject/marker`.
    Subject,
    /// Position.
    X,
    /// Position.
    Y,
    /// Position.
    Z,
    /// Orientation.
    Qx,
    /// Orientation.
    Qy,
    /// Orientation.
    Qz,
    /// Orientation.
    Qw,
    /// Flag: the sensor did not see the body.
    Occluded,
    /// Name of a joint.
    Joint,
    /// Position of a joint.
    Position,
    /// Effort of a joint.
    Effort,
    /// Name of a value of a joint, such as `position`.
    Interface,
    /// The value of that name.
    InterfaceValue,
    /// The one number of a scalar message.
    Value,
}

impl Slot {
    /// One bit per slot, to remember which were filled.
    pub(super) fn bit(self) -> u32 {
        1 << self as u32
    }

    /// Whether the slot takes text; all others take numbers.
    pub(super) fn is_text(self) -> bool {
        matches!(self, Slot::Frame | Slot::Body | Slot::Subject | Slot::Joint | Slot::Interface)
    }
}
