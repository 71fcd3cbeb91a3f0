//! Scenarios.

use super::*;
use crate::mechanisms::MechanismConfig;
use crate::scenario::{Design, Size};
use armcal_core::Reference;

fn everything() -> Vec<&'static str> {
    catalogue_families().into_iter().chain(null_families()).chain(uncatalogued_families()).collect()
}

#[test]
fn every_family_can_be_observed_and_says_what_it_hides() {
    let start = std::time::Instant::now();
    for name in everything() {
        let scenario = Scenario { size: Size::Medium, ..Scenario::new(name, Design::FreePoses, 3) };
        let seen = scenario.observe().unwrap();
        assert!((260..=297).contains(&seen.observations.len()), "{name}: {}", seen.observations.len());
        let hidden = &seen.truth.hidden;
        let displaced = name.starts_with("nothing:smooth");
        assert_eq!(hidden.len(), usize::from(displaced || !name.starts_with("nothing")), "{name}");
        for h in hidden {
            assert_eq!(h.effect.is_none(), displaced || name.starts_with("outside:"), "{name}");
            assert_eq!(h.is_discrepancy(), displaced, "{name}");
            assert!(!h.channel.is_empty() && !h.driver.is_empty() && h.size != 0.0);
        }
        let json = serde_json::to_string(&seen.truth).unwrap();
        let back: crate::Truth = serde_json::from_str(&json).unwrap();
        assert_eq!(
            back.hidden.iter().map(|h| &h.effect).collect::<Vec<_>>(),
            hidden.iter().map(|h| &h.effect).collect::<Vec<_>>()
        );
        assert_eq!(back.config.mechanisms.len(), seen.truth.config.mechanisms.len(), "{name}");
    }
    println!("{} sessions in {:?}", everything().len(), start.elapsed());
}

/// How far what is hidden moves the tip, or its reading: mean over the dwells [m].
fn moved_m(name: &str, design: Design) -> f64 {
    let scenario = Scenario { size: Size::Medium, ..Scenario::new(name, design, 8) };
    let mut planted = scenario.plant().unwrap();
    let with = observe(&planted.config).unwrap();
    planted.config.mechanisms.clear();
    let without = observe(&planted.config).unwrap();
    let arm = crate::arm::AxisArm::from_rows(&with.truth.rows);
    let pairs = with.observations.iter().zip(&without.observations);
    let moved: Vec<f64> = pairs
        .map(|(a, b)| match (&a.reference, &b.reference) {
            (Reference::Tracked { position_m: p, .. }, Reference::Tracked { position_m: q, .. }) => {
                (p - q).norm() + (arm.tip(&a.joint_rad) - arm.tip(&b.joint_rad)).norm()
            }
            _ => (arm.tip(&a.joint_rad) - arm.tip(&b.joint_rad)).norm(),
        })
        .collect();
    moved.iter().sum::<f64>() / moved.len() as f64
}

#[test]
fn a_middling_size_moves_the_tip_by_tenths_to_some_millimetres() {
    for name in catalogue_families().into_iter().chain(uncatalogued_families()) {
        let moved_mm = 1e3 * moved_m(name, Design::FreePoses);
        println!("{name}: {moved_mm:.2} mm");
        assert!((0.05..12.0).contains(&moved_mm), "{name}: {moved_mm} mm");
    }
}

/// As large as asked at the dwells that are seen, with the hand led to another place by it; smooth; and the seed's own.
#[test]
fn a_discrepancy_is_smooth_and_as_large_as_asked() {
    let sum = |name: &str, seed| {
        let mut planted = Scenario::new(name, Design::FreePoses, seed).plant().unwrap();
        let Some(MechanismConfig::Waves(waves)) = planted.config.mechanisms.pop() else { panic!("no waves") };
        (waves, planted)
    };
    for (name, times) in [("nothing:smooth_3", 3.0), ("nothing:smooth_10", 10.0)] {
        for seed in 0..4 {
            let (waves, _) = sum(name, seed);
            let seen = Scenario::new(name, Design::FreePoses, seed).observe().unwrap();
            let asked_m = times * discrepancy::declared_m(&seen.observations);
            let ratio = discrepancy::spread_m(&waves, &seen.observations) / asked_m;
            assert!((ratio - 1.0).abs() < 0.05, "{name} seed {seed}: {ratio} of what was asked");
            let arm = crate::arm::AxisArm::from_rows(&seen.truth.rows);
            let neighbour = |q: &Vec<f64>| q.iter().map(|q| q + 0.01).collect::<Vec<_>>();
            for q in seen.observations.iter().map(|o| &o.joint_rad) {
                let to = neighbour(q);
                let (apart_m, change_m) =
                    ((arm.tip(q) - arm.tip(&to)).norm(), (waves.shift_m(q) - waves.shift_m(&to)).norm());
                let share = change_m / asked_m * 0.01 / apart_m;
                assert!(share < 0.35, "{name} seed {seed}: {share} of its size over 1 cm");
            }
        }
    }
    assert_eq!(sum("nothing:smooth_3", 1), sum("nothing:smooth_3", 1));
    assert_ne!(sum("nothing:smooth_3", 1).0, sum("nothing:smooth_3", 2).0);
}

/// The tip itself is displaced: what the camera sees, and what is seated in a cavity, both differ from the rigid arm.
#[test]
fn a_discrepancy_moves_the_true_tip() {
    let seen = Scenario::new("nothing:smooth_10", Design::FreePoses, 3).observe().unwrap();
    let Some(MechanismConfig::Waves(waves)) = seen.truth.config.mechanisms.first() else {
        panic!("no waves")
    };
    let arm = crate::arm::AxisArm::from_rows(&seen.truth.rows);
    let base = &seen.truth.world_from_base;
    let turn = nalgebra::UnitQuaternion::from_quaternion(base.quaternion_xyzw.into());
    for dwell in seen.truth.recordings.iter().flat_map(|recording| &recording.dwells) {
        let from_base_m = nalgebra::Vector3::from(dwell.tip_world_m) - nalgebra::Vector3::from(base.xyz_m);
        let off_m = (turn.inverse() * from_base_m - arm.tip(&dwell.link_rad)).norm();
        assert!((off_m - waves.shift_m(&dwell.link_rad).norm()).abs() < 2e-5, "{off_m} m");
    }
}

#[test]
fn designs_have_the_dwells_they_say() {
    for (design, dwells, recordings) in [
        (Design::OneTiltOnePass, 33, 1),
        (Design::OneTiltBothWays, 66, 1),
        (Design::ThreeTiltsOnePass, 99, 3),
        (Design::ThreeTiltsBothWays, 198, 3),
        (Design::Plunge, 198, 3),
        (Design::FreePoses, 297, 3),
        (Design::Load, 396, 6),
        (Design::FreePosesAndLoad, 594, 6),
        (Design::TrackedOnly, 198, 3),
    ] {
        let seen = Scenario::new("nothing", design, 2).observe().unwrap();
        let n = seen.observations.len();
        assert!(n <= dwells && 10 * n >= 9 * dwells, "{design:?}: {n} of {dwells}");
        assert_eq!(seen.nominal.boards.len(), recordings);
        let seated = seen.observations.iter().filter(|o| o.cavity().is_some()).count();
        assert_eq!(seated == 0, design == Design::TrackedOnly);
        if design == Design::Plunge {
            // Always the same final descent: joints 2 and 3 arrive from one side.
            for joint in [1, 2] {
                let up = seen.observations.iter().filter(|o| o.arrival[joint].sign() > 0.0).count();
                assert!(20 * up.min(n - up) <= n, "joint {joint}: {up} of {n} from below");
            }
        }
    }
}

#[test]
fn an_event_happens_between_the_dwells_it_names() {
    for name in [
        "zero_slip@dwell",
        "tool_shift@dwell",
        "frame_shift@dwell",
        "zero_slip@dwells",
        "tool_shift@dwells",
        "zero_slip",
        "tool_shift",
        "frame_shift",
    ] {
        for seed in 0..4 {
            let scenario =
                Scenario { size: Size::Large, ..Scenario::new(name, Design::ThreeTiltsBothWays, seed) };
            let mut planted = scenario.plant().unwrap();
            let hidden = planted.hidden.remove(0);
            let with = observe(&planted.config).unwrap();
            planted.config.mechanisms.clear();
            let without = observe(&planted.config).unwrap();
            let recording = hidden.recording.unwrap();
            let effect = hidden.effect.unwrap();
            assert!(effect.contains(&format!("@{recording}")));
            let last: usize = effect.split_once('-').map_or(usize::MAX, |(_, last)| last.parse().unwrap());
            for (a, b) in with.observations.iter().zip(&without.observations) {
                let moved = a.joint_rad.iter().zip(&b.joint_rad).any(|(p, q)| (p - q).abs() > 2e-4);
                let since = match hidden.dwell {
                    Some(dwell) if last < usize::MAX => {
                        a.dwell.recording == recording && (dwell..=last).contains(&a.dwell.dwell)
                    }
                    Some(dwell) => (a.dwell.recording, a.dwell.dwell) >= (recording, dwell),
                    // Before the second recording: the first is the odd one out; before the last: the last is.
                    None if recording == 0 => a.dwell.recording > 0,
                    None => a.dwell.recording == recording,
                };
                assert_eq!(
                    moved, since,
                    "{name} seed {seed}: {} against {recording} {:?}",
                    a.dwell, hidden.dwell
                );
            }
        }
    }
}

#[test]
fn two_things_are_hidden_at_once() {
    let scenario = Scenario::new("backlash+compliance", Design::FreePoses, 5);
    let seen = scenario.observe().unwrap();
    assert_eq!(seen.truth.hidden.len(), 2);
    assert_eq!(seen.truth.config.mechanisms.len(), 2);
    assert_eq!(seen, scenario.observe().unwrap());
    let error = Scenario::new("backlsh", Design::FreePoses, 5).plant().unwrap_err().to_string();
    assert!(error.contains("backlsh") && error.contains("backlash,"), "{error}");
}

#[test]
fn sealed_folders_tell_nothing_of_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let (open, truth) = (folder.path().join("open"), folder.path().join("kept/truth.json"));
    let scenario = Scenario::new("outside:cable_drag", Design::OneTiltOnePass, 11);
    let sealed = seal(&scenario, &open, &truth).unwrap();
    assert_eq!(sealed.recordings.len(), 1);
    let words = ["cable", "outside", "mechanism", "seed", "hidden", "scenario", "kept"];
    for entry in std::fs::read_dir(&open).unwrap() {
        let path = entry.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        for word in words.into_iter().filter(|word| !(path.ends_with("board.toml") && *word == "mechanism")) {
            let found = bytes.windows(word.len()).any(|w| w.eq_ignore_ascii_case(word.as_bytes()));
            assert!(!found, "{} says `{word}`", path.display());
        }
    }
    let facts: crate::Truth = serde_json::from_slice(&std::fs::read(&truth).unwrap()).unwrap();
    assert_eq!(facts.scenario, Some(scenario.clone()));
    assert_eq!(facts.hidden[0].channel, "joint2");
    let pipeline: toml::Table = toml::from_str(&std::fs::read_to_string(&sealed.pipeline).unwrap()).unwrap();
    assert_eq!(pipeline["recordings"][0]["paths"][0].as_str(), Some("normal.mcap"));
    let error = seal(&scenario, &open, &open.join("truth.json")).unwrap_err().to_string();
    assert!(error.contains("outside of the folder"), "{error}");
}
