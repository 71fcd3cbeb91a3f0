//! Noise that is not independent from dwell to dwell, or not as large as declared: seats, visits, short memory, play
//! (notes 4.7 iii). [`crate::whitener`] takes it out of rows.

use crate::problem::{Part, Problem};
use nalgebra::DVector;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// What the noise may be besides independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Noise {
    /// Independent from dwell to dwell.
    White,
    /// The same offset at every visit to a place, in the board's axes.
    Place,
    /// The same offset at every visit to a place within one recording.
    Visit,
    /// Memory over a few dwells.
    Memory,
    /// The sensor wanders, which averaging within a dwell does not show: memory over tracked dwells on top of what is
    /// declared for them, seated ones remembering a share.
    Sensor,
    /// The sensor wanders, and cavities are off their place.
    SensorAndPlace,
    /// A joint (from 0) rests anywhere within its play: an angle of its own in every dwell, on top of what is declared.
    Slack(usize),
    /// Tracked dwells scatter more than declared, each by itself: a camera whose readings within a dwell are not
    /// independent.
    Tracked,
    /// They do, and cavities are off their place.
    TrackedAndPlace,
    /// Seated ones do: cavities wider than declared.
    Seated,
}

impl Noise {
    /// In words.
    pub fn word(self) -> Cow<'static, str> {
        let plain = match self {
            Noise::Slack(joint) => {
                return format!(
                    "as if joint {} took an angle of its own in every dwell, within play",
                    joint + 1
                )
                .into();
            }
            Noise::White => "independent from dwell to dwell",
            Noise::Place => "alike at every visit to a place, as seats and cavities off their place make it",
            Noise::Visit => "alike at visits to a place within a recording",
            Noise::Memory => "alike over a few dwells in a row",
            Noise::Sensor => {
                "alike over neighbouring tracked dwells and larger than declared, as a sensor or a frame that drifts makes it"
            }
            Noise::Tracked => "larger than declared where the tip was tracked",
            Noise::TrackedAndPlace => {
                "larger than declared where the tip was tracked, and alike at every visit to a cavity"
            }
            Noise::Seated => "larger than declared where the tip was seated",
            Noise::SensorAndPlace => {
                "alike over neighbouring tracked dwells and larger than declared, as a sensor or a frame that drifts makes it, and \
                 alike at every visit to a cavity"
            }
        };
        plain.into()
    }

    /// Those the data can tell from white noise: groups need repeats. Not the one of two kinds, see [`Noise::and_place`].
    pub fn available(problem: &Problem) -> Vec<Noise> {
        let repeats = |by_recording: bool| {
            let mut count: BTreeMap<(usize, &str), usize> = BTreeMap::new();
            for d in &problem.dwells {
                if let Some(place) = &d.place {
                    *count.entry((if by_recording { d.id.recording } else { 0 }, place)).or_insert(0) += 1;
                }
            }
            count.values().filter(|n| **n > 1).count() >= 4
        };
        let mut found = vec![Noise::White];
        if repeats(false) {
            found.push(Noise::Place);
        }
        let recordings: std::collections::BTreeSet<usize> =
            problem.dwells.iter().map(|d| d.id.recording).collect();
        if recordings.len() > 1 && repeats(true) {
            found.push(Noise::Visit);
        }
        if problem.dwells.len() >= 20 {
            found.push(Noise::Memory);
        }
        let (tracked, seated): (Vec<&Part>, Vec<&Part>) =
            problem.dwells.iter().flat_map(|d| &d.parts).partition(|part| part.tracked);
        if tracked.len() >= 20 && !seated.is_empty() {
            found.extend([Noise::Sensor, Noise::Tracked, Noise::Seated]);
        }
        found.extend((0..problem.joints()).map(Noise::Slack).filter(|n| n.direction(problem).is_some()));
        found
    }
}

impl Noise {
    /// Whether it adds to what is declared in a way that hides what is missing: weighed only where it says more than plain
    /// noise even of an unexplained residual.
    pub fn widens(self) -> bool {
        matches!(self, Noise::Slack(_) | Noise::Tracked | Noise::Seated)
    }

    /// The kind that has the errors of places besides, where places repeat: worth its price only where this one leads, or
    /// places lead and this one is there too.
    pub fn and_place(self, leading: Noise, available: &[Noise]) -> Option<Noise> {
        let both = match self {
            Noise::Sensor => Noise::SensorAndPlace,
            Noise::Tracked => Noise::TrackedAndPlace,
            _ => return None,
        };
        let leads = leading == self || (self == Noise::Tracked && leading == Noise::Place);
        (leads && available.contains(&Noise::Place)).then_some(both)
    }

    /// Whitened rows of what a joint's slack turns, one declared standard deviation a dwell in the mean of squares.
    pub fn direction(self, problem: &Problem) -> Option<DVector<f64>> {
        let Noise::Slack(joint) = self else { return None };
        let name = format!("joint{}", joint + 1);
        let channel = problem.channels.iter().find(|c| c.name == name)?;
        let column = channel.columns.column(0);
        let size = (column.norm_squared() / problem.dwells.len() as f64).sqrt();
        (size > 0.0).then(|| column / size)
    }
}
