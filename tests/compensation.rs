use crate::support::{armcal, number, paper_pipeline, read_json, root, run_pipeline};
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

const LAB: &str = "pipelines/lab/paper-backlash.toml";

/// Runs `armcal`; panics with its words unless it exits with one of `codes`.
fn armcal_in(folder: &Path, args: &[&str], codes: &[i32]) -> String {
    let output = armcal(args.iter().map(|arg| match arg.strip_prefix("./") {
        Some(name) => folder.join(name).into_os_string(),
        None => arg.into(),
    }));
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(codes.contains(&output.status.code().unwrap_or(-1)), "armcal {args:?}\n{out}\n{err}");
    out.into_owned()
}

/// Places over the board and in free space, in an order in which joints arrive from either side [m, base].
fn stops() -> String {
    let near = (0..18).map(|i| {
        let k = i * 7 % 18;
        let (x, y, z) = (k % 3, k / 3 % 3, k / 9);
        format!("board{k},{},{},{}\n", 0.35 + 0.08 * x as f64, 0.13 * y as f64 - 0.14, 0.13 + 0.04 * z as f64)
    });
    let free = (0..12).map(|k| {
        let share = |step: usize| (step * k % 12) as f64 / 11.0;
        let (turn, reach_m) = (1.8 * share(5) - 0.9, 0.38 + 0.16 * share(7));
        format!("free{k},{},{},{}\n", reach_m * turn.cos(), reach_m * turn.sin(), 0.25 + 0.22 * share(3))
    });
    ["name,x_m,y_m,z_m\n".to_owned()].into_iter().chain(near).chain(free).collect()
}

/// A closed curve over the board on which every joint turns back [m, base; s].
fn path() -> String {
    let waypoint = |k: usize| {
        let a = TAU * k as f64 / 12.0;
        let (x, y, z) = (0.42 + 0.07 * a.cos(), 0.09 * a.sin(), 0.18 + 0.03 * (2.0 * a).sin());
        format!("w{k},{},{x},{y},{z}\n", 4 * k)
    };
    ["name,t_s,x_m,y_m,z_m\n".to_owned()].into_iter().chain((0..=12).map(waypoint)).collect()
}

/// The same rig, driven: one recording for each file of set-points and prefix of its columns.
fn driven(folder: &Path, recordings: &[(&str, &str, &str)]) -> Value {
    let text = std::fs::read_to_string(root().join(LAB)).expect("lab");
    let mut lab: toml::Table = text.parse().expect("lab");
    let board = root().join("pipelines/boards/paper.toml").display().to_string();
    lab["board"]["file"] = board.into();
    let table = |entries: &[(&str, &str)]| -> toml::Table {
        entries.iter().map(|(k, v)| ((*k).to_owned(), (*v).into())).collect()
    };
    let names: Vec<toml::Table> = recordings.iter().map(|(name, ..)| table(&[("name", name)])).collect();
    lab["recordings"] = names.into();
    let told = recordings.iter().map(|(name, file, columns)| {
        let mut told = table(&[("recording", name), ("file", file), ("columns", columns)]);
        // The paper's PID swings a few tenths of a degree beyond where a quick move ends, and the link stays there.
        told.insert("speed_deg_s".into(), 4.0.into());
        told
    });
    let task = lab["task"].as_table_mut().expect("task");
    task.insert("set_points".into(), told.collect::<Vec<toml::Table>>().into());
    std::fs::write(folder.join("drive.toml"), toml::to_string(&lab).expect("lab as text")).expect("lab file");
    armcal_in(folder, &["simulate", "./drive.toml", "--out", "./driven"], &[0]);
    read_json(&folder.join("driven/truth.json"))
}

/// Mean and largest distance between the targets of a file of set-points and where the tip truly was [mm]; for a path,
/// the distance to the curve.
fn reached(truth: &Value, recording: usize, file: &Path, curve: bool) -> [f64; 2] {
    let text = std::fs::read_to_string(file).expect("set-points");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("{name}"));
    let columns = ["x_m", "y_m", "z_m"].map(column);
    let targets: Vec<[f64; 3]> = lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            columns.map(|c| cells[c].parse().expect("a coordinate"))
        })
        .collect();
    let distance_mm = |a: &[f64; 3], b: &[f64; 3]| {
        1e3 * a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let points = truth["recordings"][recording]["set_points"].as_array().expect("set-points");
    assert_eq!(points.len(), targets.len());
    let off = points.iter().zip(&targets).map(|(point, target)| {
        let tip: Vec<f64> = serde_json::from_value(point["tip_world_m"].clone()).expect("a tip");
        let tip = [tip[0], tip[1], tip[2]];
        match curve {
            true => targets.iter().map(|t| distance_mm(&tip, t)).fold(f64::INFINITY, f64::min),
            false => distance_mm(&tip, target),
        }
    });
    let off: Vec<f64> = off.collect();
    [off.iter().sum::<f64>() / off.len() as f64, off.iter().copied().fold(0.0, f64::max)]
}

/// Simulates, calibrates with geometry alone and with the play that the diagnosis finds, computes set-points with both.
fn calibrated(folder: &Path) -> PathBuf {
    let recordings = folder.join("recordings");
    let lab = root().join(LAB).display().to_string();
    armcal_in(folder, &["simulate", &lab, "--out", "./recordings"], &[0]);
    let pipeline = folder.join("pipeline.toml");
    std::fs::write(&pipeline, paper_pipeline(&recordings)).expect("pipeline");
    run_pipeline(&pipeline, &folder.join("geometry"), &[0]);
    let add = ["add", "suggested", "./pipeline.toml", "--write", "./extended.toml", "--out", "./effects"];
    armcal_in(folder, &add, &[0, 3]);
    std::fs::write(folder.join("stops.csv"), stops()).expect("targets");
    std::fs::write(folder.join("path.csv"), path()).expect("targets");
    // With geometry alone the diagnosis still misses something, which exit code 3 says.
    for (result, codes) in [("geometry", [3]), ("effects", [0])] {
        let (model, asked) = (format!("./{result}"), ["--frame", "base", "--from", "0,-30,10", "--out"]);
        for (targets, rate) in [("stops", &[][..]), ("path", &["--rate", "25"][..])] {
            let (file, out) = (format!("./{targets}.csv"), format!("./{result}-{targets}.csv"));
            let args = [&["compensate", &model, &file][..], &asked, &[&out], rate].concat();
            println!("{}", armcal_in(folder, &args, &codes));
        }
    }
    folder.join("effects")
}

/// The paper's control, closed: waypoints, spline, inverse kinematics, set-points, PID. Set-points from the nominal arm
/// miss by tens of millimetres, from calibrated geometry by what play does, from the model with its effects by what the
/// servo and the fit leave.
#[test]
fn compensated_set_points_reach_their_targets_in_the_rig_that_was_calibrated() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let folder = folder.path();
    let effects = calibrated(folder);
    let floor = number(&read_json(&effects.join("summary.json")), "/fit/noise_floor_mm");
    let truth = driven(
        folder,
        &[
            ("stops-nominal", "effects-stops.csv", "nominal"),
            ("stops-geometry", "geometry-stops.csv", "set_point"),
            ("stops-effects", "effects-stops.csv", "set_point"),
            ("path-nominal", "effects-path.csv", "nominal"),
            ("path-geometry", "geometry-path.csv", "set_point"),
            ("path-effects", "effects-path.csv", "set_point"),
        ],
    );
    let off = |recording: usize, file: &str| reached(&truth, recording, &folder.join(file), recording >= 3);
    let [stops, path] = [0, 3].map(|first| {
        let of = if first == 0 { "stops" } else { "path" };
        let files = ["effects", "geometry", "effects"].map(|result| format!("{result}-{of}.csv"));
        [0, 1, 2].map(|k| off(first + k, &files[k]))
    });
    println!("commanded against reached [mm]: mean (largest); declared noise of the calibration {floor:.3}");
    for (what, rows) in [("stops", stops), ("path", path)] {
        let [nominal, geometry, effects] = rows.map(|[mean, most]| format!("{mean:.3} ({most:.3})"));
        println!("{what:6} nominal {nominal}, geometry {geometry}, with effects {effects}");
    }
    for [[nominal, _], [geometry, _], _] in [stops, path] {
        assert!(nominal > 10.0 && geometry > 2.0, "nominal {nominal}, geometry {geometry} mm");
    }
    assert!(stops[2][0] < 1.5 * floor, "stops with effects");
    // On a path the servo lags, and crosses a gap in its own time.
    assert!(path[2][0] < 0.25 * path[1][0], "path with effects");
}
