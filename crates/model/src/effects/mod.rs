//! Effects: what makes the arm differ from its rigid geometry. One file, one line of the list below.
//!
//! An effect is a [`Physics`](physics::Physics) in a file of its own, whose header is its documentation under
//! fixed headings, and an [`EffectKind`] that says what it is called, where it can act and with which
//! parameters. [`catalogue`] is the only registration: specs, files, help texts, the candidates of the diagnosis
//! and the contract tests iterate it. A program that embeds armcal adds kinds of its own with [`register`].
//!
//! The prediction with effects is `B A_1(q + dq, p + dp) ... A_n T`, with small twists between the segments where
//! an effect bends or shifts something; what each effect adds to `dq`, `dp` and the twists depends only on its own
//! parameters and on the [`Drivers`] of the observation. So one pass of dual numbers through each effect and the
//! product rule of `path` give exact columns, and zero amplitudes give the rigid prediction to the last bit.
//!
//! To add one, start from `eccentricity.rs` (a joint), `tool_shift.rs` (a parameter), `frame_drift.rs` (a twist) or
//! `sensor_scale.rs` (what is seen), and name the file below: as a module, and in the catalogue.

mod algebra;
mod among_all;
mod arm_compliance;
mod axis_tilt;
mod backlash;
mod base_compliance;
mod bearing_compliance;
mod belt_backlash;
mod belt_compliance;
mod belt_coupling;
mod board_scale;
mod board_shift;
mod classification;
mod clock_offset;
mod compliance;
mod context;
mod crossed_backlash;
mod declared;
mod drivers;
mod eccentricity;
mod effort_compliance;
mod error_curve;
mod expression;
mod formula;
mod frame_drift;
mod frame_shift;
mod friction_windup;
mod gear_ratio;
mod gravity_backlash;
mod hardening_compliance;
mod kind;
mod link_bending;
mod marker_shift;
mod measure;
mod nominal_arm;
mod nominal_pose;
mod overrides;
mod periodic;
mod physics;
mod placed;
mod play;
pub mod prelude;
mod seat_offset;
mod second_harmonic;
mod sensor_scale;
mod session;
mod spec;
mod state;
mod table;
mod thermal_growth;
mod tip_marker_offset;
mod tip_marker_sag;
mod tip_marker_shift;
mod tool_shift;
mod torque_terms;
mod undeclared_load;
mod unsettled_reading;
mod volume_distortion;
mod warm_up;
mod zero_drift;
mod zero_slip;

#[cfg(test)]
mod tests;

pub use classification::{Family, Lookalikes, Offered, Target, Toggle};
pub use declared::is_of_effect;
pub use drivers::{Drivers, Torque};
pub use kind::{EffectKind, Shape};
pub use overrides::Override;
pub use placed::PlacedEffect;
pub use session::Session;
pub use spec::{EffectSpec, Expression, Since, place_and_moment};
pub use table::{EffectTable, JointReference, effects_toml, tables_toml};

pub(crate) use declared::Declared;
pub(crate) use nominal_arm::NominalArm;
pub(crate) use nominal_pose::NominalPose;
pub(crate) use placed::{Effects, place_effect};
pub(crate) use state::SEATED;

use crate::error::most_similar;
use crate::{ModelError, registry};
use std::sync::OnceLock;

/// The entries of the catalogue; each is called as its file, whose header is its documentation.
macro_rules! catalogue {
    ($($file:ident,)*) => {
        &[$(&EffectKind {
            name: stringify!($file),
            source: include_str!(concat!(stringify!($file), ".rs")),
            ..$file::KIND
        }),*]
    };
}

/// Every kind of effect, in the order in which people read about them.
static CATALOGUE: &[&EffectKind] = catalogue![
    backlash,
    gravity_backlash,
    friction_windup,
    crossed_backlash,
    belt_backlash,
    compliance,
    arm_compliance,
    hardening_compliance,
    effort_compliance,
    belt_compliance,
    link_bending,
    base_compliance,
    bearing_compliance,
    undeclared_load,
    eccentricity,
    second_harmonic,
    periodic,
    error_curve,
    gear_ratio,
    belt_coupling,
    axis_tilt,
    zero_slip,
    tool_shift,
    tip_marker_shift,
    marker_shift,
    frame_shift,
    board_shift,
    unsettled_reading,
    zero_drift,
    frame_drift,
    thermal_growth,
    warm_up,
    tip_marker_offset,
    tip_marker_sag,
    sensor_scale,
    volume_distortion,
    board_scale,
    seat_offset,
    clock_offset,
    expression,
];

/// The catalogue of this process: ours, then what was registered before it was first read.
static ALL: OnceLock<Vec<&'static EffectKind>> = OnceLock::new();

/// Every kind of effect, in the order in which people read about them.
pub fn catalogue() -> &'static [&'static EffectKind] {
    ALL.get_or_init(|| CATALOGUE.to_vec())
}

/// A kind by its name.
pub fn find(kind: &str) -> Option<&'static EffectKind> {
    catalogue().iter().copied().find(|entry| entry.name == kind)
}

impl EffectSpec {
    /// The entry of the catalogue; errors name the nearest one.
    pub fn kind(&self) -> Result<&'static EffectKind, ModelError> {
        find(&self.kind).ok_or_else(|| {
            let names = || catalogue().iter().map(|entry| entry.name);
            ModelError::UnknownEffect {
                kind: self.kind.clone(),
                nearest: most_similar(&self.kind, names()),
                known: names().collect::<Vec<_>>().join(", "),
            }
        })
    }
}

/// Adds kinds of effects to the catalogue, after its own: once, before a model, a spec or a pipeline is read, so that one process
/// has one catalogue.
///
/// # Errors
/// The catalogue is in use already; a name that a spec cannot have, or that there is already; no family.
pub fn register(kinds: &[&'static EffectKind]) -> Result<(), ModelError> {
    if let Some(kind) = kinds.iter().find(|kind| kind.family == Family::User) {
        let problem = "its family is that of formulas in a pipeline: say which it is of";
        return Err(ModelError::NotRegistered { name: kind.name.to_owned(), problem });
    }
    registry::register(&ALL, CATALOGUE, kinds, |kind| kind.name)
}
