//! Which free parameters one group of observations alone knows, and which several share.
//!
//! The derivative of all residuals by all parameters then has the shape of an arrow: a block of its own for each
//! group, and columns of shared parameters beside them. Where there is one group only, everything is shared and the
//! matrix is dense.

use crate::problem::{Known, Problem};
use crate::whitened::Axis;
use std::collections::BTreeMap;
use std::ops::Range;

/// The free parameters of a problem by who knows them; all indices are those of its axes.
#[derive(Debug, Clone)]
pub(crate) struct Structure {
    pub groups: Vec<Group>,
    pub shared: Vec<usize>,
}

/// Observations that know the same parameters.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    pub blocks: Range<usize>,
    /// Axes that no other group knows.
    pub own: Vec<usize>,
    /// Where the problem's derivative has the column of each axis, own ones first, then the shared; `None` where this
    /// group does not know it.
    pub columns: Vec<Option<usize>>,
}

impl Structure {
    pub fn of(problem: &dyn Problem, axes: &[Axis]) -> Structure {
        let known = problem.known();
        if known.len() <= 1 {
            return Structure::dense(problem, axes, known);
        }
        let mut knowers = vec![Knowers::None; problem.parameters().len()];
        for (group, known) in known.iter().enumerate() {
            known.parameters.iter().for_each(|&index| knowers[index] = knowers[index].and(group));
        }
        let mut own = vec![Vec::new(); known.len()];
        let (mut shared, mut nobodys) = (Vec::new(), Vec::new());
        for (axis, a) in axes.iter().enumerate() {
            match knowers[a.index] {
                Knowers::None => nobodys.push(axis),
                Knowers::One(group) => own[group].push(axis),
                Knowers::Several => shared.push(axis),
            }
        }
        let mut groups: Vec<Group> = known
            .into_iter()
            .zip(own)
            .map(|(known, own)| {
                let at: BTreeMap<usize, usize> =
                    known.parameters.iter().enumerate().map(|(column, &index)| (index, column)).collect();
                let columns = own.iter().chain(&shared).map(|&axis| at.get(&axes[axis].index).copied());
                Group { blocks: known.blocks, columns: columns.collect(), own }
            })
            .collect();
        // Only its prior says anything about a parameter that no observation knows.
        groups.extend(nobodys.into_iter().map(|axis| Group {
            blocks: 0..0,
            own: vec![axis],
            columns: vec![None; 1 + shared.len()],
        }));
        Structure { groups, shared }
    }

    fn dense(problem: &dyn Problem, axes: &[Axis], known: Vec<Known>) -> Structure {
        let of_index = |index: usize| match known.first() {
            None => Some(index),
            Some(known) => known.parameters.iter().position(|&k| k == index),
        };
        let columns = axes.iter().map(|a| of_index(a.index)).collect();
        let group = Group { blocks: 0..problem.blocks(), own: Vec::new(), columns };
        Structure { groups: vec![group], shared: (0..axes.len()).collect() }
    }

    /// Whether all parameters are shared by one group.
    pub fn is_dense(&self) -> bool {
        self.groups.len() == 1 && self.groups[0].own.is_empty()
    }

    /// Number of axes.
    pub fn axis_count(&self) -> usize {
        self.shared.len() + self.groups.iter().map(|group| group.own.len()).sum::<usize>()
    }

    /// The axes of a group's columns.
    pub fn axes(&self, group: usize) -> impl Iterator<Item = usize> {
        self.groups[group].own.iter().chain(&self.shared).copied()
    }
}

/// Who knows a parameter.
#[derive(Debug, Clone, Copy)]
enum Knowers {
    None,
    One(usize),
    Several,
}

impl Knowers {
    fn and(self, group: usize) -> Knowers {
        match self {
            Knowers::None => Knowers::One(group),
            Knowers::One(_) | Knowers::Several => Knowers::Several,
        }
    }
}
