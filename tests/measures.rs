//! Arms measured against points, distances and planes: what a lab without a camera has.

use crate::support::{armcal, number, read_json, root, run_pipeline, shipped, simulate};
use armcal_result::open_model;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Play in the drive of joint 2, as a lab would have it.
const PLAY: &str = "\n[[mechanisms]]\nkind = \"gap\"\njoint = 2\nwidth_deg = 0.5\n";

/// Simulates the shipped laboratory with more in it, and gives the shipped pipeline on its recording, changed by `edit`.
fn recorded(folder: &Path, more: &str, edit: impl Fn(String) -> String) -> PathBuf {
    let lab = shipped("lab/gauges.toml") + more;
    let (file, made) = (folder.join("lab.toml"), folder.join("made"));
    std::fs::write(&file, lab).expect("lab");
    simulate(&file, &made, &[]);
    written(folder, "pipeline", &edit(pipeline_on(&made)))
}

fn pipeline_on(made: &Path) -> String {
    let text = std::fs::read_to_string(root().join("pipelines/simulated/gauges.toml")).expect("pipeline");
    text.replace("../../out/gauges", &made.to_string_lossy())
        .replace("../models", &root().join("pipelines/models").to_string_lossy())
}

fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name).with_extension("toml");
    std::fs::write(&path, text).expect("pipeline");
    path
}

fn measured<'s>(summary: &'s Value, name: &str) -> &'s Value {
    let all = summary["markers"].as_array().expect("what was measured");
    all.iter().find(|m| m["marker"] == name).unwrap_or_else(|| panic!("no {name} in {all:?}"))
}

#[test]
fn a_wire_and_a_height_gauge_calibrate_the_arm_and_find_where_they_stand() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let pipeline = recorded(folder.path(), "", |text| text);
    let out = folder.path().join("out");
    let summary = run_pipeline(&pipeline, &out, &[0]);
    assert_eq!(summary["diagnosis"]["verdict"], "nothing_missing", "{:#}", summary["diagnosis"]);
    for name in ["tip from post", "tip above plate"] {
        let errors = measured(&summary, name);
        assert!(number(errors, "/nominal_mm") > 1.0, "{errors}");
        assert!(number(errors, "/fitted_mm") < 1.5 * number(errors, "/floor_mm"), "{errors}");
    }
    // Only the assertion reads where they really stand: how far from the first axis, and what the wire has where it reads zero.
    let truth = read_json(&folder.path().join("made/truth.json"));
    let past = open_model(&out).expect("model.json").arms().expect("the arm");
    let value = |name: &str| past.values[past.model.index(name).expect("a parameter")];
    let [x, y] = [0, 1].map(|axis| number(&truth, &format!("/gauges/0/in_base/xyz_m/{axis}")));
    let off_m = value("post.x").hypot(value("post.y")) - x.hypot(y);
    assert!(off_m.abs() < 0.5e-3, "the post is {off_m} m off");
    let zero_m = number(&truth, "/gauges/0/zero_m");
    assert!((value("wire.length") - zero_m).abs() < 0.5e-3, "{} {zero_m}", value("wire.length"));
    // Every form knows what a row is of.
    let page = std::fs::read_to_string(out.join("report.html")).expect("page");
    assert!(page.contains("By measurement") && page.contains("<td>tip from post</td>"));
    let observed = read_json(&out.join("observations.json"));
    let rows = observed["recordings"][0]["observations"].as_array().expect("observations");
    let kinds: Vec<&str> = rows.iter().filter_map(|o| o["reference"]["kind"].as_str()).collect();
    assert!(kinds.contains(&"apart") && kinds.contains(&"above"), "{kinds:?}");
    // At its stops the gauge reads what it has there: those dwells have the wire alone.
    let heights = kinds.iter().filter(|kind| **kind == "above").count();
    assert!(heights < kinds.len() - heights, "{heights} heights of {}", kinds.len());
}

#[test]
fn hidden_play_is_named_from_distances_and_heights_alone() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let pipeline = recorded(folder.path(), PLAY, |text| text);
    let summary = run_pipeline(&pipeline, &folder.path().join("out"), &[0, 3]);
    let effects = &summary["diagnosis"]["effects"];
    assert_eq!(summary["diagnosis"]["verdict"], "identified", "{:#}", summary["diagnosis"]);
    assert!(effects.to_string().contains("backlash:2"), "{effects:#}");
}

#[test]
fn an_instrument_read_in_another_unit_is_found_out() {
    for (wrong, said) in [("unit = \"m\"", "thousandth"), ("direction = -1", "reversed")] {
        let folder = tempfile::tempdir().expect("temporary folder");
        let reading = format!("reading = {{ topic = \"/height\", {wrong} }}");
        let pipeline = recorded(folder.path(), "", |text| {
            let text = text.replace("reading = { topic = \"/height\" }", &reading);
            text.replace("range_mm = [5.0, 995.0]\n", "")
        });
        let output = armcal([Path::new("run"), &pipeline, Path::new("--out"), &folder.path().join("out")]);
        let said_all =
            format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(
            said_all.contains("the readings of plate") && said_all.contains(said),
            "{wrong}:\n{said_all}"
        );
    }
}

/// A Panda whose ball was put into the two sockets of a fixture, which stood in three places: as six points that nobody
/// measured, instead of a fixture whose drawing is known. Real data; the socket of each dwell is in the truth beside it.
#[test]
fn a_real_arm_is_calibrated_by_points_that_nobody_measured() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let by_board = shipped("mukca-panda4.toml");
    let board = folder.path().join("board");
    let known = run_pipeline(&written(folder.path(), "by-board", &by_board), &board, &[0, 3]);
    // A tape measure would say it as well: starts are the fixture's places, each coordinate off by 8 mm.
    let past = open_model(&board).expect("model.json").arms().expect("the arm");
    let mut text = by_board
        .replace("[table]\n", "")
        .lines()
        .filter(|line| {
            !["board =", "pose = \"estimated\"                       # one", "[table.", "visiting_order"]
                .iter()
                .any(|own| line.starts_with(own))
        })
        .collect::<Vec<_>>()
        .join("\n");
    for (recording, name) in ["front", "right", "very-front"].iter().enumerate() {
        let pose = past.model.board_in_world(&past.values, recording).expect("a fixture");
        for (socket, x_m) in [0.0, 0.05].into_iter().enumerate() {
            let at = pose * nalgebra::Point3::new(x_m, 0.0, 0.0);
            let [x, y, z] = [at.x + 8e-3, at.y - 8e-3, at.z + 8e-3];
            text += &format!(
                "\n[points.{name}_{socket}]\npose = \"estimated\"\nat = {{ xyz_m = [{x}, {y}, {z}] }}\n[[measure]]\nkind = \"coincide\"\n\
                 between = [\"tip\", \"{name}_{socket}\"]\nsigma_mm = 0.12\nrecordings = [\"{name}\"]\n"
            );
        }
    }
    let out = folder.path().join("points");
    let summary = run_pipeline(&written(folder.path(), "by-points", &text), &out, &[0, 3]);
    let [board_mm, points_mm] = [&known, &summary].map(|s| number(s, "/fit/holdout/fitted_mm/mean"));
    println!("held out: by the fixture {board_mm:.3} mm, by six points {points_mm:.3} mm");
    assert!(points_mm < 1.1 * board_mm, "{points_mm} {board_mm}");
    // Every dwell is in the point of its socket, as the truth has it.
    let observed = read_json(&out.join("observations.json"));
    for (recording, name) in ["front", "right", "very-front"].iter().enumerate() {
        let truth = root().join(format!("fixtures/mukca-panda4/{name}.truth.csv"));
        let truth = std::fs::read_to_string(truth).expect("truth");
        let sockets: Vec<&str> = truth.lines().skip(1).filter_map(|line| line.split(',').nth(2)).collect();
        let rows = observed["recordings"][recording]["observations"].as_array().expect("observations");
        assert_eq!(rows.len(), sockets.len(), "{name}");
        for (row, socket) in rows.iter().zip(sockets) {
            let place = row["reference"]["to"]["fixed"].as_u64().expect("a fixed place");
            // Points are in the order of their names.
            assert_eq!(format!("hole_{}", place % 2), socket, "{name} {row}");
        }
    }
}

#[test]
fn measurements_that_contradict_themselves_are_refused_by_their_key() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let text = pipeline_on(Path::new("nowhere"));
    for (from, to, key, said) in [
        (
            "between = [\"tip\", \"post\"]",
            "between = [\"tip\", \"pots\"]",
            "measure[0].between",
            "add [points.pots]",
        ),
        (
            "between = [\"tip\", \"post\"]",
            "between = [\"top\", \"post\"]",
            "measure[0].between",
            "none of tip",
        ),
        ("sigma_mm = 0.01", "sigma_mm = 0.0", "measure[0].sigma_mm", "above zero"),
        (
            "reading = { topic = \"/wire\" }\nrange_mm = [110.0, 1790.0]",
            "",
            "measure[0].length_mm",
            "above zero",
        ),
        (
            "range_mm = [110.0, 1790.0]",
            "range_mm = [1790.0, 110.0]",
            "measure[0].range_mm",
            "[smallest, largest]",
        ),
        ("kind = \"plane\"", "kind = \"coincide\"", "measure[1].between", "add [points.plate]"),
        ("[planes.plate]", "[planes.tip]", "planes.tip", "the name of something else"),
        ("[holdout]", "[points.idle]\n[holdout]", "points.idle", "measured by no [[measure]]"),
        (
            "[holdout]",
            "[frames.base]\npose = \"estimated\"\n[holdout]",
            "frames.base.pose",
            "nothing holds them",
        ),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        let output = armcal([Path::new("run"), &written(folder.path(), "bad", &changed)]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && told.contains(key) && told.contains(said), "{to}:\n{told}");
    }
}

#[test]
fn a_place_that_is_never_reached_is_told_with_how_near_the_arm_came() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let pipeline = recorded(folder.path(), "", |text| {
        text + "\n[points.far]\nat = { xyz_m = [5.0, 0.0, 0.0] }\n[[measure]]\nkind = \"coincide\"\nbetween = [\"tip\", \"far\"]\n\
                sigma_mm = 0.1\n"
    });
    let output = armcal([Path::new("run"), &pipeline, Path::new("--out"), &folder.path().join("out")]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(told.contains("[[measure]] `far`: the nominal arm is nowhere nearer to it than 4"), "{told}");
}
