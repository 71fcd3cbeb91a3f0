//! What the catalogue says about a kind of effect, and what placing it gives.

use super::context::EffectContext;
use super::physics::{AnyPhysics, Slot};
use armcal_core::{Observation, Parameter, Unit};
use serde::Serialize;
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

/// Effects that are the same to every motion, so that only another sensor or test tells them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lookalikes {
    /// What depends on the direction of arrival.
    LostMotion,
    /// Joints and links that give way.
    Springs,
    /// Changes at a moment.
    Moments,
    /// What makes every length another.
    Lengths,
    /// What depends on the angle of a joint.
    Turns,
    /// What creeps.
    Slow,
}

/// Families of mechanisms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Play and friction: what depends on the direction of arrival.
    LostMotion,
    /// What gives way under load.
    Elasticity,
    /// Gears, belts and encoders: what depends on the joint angle.
    Transmission,
    /// The shape of the arm.
    Geometry,
    /// Something moved or slipped once.
    Event,
    /// Something creeps with time or temperature.
    Drift,
    /// The position sensor.
    Sensor,
    /// The calibration board.
    Board,
    /// Clocks.
    Timing,
    /// A formula of the user, in a pipeline.
    User,
}

/// What can be switched while the pose stays, so that the effect shows in the difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Toggle {
    /// The direction of arrival.
    Direction,
    /// The way to the pose: from which side, and how far the joints came.
    Approach,
    /// The load at the tip.
    Load,
    /// Time.
    Time,
    /// The recording.
    Recording,
    /// The temperature.
    Temperature,
    /// Nothing.
    None,
}

impl Toggle {
    /// In words: what two visits to one pose differ in.
    pub fn word(self) -> &'static str {
        match self {
            Toggle::Direction => "arrival direction",
            Toggle::Approach => "approach",
            Toggle::Load => "load",
            Toggle::Time => "time",
            Toggle::Recording => "recording",
            Toggle::Temperature => "temperature",
            Toggle::None => "pose",
        }
    }
}

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// At one joint.
    Joint,
    /// On the whole: its spec names no joint.
    Whole,
    /// At one marker.
    Marker,
}

/// How the catalogue offers an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Offered {
    /// For every target.
    Once,
    /// For every target in every recording, and as a step at any dwell.
    Events,
    /// For every target in every recording.
    Recordings,
    /// Only with its shape scanned.
    Scanned,
    /// Not by itself: it belongs to the noise, or to the user.
    Never,
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
