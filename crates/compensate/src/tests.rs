//! Tests of the whole inverse, by question.

mod ambiguous;
mod reach;
mod round_trip;

use crate::{Arm, Compensator, Conditions, Limits, Past};
use armcal_core::{Arrival, DwellId, Observation, Reference};
use armcal_model::{Chain, Frames, Model, Session};
use nalgebra::Vector3;
use std::path::Path;

const RIGHT_ARM: &str = include_str!("../../../pipelines/models/right_arm.toml");
const UR10: &str = include_str!("../../../pipelines/models/ur10.toml");

fn bare(dh: &str) -> Model {
    let chain = Chain::from_dh_toml(dh, Path::new("arm.toml")).expect("a valid table");
    Model::new(chain, Frames::of_bare_arm()).expect("frames without a fault")
}

/// The arm with effects, and its parameters: geometry moved by `off` of its bounds, effects of these sizes.
fn deviating(dh: &str, off: &[f64], effects: &[(&str, &[f64])]) -> (Model, Vec<f64>) {
    let rigid = bare(dh);
    let specs: Vec<_> = effects.iter().map(|(spec, _)| rigid.effect(spec).expect(spec)).collect();
    let mut values: Vec<f64> = rigid.nominal();
    for ((value, p), off) in values.iter_mut().zip(rigid.chain().parameters()).zip(off) {
        *value += off * (p.upper - p.nominal);
    }
    let model = rigid.with_effects(&specs, &Session::of(&[])).expect("effects that fit the arm");
    values.extend(&model.nominal()[values.len()..]);
    for (placed, (_, sizes)) in model.effects().iter().zip(effects) {
        values[placed.parameters.clone()][..sizes.len()].copy_from_slice(sizes);
    }
    (model, values)
}

/// The tip after a path of readings, all of it told to the model [m].
fn tip_after(model: &Model, values: &[f64], path: &[Vec<f64>]) -> Vector3<f64> {
    let rest = &path[path.len() - 1];
    let column = |j: usize| path.iter().map(|q| q[j]).collect::<Vec<f64>>();
    let pair = |k: usize, sign: f64| path.iter().map(|q| q[k + 1] + sign * q[k]).collect::<Vec<f64>>();
    let arrival = |j: usize| {
        let last = path.windows(2).rev().map(|w| w[1][j] - w[0][j]).find(|travel| travel.abs() > 1e-6);
        last.map_or(Arrival::Unknown, |t| if t > 0.0 { Arrival::Positive } else { Arrival::Negative })
    };
    let joints = rest.len();
    let nowhere = Reference::position(Vector3::zeros());
    let o = Observation {
        arrival: (0..joints).map(arrival).collect(),
        path_memory_rad: Some((0..joints).map(column).collect()),
        moved_rad: path
            .windows(2)
            .last()
            .map(|w| w[1].iter().zip(&w[0]).map(|(to, from)| to - from).collect()),
        pair_memory_rad: Some((1..joints).map(|k| [pair(k - 1, 1.0), pair(k - 1, -1.0)]).collect()),
        ..Observation::bare(DwellId { recording: 0, dwell: 0 }, rest.clone(), nowhere)
    };
    model.predicted_tip_in_world(values, &o)
}

fn compensator<'a>(nominal: &'a Model, (model, values): (&'a Model, &[f64])) -> Compensator<'a> {
    let joints = nominal.joint_count();
    Compensator {
        nominal: Arm { model: nominal, values: nominal.nominal() },
        calibrated: Arm { model, values: values.to_vec() },
        conditions: unloaded(),
        limits: Limits::none(joints),
        postures_rad: vec![Past::at(&vec![0.0; joints]).joint_rad().unwrap()],
        recorded_rad: vec![[-1.0, 1.0]; joints],
        approach_rad: 0.0,
        crossing_s: 0.0,
    }
}

fn unloaded() -> Conditions {
    Conditions {
        feature: armcal_core::FeatureId::TIP,
        recording: 0,
        dwell: 0,
        time_ns: 0,
        load_kg: 0.0,
        more_loads: Vec::new(),
        temperature_c: None,
    }
}
