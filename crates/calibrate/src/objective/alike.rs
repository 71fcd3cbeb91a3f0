//! Poses that are alike, told one after the other.

use std::collections::BTreeMap;

/// Poses in groups: each with the first one before it that is alike in every joint, if there is one.
#[derive(Debug, Clone)]
pub struct AlikePoses {
    reach_rad: f64,
    first: Vec<Vec<f64>>,
    /// Groups by the cell of their first pose's first two joints, as wide as the reach.
    cells: BTreeMap<[i64; 2], Vec<usize>>,
}

impl AlikePoses {
    /// Poses are alike that differ by less than this in every joint [rad] (sliding: [m]).
    pub fn within(reach_rad: f64) -> AlikePoses {
        AlikePoses { reach_rad, first: Vec::new(), cells: BTreeMap::new() }
    }

    /// How many groups there are so far.
    pub fn groups(&self) -> usize {
        self.first.len()
    }

    /// The group of the next pose.
    pub fn group_of(&mut self, joint_rad: &[f64]) -> usize {
        let cell = [0, 1].map(|j| joint_rad.get(j).map_or(0, |q| (q / self.reach_rad).floor() as i64));
        let near = (-1..=1)
            .flat_map(|i| (-1..=1).map(move |j| [cell[0].saturating_add(i), cell[1].saturating_add(j)]));
        let near = near.filter_map(|cell| self.cells.get(&cell)).flatten().copied();
        let is_alike = |group: &usize| {
            let first = &self.first[*group];
            let close = |(a, b): (&f64, &f64)| (a - b).abs() < self.reach_rad;
            first.len() == joint_rad.len() && first.iter().zip(joint_rad).all(close)
        };
        near.filter(is_alike).min().unwrap_or_else(|| {
            self.first.push(joint_rad.to_vec());
            self.cells.entry(cell).or_default().push(self.first.len() - 1);
            self.first.len() - 1
        })
    }
}

#[cfg(test)]
#[path = "../tests/alike.rs"]
mod tests;
