//! Which free parameters one group of observations alone knows, and which several share.
//!
//! The derivative of all residuals by all parameters then has the shape of an arrow: a block of its own for each
//! group, and columns of shared parameters beside them. Where there is one group only, everything is shared and the
//! matrix is dense.

use crate::objective::axes::Axis;
use crate::objective::problem::{Known, Problem};
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
            let all = || Known {
                blocks: 0..problem.blocks(),
                parameters: (0..problem.parameters().len()).collect(),
            };
            let known = if known.is_empty() { vec![all()] } else { known };
            return Structure::over(known, axes, (0..axes.len()).collect());
        }
        let mut knowers = vec![ParameterScope::None; problem.parameters().len()];
        for (group, known) in known.iter().enumerate() {
            known.parameters.iter().for_each(|&index| knowers[index] = knowers[index].and(group));
        }
        let is = |wanted| {
            (0..axes.len()).filter(|&axis| knowers[axes[axis].index] == wanted).collect::<Vec<usize>>()
        };
        let (shared, unobserved) = (is(ParameterScope::Several), is(ParameterScope::None));
        let mut structure = Structure::over(known, axes, shared);
        // Only its prior says anything about a parameter that no observation knows.
        let columns = vec![None; 1 + structure.shared.len()];
        let alone = |axis| Group { blocks: 0..0, own: vec![axis], columns: columns.clone() };
        structure.groups.extend(unobserved.into_iter().map(alone));
        structure
    }

    /// Of groups that share these axes; what else one of them knows is its own.
    fn over(known: Vec<Known>, axes: &[Axis], shared: Vec<usize>) -> Structure {
        let axis_of: BTreeMap<usize, usize> =
            axes.iter().enumerate().map(|(axis, a)| (a.index, axis)).collect();
        let group = |known: Known| {
            let at: BTreeMap<usize, usize> =
                known.parameters.iter().enumerate().map(|(column, &index)| (index, column)).collect();
            let of_group = at.keys().filter_map(|index| axis_of.get(index)).copied();
            let own: Vec<usize> = of_group.filter(|axis| shared.binary_search(axis).is_err()).collect();
            let columns = own.iter().chain(&shared).map(|&axis| at.get(&axes[axis].index).copied());
            Group { blocks: known.blocks, columns: columns.collect(), own }
        };
        Structure { groups: known.into_iter().map(group).collect(), shared }
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
#[derive(Debug, Clone, Copy, PartialEq)]
enum ParameterScope {
    None,
    One(usize),
    Several,
}

impl ParameterScope {
    fn and(self, group: usize) -> ParameterScope {
        match self {
            ParameterScope::None => ParameterScope::One(group),
            ParameterScope::One(_) | ParameterScope::Several => ParameterScope::Several,
        }
    }
}
