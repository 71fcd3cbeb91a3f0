use crate::holdout::resolve;
use crate::{CalibrateError, HoldoutConfig};
use armcal_core::{DwellId, Observation, Reference};
use nalgebra::Vector3;

/// One observation: recording, dwell, and the cavity, if any. Every one has a pose of its own.
fn seen(recording: usize, dwell: usize, cavity: Option<&str>) -> Observation {
    let reference = match cavity {
        Some(cavity) => Reference::Seated { cavity: cavity.to_owned(), in_board_m: Vector3::zeros() },
        None => Reference::position(Vector3::zeros()),
    };
    let pose = vec![0.1 * recording as f64, 0.2 * dwell as f64, 0.05 * (recording * dwell) as f64];
    Observation::bare(DwellId { recording, dwell }, pose, reference)
}

/// Three recordings: cavities c1 to c12 in text order, so that natural order differs, and two tracked dwells in the last.
fn observations() -> Vec<Observation> {
    let mut names: Vec<String> = (1..=12).map(|n| format!("c{n}")).collect();
    names.sort();
    let mut all: Vec<Observation> = Vec::new();
    for recording in 0..3 {
        all.extend(names.iter().enumerate().map(|(dwell, name)| seen(recording, dwell, Some(name))));
    }
    all.extend([seen(2, 12, None), seen(2, 13, None)]);
    all
}

fn boards() -> Vec<String> {
    ["board.flat", "board.rolled", "board.pitched"].map(str::to_owned).to_vec()
}

fn turns_of(config: &str, observations: &[Observation]) -> Result<(Vec<Vec<usize>>, bool), CalibrateError> {
    let config: HoldoutConfig = toml::from_str(config).unwrap();
    let holdout = resolve(&config, observations, &boards())?;
    Ok((holdout.turns, holdout.in_turn))
}

/// Indices of the observations for which this holds.
fn where_is(observations: &[Observation], wanted: impl Fn(&Observation) -> bool) -> Vec<usize> {
    (0..observations.len()).filter(|i| wanted(&observations[*i])).collect()
}

fn refused(config: &str) -> String {
    turns_of(config, &observations()).unwrap_err().to_string()
}

#[test]
fn nothing_is_held_out_by_default() {
    assert_eq!(turns_of("kind = \"none\"", &observations()).unwrap(), (vec![], false));
}

#[test]
fn named_cavities_are_held_out_in_every_recording() {
    let all = observations();
    let (turns, in_turn) = turns_of("kind = \"cavities\"\nnames = [\"c2\", \"c11\"]", &all).unwrap();
    assert_eq!(turns, [where_is(&all, |o| matches!(o.cavity(), Some("c2" | "c11")))]);
    assert_eq!((turns[0].len(), in_turn), (6, false));
    // Leading zeros are another name.
    assert!(refused("kind = \"cavities\"\nnames = [\"c02\"]").contains("did you mean `c12`"));
    assert!(refused("kind = \"cavities\"\nnames = [\"c13\"]").contains("c13"));
}

/// Sorted by numbers in names: c1, c2, .. c12.
#[test]
fn every_nth_cavity_counts_in_natural_order() {
    let all = observations();
    for (n, offset) in [(2, 0), (2, 1), (5, 4), (3, 1)] {
        let config = format!("kind = \"every-nth-cavity\"\nn = {n}\noffset = {offset}");
        let number = |o: &Observation| o.cavity().map(|name| name[1..].parse::<usize>().unwrap() - 1);
        let expected = where_is(&all, |o| number(o).is_some_and(|k| k % n == offset));
        assert_eq!(turns_of(&config, &all).unwrap(), (vec![expected], false), "{config}");
    }
    for config in ["n = 1", "n = 0", "n = 2\noffset = 2", "n = 3\noffset = 7"] {
        let error = refused(&format!("kind = \"every-nth-cavity\"\n{config}"));
        assert!(error.contains("n of 2 or more, offset below n"), "{error}");
    }
}

#[test]
fn recordings_go_by_index_or_by_the_name_of_their_board() {
    let all = observations();
    for key in ["1", "\"rolled\"", "\"board.rolled\""] {
        let config = format!("kind = \"recordings\"\nrecordings = [{key}]");
        let expected = vec![where_is(&all, |o| o.dwell.recording == 1)];
        assert_eq!(turns_of(&config, &all).unwrap(), (expected, false), "{config}");
    }
    let config = "kind = \"recordings\"\nrecordings = [0, \"pitched\"]";
    assert_eq!(turns_of(config, &all).unwrap().0, [where_is(&all, |o| o.dwell.recording != 1)]);
    let error = refused("kind = \"recordings\"\nrecordings = [\"pitch\"]");
    assert!(error.contains("did you mean `pitched`"), "{error}");
    let error = refused("kind = \"recordings\"\nrecordings = [3]");
    assert!(error.contains("by their index in the pipeline") && !error.contains("did you mean"), "{error}");
    let config: HoldoutConfig = toml::from_str("kind = \"recordings\"\nrecordings = [\"flat\"]").unwrap();
    let error = resolve(&config, &all, &[]).unwrap_err().to_string();
    assert!(error.contains("by their index in the pipeline"), "{error}");
}

#[test]
fn each_recording_has_its_turn_and_folds_deal_them_out() {
    let all = observations();
    let of = |r: usize| where_is(&all, |o| o.dwell.recording == r);
    assert_eq!(turns_of("kind = \"each-recording\"", &all).unwrap(), (vec![of(0), of(1), of(2)], true));
    let mut of_0_and_2 = of(0);
    of_0_and_2.extend(of(2));
    let (turns, in_turn) = turns_of("kind = \"recording-folds\"\nk = 2", &all).unwrap();
    assert_eq!((turns, in_turn), (vec![of_0_and_2.clone(), of(1)], true));
    assert_eq!(turns_of("kind = \"recording-folds\"\nk = 3", &all).unwrap().0.len(), 3);
    // Turns are in rising order, whatever the order of the observations.
    let mut turned = all.clone();
    turned.reverse();
    let (turns, _) = turns_of("kind = \"recording-folds\"\nk = 2", &turned).unwrap();
    assert_eq!(turns[0], where_is(&turned, |o| o.dwell.recording != 1));
    for k in [0, 1, 4] {
        let error = refused(&format!("kind = \"recording-folds\"\nk = {k}"));
        assert!(error.contains("from 2 to 3, the number of recordings"), "{error}");
    }
}

/// SplitMix64 by its definition (Steele, Lea and Flood 2014): the state grows by the golden gamma, its mix is the output.
fn splitmix64(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn hash(seed: u64, o: &Observation) -> u64 {
    splitmix64(splitmix64(splitmix64(seed) ^ o.dwell.recording as u64) ^ o.dwell.dwell as u64)
}

/// The published first outputs for seed 0; the golden gamma twice is the second state.
#[test]
fn the_reference_generator_of_these_tests_is_the_published_one() {
    assert_eq!(splitmix64(0), 0xe220_a839_7b1d_cdaf);
    assert_eq!(splitmix64(0x9e37_79b9_7f4a_7c15), 0x6e78_9e6a_a1b9_65f4);
}

#[test]
fn cavities_and_tracked_dwells_are_dealt_out_by_the_hash_of_their_first_visit() {
    let all = observations();
    let mut groups: Vec<Vec<usize>> =
        (1..=12).map(|n| where_is(&all, |o| o.cavity() == Some(&format!("c{n}")))).collect();
    groups.extend([vec![36], vec![37]]);
    groups.sort_by_key(|group| hash(0, &all[group[0]]));
    for k in [2, 5, 14] {
        let mut expected = vec![Vec::new(); k];
        groups.iter().enumerate().for_each(|(g, group)| expected[g % k].extend(group));
        expected.iter_mut().for_each(|turn| turn.sort_unstable());
        let found = turns_of(&format!("kind = \"cavity-folds\"\nk = {k}"), &all).unwrap();
        assert_eq!(found, (expected, true), "{k}");
    }
    for k in [1, 15] {
        let error = refused(&format!("kind = \"cavity-folds\"\nk = {k}"));
        assert!(error.contains("from 2 to 14"), "{error}");
    }
}

#[test]
fn a_share_at_random_is_the_smallest_hashes_and_stays_when_dwells_are_added() {
    let all = observations();
    // Of 38: 9.5 rounds up, 3.8 rounds up, 36.1 rounds down.
    for (share, seed, count) in [(0.25, 0, 10), (0.1, 7, 4), (0.95, 3, 36)] {
        let mut ranked: Vec<usize> = (0..all.len()).collect();
        ranked.sort_by_key(|i| hash(seed, &all[*i]));
        let mut expected: Vec<usize> = ranked.into_iter().take(count).collect();
        expected.sort_unstable();
        let config = format!("kind = \"random\"\nshare = {share}\nseed = {seed}");
        assert_eq!(turns_of(&config, &all).unwrap(), (vec![expected], false), "{config}");
    }
    assert!(refused("kind = \"random\"\nshare = 0.99").contains("takes all 38"));
    for share in ["0.0", "1.0", "-0.1", "1.5", "nan"] {
        let error = refused(&format!("kind = \"random\"\nshare = {share}"));
        assert!(error.contains("a number between 0 and 1"), "{error}");
    }
}

#[test]
fn listed_dwells_go_by_recording_and_dwell() {
    let all = observations();
    let config = "kind = \"dwells\"\ndwells = [[2, 13], [1, 0], [2, 13]]";
    assert_eq!(turns_of(config, &all).unwrap(), (vec![vec![12, 37]], false));
    for (config, name) in [("[[0, 12]]", "[0, 12]"), ("[[3, 0]]", "[3, 0]"), ("[[1, 13]]", "[1, 13]")] {
        let error = refused(&format!("kind = \"dwells\"\ndwells = {config}"));
        assert!(error.contains(name) && error.contains("not associated"), "{error}");
    }
}

#[test]
fn a_hold_out_of_everything_is_refused_and_one_of_nothing_has_no_turn() {
    let all = observations();
    let error = refused("kind = \"recordings\"\nrecordings = [0, 1, 2]");
    assert!(error.contains("takes all 38 of them"), "{error}");
    let one_recording: Vec<Observation> = all.iter().filter(|o| o.dwell.recording == 0).cloned().collect();
    assert!(turns_of("kind = \"each-recording\"", &one_recording).is_err());
    assert_eq!(turns_of("kind = \"cavities\"\nnames = []", &all).unwrap().0, Vec::<Vec<usize>>::new());
    assert_eq!(turns_of("kind = \"random\"\nshare = 0.001", &all).unwrap().0, Vec::<Vec<usize>>::new());
}

/// Numbers in names count as numbers and come before letters and the name's end; equal ones go by their text.
#[test]
fn natural_order_of_mixed_names() {
    let names = ["b1", "a10", "a2", "a02", "a2b", "a", "a2a10", "a2a9"];
    let all: Vec<Observation> = names.iter().enumerate().map(|(i, name)| seen(0, i, Some(name))).collect();
    let expected = ["a02", "a2", "a2a9", "a2a10", "a2b", "a10", "a", "b1"];
    for (offset, name) in expected.iter().enumerate() {
        let config = format!("kind = \"every-nth-cavity\"\nn = 8\noffset = {offset}");
        let held = turns_of(&config, &all).unwrap().0;
        assert_eq!(held, [where_is(&all, |o| o.cavity() == Some(name))], "{offset}");
    }
}
