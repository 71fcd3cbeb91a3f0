//! What the links of an arm weigh: as in its URDF, or as much as they are long.

use super::Chain;
use crate::ModelError;
use crate::segment::{Body, Segment};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Where the masses of the links come from. Where nobody says, from a URDF that gives all of them, else as `Uniform`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Masses {
    /// Mass and centre of each link from its `<inertial>`; a link without weighs as in `Uniform`.
    Urdf,
    /// Every link weighs 2.5 kg for every metre, evenly spread.
    Uniform,
}

impl Chain {
    /// The same chain with masses from where the pipeline says.
    ///
    /// # Errors
    /// Masses of a file that gives none; `path` is named then.
    pub fn with_masses(mut self, masses: Option<Masses>, path: &Path) -> Result<Chain, ModelError> {
        if masses == Some(Masses::Urdf) && self.moved().all(|(_, mass_kg)| mass_kg == 0.0) {
            return Err(ModelError::NoMasses { path: path.to_owned() });
        }
        self.masses = masses;
        Ok(self)
    }

    /// Where the masses of its links come from, where that has been said.
    pub fn masses(&self) -> Option<Masses> {
        self.masses
    }

    /// The links without a mass, where the arm has others with one; by name, unless nobody wants the masses of the file.
    pub fn links_without_mass(&self) -> Vec<String> {
        if !self.arms().is_empty() {
            let of_arms = self.arms().iter();
            let named = of_arms.flat_map(|arm| {
                arm.chain.links_without_mass().into_iter().map(|link| format!("{}.{link}", arm.name))
            });
            return named.collect();
        }
        let any = self.moved().any(|(_, mass_kg)| mass_kg > 0.0);
        let wanted = any && self.masses != Some(Masses::Uniform);
        let without = self.moved().filter(|(_, mass_kg)| wanted && *mass_kg == 0.0);
        without.filter_map(|(segment, _)| segment.frame.clone()).collect()
    }

    /// The segments with the masses that count: those of the file, as far as they are wanted.
    pub(crate) fn weighed(&self) -> Vec<Segment> {
        let kept = match self.masses {
            Some(masses) => masses == Masses::Urdf,
            // Masses of the file beside guesses would make the heavy links those that the file leaves out.
            None => self.moved().all(|(_, mass_kg)| mass_kg > 0.0),
        };
        let body = |segment: &Segment| segment.body.filter(|_| kept);
        self.segments.iter().map(|segment| Segment { body: body(segment), ..segment.clone() }).collect()
    }

    /// Every segment that a joint moves, with the mass of what it carries as far as the next joints [kg].
    fn moved(&self) -> impl Iterator<Item = (&Segment, f64)> {
        let mut carrier: Vec<Option<usize>> = Vec::with_capacity(self.segments.len());
        let mut masses_kg = vec![0.0; self.segments.len()];
        for (at, segment) in self.segments.iter().enumerate() {
            let before = segment.parent.and_then(|parent| carrier[parent]);
            carrier.push(segment.joint.map(|_| at).or(before));
            let mass_kg = segment.body.map_or(0.0, |body: Body| body.mass_kg);
            carrier[at].into_iter().for_each(|link| masses_kg[link] += mass_kg);
        }
        self.segments.iter().zip(masses_kg).filter(|(segment, _)| segment.joint.is_some())
    }
}
