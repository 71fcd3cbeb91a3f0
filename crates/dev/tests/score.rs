//! How often is the diagnosis right on scenarios whose truth it cannot see, and does every answer obey the laws of the verdict?

#![allow(clippy::print_stdout, reason = "a test says what it measured")]

use serde_json::Value;
use std::ffi::OsStr;
use std::process::{Command, Output};

fn score<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_armcal-dev"));
    command.arg("score").args(args).output().expect("starting armcal-dev")
}

fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}

/// Scenarios scored by the program itself, on seeds nobody looked at while the rules were made. The truth is read by
/// the scorer alone, after the answer.
fn scored(args: &[&str]) -> Vec<Value> {
    scored_from("7001", args)
}

fn scored_from(seed: &str, args: &[&str]) -> Vec<Value> {
    let output = score(["--json", "--from", seed].iter().chain(args));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let all = report["scenarios"].as_array().expect("scenarios").clone();
    for s in &all {
        let (family, seed) = (&s["scenario"]["family"], &s["scenario"]["seed"]);
        println!(
            "{family} seed {seed}: {} {} suggested {}",
            s["judgement"], s["answer"]["verdict"], s["answer"]["suggested"]
        );
    }
    all
}

fn count(all: &[Value], judgements: &[&str]) -> usize {
    all.iter().filter(|s| judgements.iter().any(|j| s["judgement"] == *j)).count()
}

/// Share of scenarios whose held-out error comes within a tenth of the floor once the suggestion is added.
fn at_floor(all: &[Value]) -> usize {
    let ratio = |s: &&Value| number(s, "/answer/after_mm") / number(s, "/answer/floor_mm");
    all.iter().filter(|s| ratio(s) < 1.1).count()
}

#[test]
fn hidden_effects_are_named_and_adding_them_reaches_the_floor() {
    let all = scored(&[
        "backlash",
        "compliance",
        "link_bending",
        "axis_tilt",
        "eccentricity",
        "second_harmonic",
        "gear_ratio",
        "belt_coupling",
        "zero_slip",
        "tool_shift",
        "frame_shift",
        "frame_shift@dwell",
        "zero_drift",
        "thermal_growth",
        "--seeds",
        "2",
    ]);
    let (named, held) = (count(&all, &["first"]), count(&all, &["first", "in_set"]));
    println!("named first {named}, in the set {held}, at the floor {} of {}", at_floor(&all), all.len());
    assert_eq!(count(&all, &["wrong", "wrong_set"]), 0);
    assert!(10 * held >= 9 * all.len() && 10 * named >= 8 * all.len());
    assert!(10 * at_floor(&all) >= 9 * all.len());
}

#[test]
fn what_only_the_sensor_sees_is_no_tool_board_or_frame_that_moved() {
    let of_markers = ["tip_marker_shift", "tip_marker_shift@dwell"];
    let all = scored(&[&of_markers[..], &["--seeds", "3"]].concat());
    assert_eq!(count(&all, &["wrong", "wrong_set"]), 0);
    assert!(10 * count(&all, &["first", "in_set"]) >= 9 * all.len() && 10 * at_floor(&all) >= 9 * all.len());
}

#[test]
fn where_nothing_is_hidden_nothing_is_claimed_whatever_the_noise() {
    // The noise alone; a smooth displacement is a test of its own, below.
    let all = scored(&[
        "nothing",
        "nothing:white",
        "nothing:cavities",
        "nothing:autocorrelated",
        "nothing:heavy_tails",
        "nothing:swaps",
        "--seeds",
        "3",
    ]);
    let named = |s: &&Value| s["answer"]["names"].as_array().is_some_and(|names| !names.is_empty());
    println!("silent {} of {}", count(&all, &["rightly_silent"]), all.len());
    assert!(all.len() >= 18);
    assert_eq!(all.iter().filter(named).count(), 0, "no effect may be named");
    // Two in a hundred may be called unknown (docs/confusion.md has the large run): of eighteen, one.
    assert!(count(&all, &["rightly_silent"]) + 1 >= all.len());
}

/// A smooth displacement of the tip is beyond the noise and has no name.
#[test]
fn where_the_tip_is_only_displaced_smoothly_no_name_is_given() {
    let all = scored(&["nothing:smooth_3", "nothing:smooth_10", "--seeds", "2"]);
    assert_eq!(count(&all, &["rightly_silent"]), all.len());
    assert!(all.iter().any(|s| number(s, "/answer/before_mm") > 3.0 * number(s, "/answer/floor_mm")));
}

#[test]
fn what_is_in_no_catalogue_gets_no_confident_name() {
    let all = scored(&[
        "outside:cable_drag",
        "outside:damaged_teeth",
        "outside:twist",
        "outside:soft_stop",
        "--seeds",
        "1",
    ]);
    assert_eq!(count(&all, &["wrong"]), 0);
    assert!(count(&all, &["placed"]) + 1 >= all.len());
}

/// The whole way: recordings on disk, their truth elsewhere, the pipeline as a user would run it.
#[test]
fn recordings_on_disk_are_diagnosed_as_observations_are() {
    let all = scored(&["backlash", "gear_ratio", "nothing:white", "--seeds", "1", "--sealed"]);
    assert_eq!(count(&all, &["first", "rightly_silent"]), all.len());
}

/// The wrong ratio of a large joint drives four parameters onto their bounds: free to leave them they would take two thirds of the
/// error, the ratio takes all of it.
#[test]
fn an_effect_that_leaves_less_takes_the_place_of_parameters_beyond_their_bounds() {
    let all = scored_from("181001", &["gear_ratio", "--seeds", "1", "--sealed"]);
    assert_eq!((count(&all, &["first"]), at_floor(&all)), (1, 1), "{all:?}");
}

/// docs/confusion.md in small: the page says what was answered, scenario by scenario, and how to make it again.
#[test]
fn the_page_of_scores_says_what_was_answered() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let file = folder.path().join("confusion.md");
    let words = "gear_ratio gravity_backlash outside:twist nothing:white backlash+eccentricity --seeds 1 --from 7001 --sealed-seeds 1";
    let page = ["--json".as_ref(), "--page".as_ref(), file.as_os_str()];
    let output = score(page.into_iter().chain(words.split(' ').map(OsStr::new)));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let scenarios = |key: &str| report[key].as_array().expect("scenarios").clone();
    let (quick, whole) = (scenarios("scenarios"), scenarios("whole_way"));
    assert_eq!((quick.len(), whole.len()), (5, 2));
    let text = std::fs::read_to_string(&file).expect("the page");
    println!("{text}");
    let version = env!("CARGO_PKG_VERSION");
    assert!(
        text.contains(&format!("Written in one go by armcal {version}: 7 scenarios, seeds 7001 to 7001.\n"))
    );
    assert!(text.contains(&format!(
        "```sh\ncargo run --release -p armcal-dev -- score {words} --page docs/confusion.md\n```\n"
    )));

    let all: Vec<&Value> = quick.iter().chain(&whole).collect();
    let right = ["rightly_silent", "first", "in_set", "placed", "nearest", "not_shown"];
    let (held, missed): (Vec<&Value>, Vec<&Value>) =
        all.iter().partition(|s| right.iter().any(|judgement| s["judgement"] == *judgement));
    assert!(text.contains(&format!("Missed or answered wrongly: {}", missed.len())));
    let misses = text.split("## Misses").nth(1).expect("the misses");
    for s in &missed {
        let family = s["scenario"]["family"].as_str().expect("a family");
        assert!(misses.contains(&format!("| `{family}`")), "{family} is missing among the misses");
    }
    assert_eq!(misses.lines().filter(|line| line.starts_with("| `")).count(), missed.len());
    // The bars of the whole page, on these few: nothing wrong, no claim without a cause, and the unmistakable found.
    assert_eq!(all.iter().filter(|s| s["judgement"] == "wrong" || s["judgement"] == "wrong_set").count(), 0);
    for family in ["gear_ratio", "outside:twist", "nothing:white", "backlash+eccentricity"] {
        let of = |s: &&&Value| s["scenario"]["family"] == family;
        assert_eq!(held.iter().filter(of).count(), all.iter().filter(of).count(), "{family}");
    }
}

/// Scenarios run beside each other, and the page is the same.
#[test]
fn the_page_of_scores_is_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let page = |threads: &str| {
        let file = folder.path().join(threads);
        let output = Command::new(env!("CARGO_BIN_EXE_armcal-dev"))
            .args(["score", "gear_ratio", "gravity_backlash", "--seeds", "2", "--from", "7001", "--page"])
            .arg(&file)
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .expect("starting armcal-dev");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read_to_string(&file).expect("the page")
    };
    assert_eq!(page("1"), page("4"));
}

/// The laws that `armcal-dev score --laws` asks (docs/laws.md in full), of a few sessions on seeds of their own. All hold but one,
/// which may be broken by chance: the set of half of the dwells holds that of all.
#[test]
fn what_must_hold_of_every_answer_holds() {
    let families = ["backlash", "compliance", "zero_slip@dwell", "backlash+eccentricity", "nothing"];
    let output = score(["--laws", "--seeds", "1", "--from", "8101"].into_iter().chain(families));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut asked = 0;
    for row in text.lines().filter(|line| line.contains(" of ") && line.starts_with("| ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [held, of]: [usize; 2] = {
            let numbers: Vec<usize> = cells[3].split(" of ").filter_map(|n| n.parse().ok()).collect();
            numbers.try_into().expect("k of n")
        };
        let may_break = usize::from(cells[1] == "less holds more");
        assert!(of > 0 && held + may_break >= of, "{text}");
        asked += 1;
    }
    assert_eq!(asked, 7, "{text}");
}

/// A name that the command line gets wrong is a mistake of usage, told with the nearest name.
#[test]
fn names_that_do_not_exist_are_usage_errors_with_the_nearest_name() {
    for (arguments, says) in [
        (&["nothing", "bcklash"][..], "did you mean `backlash`?"),
        (&["nothing", "--design", "free-pose"], "free-poses"),
        (&["backlash+gear_rato"], "did you mean `gear_ratio`?"),
    ] {
        let output = score(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.starts_with("error: ") && said.contains(says), "{said}");
    }
}
