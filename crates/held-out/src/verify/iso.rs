//! What the recordings say by the criteria of ISO 9283: stops and paths against what was commanded.
//!
//! A command is a set-point seen through a model: the nominal one is what a factory controller believes it commands,
//! the calibrated one what a compensated controller commands. Where set-points are not recorded, the encoder readings
//! stand for them, and what the servo leaves over does not count.

use super::motion::{Motion, set_point};
use crate::error::HeldOutError;
use armcal_core::{Dwell, DwellId, Observation, Reference, Samples};
use armcal_iso9283::{Evidence, PathTest, Settings, TimedPose, TipPose, Visit, assess};
use armcal_result::IsoReport;
use armcal_stages::{Placed, PlacedBase};
use armcal_stages::{RecordingData, observe};
use armcal_verify::{PathError, Planned, Polyline};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Set-points closer than this, in every joint, are one command [rad]: rounding, not intention.
const SAME_COMMAND_RAD: f64 = 1e-3;
/// Commanded paths that differ by less than this at every tenth of their length are one command [m].
const SAME_PATH_M: f64 = 1e-3;
/// Corners of a commanded path that are smaller than this are the jitter of its samples [m].
const JITTER_M: f64 = 2e-4;
/// Shorter motions are no path to judge [m].
const SHORTEST_PATH_M: f64 = 0.1;
/// How much of the motion before a stop is looked at [s].
const ARRIVAL_S: f64 = 3.0;
/// The approach is the direction over this last way before the stop [m].
const APPROACH_M: f64 = 2e-3;

/// Everything the recordings show, in the calibrated base frame.
pub struct Shown<'a> {
    pub placed: &'a Placed,
    pub base: PlacedBase<'a>,
    pub seen: &'a [RecordingData],
    pub samples: &'a [Samples],
    pub motions: &'a [Motion],
}

impl Shown<'_> {
    /// Both assessments.
    pub fn assess(&self) -> Result<IsoReport, HeldOutError> {
        let by = |values, path| assess(&self.evidence(Side { values, path }), &Settings::default());
        let commands_recorded = self.samples.iter().any(|s| s.set_points.is_some());
        let nominal = by(&self.placed.nominal, |planned| &planned.before)?;
        let calibrated = by(&self.placed.calibrated, |planned| &planned.after)?;
        Ok(IsoReport { commands_recorded, nominal, calibrated })
    }

    fn evidence(&self, side: Side<'_>) -> Evidence {
        let mut visits = Vec::new();
        let mut commands: Vec<Command> = Vec::new();
        for (recording, (seen, samples)) in self.seen.iter().zip(self.samples).enumerate() {
            for (index, dwell) in seen.dwells.iter().enumerate() {
                let before = index.checked_sub(1).map(|i| &seen.dwells[i]);
                visits.extend(self.visit(side, recording, samples, dwell, before, &mut commands));
            }
        }
        // The standard's criteria are about repeats: what was commanded once tests nothing.
        let mut times: BTreeMap<String, usize> = BTreeMap::new();
        visits.iter().for_each(|v: &Visit| *times.entry(v.pose.clone()).or_default() += 1);
        visits.retain(|v| times[&v.pose] > 1);
        Evidence { visits, paths: self.paths(side) }
    }

    /// One stop at which the sensor saw the tip.
    fn visit(
        &self,
        side: Side<'_>,
        recording: usize,
        samples: &Samples,
        dwell: &Dwell,
        before: Option<&Dwell>,
        commands: &mut Vec<Command>,
    ) -> Option<Visit> {
        let tip_m = self.base.from_world_m(&dwell.tip.as_ref()?.position_m);
        let asked = samples.set_points.as_ref().and_then(|s| set_point(s, dwell.mid_ns()));
        let joint_rad = asked.unwrap_or_else(|| dwell.joint_rad.clone());
        let commanded_m = self.commanded_m(side, recording, dwell, joint_rad.clone());
        let same =
            |c: &Command| c.joint_rad.iter().zip(&joint_rad).all(|(a, b)| (a - b).abs() < SAME_COMMAND_RAD);
        let at = commands.iter().position(same).unwrap_or_else(|| {
            commands.push(Command { joint_rad: joint_rad.clone(), commanded_m });
            commands.len() - 1
        });
        // Cycles of one command have one commanded pose; what differs by rounding moves the attained pose along.
        let attained_m = tip_m + commands[at].commanded_m - commanded_m;
        let way = self.way_to(recording, dwell, tip_m);
        Some(Visit {
            pose: format!("P{}", at + 1),
            recording,
            commanded: TipPose::at(commands[at].commanded_m),
            attained: TipPose::at(attained_m),
            time_ns: dwell.mid_ns(),
            approach: approach_direction(&way),
            departed_ns: before.map(|d| d.end_ns),
            arrival: way
                .iter()
                .map(|(time_ns, m)| TimedPose {
                    time_ns: *time_ns,
                    pose: TipPose::at(m + commands[at].commanded_m - commanded_m),
                })
                .collect(),
        })
    }

    /// The tip on its way to a stop, and at rest there.
    fn way_to(&self, recording: usize, dwell: &Dwell, tip_m: Vector3<f64>) -> Vec<(i64, Vector3<f64>)> {
        let errors = &self.motions[recording].errors;
        let end = errors.partition_point(|e| e.time_ns < dwell.start_ns);
        let since_ns = dwell.start_ns.saturating_sub((ARRIVAL_S * 1e9) as i64);
        let motion = errors[..end].last().map(|e| e.motion);
        let moving = errors[..end]
            .iter()
            .filter(|e| e.time_ns >= since_ns && Some(e.motion) == motion)
            .map(|e| (e.time_ns, e.measured_m));
        moving.chain([(dwell.start_ns, tip_m)]).collect()
    }

    fn commanded_m(
        &self,
        side: Side<'_>,
        recording: usize,
        dwell: &Dwell,
        joint_rad: Vec<f64>,
    ) -> Vector3<f64> {
        let (seen, nowhere) = (&self.seen[recording], Reference::position(Vector3::zeros()));
        let o =
            Observation { joint_rad, ..observe::dwell_observation(dwell, seen, nowhere, Matrix3::zeros()) };
        self.base.predicted_tip_m(side.values, &o)
    }

    /// Commanded paths with their runs: motions that were commanded alike are cycles of one path.
    fn paths(&self, side: Side<'_>) -> Vec<PathTest> {
        let mut tests: Vec<(Polyline, PathTest)> = Vec::new();
        for motion in self.motions {
            for (id, planned) in &motion.planned {
                let path = (side.path)(planned);
                if path.length_m() < SHORTEST_PATH_M {
                    continue;
                }
                let run = run_of(&motion.errors, *id);
                match tests.iter_mut().find(|(known, _)| known.is_like(path, SAME_PATH_M)) {
                    Some((_, test)) => test.runs.push(run),
                    None => {
                        let name = format!("path {}", tests.len() + 1);
                        let corners = path.simplified(JITTER_M);
                        let commanded = corners.points_m().iter().map(|m| TipPose::at(*m)).collect();
                        let test = PathTest { name, commanded, runs: vec![run], speed_m_s: None };
                        tests.push((path.clone(), test));
                    }
                }
            }
        }
        tests.into_iter().map(|(_, test)| test).filter(|test| test.runs.len() > 1).collect()
    }
}

/// Through which model commands are seen.
#[derive(Clone, Copy)]
struct Side<'a> {
    values: &'a [f64],
    path: fn(&Planned) -> &Polyline,
}

/// A commanded pose.
struct Command {
    joint_rad: Vec<f64>,
    commanded_m: Vector3<f64>,
}

/// Direction of the last way before the stop, where it is long enough.
fn approach_direction(way: &[(i64, Vector3<f64>)]) -> Option<Vector3<f64>> {
    let stop_m = way.last()?.1;
    let from = way.iter().rev().find(|(_, m)| (stop_m - m).norm() > APPROACH_M)?;
    Some(stop_m - from.1)
}

fn run_of(errors: &[PathError], motion: DwellId) -> Vec<TimedPose> {
    let own = errors.iter().filter(|e| e.motion == motion);
    own.map(|e| TimedPose { time_ns: e.time_ns, pose: TipPose::at(e.measured_m) }).collect()
}
