//! `[points.*]`, `[planes.*]` and `[[measure]]`: what the tip, or a marker, is measured against beside sensor and table.

use super::{FramePose, FrameSection, Pipeline};
use crate::error::Error;
use crate::two_arms::closure::{ClosedChainSection, ClosureKind};
use armcal_core::{Against, FeatureId, Pose};
use armcal_model::{FixedPlace, Frame, Knowledge, Length};
use armcal_recording::GaugeStream;
use serde::Deserialize;

/// One measurement, as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasureSection {
    /// Its name, of which parameters, errors and warnings speak; that of the place when absent.
    pub name: Option<String>,
    /// `"coincide"`, `"distance"` or `"plane"`.
    pub kind: MeasureKind,
    /// `"tip"` or a marker, then a point (for `"plane"`: a plane).
    pub between: [String; 2],
    /// Of a distance [mm]: what it is, or what it is where the instrument reads zero; default 0 with a `reading`.
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeasureKind {
    /// Both in one point: 3 rows.
    Coincide,
    /// How far they are from each other: 1 row.
    Distance,
    /// How high it is above the plane: 1 row.
    Plane,
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
    /// Of a distance: which of the model's lengths it counts from.
    pub length: usize,
    /// Standard error per row [m].
    pub sigma_m: f64,
    /// Whether an instrument says how far, and between which readings [m].
    pub reading_m: Option<[f64; 2]>,
    /// The recordings it was made in; all of them where nothing is said.
    pub recordings: Option<Vec<usize>>,
    /// How far off the nominal arm may be [m].
    pub max_gap_m: f64,
}

impl MeasureSection {
    /// Its name, given or that of its place.
    pub fn name(&self) -> &str {
        self.name.as_ref().unwrap_or(&self.between[1])
    }

    fn length(&self) -> Length {
        let knowledge = knowledge(self.length, self.length_sigma_mm);
        let length_m = self.length_mm.unwrap_or(0.0) * 1e-3;
        Length { name: self.name().to_owned(), length_m, knowledge }
    }
}

/// How well a length is known.
pub(crate) fn knowledge(length: FramePose, sigma_mm: f64) -> Knowledge {
    match length {
        FramePose::Given => Knowledge::Given,
        FramePose::Measured => Knowledge::Measured { sigma_m: sigma_mm * 1e-3, sigma_rad: 0.0 },
        FramePose::Estimated => Knowledge::Estimated,
    }
}

impl Pipeline {
    /// The points, then the planes that stand in the world.
    pub fn places(&self) -> Vec<FixedPlace> {
        let place = |(name, section, is_plane): (&String, &FrameSection, bool)| {
            let frame = crate::stages::frames::frame(name, section, is_plane);
            FixedPlace { frame: Frame { pose: Pose::from(section.at), ..frame }, is_plane }
        };
        let points = self.points.iter().map(|(name, section)| (name, section, false));
        points.chain(self.planes.iter().map(|(name, section)| (name, section, true))).map(place).collect()
    }

    /// The lengths that distances count from, in the order of the measurements.
    pub fn lengths(&self) -> Vec<Length> {
        let distances = self.measure.iter().filter(|m| m.kind == MeasureKind::Distance);
        let link = self.closed_chain.iter().filter_map(ClosedChainSection::link);
        link.chain(distances.map(MeasureSection::length)).collect()
    }

    /// What is measured between places: each `[[measure]]`, and the joined tips of two arms.
    pub fn measures(&self) -> Vec<Measure> {
        let joined = self.closed_chain.iter().map(|closure| {
            let [feature, to] = self.joins(closure);
            Measure {
                name: "the other tip".into(),
                kind: match closure.kind {
                    ClosureKind::SamePoint => MeasureKind::Coincide,
                    ClosureKind::RigidLink => MeasureKind::Distance,
                },
                feature,
                against: Against::Feature(to),
                length: 0,
                sigma_m: closure.sigma_mm * 1e-3,
                reading_m: None,
                recordings: None,
                max_gap_m: closure.max_gap_mm * 1e-3,
            }
        });
        let mut lengths = usize::from(self.closed_chain.iter().any(|closure| closure.link().is_some()))..;
        let mut next = |kind| if kind == MeasureKind::Distance { lengths.next().unwrap_or(0) } else { 0 };
        let of_section = self.measure.iter().map(|section| Measure {
            name: section.name().to_owned(),
            kind: section.kind,
            feature: self.feature(&section.between[0]).unwrap_or_default(),
            against: Against::Fixed(self.place(&section.between[1]).unwrap_or(0)),
            length: next(section.kind),
            sigma_m: section.sigma_mm * 1e-3,
            reading_m: section.reading.as_ref().map(|_| {
                section.range_mm.map_or([f64::NEG_INFINITY, f64::INFINITY], |range| range.map(|mm| mm * 1e-3))
            }),
            recordings: section.recordings.as_ref().map(|names| {
                let all = self.recordings.iter().enumerate();
                all.filter(|(_, r)| names.contains(&r.name())).map(|(index, _)| index).collect()
            }),
            max_gap_m: section.max_gap_mm * 1e-3,
        });
        joined.chain(of_section).collect()
    }

    /// The joined features of the model: of two arms their tips.
    fn joins(&self, closure: &ClosedChainSection) -> [FeatureId; 2] {
        let of = |name: &String| self.feature(name).unwrap_or_default();
        closure.between.as_ref().map_or([FeatureId::TIP, FeatureId(1)], |names| names.each_ref().map(of))
    }

    fn feature(&self, name: &str) -> Option<FeatureId> {
        let mut all = std::iter::once("tip").chain(self.markers.keys().map(String::as_str));
        all.position(|own| own == name).map(FeatureId)
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.points.keys().chain(self.planes.keys()).position(|own| own == name)
    }
}

/// Places and measurements that contradict each other; `fail` makes an error of a key and what is wrong with it.
pub(super) fn check(
    pipeline: &Pipeline,
    fail: &dyn Fn(&str, String) -> Result<(), Error>,
) -> Result<(), Error> {
    for (kind, name, section) in pipeline
        .points
        .iter()
        .map(|(name, section)| ("points", name, section))
        .chain(pipeline.planes.iter().map(|(name, section)| ("planes", name, section)))
    {
        let key = format!("{kind}.{name}");
        if let Some(why) = super::markers::no_name(name) {
            return fail(&key, why);
        }
        if pipeline.markers.contains_key(name) || kind == "planes" && pipeline.points.contains_key(name) {
            return fail(&key, "is the name of something else too; give one of them another".to_owned());
        }
        if section.pose == FramePose::Measured && section.sigma_mm == 0.0 {
            return fail(&format!("{key}.pose"), "is \"measured\" without sigma_mm".to_owned());
        }
    }
    let seen = pipeline.table.is_some() || pipeline.tip_is_tracked() || !pipeline.markers.is_empty();
    let all_estimated = || {
        let mut places = pipeline.points.values().chain(pipeline.planes.values());
        places.all(|place| place.pose == FramePose::Estimated)
    };
    let adrift = !pipeline.measure.is_empty() && !seen && all_estimated();
    if adrift && pipeline.frames.base.pose == FramePose::Estimated {
        let problem = "is \"estimated\" as all places are, so that nothing holds them; leave it \"given\": the base is the world then";
        return fail("frames.base.pose", problem.to_owned());
    }
    for (at, section) in pipeline.measure.iter().enumerate() {
        if let Some((key, problem)) = contradiction(pipeline, section) {
            return fail(&format!("measure[{at}].{key}"), problem);
        }
        if pipeline.measure[..at].iter().any(|other| other.name() == section.name()) {
            let problem = format!("`{}` names two of them; give one another name = \"...\"", section.name());
            return fail(&format!("measure[{at}].name"), problem);
        }
    }
    for (kind, names) in [("points", pipeline.points.keys()), ("planes", pipeline.planes.keys())] {
        let is_idle = |name: &&String| !pipeline.measure.iter().any(|m| m.between[1] == **name);
        if let Some(name) = names.into_iter().find(is_idle) {
            let problem = "is measured by no [[measure]]; add one with it in `between`";
            return fail(&format!("{kind}.{name}"), problem.to_owned());
        }
    }
    Ok(())
}

/// The key of a measurement that cannot be, and why.
fn contradiction(pipeline: &Pipeline, m: &MeasureSection) -> Option<(&'static str, String)> {
    let [of, against] = &m.between;
    if pipeline.feature(of).is_none() {
        let known: Vec<&str> =
            std::iter::once("tip").chain(pipeline.markers.keys().map(String::as_str)).collect();
        return Some(("between", format!("begins with `{of}`, which is none of {}", known.join(", "))));
    }
    let (kind, known) = match m.kind {
        MeasureKind::Plane => ("planes", &pipeline.planes),
        MeasureKind::Coincide | MeasureKind::Distance => ("points", &pipeline.points),
    };
    if !known.contains_key(against) {
        let problem = format!("ends with `{against}`, which is not there; add [{kind}.{against}]");
        return Some(("between", problem));
    }
    if let Some(why) = super::markers::no_name(m.name()) {
        return Some(("name", why));
    }
    let positive = |v: f64| v.is_finite() && v > 0.0;
    if !positive(m.sigma_mm) {
        return Some(("sigma_mm", "must be above zero: nothing is measured exactly".into()));
    }
    if !positive(m.max_gap_mm) {
        return Some(("max_gap_mm", "must be above zero".into()));
    }
    let is_distance = m.kind == MeasureKind::Distance;
    if !is_distance && m.length_mm.is_some() {
        return Some(("length_mm", "belongs to kind = \"distance\"".into()));
    }
    if is_distance && m.reading.is_none() && !m.length_mm.is_some_and(positive) {
        let problem = "must be above zero where no instrument reads the distance; give it, or `reading`";
        return Some(("length_mm", problem.into()));
    }
    if m.kind == MeasureKind::Coincide && m.reading.is_some() {
        return Some(("reading", "belongs to kind = \"distance\" or \"plane\"".into()));
    }
    if m.reading.as_ref().is_some_and(|reading| reading.direction.abs() != 1) {
        return Some(("reading.direction", "must be 1 or -1".into()));
    }
    if let Some([low, high]) = m.range_mm
        && !(m.reading.is_some() && low < high)
    {
        return Some(("range_mm", "is [smallest, largest] of what the `reading` may be".into()));
    }
    let unknown = |name: &&String| !pipeline.recordings.iter().any(|r| r.name() == **name);
    let missing = m.recordings.iter().flatten().find(unknown).filter(|_| !pipeline.recordings.is_empty());
    missing.map(|name| ("recordings", format!("names `{name}`, which is no recording of this pipeline")))
}
