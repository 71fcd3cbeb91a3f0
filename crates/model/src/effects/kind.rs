//! What the catalogue says about a kind of effect, what placing it takes and what it gives.

use super::classification::{Family, Lookalikes, Offered, Target, Toggle};
use super::nominal_arm::NominalArm;
use super::nominal_pose::NominalPose;
use super::physics::{AnyPhysics, Slot};
use super::session::Session;
use super::spec::EffectSpec;
use armcal_core::{Observation, Parameter, Unit};
use std::sync::Arc;

/// One entry of the catalogue.
pub struct EffectKind {
    /// Its name in specs and files: letters, digits, underscores.
    pub name: &'static str,
    /// Other mechanisms that are the same to the data.
    pub aliases: &'static [&'static str],
    /// One line.
    pub summary: &'static str,
    /// Which part of the world it belongs to.
    pub family: Family,
    /// What the user can switch to see it in a paired experiment.
    pub toggle: Toggle,
    /// Whether it acts at a joint.
    pub target: Target,
    /// How the catalogue offers it to the diagnosis.
    pub offered: Offered,
    /// Numbers that are not amplitudes.
    pub shapes: &'static [Shape],
    /// Amplitudes that physics does not let be negative, without the number of a joint: a spring yields with its load.
    pub never_negative: &'static [&'static str],
    /// Other entries that look alike in common data, though not in all.
    pub confused_with: &'static [&'static str],
    /// Whether its cause, a make of gear, bearing or encoder, is likely to be in every joint.
    pub of_a_make: bool,
    /// What to look at on the rig where it is named; empty where that is what its family asks for.
    pub look_at: &'static str,
    /// The measurement that tells it from anything else; empty where there is none of its own.
    pub told_by: &'static str,
    /// Whether it acts where the tip is tracked alone.
    pub where_tracked: bool,
    /// Effects that it is the same as to every motion.
    pub lookalikes: &'static [Lookalikes],
    /// Its source file, whose header is its documentation.
    pub source: &'static str,
    /// Puts it in its place, or says why it has none there.
    pub place: fn(&EffectContext<'_>) -> Result<Placement, String>,
}

impl EffectKind {
    /// What most entries have in common; each says the rest itself, and the contract tests ask for it.
    pub const PLAIN: EffectKind = EffectKind {
        name: "",
        aliases: &[],
        summary: "",
        family: Family::User,
        toggle: Toggle::None,
        target: Target::Joint,
        offered: Offered::Once,
        shapes: &[],
        never_negative: &[],
        confused_with: &[],
        of_a_make: false,
        look_at: "",
        told_by: "",
        where_tracked: false,
        lookalikes: &[],
        source: "",
        place: |_| Err("it has no physics".to_owned()),
    };

    /// Its documentation under the fixed headings: the header of its source file.
    pub fn docs(&self) -> String {
        self.source
            .lines()
            .map_while(|line| line.strip_prefix("//!"))
            .map(|line| line.strip_prefix(' ').unwrap_or(line))
            .collect::<Vec<_>>()
            .join("\n")
    }
}

impl std::fmt::Debug for EffectKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "EffectKind({})", self.name)
    }
}

/// The values of a shape worth trying, where it would be placed, for these observations.
pub type Values = fn(&EffectContext<'_>, &[Observation]) -> Vec<f64>;

/// A number of an effect that is not an amplitude.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Key in specs and files.
    pub name: &'static str,
    /// SI unit.
    pub unit: Unit,
    /// Value where none is given; without one the spec must say it.
    pub default: Option<f64>,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// What it means.
    pub meaning: &'static str,
    /// Whether it is a parameter (fixed unless freed); otherwise it names a part of the arm.
    pub parameter: bool,
    /// The values worth trying.
    pub values: Option<Values>,
}

/// One spec about to be placed.
pub struct EffectContext<'a> {
    /// The arm it is to act on.
    pub nominal: NominalArm<'a>,
    /// The observations it will explain.
    pub session: &'a Session,
    /// What was asked for.
    pub spec: &'a EffectSpec,
    /// Its entry in the catalogue.
    pub kind: &'static EffectKind,
    /// The nominal arm with all joints at zero.
    pub(crate) zero: &'a NominalPose,
}

/// An effect in its place: its amplitudes and its physics.
pub struct Placement {
    /// The amplitudes; their names are the quantities, without the spec.
    pub(crate) amplitudes: Vec<Parameter>,
    /// What they do.
    pub(crate) physics: Arc<dyn AnyPhysics>,
    /// Where it twists the path.
    pub(crate) slots: Vec<Slot>,
    /// Whether it distorts what the sensor sees.
    pub(crate) distorts: bool,
}

impl Placement {
    /// An effect that changes joints, parameters or seated points.
    pub fn new(amplitudes: Vec<Parameter>, physics: impl AnyPhysics + 'static) -> Placement {
        Placement { amplitudes, physics: Arc::new(physics), slots: Vec::new(), distorts: false }
    }

    /// An effect that twists the path at a slot.
    pub fn twisting(slot: Slot, amplitudes: Vec<Parameter>, physics: impl AnyPhysics + 'static) -> Placement {
        Placement { slots: vec![slot], ..Placement::new(amplitudes, physics) }
    }

    /// An effect that distorts what the sensor sees.
    pub fn distorting(amplitudes: Vec<Parameter>, physics: impl AnyPhysics + 'static) -> Placement {
        Placement { distorts: true, ..Placement::new(amplitudes, physics) }
    }
}
