use armcal_mistakes::judge::{Case, Judgement, run_case};
use armcal_mistakes::run::{Place, Statement};
use armcal_mistakes::{Rig, kinds, sound};
use std::path::Path;

/// A seed of its own: not that of the table in the documentation.
const SEED: u64 = 41;

/// Mistakes whose cause is named, on the rigs where it is.
const NAMED: &[(&str, Rig)] = &[
    ("degrees-read-as-radians", Rig::Sockets),
    ("positions-in-millimetres", Rig::Table),
    ("joint-name-misspelt", Rig::Poses),
    ("topic-misspelt", Rig::Table),
    ("file-cut", Rig::Sockets),
    ("degrees-read-as-radians", Rig::Poses),
    ("first-joint-reversed", Rig::Table),
    ("half-turn-off", Rig::Table),
    ("tip-axis-mirrored", Rig::Table),
    ("joint-frozen-from-the-middle", Rig::Sockets),
    ("joint-stamps-in-microseconds", Rig::Sockets),
    ("tip-is-a-still-body", Rig::Poses),
    ("encoder-stale", Rig::Sockets),
];

fn answer(name: &str, rig: Rig) -> Case {
    let folder = tempfile::tempdir().expect("temporary folder");
    let kind = kinds::find_kind(name).expect("a kind");
    let case =
        run_case(Path::new(env!("CARGO_BIN_EXE_armcal")), &kind, rig, SEED, folder.path()).expect("a case");
    println!("{name} on {rig:?}: {:?}, reported {:?}", case.judgement, case.reported);
    case
}

fn stay_named(on: Rig) {
    for (name, rig) in NAMED.iter().filter(|(_, rig)| *rig == on) {
        let case = answer(name, *rig);
        assert_eq!(case.judgement, Judgement::Right, "{name} on {rig:?}: {:#?}", case.said);
    }
}

#[test]
fn mistakes_on_a_rig_of_sockets_that_are_named_stay_named() {
    stay_named(Rig::Sockets);
}

#[test]
fn mistakes_on_a_table_that_are_named_stay_named() {
    stay_named(Rig::Table);
}

#[test]
fn mistakes_on_an_arm_of_free_poses_that_are_named_stay_named() {
    stay_named(Rig::Poses);
}

#[test]
fn a_joint_that_was_homed_again_is_told_with_the_recording_from_which_on() {
    // By its truth the second of three recordings and the third begin with another zero.
    let case = answer("homed-again-between-recordings", Rig::Table);
    let setup: Vec<&Statement> = case.said.statements.iter().filter(|s| s.place == Place::Setup).collect();
    let [told] = setup.as_slice() else { panic!("{:#?}", case.said) };
    assert_eq!(told.code, "joint-zero");
    assert!(told.text.contains("from recording `roll` on"), "{}", told.text);
    assert_eq!(case.judgement, Judgement::Right);
}

#[test]
fn a_sound_session_of_each_rig_is_not_accused() {
    for number in 0..6 {
        let folder = tempfile::tempdir().expect("temporary folder");
        let armcal = Path::new(env!("CARGO_BIN_EXE_armcal"));
        let sound = sound::run_session(armcal, number, SEED, folder.path()).expect("a sound session");
        assert!(sound.alarms.is_empty(), "{:?}, hidden {}: {:?}", sound.rig, sound.hidden, sound.alarms);
    }
}
