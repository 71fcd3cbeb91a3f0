//! What a pipeline measures between places: `[points.*]`, `[planes.*]`, `[[measure]]` and joined tips, as the model has them.

use crate::{ClosedChainSection, ClosureKind, FrameSection, Measure, MeasureKind, MeasureSection, Pipeline};
use armcal_core::{Against, FeatureId, Pose};
use armcal_model::{DISTANCE, FixedPlace, Frame, Length};

impl Pipeline {
    /// The points, then the planes that stand in the world.
    pub fn places(&self) -> Vec<FixedPlace> {
        let place = |(name, section, is_plane): (&String, &FrameSection, bool)| {
            let frame = section.frame(name, is_plane);
            FixedPlace { frame: Frame { pose: Pose::from(section.at), ..frame }, is_plane }
        };
        let points = self.points.iter().map(|(name, section)| (name, section, false));
        points.chain(self.planes.iter().map(|(name, section)| (name, section, true))).map(place).collect()
    }

    /// The lengths that distances count from, in the order of the measurements.
    pub fn lengths(&self) -> Vec<Length> {
        let counted = self.measure.iter().filter(|m| m.kind.has_length());
        let link = self.closed_chain.iter().filter_map(ClosedChainSection::link);
        link.chain(counted.map(MeasureSection::length)).collect()
    }

    /// What is measured between places: each `[[measure]]`, and the joined tips of two arms.
    pub fn measures(&self) -> Vec<Measure> {
        // One number after the other, in the order of `lengths`.
        let mut lengths = 0..;
        let mut next = |counts: bool| if counts { lengths.next() } else { None };
        let mut all: Vec<Measure> = Vec::new();
        all.extend(self.closed_chain.iter().map(|closure| {
            let [feature, to] = self.joins(closure);
            Measure {
                name: "the other tip".into(),
                kind: match closure.kind {
                    ClosureKind::SamePoint => MeasureKind::Coincide,
                    ClosureKind::RigidLink => MeasureKind::Number(&DISTANCE),
                },
                feature,
                against: Against::Feature(to),
                length: next(closure.link().is_some()),
                sigma_m: closure.sigma_mm * 1e-3,
                reading_m: None,
                recordings: None,
                max_gap_m: closure.max_gap_mm * 1e-3,
            }
        }));
        all.extend(self.measure.iter().map(|section| Measure {
            name: section.name().to_owned(),
            kind: section.kind,
            feature: self.feature(&section.between[0]).unwrap_or_default(),
            against: Against::Fixed(self.place(&section.between[1]).unwrap_or(0)),
            length: next(section.kind.has_length()),
            sigma_m: section.sigma_mm * 1e-3,
            reading_m: section.reading.as_ref().map(|_| {
                section.range_mm.map_or([f64::NEG_INFINITY, f64::INFINITY], |range| range.map(|mm| mm * 1e-3))
            }),
            recordings: section.recordings.as_ref().map(|names| {
                let all = self.recordings.iter().enumerate();
                all.filter(|(_, r)| names.contains(&r.name())).map(|(index, _)| index).collect()
            }),
            max_gap_m: section.max_gap_mm * 1e-3,
        }));
        all
    }

    /// The joined features of the model: of two arms their tips.
    fn joins(&self, closure: &ClosedChainSection) -> [FeatureId; 2] {
        let of = |name: &String| self.feature(name).unwrap_or_default();
        closure.between.as_ref().map_or([FeatureId::TIP, FeatureId(1)], |names| names.each_ref().map(of))
    }

    /// The tip or a marker, by its name.
    pub(crate) fn feature(&self, name: &str) -> Option<FeatureId> {
        let mut all = std::iter::once("tip").chain(self.markers.keys().map(String::as_str));
        all.position(|own| own == name).map(FeatureId)
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.points.keys().chain(self.planes.keys()).position(|own| own == name)
    }
}
