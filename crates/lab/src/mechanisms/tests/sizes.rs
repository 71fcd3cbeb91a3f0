//! Mechanisms of no size, and of sizes that cannot be.

use super::*;
use crate::config::{LabConfig, Order, PassConfig};
use crate::{nothing_hidden, observe_from, simulate_in_memory};
use std::path::Path;

const LABS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../pipelines/lab");

const NOTHING_MUCH: &[&str] = &[
    "kind = 'gap'\njoint = 2\nwidth_deg = 0.0",
    "kind = 'gap'\njoint = 2\nwidth_deg = 0.0\nfriction_nm = 0.0",
    "kind = 'gap'\njoint = 3\nbelt_over = 2\nwidth_deg = 0.0",
    "kind = 'friction_windup'\njoint = 2\nstiffness_nm_rad = 500.0\nfriction_nm = 0.0",
    "kind = 'compliance'\njoint = 2\nstiffness_nm_rad = 1e300",
    "kind = 'belt_compliance'\njoint = 2\nstiffness_nm_rad = 1e300",
    "kind = 'link_bending'\nlink = 2\nstiffness_nm2 = 1e300",
    "kind = 'base_compliance'\nstiffness_nm_rad = 1e300",
    "kind = 'eccentricity'\njoint = 1\noffset_mm = 0.0\nradius_mm = 20.0",
    "kind = 'eccentricity'\njoint = 1\noffset_mm = 0.0\nradius_mm = 20.0\non = 'encoder'",
    "kind = 'second_harmonic'\njoint = 1\namplitude_deg = 0.0",
    "kind = 'tooth_runout'\njoint = 1\namplitude_deg = 0.0\nper_turn = 30",
    "kind = 'gear_ratio'\njoint = 1\nerror_percent = 0.0",
    "kind = 'belt_coupling'\nshare_percent = 0.0",
    "kind = 'axis_tilt'\njoint = 3\ntilt_deg = 0.0",
    "kind = 'zero_slip'\njoint = 1\nslip_deg = 0.0\nrecording = 0",
    "kind = 'bump'\nbody = 'base'\nrecording = 0",
    "kind = 'bump'\nbody = 'tool'\nrecording = 0",
    "kind = 'bump'\nbody = 'cameras'\nrecording = 0",
    "kind = 'thermal_growth'\nper_kelvin_ppm = 0.0",
    "kind = 'warm_up'\nper_kelvin_ppm = 0.0\nrise_k = 10\ntime_constant_s = 900",
    "kind = 'zero_drift'\njoint = 1\ndeg_per_hour = 0.0",
    "kind = 'frame_drift'\nbody = 'base'\nmm_per_hour = [0.0, 0.0, 0.0]",
    "kind = 'camera_scale'\npercent = [0.0, 0.0, 0.0]\ncentre_m = [1.0, 0.3, 0.7]",
    "kind = 'camera_distortion'\nmm_at_1m = 0.0",
    "kind = 'board_scale'\npercent = [0.0, 0.0, 0.0]",
    "kind = 'axis_wobble'\njoint = 1\ntilt_deg = 0.0\nper_turn = 3",
    "kind = 'cable_drag'\njoint = 2\nby = 1\ncable_nm_rad = 0.0\nslack_deg = 5\ngear_nm_rad = 400",
    "kind = 'damaged_teeth'\njoint = 1\nheight_deg = 0.0\ncentre_deg = 5\nspan_deg = 7",
    "kind = 'sawtooth'\njoint = 1\namplitude_deg = 0.0\nper_turn = 12",
    "kind = 'soft_stop'\njoint = 2\nfrom_deg = -45\ngive_percent = 0.0",
    "kind = 'twist'\nlink = 2\nby = 1\ndeg_at_45 = 0.0",
    "kind = 'room_temperature'\nper_kelvin_ppm = 70\nswing_k = 0.0\nperiod_s = 300\ntime_constant_s = 60",
    "kind = 'crossed_friction'\njoint = 2\nby = 3\nfriction_nm = 0.0\nstiffness_nm_rad = 500",
    "kind = 'waves'\nwaves = [{ per_rad = [1, 2, 3], phase_rad = 0.5, shift_mm = [0.0, 0.0, 0.0] }]",
];

fn lab() -> LabConfig {
    let path = Path::new(LABS).join("paper-small.toml");
    let mut config = LabConfig::from_toml(&std::fs::read_to_string(&path).unwrap(), &path).unwrap();
    config.recordings.truncate(1);
    config.task.passes = vec![PassConfig { order: Order::Forward, share: 0.1 }];
    config.task.free.poses = 2;
    config
}

#[test]
fn a_mechanism_of_no_size_changes_no_bit() {
    let plain = lab();
    let (rigid, _) = simulate_in_memory(&plain, Path::new(LABS), &nothing_hidden).unwrap();
    let quick = observe_from(&plain, Path::new(LABS)).unwrap().observations;
    let kinds = NOTHING_MUCH.iter().map(|text| toml::from_str::<MechanismConfig>(text).unwrap());
    for (text, mechanism) in NOTHING_MUCH.iter().zip(kinds) {
        let config = LabConfig { mechanisms: vec![mechanism], ..plain.clone() };
        config.check().unwrap();
        assert_eq!(observe_from(&config, Path::new(LABS)).unwrap().observations, quick, "{text}");
    }
    // All at once through the streams.
    let mechanisms = NOTHING_MUCH.iter().map(|text| toml::from_str(text).unwrap()).collect();
    let (hidden, _) =
        simulate_in_memory(&LabConfig { mechanisms, ..plain }, Path::new(LABS), &nothing_hidden).unwrap();
    assert_eq!(hidden.recordings[0].dwells, rigid.recordings[0].dwells);
}

#[test]
fn what_cannot_be_is_refused_by_its_key() {
    for (text, says) in [
        ("kind = 'gap'\njoint = 4\nwidth_deg = 1", "mechanisms[0].joint"),
        ("kind = 'gap'\njoint = 1\nwidth_deg = -1", "mechanisms[0].width_deg"),
        ("kind = 'compliance'\njoint = 1\nstiffness_nm_rad = 0", "stiffness_nm_rad"),
        ("kind = 'zero_slip'\njoint = 1\nslip_deg = 1\nrecording = 7", "recordings count from 0 to 0"),
        ("kind = 'axis_tilt'\njoint = 1\ntilt_deg = 1", "2 or later"),
        ("kind = 'belt_compliance'\njoint = 3\nstiffness_nm_rad = 1", "mechanisms[0].joint"),
        ("kind = 'gap'\njoint = 1\nwidth_deg = nan", "width_deg"),
        (
            "kind = 'waves'\nwaves = [{ per_rad = [1.0], phase_rad = 0, shift_mm = [1, 0, 0] }]",
            "waves.per_rad",
        ),
    ] {
        let config = LabConfig { mechanisms: vec![toml::from_str(text).unwrap()], ..lab() };
        let error = config.check().unwrap_err().to_string();
        assert!(error.contains(says), "{text}: {error}");
    }
    for (text, says) in [
        ("kind = 'gap'\njoint = 1\nwidth = 1", "width"),
        ("kind = 'gap'\njoint = 1", "width_deg"),
        ("kind = 'gup'", "gap"),
    ] {
        let error = toml::from_str::<MechanismConfig>(text).unwrap_err().to_string();
        assert!(error.contains(says), "{text}: {error}");
    }
}
