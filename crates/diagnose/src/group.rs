//! One family at all joints together.

use crate::problem::{Amplitude, Candidate, Columns};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Families whose cause, a make of gear or encoder, is likely to be in every joint.
const OF_A_MAKE: [&str; 6] =
    ["backlash", "friction_windup", "eccentricity", "second_harmonic", "gear_ratio", "zero_drift"];

/// The candidates, and for gears of one make all joints together: each joint alone may be hidden by the others.
pub(crate) fn with_groups(mut all: Vec<Candidate>) -> Vec<Candidate> {
    for family in OF_A_MAKE {
        let members: Vec<&Candidate> =
            all.iter().filter(|c| c.family == family && matches!(c.columns, Columns::Dense(_))).collect();
        if members.len() < 2 {
            continue;
        }
        let columns: Vec<_> = members
            .iter()
            .filter_map(|c| match &c.columns {
                Columns::Dense(own) => Some(own.column_iter().map(|column| column.into_owned())),
                Columns::Product { .. } => None,
            })
            .flatten()
            .collect();
        let group = Candidate {
            spec: members.iter().map(|c| c.spec.as_str()).collect::<Vec<_>>().join(Candidate::AND),
            target: "all joints".to_owned(),
            known: None,
            amplitudes: members.iter().flat_map(|c| named(c)).collect(),
            columns: Columns::Dense(Arc::new(DMatrix::from_columns(&columns))),
            ..members[0].clone()
        };
        all.push(group);
    }
    all
}

/// Its amplitudes, told apart from those of the other members.
fn named(c: &Candidate) -> Vec<Amplitude> {
    let full = |a: &Amplitude| Amplitude { name: format!("{}.{}", c.spec, a.name), ..a.clone() };
    c.amplitudes.iter().map(full).collect()
}
