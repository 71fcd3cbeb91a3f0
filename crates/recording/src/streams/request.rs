//! What is asked of a recording.

use crate::LengthUnit;
use crate::decode::{Place, Role};

/// One stream asked for.
#[derive(Debug, Clone)]
pub(crate) struct Request<'a> {
    pub role: &'static str,
    /// Which of several of this role.
    pub name: Option<&'a str>,
    pub topic: &'a str,
    pub kind: Kind<'a>,
    /// Where its values are, if the pipeline says so.
    pub fields: Vec<(Place, &'a str)>,
}

/// What to read out of the messages.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind<'a> {
    Joints {
        wanted: &'a [String],
    },
    Pose {
        body: Option<&'a str>,
        frame: Option<&'a str>,
        unit: LengthUnit,
    },
    /// Every body in every frame.
    Transforms {
        unit: LengthUnit,
    },
    Scalar,
}

impl Kind<'_> {
    pub fn role(&self) -> Role {
        match self {
            Kind::Joints { .. } => Role::Joints,
            Kind::Pose { .. } | Kind::Transforms { .. } => Role::Pose,
            Kind::Scalar => Role::Scalar,
        }
    }
}
