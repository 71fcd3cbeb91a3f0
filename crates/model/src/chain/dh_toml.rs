//! DH tables as TOML, read and written back. Millimetres and degrees in the file, SI inside.
//!
//! ```toml
//! name = "two links"
//! convention = "standard"        # default; or "modified" (Craig)
//!
//! [deviation]                    # optional; these are the defaults. Without it, fits learn how near to nominal the arm is
//! bound_mm = 5.0
//! bound_deg = 2.0
//! prior_sigma_mm = 4.0
//! prior_sigma_deg = 1.6
//!
//! [[rows]]
//! name = "joint1"
//! joint = "revolute"             # default; "prismatic"; "fixed"
//! theta_deg = 0.0                # the joint value is added to theta (prismatic: to d)
//! d_mm = { nominal = 76.0, bound = 2.0, prior_sigma = 1.0 }   # own deviation, in the entry's unit
//! a_mm = { nominal = 0.0, free = false }
//! alpha_deg = 90.0
//! beta_deg = 0.0                 # optional: Hayati's Ry(beta) at the end of the row
//! limits_deg = [-170.0, 170.0]   # optional: what the joint can read; limits_mm where it slides
//! ```

use super::{Chain, Source};
use crate::deviation::{check_positive, from_display, robot_parameter};
use crate::segment::{Geometry, Joint, Motion, Segment};
use crate::{Deviation, ModelError};
use armcal_core::{Parameter, ParameterKind, Unit};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

/// The file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DhTable {
    name: String,
    #[serde(default)]
    convention: Convention,
    deviation: Option<Deviation>,
    rows: Vec<Row>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Convention {
    #[default]
    Standard,
    Modified,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum JointKind {
    #[default]
    Revolute,
    Prismatic,
    Fixed,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    name: String,
    #[serde(default)]
    joint: JointKind,
    theta_deg: Entry,
    d_mm: Entry,
    a_mm: Entry,
    alpha_deg: Entry,
    beta_deg: Option<Entry>,
    limits_deg: Option<[f64; 2]>,
    limits_mm: Option<[f64; 2]>,
}

/// A number, or a table that says more about it; in the unit of its key.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    nominal: f64,
    free: bool,
    bound: Option<f64>,
    prior_sigma: Option<f64>,
}

/// One entry of a row with its key, its unit and its part in the name and meaning of the parameter.
struct Field<'a> {
    key: &'static str,
    quantity: &'static str,
    unit: Unit,
    meaning: &'static str,
    entry: &'a Entry,
}

impl Chain {
    /// Reads a DH table; `path` is only named in errors.
    ///
    /// Every number of the table becomes a parameter `<row>.theta`, `.d`, `.a`, `.alpha`(, `.beta`). Errors
    /// name the line or the key: malformed TOML, unknown keys, numbers that are not finite, deviations that
    /// are not positive, rows without or with the same name, no moving joint.
    pub fn from_dh_toml(text: &str, path: &Path) -> Result<Chain, ModelError> {
        let table: DhTable = toml::from_str(text)
            .map_err(|cause| ModelError::DhToml { path: path.to_owned(), cause: Box::new(cause) })?;
        table.check(path)?;
        Ok(table.into_chain())
    }

    /// The same numbers read by the other convention (standard by Craig's modified one, and the reverse); none where the
    /// chain came from a URDF.
    pub fn in_other_convention(&self) -> Option<Chain> {
        let Source::Dh(table) = &self.source else { return None };
        let convention = match table.convention {
            Convention::Standard => Convention::Modified,
            Convention::Modified => Convention::Standard,
        };
        Some(DhTable { convention, ..table.clone() }.into_chain())
    }

    /// The DH table with the numbers of a row and the next one exchanged, names and joints staying where they are; none
    /// where there are no such rows.
    pub fn with_rows_exchanged(&self, row: usize) -> Option<Chain> {
        let Source::Dh(table) = &self.source else { return None };
        let mut table = table.clone();
        let (a, b) = (table.rows.get(row)?.clone(), table.rows.get(row + 1)?.clone());
        table.rows[row] = Row { name: a.name.clone(), ..b.clone() }.with_joint_of(&a);
        table.rows[row + 1] = Row { name: b.name.clone(), ..a }.with_joint_of(&b);
        Some(table.into_chain())
    }

    /// The DH table with calibrated numbers, in the same format: everything else as it was read.
    ///
    /// `values` is a parameter vector that begins with the chain's parameters, such as a model's. Errors
    /// when the chain came from a URDF or `values` is too short.
    pub fn to_dh_toml(&self, values: &[f64]) -> Result<String, ModelError> {
        let Source::Dh(table) = &self.source else {
            return Err(ModelError::WrongFormat { model: self.name.clone(), format: "DH table" });
        };
        if values.len() < self.parameters.len() {
            return Err(ModelError::ParameterCount { actual: values.len(), expected: self.parameters.len() });
        }
        Ok(table.with_values(&self.parameters, values).to_toml())
    }
}

/// A row of a DH table at some values, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct DhRow {
    /// Its name.
    pub name: String,
    /// How its joint moves; none of a fixed row.
    pub motion: Option<Motion>,
    /// Angle about z, without the joint's reading [rad].
    pub theta_rad: f64,
    /// Offset along z, without the joint's reading [m].
    pub d_m: f64,
    /// Length along x [m].
    pub a_m: f64,
    /// Twist about x [rad].
    pub alpha_rad: f64,
    /// Hayati's tilt about y [rad]; zero where the row has none.
    pub beta_rad: f64,
}

impl Chain {
    /// The rows of the DH table that it came from, at these `values` of its parameters, and their convention: `standard` or
    /// `modified`; none where it came from a URDF.
    pub fn dh_rows(&self, values: &[f64]) -> Option<(&'static str, Vec<DhRow>)> {
        let Source::Dh(table) = &self.source else { return None };
        let convention = match table.convention {
            Convention::Standard => "standard",
            Convention::Modified => "modified",
        };
        let row = |segment: &Segment| {
            let own = &values[segment.parameters.clone()];
            DhRow {
                name: segment.frame.clone().unwrap_or_default(),
                motion: segment.joint.map(|joint| joint.motion),
                theta_rad: own[0],
                d_m: own[1],
                a_m: own[2],
                alpha_rad: own[3],
                beta_rad: own.get(4).copied().unwrap_or(0.0),
            }
        };
        Some((convention, self.segments.iter().map(row).collect()))
    }
}

impl DhTable {
    fn check(&self, path: &Path) -> Result<(), ModelError> {
        self.deviation.unwrap_or_default().check(path)?;
        let mut names = BTreeSet::new();
        for (index, row) in self.rows.iter().enumerate() {
            if row.name.is_empty() {
                return Err(ModelError::NamelessRow { path: path.to_owned(), index: index + 1 });
            }
            if !names.insert(&row.name) {
                return Err(ModelError::DuplicateRow { path: path.to_owned(), row: row.name.clone() });
            }
            row.check_limits(path)?;
            for field in row.fields() {
                let key = format!("{}.{}", row.name, field.key);
                let value = field.entry.nominal;
                if !value.is_finite() {
                    let expected = "a finite number";
                    return Err(ModelError::BadValue { path: path.to_owned(), key, value, expected });
                }
                for (what, value) in [("bound", field.entry.bound), ("prior_sigma", field.entry.prior_sigma)]
                {
                    check_positive(path, &format!("{key}.{what}"), value.unwrap_or(1.0))?;
                }
            }
        }
        if self.rows.iter().all(|row| row.joint == JointKind::Fixed) {
            return Err(ModelError::NoJoint { path: path.to_owned() });
        }
        Ok(())
    }

    fn into_chain(self) -> Chain {
        let (mut segments, mut parameters) = (Vec::new(), Vec::new());
        let (mut joint_names, mut joint_limits) = (Vec::new(), Vec::new());
        for row in &self.rows {
            let motion = match row.joint {
                JointKind::Revolute => Some(Motion::Revolute),
                JointKind::Prismatic => Some(Motion::Prismatic),
                JointKind::Fixed => None,
            };
            let joint = motion.map(|motion| Joint::read(joint_names.len(), motion));
            if joint.is_some() {
                joint_names.push(row.name.clone());
                joint_limits.push(row.limits());
            }
            let hayati = row.beta_deg.is_some();
            let geometry = match self.convention {
                Convention::Standard => Geometry::StandardDh { hayati },
                Convention::Modified => Geometry::ModifiedDh { hayati },
            };
            let first = parameters.len();
            parameters.extend(row.fields().map(|field| field.parameter(row, self.deviation)));
            let parameters = first..parameters.len();
            let parent = segments.len().checked_sub(1);
            let frame = Some(row.name.clone());
            segments.push(Segment { parent, frame, geometry, joint, parameters, body: None });
        }
        let (name, end) = (self.name.clone(), segments.len().checked_sub(1));
        let (source, masses) = (Source::Dh(self), None);
        Chain { name, segments, end, parameters, joint_names, joint_limits, source, masses }
    }

    /// Replaces the nominal number of every entry whose value has changed, so that the others keep every digit.
    fn with_values(&self, parameters: &[Parameter], values: &[f64]) -> DhTable {
        let mut table = self.clone();
        let entries = table.rows.iter_mut().flat_map(|row| {
            [&mut row.theta_deg, &mut row.d_mm, &mut row.a_mm, &mut row.alpha_deg]
                .into_iter()
                .chain(&mut row.beta_deg)
        });
        for ((entry, parameter), value) in entries.zip(parameters).zip(values) {
            if *value != parameter.nominal {
                entry.nominal = parameter.unit.to_display(*value);
            }
        }
        table
    }

    fn to_toml(&self) -> String {
        let mut text =
            format!("name = {}\nconvention = {}\n", toml_of(&self.name), toml_of(&self.convention));
        let declared = self.deviation.map(|d| {
            [
                ("\n[deviation]\nbound_mm", d.bound_mm),
                ("bound_deg", d.bound_deg),
                ("prior_sigma_mm", d.prior_sigma_mm),
                ("prior_sigma_deg", d.prior_sigma_deg),
            ]
        });
        for (key, value) in declared.into_iter().flatten() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{key} = {value:?}");
        }
        for row in &self.rows {
            let (name, joint) = (toml_of(&row.name), toml_of(&row.joint));
            let _ = write!(text, "\n[[rows]]\nname = {name}\njoint = {joint}\n");
            for field in row.fields() {
                let _ = writeln!(text, "{} = {}", field.key, field.entry.to_toml());
            }
            for (key, limits) in row.declared_limits() {
                let _ = writeln!(text, "{key} = {limits:?}");
            }
        }
        text
    }
}

impl Row {
    /// This row where the joint of another one is.
    fn with_joint_of(self, other: &Row) -> Row {
        Row { joint: other.joint, limits_deg: other.limits_deg, limits_mm: other.limits_mm, ..self }
    }

    fn declared_limits(&self) -> impl Iterator<Item = (&'static str, [f64; 2])> {
        let both = [("limits_deg", self.limits_deg), ("limits_mm", self.limits_mm)];
        both.into_iter().filter_map(|(key, limits)| Some((key, limits?)))
    }

    /// Lowest and highest reading [rad], [m].
    fn limits(&self) -> Option<[f64; 2]> {
        let of = |unit, limits: Option<[f64; 2]>| limits.map(|l| l.map(|v| from_display(unit, v)));
        of(Unit::Radian, self.limits_deg).or(of(Unit::Metre, self.limits_mm))
    }

    fn check_limits(&self, path: &Path) -> Result<(), ModelError> {
        let own = match self.joint {
            JointKind::Revolute => "limits_deg",
            JointKind::Prismatic => "limits_mm",
            JointKind::Fixed => "",
        };
        for (key, [low, high]) in self.declared_limits() {
            let refuse = |value, expected| {
                let key = format!("{}.{key}", self.name);
                Err(ModelError::BadValue { path: path.to_owned(), key, value, expected })
            };
            if key != own {
                return refuse(
                    low,
                    "limits_deg of a revolute joint, limits_mm of a prismatic one, none of a fixed one",
                );
            }
            if !(low.is_finite() && high.is_finite() && low < high) {
                return refuse(high, "two finite numbers, the higher one after the lower one");
            }
        }
        Ok(())
    }

    fn fields(&self) -> impl Iterator<Item = Field<'_>> {
        let field = |key, quantity, unit, meaning, entry| Field { key, quantity, unit, meaning, entry };
        let (mm, deg) = (Unit::Metre, Unit::Radian);
        [
            field(
                "theta_deg",
                "theta",
                deg,
                "angle about z (for a revolute joint: its zero)",
                &self.theta_deg,
            ),
            field("d_mm", "d", mm, "offset along z (for a prismatic joint: its zero)", &self.d_mm),
            field("a_mm", "a", mm, "length along x", &self.a_mm),
            field("alpha_deg", "alpha", deg, "twist about x", &self.alpha_deg),
        ]
        .into_iter()
        .chain(self.beta_deg.iter().map(move |entry| {
            field("beta_deg", "beta", deg, "Hayati's tilt of the next axis about y", entry)
        }))
    }
}

impl Field<'_> {
    fn kind(&self, joint: JointKind) -> ParameterKind {
        match (joint, self.quantity) {
            (JointKind::Revolute, "theta") | (JointKind::Prismatic, "d") => ParameterKind::JointZero,
            _ if self.unit == Unit::Metre => ParameterKind::Length,
            _ => ParameterKind::Angle,
        }
    }

    fn parameter(&self, row: &Row, declared: Option<Deviation>) -> Parameter {
        let deviation = declared.unwrap_or_default();
        let own = |value: Option<f64>, default: f64| value.map_or(default, |v| from_display(self.unit, v));
        let parameter = robot_parameter(
            format!("{}.{}", row.name, self.quantity),
            self.unit,
            from_display(self.unit, self.entry.nominal),
            own(self.entry.bound, deviation.bound(self.unit)),
            own(self.entry.prior_sigma, deviation.prior_sigma(self.unit)),
            format!("{}: {}", row.name, self.meaning),
        );
        let known = declared.is_some() || self.entry.bound.is_some() || self.entry.prior_sigma.is_some();
        Parameter { free: self.entry.free, assumed: (!known).then(|| self.kind(row.joint)), ..parameter }
    }
}

impl Entry {
    fn to_toml(self) -> String {
        if self.free && self.bound.is_none() && self.prior_sigma.is_none() {
            return format!("{:?}", self.nominal);
        }
        let mut text = format!("{{ nominal = {:?}", self.nominal);
        if !self.free {
            text.push_str(", free = false");
        }
        for (key, value) in [("bound", self.bound), ("prior_sigma", self.prior_sigma)] {
            if let Some(value) = value {
                let _ = write!(text, ", {key} = {value:?}");
            }
        }
        text.push_str(" }");
        text
    }
}

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Entry, D::Error> {
        deserializer.deserialize_any(EntryVisitor)
    }
}

/// Tells a number from a table without losing the position of an error inside the table.
struct EntryVisitor;

impl<'de> Visitor<'de> for EntryVisitor {
    type Value = Entry;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number or a table { nominal, free, bound, prior_sigma }")
    }

    fn visit_f64<E: serde::de::Error>(self, nominal: f64) -> Result<Entry, E> {
        Ok(Entry { nominal, free: true, bound: None, prior_sigma: None })
    }

    fn visit_i64<E: serde::de::Error>(self, nominal: i64) -> Result<Entry, E> {
        let exact = i32::try_from(nominal).map_err(|_| E::custom("the number is out of range"))?;
        self.visit_f64(f64::from(exact))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Entry, A::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Detailed {
            nominal: f64,
            free: Option<bool>,
            bound: Option<f64>,
            prior_sigma: Option<f64>,
        }
        let d = Detailed::deserialize(MapAccessDeserializer::new(map))?;
        Ok(Entry {
            nominal: d.nominal,
            free: d.free.unwrap_or(true),
            bound: d.bound,
            prior_sigma: d.prior_sigma,
        })
    }
}

/// A word as TOML has it.
fn toml_of(word: &impl Serialize) -> String {
    toml::Value::try_from(word).map_or_else(|_| String::new(), |value| value.to_string())
}
