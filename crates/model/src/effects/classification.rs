//! How kinds of effects are told apart: their families, what shows them, where they act.

use serde::Serialize;

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
