//! What stands fixed in the world beside the arms, and is measured against: points, planes, and the lengths between.
//!
//! ```text
//! in a point:      0 = point - tip                                  3 rows [m]
//! at a distance:   0 = |place - tip| - (length + reading)           1 row  [m]
//! above a plane:   0 = reading - z . (tip - plane)                  1 row  [m]
//! ```
//!
//! A point that the tip is brought into again and again, with the arm standing otherwise each time, calibrates it without any
//! sensor; so do distances by a ballbar or a wire, and a plane that is touched (Driels 1993; Ikits and Hollerbach 1997; Zhuang
//! and Roth 1996, ch. 8 and 9).

use crate::segment::{Freedom, Segment};
use crate::{Frame, Knowledge, ModelError};
use armcal_core::{Parameter, Role, Unit};

/// A point or a plane that stands fixed in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedPlace {
    /// Where it is: world_from_place. Of a plane z is its normal.
    pub frame: Frame,
    /// Whether it is a plane: only its offset along its normal, and its tilt about x and y, have a meaning then.
    pub is_plane: bool,
}

/// A length that a distance counts from: a rigid link between two tips, what a ballbar has where it reads zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Length {
    /// What has it: the parameter is `<name>.length`.
    pub name: String,
    /// The length before the fit [m].
    pub length_m: f64,
    /// How well that is known.
    pub knowledge: Knowledge,
}

/// A fixed place in a model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Standing {
    pub name: String,
    pub is_plane: bool,
    /// From the world to it.
    pub segment: Segment,
}

impl FixedPlace {
    /// The place in a model, whose parameters start at index `first`, and these.
    pub(crate) fn standing(&self, first: usize) -> Result<(Standing, Vec<Parameter>), ModelError> {
        let freedom = if self.is_plane { Freedom::Plane } else { Freedom::Position };
        let (segment, parameters) = self.frame.segment_with(freedom, first)?;
        Ok((Standing { name: self.frame.name.clone(), is_plane: self.is_plane, segment }, parameters))
    }
}

impl Length {
    /// A rigid link with a ball joint at either end, between the tips of two arms.
    pub fn of_link(length_m: f64, knowledge: Knowledge) -> Length {
        Length { name: "link".into(), length_m, knowledge }
    }

    /// It as a parameter [m].
    ///
    /// # Errors
    /// A length that is negative or no number, a standard error that is no positive number.
    pub(crate) fn parameter(&self) -> Result<Parameter, ModelError> {
        let bad = |problem: String| Err(ModelError::BadLength { name: self.name.clone(), problem });
        let length_m = self.length_m;
        if !(length_m.is_finite() && length_m >= 0.0) {
            return bad(format!("is {length_m} m; give it in millimetres, zero or more"));
        }
        let (free, prior_sigma, role) = match self.knowledge {
            Knowledge::Given => (false, None, Role::KnownFrame),
            Knowledge::Measured { sigma_m, .. } if sigma_m.is_finite() && sigma_m > 0.0 => {
                (true, Some(sigma_m), Role::KnownFrame)
            }
            Knowledge::Measured { sigma_m, .. } => {
                return bad(format!(
                    "has a standard error of {sigma_m} m; give one above zero, or call it given"
                ));
            }
            Knowledge::Estimated => (true, None, Role::EstimatedFrame),
        };
        let (name, meaning) =
            (format!("{}.length", self.name), format!("distance that {} stands for", self.name));
        let fixed = Parameter::fixed(name, Unit::Metre, length_m, role, meaning);
        Ok(Parameter { lower: 0.0, prior_sigma, free, ..fixed })
    }
}
