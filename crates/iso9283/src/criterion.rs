//! What an assessment says: every criterion that could be computed, and every other one with the reason.

use crate::IsoError;
use crate::catalogue::{CHARACTERISTICS, Characteristic, Component, Quantity};
use crate::pose::Deviation;
use armcal_core::list_names;
use serde::{Serialize, Serializer};

/// One criterion at one place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Criterion {
    /// Clause of ISO 9283:1998.
    pub clause: &'static str,
    /// The standard's symbol; empty where it has none.
    pub symbol: String,
    /// The standard's name.
    pub name: String,
    /// The pose, move, path or corner it holds for.
    pub at: String,
    /// Its value in SI units.
    pub value: f64,
    /// Whether the value is the half-width of a band: plus or minus.
    pub plus_minus: bool,
    /// What it measures, and so its unit.
    #[serde(rename = "unit", serialize_with = "si_symbol")]
    pub quantity: Quantity,
    /// Cycles it was computed from.
    pub n: usize,
    /// Cycles that the standard asks for.
    pub asked: usize,
    /// Where the test falls short of the standard's.
    pub notes: Vec<String>,
}

fn si_symbol<S: Serializer>(quantity: &Quantity, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(quantity.symbol())
}

impl Criterion {
    /// The value in the unit shown to people.
    pub fn display_value(&self) -> f64 {
        self.quantity.to_display(self.value)
    }
}

impl std::fmt::Display for Criterion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sign = if self.plus_minus { "±" } else { "" };
        let (value, unit) = (self.display_value(), self.quantity.display_symbol());
        write!(f, "{} {}", self.clause, self.name)?;
        if !self.symbol.is_empty() {
            write!(f, " {}", self.symbol)?;
        }
        write!(f, " at {}: {sign}{value:.4} {unit}", self.at)?;
        // Fewer cycles than asked for are the first note.
        if self.n >= self.asked {
            write!(f, "; n = {}", self.n)?;
        }
        self.notes.iter().try_for_each(|note| write!(f, "; {note}"))
    }
}

/// A criterion that the evidence does not show.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NotMeasured {
    /// Clause of ISO 9283:1998.
    pub clause: &'static str,
    /// The standard's symbol; empty where it has none.
    pub symbol: String,
    /// The standard's name.
    pub name: String,
    /// Why, and what it needs.
    pub reason: String,
}

impl std::fmt::Display for NotMeasured {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {} {}: {}", self.clause, self.name, self.symbol, self.reason)
    }
}

/// Every criterion of the standard, computed or with the reason why not.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Assessment {
    /// Computed criteria, in the order of the standard, then of the evidence.
    pub criteria: Vec<Criterion>,
    /// All others, in the order of the standard.
    pub not_measured: Vec<NotMeasured>,
    /// Where the whole test falls short of the standard's, or is not known to follow it.
    pub notes: Vec<String>,
}

impl Assessment {
    /// For every criterion that was computed, the place with the largest magnitude; the first of equals.
    pub fn worst(&self) -> Vec<&Criterion> {
        let mut worst: Vec<&Criterion> = Vec::new();
        for criterion in &self.criteria {
            match worst.iter_mut().find(|w| w.clause == criterion.clause && w.name == criterion.name) {
                Some(known) if known.value.abs() >= criterion.value.abs() => {}
                Some(known) => *known = criterion,
                None => worst.push(criterion),
            }
        }
        worst
    }
}

/// Collects criteria and the reasons for missing ones, in whatever order they are found.
#[derive(Default)]
pub(crate) struct Findings {
    found: Vec<(&'static Characteristic, Component, Criterion)>,
    lacks: Vec<(&'static Characteristic, Option<Component>, String, String)>,
}

/// Where a number was found, and from what.
pub(crate) struct Place<'a> {
    pub at: &'a str,
    pub n: usize,
    pub notes: &'a [String],
}

impl Findings {
    pub fn give(
        &mut self,
        what: &'static Characteristic,
        component: Component,
        value: f64,
        place: &Place<'_>,
    ) {
        let few = (place.n < what.cycles).then(|| format!("n = {} instead of {}", place.n, what.cycles));
        let criterion = Criterion {
            clause: what.clause,
            symbol: what.symbol_of(component),
            name: what.name_of(component),
            at: place.at.to_owned(),
            value,
            plus_minus: what.is_band(component),
            quantity: what.quantity_of(component),
            n: place.n,
            asked: what.cycles,
            notes: few.into_iter().chain(place.notes.iter().cloned()).collect(),
        };
        self.found.push((what, component, criterion));
    }

    /// The only part, or why there is none.
    pub fn tell(&mut self, what: &'static Characteristic, value: Result<f64, IsoError>, place: &Place<'_>) {
        match value {
            Ok(value) => self.give(what, Component::Only, value, place),
            Err(why) => self.lack(what, place.at, why),
        }
    }

    /// Position and angles, or why there are none.
    pub fn tell_deviation(
        &mut self,
        what: &'static Characteristic,
        deviation: Result<Deviation, IsoError>,
        place: &Place<'_>,
    ) {
        match deviation {
            Ok(deviation) => {
                self.give(what, Component::Position, deviation.position_m, place);
                self.give_angles(what, deviation.angles_rad, place);
            }
            Err(why) => self.lack(what, place.at, why),
        }
    }

    /// Three parts at once.
    pub fn give_three(
        &mut self,
        what: &'static Characteristic,
        components: [Component; 3],
        values: &nalgebra::Vector3<f64>,
        place: &Place<'_>,
    ) {
        components
            .iter()
            .zip(values)
            .for_each(|(component, value)| self.give(what, *component, *value, place));
    }

    /// The angles, or that the orientation was not tracked.
    pub fn give_angles(
        &mut self,
        what: &'static Characteristic,
        angles_rad: Option<nalgebra::Vector3<f64>>,
        place: &Place<'_>,
    ) {
        const WHY: &str = "needs the orientation of the tip, commanded and tracked in every sample";
        match angles_rad {
            Some(angles_rad) => self.give_three(what, Component::ANGLES, &angles_rad, place),
            None => Component::ANGLES.iter().for_each(|&angle| {
                self.lacks.push((what, Some(angle), place.at.to_owned(), WHY.to_owned()));
            }),
        }
    }

    /// That a characteristic cannot be computed at a place.
    pub fn lack(&mut self, what: &'static Characteristic, at: &str, why: impl std::fmt::Display) {
        self.lacks.push((what, None, at.to_owned(), why.to_string()));
    }

    pub fn finish(self, notes: Vec<String>) -> Assessment {
        let mut assessment = Assessment { notes, ..Assessment::default() };
        let parts =
            CHARACTERISTICS.iter().flat_map(|&what| what.components.iter().map(move |part| (what, *part)));
        for (what, component) in parts {
            let before = assessment.criteria.len();
            let found = self.found.iter().filter(|found| found.0 == what && found.1 == component);
            assessment.criteria.extend(found.map(|found| found.2.clone()));
            if assessment.criteria.len() == before {
                assessment.not_measured.push(NotMeasured {
                    clause: what.clause,
                    symbol: what.symbol_of(component),
                    name: what.name_of(component),
                    reason: self.reason(what, component),
                });
            }
        }
        assessment
    }

    /// The reasons found, places with the same one together; what it needs where nobody looked.
    fn reason(&self, what: &'static Characteristic, component: Component) -> String {
        let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
        let of_part =
            |lack: &&(_, Option<Component>, _, _)| lack.0 == what && lack.1.is_none_or(|c| c == component);
        for (_, _, at, why) in self.lacks.iter().filter(of_part) {
            match reasons.iter_mut().find(|known| known.0 == why) {
                Some(known) => known.1.push(at.clone()),
                None => reasons.push((why, vec![at.clone()])),
            }
        }
        if reasons.is_empty() {
            return format!("{}; there are none here", what.needs);
        }
        let said: Vec<String> =
            reasons.iter().map(|(why, at)| format!("{why} ({})", list_names(at))).collect();
        list_names(&said)
    }
}
