//! Families of events and drifts, of sensors and boards.

use super::*;
use crate::checks::value_error;
use armcal_core::Pose;
use nalgebra::Point3;

pub fn zero_slip(draw: &mut Draw, config: &LabConfig, timing: Timing) -> Result<Made, LabError> {
    let slip_deg = draw.signed();
    let Event { recording, at_s, until_s, when } = draw.event(config, timing)?;
    let slip = ZeroSlip { joint: draw.joint, slip_deg, recording, at_s, until_s };
    let same = match draw.joint {
        1 => vec![format!("frame_shift{when}")],
        joint if joint == config.arm.drives.len() => vec![format!("tool_shift{when}")],
        _ => Vec::new(),
    };
    let effect = draw.at_joint("zero_slip") + &when;
    let enters = [draw.joint_channel(), "recording".to_owned()];
    Ok(known_effect(MechanismConfig::ZeroSlip(slip), effect, enters).same(&same))
}

pub fn body_shift(
    draw: &mut Draw,
    config: &LabConfig,
    body: BumpedBody,
    timing: Timing,
) -> Result<Made, LabError> {
    let shift_mm: [f64; 3] = (draw.direction() * draw.size).into();
    let turn_deg =
        if body == BumpedBody::Base { draw.direction() * (0.1 * draw.size) } else { Vector3::zeros() };
    let Event { recording, at_s, until_s, when } = draw.event(config, timing)?;
    let knock = Bump { body, marker: None, shift_mm, turn_deg: turn_deg.into(), recording, at_s, until_s };
    if body == BumpedBody::Marker {
        return markers_of_tip(config, knock);
    }
    let (effect, channel, alike) = match body {
        BumpedBody::Tool => {
            ("tool_shift", "tip", vec![format!("zero_slip:3{when}"), format!("frame_shift{when}")])
        }
        _ => ("frame_shift", "world", vec![format!("zero_slip:1{when}"), format!("tool_shift{when}")]),
    };
    let enters = [channel.to_owned(), "recording".to_owned()];
    Ok(known_effect(MechanismConfig::Bump(knock), format!("{effect}{when}"), enters).alike(&alike))
}

/// Only the sensor sees it: its name is that of the first dwell that is tracked after it, whatever sat in cavities meanwhile.
fn markers_of_tip(config: &LabConfig, knock: Bump) -> Result<Made, LabError> {
    let rehearsal = observe(config)?;
    let at_ns = config.start_ns(knock.recording) + (knock.at_s * 1e9) as i64;
    let of_it = || rehearsal.observations.iter().filter(|o| o.dwell.recording == knock.recording);
    let tracked = |o: &armcal_core::Observation| o.cavity().is_none();
    let after = of_it().position(|o| o.time_ns >= at_ns && tracked(o));
    let first =
        after.ok_or_else(|| value_error("scenario.design", "tracks no dwell after the event".into()))?;
    let before = of_it().take(first).filter(|o| tracked(o)).count();
    let name = |effect: &str| format!("{effect}@{}.{first}", knock.recording);
    let mut same = Vec::new();
    if before == 0 && knock.recording + 1 == config.recordings.len() {
        same.push(format!("tip_marker_shift@{}", knock.recording));
    }
    let mut later = rehearsal.observations.iter().filter(|o| o.time_ns >= at_ns);
    if later.all(tracked) {
        same.push(name("tool_shift"));
    }
    let enters = ["tip".to_owned(), "recording".to_owned()];
    let effect = name("tip_marker_shift");
    Ok(known_effect(MechanismConfig::Bump(knock), effect, enters).same(&same))
}

/// Read at the end of its rest, a joint has this share of its last move before it: only where motors drive the arm to
/// free poses.
pub fn unsettled_reading(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    config.task.free.by_hand = false;
    let [_, longest_s] = config.task.free.hold_s;
    config.task.free.hold_s = [longest_s; 2];
    let lag = Lag { joint: draw.joint, time_constant_s: longest_s / -draw.size.ln(), before: None };
    let enters = [draw.joint_channel(), format!("s{}", draw.joint)];
    let made = known_effect(MechanismConfig::Lag(lag), draw.at_joint("unsettled_reading"), enters);
    Ok(made
        .alike_unless(draw.design.is_wide(), &[draw.at_joint("backlash"), draw.at_joint("friction_windup")]))
}

/// Length of the session [s].
fn session_s(config: &LabConfig) -> Result<f64, LabError> {
    let rehearsal = observe(config)?;
    let times = || rehearsal.observations.iter().map(|o| o.time_ns);
    let (first, last) = (times().min().unwrap_or_default(), times().max().unwrap_or_default());
    Ok((last - first).max(1) as f64 * 1e-9)
}

fn slow_relatives() -> Vec<String> {
    let mut all: Vec<String> =
        ["frame_drift", "thermal_growth", "warm_up"].iter().map(|name| (*name).to_owned()).collect();
    all.extend((1..=3).map(|joint| format!("zero_drift:{joint}")));
    all
}

pub fn zero_drift(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let deg_per_hour = draw.signed() * 3600.0 / session_s(config)?;
    let drift = ZeroDrift { joint: draw.joint, deg_per_hour };
    let enters = [draw.joint_channel(), "time".to_owned()];
    let made = known_effect(MechanismConfig::ZeroDrift(drift), draw.at_joint("zero_drift"), enters);
    Ok(made.alike_unless(draw.design.is_wide(), &slow_relatives()))
}

pub fn frame_drift(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let way = draw.direction() * (draw.size * 3600.0 / session_s(config)?);
    let drift = FrameDrift { body: DriftingBody::Base, mm_per_hour: way.into() };
    let enters = ["world".to_owned(), "time".to_owned()];
    let made = known_effect(MechanismConfig::FrameDrift(drift), "frame_drift".into(), enters);
    Ok(made.alike_unless(draw.design.is_wide(), &slow_relatives()))
}

/// Printed links: 70 ppm/K.
const PLASTIC_PPM: f64 = 70.0;

pub fn thermal_growth(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    // The size is reached when the thermometer no longer rises.
    config.temperature.rise_k = draw.size * 1e4 / PLASTIC_PPM;
    let growth = ThermalGrowth { links: vec![1, 2, 3], per_kelvin_ppm: PLASTIC_PPM, ..Default::default() };
    let enters = ["length".to_owned(), "temperature".to_owned()];
    let made = known_effect(MechanismConfig::ThermalGrowth(growth), "thermal_growth".into(), enters);
    Ok(made.alike_unless(draw.design.is_wide(), &slow_relatives()))
}

pub fn warm_up(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    config.temperature.published = false;
    let time_constant_s = draw.draw.uniform([400.0, 1200.0]);
    let warming = WarmUp {
        links: vec![1, 2, 3],
        per_kelvin_ppm: PLASTIC_PPM,
        rise_k: draw.size * 1e4 / PLASTIC_PPM,
        time_constant_s,
        ..Default::default()
    };
    let enters = ["length".to_owned(), "time".to_owned()];
    let made = known_effect(MechanismConfig::WarmUp(warming), "warm_up".into(), enters);
    Ok(made.alike(&["thermal_growth".to_owned()]).alike_unless(draw.design.is_wide(), &slow_relatives()))
}

/// Between the base and the board, where the arm works, in the world [m].
fn middle_m(config: &LabConfig) -> [f64; 3] {
    (Pose::from(config.base) * Point3::new(0.3, 0.0, 0.3)).coords.into()
}

pub fn sensor_scale(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    let axes = draw.direction();
    let percent: [f64; 3] = (axes * (draw.size / axes.amax())).into();
    let wand = CameraScale { percent, centre_m: middle_m(config) };
    let enters = ["world".to_owned(), "position".to_owned()];
    let made = known_effect(MechanismConfig::CameraScale(wand), "sensor_scale".into(), enters);
    Ok(made.alike(&["volume_distortion".to_owned(), "board_scale".to_owned()]))
}

pub fn volume_distortion(draw: &mut Draw, config: &mut LabConfig) -> Result<Made, LabError> {
    // The edge of the arm's own volume is half a metre away.
    let mm_at_1m = draw.signed() / 0.5f64.powi(3);
    let lens = CameraDistortion { mm_at_1m, centre_m: middle_m(config) };
    let enters = ["world".to_owned(), "position".to_owned()];
    let made = known_effect(MechanismConfig::CameraDistortion(lens), "volume_distortion".into(), enters);
    Ok(made.alike(&["sensor_scale".to_owned()]))
}

pub fn board_scale(draw: &mut Draw, _config: &mut LabConfig) -> Result<Made, LabError> {
    let percent = [draw.signed(); 3];
    let enters = ["board".to_owned(), "position".to_owned()];
    let made =
        known_effect(MechanismConfig::BoardScale(BoardScale { percent }), "board_scale".into(), enters);
    Ok(made.alike(&["sensor_scale".to_owned()]))
}
