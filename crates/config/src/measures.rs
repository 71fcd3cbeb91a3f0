//! `[[measure]]`: what the tip, or a marker, is measured against beside sensor and table.

use crate::FramePose;
use armcal_core::{Against, FeatureId};
use armcal_model::{Knowledge, Length, MeasurementKind, find_measurement, measurement_kinds};
use armcal_recording::GaugeStream;
use serde::{Deserialize, Deserializer};

/// One measurement, as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasureSection {
    /// Its name, of which parameters, errors and warnings speak; that of the place when absent.
    pub name: Option<String>,
    /// `"coincide"`, `"distance"`, `"plane"`, or what was registered beside them.
    pub kind: MeasureKind,
    /// `"tip"` or a marker, then a point (for `"plane"`: a plane).
    pub between: [String; 2],
    /// Of a kind that counts from a length, as a distance does [mm]: what it is, or what it is where the instrument reads zero;
    /// default 0 with a `reading`.
    pub length_mm: Option<f64>,
    /// How well that is known: `"given"` (default), `"measured"` with `length_sigma_mm`, `"estimated"`.
    #[serde(default)]
    pub length: FramePose,
    /// Standard error of a measured length [mm].
    #[serde(default)]
    pub length_sigma_mm: f64,
    /// Standard error of one measurement, per row [mm].
    pub sigma_mm: f64,
    /// The instrument: a topic of one number. Without one a distance is `length_mm`, and a plane is touched.
    pub reading: Option<GaugeStream>,
    /// Readings outside are none, as of an instrument that touches nothing or is at its stop [mm].
    pub range_mm: Option<[f64; 2]>,
    /// The recordings it was made in, by name; all when absent.
    pub recordings: Option<Vec<String>>,
    /// Without an instrument: dwells in which the nominal arm is further off than this do not belong [mm]; default 50.
    #[serde(default = "default_max_gap_mm")]
    pub max_gap_mm: f64,
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeasureKind {
    /// Both in one point: 3 rows.
    Coincide,
    /// A number between them: 1 row.
    Number(&'static MeasurementKind),
}

/// In files, both in one point.
const COINCIDE: &str = "coincide";

impl MeasureKind {
    /// Whether it counts from a length.
    pub fn has_length(self) -> bool {
        matches!(self, MeasureKind::Number(kind) if kind.has_length)
    }

    /// Whether it is against a plane; otherwise against a point.
    pub(crate) fn is_against_plane(self) -> bool {
        matches!(self, MeasureKind::Number(kind) if kind.is_against_plane)
    }
}

impl<'de> Deserialize<'de> for MeasureKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<MeasureKind, D::Error> {
        let name = String::deserialize(deserializer)?;
        if name == COINCIDE {
            return Ok(MeasureKind::Coincide);
        }
        find_measurement(&name).map(MeasureKind::Number).ok_or_else(|| {
            let known: Vec<String> = std::iter::once(COINCIDE)
                .chain(measurement_kinds().iter().map(|kind| kind.name))
                .map(|known| format!("`{known}`"))
                .collect();
            serde::de::Error::custom(format!(
                "unknown variant `{name}`, expected one of {}",
                known.join(", ")
            ))
        })
    }
}

fn default_max_gap_mm() -> f64 {
    50.0
}

/// A measurement between places of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// Its name.
    pub name: String,
    /// What is measured.
    pub kind: MeasureKind,
    /// Of what.
    pub feature: FeatureId,
    /// Against what.
    pub against: Against,
    /// Which of the model's lengths it counts from, where its kind does.
    pub length: Option<usize>,
    /// Standard error per row [m].
    pub sigma_m: f64,
    /// Whether an instrument says how far, and between which readings [m].
    pub reading_m: Option<[f64; 2]>,
    /// The recordings it was made in; all of them where nothing is said.
    pub recordings: Option<Vec<usize>>,
    /// How far off the nominal arm may be [m].
    pub max_gap_m: f64,
}

impl Measure {
    /// Whether it was made in a recording.
    pub fn is_in(&self, recording: usize) -> bool {
        self.recordings.as_ref().is_none_or(|own| own.contains(&recording))
    }
}

impl MeasureSection {
    /// Its name, given or that of its place.
    pub fn name(&self) -> &str {
        self.name.as_ref().unwrap_or(&self.between[1])
    }

    /// The length that it counts from.
    pub(crate) fn length(&self) -> Length {
        let knowledge = length_knowledge(self.length, self.length_sigma_mm);
        let length_m = self.length_mm.unwrap_or(0.0) * 1e-3;
        Length { name: self.name().to_owned(), length_m, knowledge }
    }
}

/// How well a length is known.
pub(crate) fn length_knowledge(length: FramePose, sigma_mm: f64) -> Knowledge {
    match length {
        FramePose::Given => Knowledge::Given,
        FramePose::Measured => Knowledge::Measured { sigma_m: sigma_mm * 1e-3, sigma_rad: 0.0 },
        FramePose::Estimated => Knowledge::Estimated,
    }
}
