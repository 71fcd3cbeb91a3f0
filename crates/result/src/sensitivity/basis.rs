//! What all refits of a run share: its dwells, what may drive an error, and the sensitivities.

use super::of_dwells::{Sensitivities, joint_units};
use crate::analysis::feels_gravity;
use crate::column::Column;
use crate::run::Run;
use armcal_diagnose::DependsOn;
use armcal_model::Masses;
use nalgebra::Vector3;
use serde::Serialize;

/// A driver that moves by less than this share of its largest size, or not at all, drives nothing.
const SMALLEST_SPREAD: f64 = 1e-6;

/// The part of a run's page that no refit changes.
///
/// Made once; every refit, embedded or live, is drawn with it.
pub struct Basis {
    /// What each dwell says about each place.
    pub sensitivity: Sensitivities,
    /// Whether each channel is drawn: a joint that does not move the tip is not.
    pub drawn: Vec<bool>,
    /// What errors may follow.
    pub drivers: Vec<Driver>,
    /// Direction of arrival, `[joint][observation]`: 1, -1, or 0 where it is not known.
    pub arrival: Vec<Vec<i8>>,
    /// Rotates the world into the board of a seated observation's recording.
    pub into_board: Vec<Option<nalgebra::UnitQuaternion<f64>>>,
    /// Between recordings on the axis of time [min].
    pub time_cuts: Vec<f64>,
    /// From the base to the tip, of unit length.
    pub outwards: Vec<Vector3<f64>>,
}

/// A quantity that an error may follow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driver {
    /// Name for programs: `q1`, `tau1`, `time`, `temperature`, `load`.
    pub key: DependsOn,
    /// Name for people, with its unit.
    pub label: String,
    /// The joint it belongs to.
    pub joint: Option<usize>,
    /// One value an observation, in the unit of the label.
    pub values: Column,
}

impl Basis {
    /// Of a run.
    pub fn of(run: &Run) -> Basis {
        let values = run.calibration.fit.values();
        let observations = &run.observations;
        let sign = |o: &armcal_core::Observation, j: usize| o.arrival.get(j).map_or(0, |a| a.sign() as i8);
        let joints = 0..run.model.joint_count();
        let sensitivity = Sensitivities::of(run);
        Basis {
            drawn: sensitivity.drawn(run),
            sensitivity,
            drivers: drivers(run),
            arrival: joints.map(|j| observations.iter().map(|o| sign(o, j)).collect()).collect(),
            into_board: observations
                .iter()
                .map(|o| {
                    o.cavity()?;
                    let board = run.model.board_in_world(&values, o.dwell.recording)?;
                    Some(board.rotation.inverse())
                })
                .collect(),
            time_cuts: run.recorded_time().cuts(),
            outwards: observations
                .iter()
                .map(|o| run.model.measured_tip_in_world(&values, o) - run.base_m(&values, o.dwell.recording))
                .map(|d| d.try_normalize(1e-9).unwrap_or_else(Vector3::zeros))
                .collect(),
        }
    }

    /// Index of a driver.
    pub(crate) fn driver(&self, key: DependsOn) -> Option<usize> {
        self.drivers.iter().position(|d| d.key == key)
    }
}

/// Everything that varies: each joint's angle and gravity torque, time, temperature, load.
fn drivers(run: &Run) -> Vec<Driver> {
    let names = run.model.chain().joint_names();
    let units = joint_units(run);
    let driven: Vec<_> = run.observations.iter().map(|o| run.model.drivers(&run.session, o)).collect();
    let mut all = Vec::new();
    for (j, (name, unit)) in names.iter().zip(&units).enumerate() {
        all.push(Driver {
            key: DependsOn::Angle(j),
            label: format!("{name} [{}]", unit.display_symbol()),
            joint: Some(j),
            values: Column::of_all(driven.iter().map(|d| unit.to_display(d.joint_rad(j)))),
        });
    }
    let masses = match run.model.masses() {
        Some(Masses::Urdf) => "links as in the URDF",
        Some(Masses::Uniform) => "links of 2.5 kg/m",
        None => "links as in the URDF or of 2.5 kg/m",
    };
    let of_joint = |j: usize| driven.iter().map(|d| d.torque()[j].total_nm()).collect();
    let torques_nm: Vec<Vec<f64>> = (0..names.len()).map(of_joint).collect();
    let felt = feels_gravity(&torques_nm);
    for (j, name) in names.iter().enumerate().filter(|(j, _)| felt[*j]) {
        all.push(Driver {
            key: DependsOn::Torque(j),
            label: format!("gravity torque on {name}, {masses} [N m]"),
            joint: Some(j),
            values: Column::of_all(torques_nm[j].iter().copied()),
        });
    }
    let whole = |key, label: &str, values| Driver { key, label: label.into(), joint: None, values };
    let time = run.recorded_time();
    let label = match time.begins().0.iter().flatten().count() {
        0 | 1 => "time since the first dwell [min]",
        _ => "recorded time, without the time between recordings [min]",
    };
    all.push(whole(DependsOn::Time, label, Column::of_all(run.observations.iter().map(|o| time.at_min(o)))));
    let temperature = Column::of(run.observations.iter().map(|o| o.temperature_c));
    all.push(whole(DependsOn::Temperature, "temperature [°C]", temperature));
    let elsewhere = run.observations.iter().any(|o| !o.more_loads.is_empty());
    let label = if elsewhere { "all loads on the arm [kg]" } else { "load at the tip [kg]" };
    all.push(whole(
        DependsOn::Load,
        label,
        Column::of_all(run.observations.iter().map(|o| o.all_loads_kg())),
    ));
    all.retain(is_varying);
    all
}

/// Whether a driver moves at all; a joint's angle and time always belong on an axis.
fn is_varying(driver: &Driver) -> bool {
    let size = driver.values.0.iter().flatten().fold(0.0, |size: f64, v| size.max(v.abs()));
    matches!(driver.key, DependsOn::Time | DependsOn::Angle(_)) || spread(driver) > SMALLEST_SPREAD * size
}

/// Largest minus smallest value.
fn spread(driver: &Driver) -> f64 {
    let known = driver.values.0.iter().flatten();
    let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if high >= low { high - low } else { 0.0 }
}
