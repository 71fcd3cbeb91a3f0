//! Clause 8 from a commanded path and what was attained.

use crate::catalogue::{
    CORNER_OVERSHOOT, Component, PATH_ACCURACY, PATH_REPEATABILITY, REORIENTATION, ROUND_OFF,
    VELOCITY_ACCURACY, VELOCITY_FLUCTUATION, VELOCITY_REPEATABILITY,
};
use crate::command::{CommandPath, Plane};
use crate::criterion::{Findings, Place};
use crate::evidence::{PathTest, Settings};
use crate::path::{path_accuracy, path_repeatability};
use crate::planes::{Crossing, find_crossings};
use crate::settling::elapsed_s;
use crate::tip_pose::TipPose;
use crate::velocity::{velocity_accuracy, velocity_fluctuation_m_s, velocity_repeatability};
use crate::{IsoError, cornering};
use nalgebra::Vector3;

/// A crossing further from the command than this part of the path's length is another motion: the far side of a
/// circle is 1/pi of its length away.
const REACH: f64 = 0.3;

pub(super) fn assess(path: &PathTest, settings: &Settings, findings: &mut Findings) -> Result<(), IsoError> {
    let command = CommandPath::new(&path.commanded)?;
    let planes = command.planes(settings.planes);
    let reach_m = REACH * command.length_m();
    let runs: Vec<Vec<Option<Crossing>>> =
        path.runs.iter().map(|run| find_crossings(&planes, run, reach_m)).collect();
    assess_planes(path, &command, settings, &planes, &runs, findings);
    assess_corners(path, &command, settings, findings);
    assess_speed(path, &planes, &runs, findings);
    Ok(())
}

/// AT and RT on the planes that every run crosses.
fn assess_planes(
    path: &PathTest,
    command: &CommandPath,
    settings: &Settings,
    planes: &[Plane],
    runs: &[Vec<Option<Crossing>>],
    findings: &mut Findings,
) {
    let (mut commanded, mut attained): (Vec<TipPose>, Vec<Vec<TipPose>>) = (Vec::new(), Vec::new());
    for (index, plane) in planes.iter().enumerate() {
        let poses: Option<Vec<TipPose>> =
            runs.iter().map(|run| run[index].map(|crossing| crossing.pose)).collect();
        if let Some(poses) = poses.filter(|poses| !poses.is_empty()) {
            commanded.push(plane.pose);
            attained.push(poses);
        }
    }
    let missed = planes.len() - commanded.len();
    let missed =
        (missed > 0).then(|| format!("{missed} of {} planes not crossed by every run", planes.len()));
    let notes: Vec<String> = missed.into_iter().collect();
    let place = Place { at: &path.name, n: runs.len(), notes: &notes };
    let accuracy = path_accuracy(&commanded, &attained);
    let turns_rad = command.reorientation_rad();
    if turns_rad.is_some_and(|turn_rad| turn_rad > settings.reorientation_rad) {
        match &accuracy {
            Ok(at) => findings.give(&REORIENTATION, Component::Position, at.position_m, &place),
            Err(why) => findings.lack(&REORIENTATION, &path.name, why),
        }
    } else {
        findings.lack(&REORIENTATION, &path.name, REORIENTATION.needs);
    }
    findings.tell_deviation(&PATH_ACCURACY, accuracy, &place);
    findings.tell_deviation(&PATH_REPEATABILITY, path_repeatability(&attained), &place);
}

fn assess_corners(path: &PathTest, command: &CommandPath, settings: &Settings, findings: &mut Findings) {
    let positions_m: Vec<Vec<Vector3<f64>>> =
        path.runs.iter().map(|run| run.iter().map(|s| s.pose.position_m).collect()).collect();
    for (index, corner) in command.corners(settings.corner_rad).iter().enumerate() {
        let at = format!("{} corner {}", path.name, index + 1);
        let place = Place { at: &at, n: path.runs.len(), notes: &[] };
        findings.tell(&ROUND_OFF, cornering::round_off_m(corner, &positions_m), &place);
        findings.tell(&CORNER_OVERSHOOT, cornering::overshoot_m(corner, &positions_m), &place);
    }
}

/// Speeds between neighbouring planes, in the middle half of the path.
fn assess_speed(path: &PathTest, planes: &[Plane], runs: &[Vec<Option<Crossing>>], findings: &mut Findings) {
    let all = [&VELOCITY_ACCURACY, &VELOCITY_REPEATABILITY, &VELOCITY_FLUCTUATION];
    let Some(commanded_m_s) = path.speed_m_s else {
        return all.iter().for_each(|what| findings.lack(what, &path.name, what.needs));
    };
    let middle = planes.len() / 4..planes.len() - planes.len() / 4;
    let speeds_m_s: Vec<Vec<f64>> = runs.iter().map(|run| speeds_m_s(&run[middle.clone()])).collect();
    let spacing_m = planes.windows(2).next().map_or(0.0, |pair| pair[1].along_m - pair[0].along_m);
    let notes = [format!("speeds over {:.1} mm each, in the middle half of the path", spacing_m * 1e3)];
    let place = Place { at: &path.name, n: runs.len(), notes: &notes };
    findings.tell(&VELOCITY_ACCURACY, velocity_accuracy(commanded_m_s, &speeds_m_s), &place);
    findings.tell(&VELOCITY_REPEATABILITY, velocity_repeatability(commanded_m_s, &speeds_m_s), &place);
    findings.tell(&VELOCITY_FLUCTUATION, velocity_fluctuation_m_s(&speeds_m_s), &place);
}

fn speeds_m_s(crossings: &[Option<Crossing>]) -> Vec<f64> {
    let pieces = crossings.windows(2).filter_map(|pair| pair[0].zip(pair[1]));
    let moving = pieces.filter(|(from, to)| to.time_ns > from.time_ns);
    moving
        .map(|(from, to)| {
            (to.pose.position_m - from.pose.position_m).norm() / elapsed_s(from.time_ns, to.time_ns)
        })
        .collect()
}
