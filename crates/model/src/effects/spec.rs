//! Naming one effect in one place: `backlash:1`, `zero_slip:2@1`, `tool_shift@1.17`, `periodic:1,frequency=30`.
//!
//! Grammar: `kind [":" place] ["@" recording ["." dwell ["-" dwell]]] {"," shape "=" number}`. The place is a
//! joint, by its number from 1 or its name, or a marker by its name; recordings and dwells count from 0, as [`DwellId`] does. `@1` is in recording 1 only;
//! `@1.17` is from dwell 17 of recording 1 to the end of the session; `@1.17-25` in its dwells 17 to 25 only.

use super::classification::{Family, Target};
use super::overrides::Override;
use crate::ModelError;
use crate::error::similar_name_hint;
use armcal_core::DwellId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One effect in one place.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EffectSpec {
    /// Its kind: the name of an entry of the catalogue.
    pub kind: String,
    /// Index of its joint, from 0.
    pub target: Option<usize>,
    /// Name of its marker.
    pub marker: Option<String>,
    /// When it acts; always, where nothing is said.
    pub since: Option<Since>,
    /// Shapes that differ from their defaults, in the order they were given.
    pub shape: Vec<(String, f64)>,
    /// What the user says about its parameters, by quantity.
    pub overrides: BTreeMap<String, Override>,
    /// The formula of an `expression`.
    pub expression: Option<Expression>,
}

/// A user's formula.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Expression {
    /// Its name in specs and parameter names.
    pub name: String,
    /// The formula.
    pub formula: String,
    /// A joint, a parameter of the path, `lengths` (the relative growth of all of them), or `world.x`, `world.y`,
    /// `world.z`.
    pub acts_on: String,
}

/// When an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Since {
    /// In this recording only.
    Recording(usize),
    /// From this dwell on, to the end of the session.
    Dwell(DwellId),
    /// In these dwells of one recording only.
    Dwells {
        /// The first of them.
        first: DwellId,
        /// Number of the last of them.
        last: usize,
    },
}

impl Since {
    /// Whether the effect acts in this dwell.
    pub fn holds(&self, dwell: DwellId) -> bool {
        match self {
            Since::Recording(recording) => dwell.recording == *recording,
            Since::Dwell(first) => dwell >= *first,
            Since::Dwells { first, last } => {
                dwell.recording == first.recording && (first.dwell..=*last).contains(&dwell.dwell)
            }
        }
    }

    /// Whether another one tells of the same moment, its dwells at most so many apart.
    pub fn near(&self, other: &Since, dwells: usize) -> bool {
        let close = |a: usize, b: usize| a.abs_diff(b) <= dwells;
        let begin = |a: &DwellId, b: &DwellId| a.recording == b.recording && close(a.dwell, b.dwell);
        match (self, other) {
            (Since::Recording(a), Since::Recording(b)) => a == b,
            (Since::Dwell(a), Since::Dwell(b)) => begin(a, b),
            (Since::Dwells { first: a, last: x }, Since::Dwells { first: b, last: y }) => {
                begin(a, b) && close(*x, *y)
            }
            _ => false,
        }
    }
}

impl std::fmt::Display for Since {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Since::Recording(recording) => write!(f, "{recording}"),
            Since::Dwell(dwell) => write!(f, "{}.{}", dwell.recording, dwell.dwell),
            Since::Dwells { first, last } => write!(f, "{}.{}-{last}", first.recording, first.dwell),
        }
    }
}

impl std::str::FromStr for Since {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Since, &'static str> {
        let number = |text: &str| {
            text.parse().map_err(|_| {
                "expected RECORDING, RECORDING.DWELL or RECORDING.FIRST-LAST, counted from 0, after \"@\""
            })
        };
        let Some((recording, dwells)) = text.split_once('.') else {
            return Ok(Since::Recording(number(text)?));
        };
        let recording = number(recording)?;
        let Some((first, last)) = dwells.split_once('-') else {
            return Ok(Since::Dwell(DwellId { recording, dwell: number(dwells)? }));
        };
        let (first, last) = (DwellId { recording, dwell: number(first)? }, number(last)?);
        if last < first.dwell {
            return Err("the last dwell after \"@\" comes before the first");
        }
        Ok(Since::Dwells { first, last })
    }
}

/// What the name of an effect tells without an arm at hand: its kind with its place, and when it acts; none where that
/// is no moment. Shapes are left away.
pub fn place_and_moment(spec: &str) -> Option<(&str, Option<Since>)> {
    let head = spec.split_once(',').map_or(spec, |(head, _)| head);
    match head.split_once('@') {
        None => Some((head, None)),
        Some((place, since)) => Some((place, Some(since.parse().ok()?))),
    }
}

impl EffectSpec {
    /// An effect on the whole, always, with default shapes.
    pub fn new(kind: impl Into<String>) -> EffectSpec {
        EffectSpec { kind: kind.into(), ..EffectSpec::default() }
    }

    /// The same at a joint (index from 0).
    pub fn at(self, joint: usize) -> EffectSpec {
        EffectSpec { target: Some(joint), ..self }
    }

    /// The same at a marker.
    pub fn at_marker(self, name: &str) -> EffectSpec {
        EffectSpec { marker: Some(name.to_owned()), ..self }
    }

    /// The same at another time.
    pub fn since(self, since: Since) -> EffectSpec {
        EffectSpec { since: Some(since), ..self }
    }

    /// The same with another shape.
    pub fn with(mut self, shape: &str, value: f64) -> EffectSpec {
        self.shape.retain(|(name, _)| name != shape);
        self.shape.push((shape.to_owned(), value));
        self
    }

    /// Reads a spec; errors name what is not understood and what is known.
    pub fn parse(text: &str, joint_names: &[String]) -> Result<EffectSpec, ModelError> {
        let bad = |problem: String| ModelError::BadEffect { effect: text.to_owned(), problem };
        let mut parts = text.split(',').map(str::trim);
        let head = parts.next().unwrap_or_default();
        let (place, since) = head.split_once('@').map_or((head, None), |(place, since)| (place, Some(since)));
        let (kind, target) = place.split_once(':').map_or((place, None), |(kind, joint)| (kind, Some(joint)));
        let mut spec = EffectSpec::new(kind);
        if spec.kind()?.family == Family::User {
            return Err(bad("write a formula as an [[effects]] table".to_owned()));
        }
        match (target, spec.kind()?.target) {
            // Which markers there are, the model knows.
            (Some(marker), Target::Marker) => spec.marker = Some(marker.to_owned()),
            (Some(joint), _) => spec.target = Some(joint_index(joint, joint_names).map_err(bad)?),
            (None, _) => {}
        }
        spec.since = since.map(str::parse).transpose().map_err(|problem: &str| bad(problem.to_owned()))?;
        for part in parts {
            let (name, value) = part
                .split_once('=')
                .and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)))
                .ok_or_else(|| bad(format!("\"{part}\" is not of the form shape=number")))?;
            spec = spec.with(name, value);
        }
        Ok(spec)
    }

    /// Whether what is said of this one holds for another: where it names no joint, no time or no shape, for every one.
    pub fn covers(&self, other: &EffectSpec) -> bool {
        self.kind == other.kind
            && (self.target.is_none() || self.target == other.target)
            && (self.marker.is_none() || self.marker == other.marker)
            && (self.since.is_none() || self.since == other.since)
            && self.shape.iter().all(|said| other.shape.contains(said))
    }
}

impl std::fmt::Display for EffectSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.kind)?;
        if let Some(expression) = &self.expression {
            write!(f, ":{}", expression.name)?;
        }
        if let Some(joint) = self.target {
            write!(f, ":{}", joint + 1)?;
        }
        if let Some(marker) = &self.marker {
            write!(f, ":{marker}")?;
        }
        if let Some(since) = &self.since {
            write!(f, "@{since}")?;
        }
        self.shape.iter().try_for_each(|(name, value)| write!(f, ",{name}={value}"))
    }
}

/// The index of a joint by number from 1 or by name; what is wrong otherwise.
pub(crate) fn joint_index(text: &str, joint_names: &[String]) -> Result<usize, String> {
    if let Ok(number) = text.parse::<usize>() {
        let within = (1..=joint_names.len()).contains(&number);
        let wrong = || format!("there is no joint {number}; the arm has joints 1 to {}", joint_names.len());
        return if within { Ok(number - 1) } else { Err(wrong()) };
    }
    joint_names.iter().position(|name| name == text).ok_or_else(|| {
        let hint = similar_name_hint(text, joint_names.iter().map(String::as_str));
        format!("there is no joint \"{text}\"{hint} The joints are {}", joint_names.join(", "))
    })
}
