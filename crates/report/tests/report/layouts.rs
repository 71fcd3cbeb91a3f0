//! What a viewer does with the layouts, held against the keys that its panels document: every path leads to something, every
//! picture holds what it is of, every scale its data.

use crate::findings::with_play_found;
use crate::recording::{Full, get, list, number, own, read, rotation, string, vector, write};
use crate::synthetic::{Synthetic, synthetic};
use armcal_config::InputMessages;
use nalgebra::{Matrix3, Vector3};
use prost_reflect::{DynamicMessage, ReflectMessage as _, Value as Field};
use serde_json::Value;
use std::collections::BTreeMap;

/// A run as a viewer opens it: its messages, and the panels of the older format by their names.
struct Opened {
    messages: Vec<Full>,
    panels: BTreeMap<String, Value>,
}

fn open(s: &Synthetic, folder: &str) -> Opened {
    let out = write(s, InputMessages::Reference, folder);
    let text = std::fs::read(out.join("foxglove-layout-legacy.json")).unwrap();
    let layout: Value = serde_json::from_slice(&text).unwrap();
    let panels = layout["configById"].as_object().unwrap().clone().into_iter().collect();
    Opened { messages: read(&out.join("run.mcap")), panels }
}

/// With nothing found, with play found, and with errors that no small angle of a joint explains.
fn opened() -> Vec<Opened> {
    let mut found = synthetic();
    with_play_found(&mut found, 1e-3);
    let mut far = synthetic();
    for r in &mut far.run.calibration.residuals {
        r.fitted_m *= 1e4;
    }
    [("plain", synthetic()), ("found", found), ("far", far)].map(|(name, s)| open(&s, name)).into()
}

impl Opened {
    fn of(&self, kind: &str) -> Vec<&Value> {
        let own = self.panels.iter().filter(|(name, _)| name.split('!').next() == Some(kind));
        own.map(|(_, config)| config).collect()
    }

    /// The first message of a topic and what a path of names finds in it, without slices.
    fn at(&self, path: &str) -> Field {
        let path = path.replace("[:]", "").replace("[1:]", "");
        let (topic, field) = path.split_once('.').unwrap();
        let message = own(&self.messages, topic).into_iter().next();
        get(&message.unwrap_or_else(|| panic!("nothing on {topic}")), field)
    }

    fn numbers(&self, path: &str) -> Vec<f64> {
        let number = |v: &Field| v.as_f64().or_else(|| v.as_u32().map(f64::from)).unwrap();
        // The steps are messages, each with its own field.
        if let Some((list, field)) = path.split_once("[1:].") {
            let steps = self.at(list);
            let steps = steps.as_list().unwrap()[1..].iter();
            return steps.map(|s| number(&get(s.as_message().unwrap(), field))).collect();
        }
        self.at(path).as_list().unwrap().iter().map(number).collect()
    }
}

#[test]
fn every_panel_has_a_title_in_both_viewers() {
    for run in opened() {
        for (name, config) in run.panels.iter().filter(|(name, _)| !name.starts_with("Tab!")) {
            let title = config["foxglovePanelTitle"].as_str().unwrap();
            assert!(!title.is_empty() && config["lichtblickPanelTitle"] == title, "{name}: {config}");
            // Days lie between recordings: nothing is drawn over the time of the clock.
            assert!(!name.starts_with("StateTransitions!"), "{name}");
        }
    }
}

#[test]
fn a_tab_fits_a_laptop() {
    fn panels(tree: &Value) -> usize {
        match tree {
            Value::Object(split) => panels(&split["first"]) + panels(&split["second"]),
            _ => 1,
        }
    }
    for run in opened() {
        for tab in run.of("Tab")[0]["tabs"].as_array().unwrap() {
            assert!(panels(&tab["layout"]) <= 9, "{}", tab["title"]);
            // A longer title is cut.
            assert!(tab["title"].as_str().unwrap().len() <= 14, "{}", tab["title"]);
        }
    }
}

#[test]
fn a_table_is_on_the_first_tab() {
    fn names(tree: &Value, found: &mut Vec<String>) {
        match tree {
            Value::String(name) => found.push(name.clone()),
            split => ["first", "second"].iter().for_each(|part| names(&split[*part], found)),
        }
    }
    for run in opened() {
        // Lichtblick 1.28 loads its table panel when the first one is shown: one that is first shown on another tab waits for a
        // message until somebody plays or seeks.
        let mut first = Vec::new();
        names(&run.of("Tab")[0]["tabs"][0]["layout"], &mut first);
        assert!(first.iter().any(|name| name.starts_with("Table!")), "{first:?}");
    }
}

#[test]
fn texts_are_shown_whole_and_not_as_changes() {
    for run in opened() {
        let paths = run.of("RawMessages").into_iter().map(|config| config["topicPath"].as_str().unwrap());
        for path in paths.filter(|path| *path != "/armcal/diagnosis.sentence") {
            for line in run.at(path).as_list().unwrap() {
                let line = line.as_str().unwrap();
                // From 512 characters on the rest is behind a button; an arrow is drawn as a change from one message to the next.
                assert!(line.chars().count() < 512 && !line.contains(" -> "), "{path}: {line}");
            }
        }
    }
}

#[test]
fn tables_have_rows_and_all_columns_in_the_first() {
    for run in opened() {
        for config in run.of("Table") {
            let path = config["topicPath"].as_str().unwrap();
            // With a slice the viewer draws one row.
            assert!(!path.contains('['), "{path}");
            let rows = run.at(path);
            let rows: Vec<&DynamicMessage> =
                rows.as_list().unwrap().iter().map(|row| row.as_message().unwrap()).collect();
            let absent = |row: &DynamicMessage| {
                let descriptor = row.descriptor();
                let fields = descriptor.fields().filter(|f| f.supports_presence() && !row.has_field(f));
                fields.map(|f| f.name().to_owned()).collect::<Vec<_>>()
            };
            let first = absent(rows.first().unwrap_or_else(|| panic!("{path} is empty")));
            assert!(
                rows.iter().all(|row| first.iter().all(|f| absent(row).contains(f))),
                "{path}: {first:?}"
            );
        }
        for config in run.of("RawMessages") {
            let path = config["topicPath"].as_str().unwrap();
            let empty = match run.at(path) {
                Field::List(all) => all.is_empty(),
                other => other.as_str().unwrap().is_empty(),
            };
            assert!(!empty, "{path}");
        }
    }
}

#[test]
fn parameters_have_the_digits_that_count() {
    for run in opened() {
        let rows = run.at("/armcal/parameter_table.rows");
        for row in rows.as_list().unwrap().iter().map(|row| row.as_message().unwrap()) {
            let powers = |field: &str| string(row, field).contains("e-");
            let (half, value) = (string(row, "interval95"), string(row, "calibrated"));
            let places = |number: &str| number.split_once('.').map_or(0, |(_, places)| places.len());
            assert!(half.contains('e') || half == "± -" || places(&half) == places(&value), "{row:?}");
            // A power of ten beside an interval that has none would be nothing, told to nine decimals.
            assert!(powers("interval95") || !(powers("calibrated") || powers("change")), "{row:?}");
        }
    }
}

#[test]
fn what_the_data_determine_and_change_most_is_first() {
    for run in opened() {
        let (rows, all) = (run.at("/armcal/parameter_table.rows"), run.at("/armcal/parameters.parameters"));
        let of = |name: &str| {
            let all = all.as_list().unwrap().iter().map(|p| p.as_message().unwrap());
            let p = all.into_iter().find(|p| string(p, "name") == name).unwrap_or_else(|| panic!("{name}"));
            let sigmas = (number(p, "value") - number(p, "nominal")).abs() / number(p, "sigma");
            (get(p, "determined").as_bool().unwrap(), if sigmas.is_finite() { sigmas } else { 0.0 })
        };
        let rows = rows.as_list().unwrap().iter().map(|row| string(row.as_message().unwrap(), "parameter"));
        let order: Vec<(bool, f64)> = rows.map(|name| of(&name)).collect();
        assert!(
            order.windows(2).all(|w| (w[0].0 && !w[1].0) || (w[0].0 == w[1].0 && w[0].1 >= w[1].1)),
            "{order:?}"
        );
    }
}

#[test]
fn plots_have_points_on_their_scale_and_no_legend_over_them() {
    for run in opened() {
        for config in run.of("Plot") {
            assert_eq!((&config["showLegend"], &config["legendDisplay"]), (&false.into(), &"none".into()));
            let x = run.numbers(config["xAxisPath"]["value"].as_str().unwrap());
            let mut beyond = 0;
            for series in config["paths"].as_array().unwrap() {
                let path = series["value"].as_str().unwrap();
                if path.parse::<f64>().is_ok() {
                    continue;
                }
                let y: Vec<f64> = run.numbers(path);
                assert_eq!(x.len(), y.len(), "{path}");
                let y: Vec<f64> = y.into_iter().filter(|y| y.is_finite()).collect();
                assert!(!y.is_empty(), "{path} draws nothing");
                let Some(most) = config["maxYValue"].as_f64() else { continue };
                let inside = y.iter().filter(|y| y.abs() <= most).count();
                beyond += y.len() - inside;
                assert!(10 * inside >= 8 * y.len(), "{path}: {y:?} up to {most}");
            }
            let title = config["foxglovePanelTitle"].as_str().unwrap();
            let told =
                title.split_once("; ").and_then(|(_, rest)| rest.strip_suffix(" beyond")?.parse().ok());
            assert_eq!(told.unwrap_or(0), beyond, "{title}");
        }
    }
}

#[test]
fn a_joint_is_drawn_only_where_its_implied_error_is_a_small_angle() {
    for run in opened() {
        for joint in 1..=3 {
            let topic = format!("/armcal/implied/joint{joint}");
            let mut errors: Vec<f64> =
                run.numbers(&format!("{topic}.error[:]")).iter().map(|e| e.abs()).collect();
            errors.sort_by(f64::total_cmp);
            let drawn = run.of("Plot").iter().any(|plot| plot.to_string().contains(&topic));
            assert_eq!(drawn, errors[errors.len() / 2] < 10.0, "{topic}: {errors:?}");
        }
    }
}

#[test]
fn a_lamp_is_red_wherever_the_result_does_not_stand() {
    for run in opened() {
        let lamp = run.of("Indicator")[0];
        let rules = lamp["rules"].as_array().unwrap();
        let colour = |word: &str| rules.iter().find(|r| r["rawValue"] == word).unwrap()["color"].clone();
        let red = colour("inadequate");
        assert!(["data_lost", "unexplained", "setup"].iter().all(|word| colour(word) == red));
        // Where the result stands, the lamp says so.
        let label = |r: &Value| r["label"].as_str().unwrap().starts_with("ok: ");
        assert!(rules.iter().all(|r| label(r) != (r["color"] == red)), "{rules:?}");
        let like_success = rules.iter().filter(|r| r["color"] == colour("nothing_missing"));
        assert_eq!(like_success.count(), 1);
        let shown = run.at(lamp["path"].as_str().unwrap());
        assert!(rules.iter().any(|r| r["rawValue"] == shown.as_str().unwrap()), "{shown:?}");
    }
}

/// Places in the picture of a camera: across, up (1 is the upper edge, of a square picture also the right one), and whether they are in front of it.
fn seen(camera: &Value, places: &[Vector3<f64>]) -> Vec<(f64, f64, bool)> {
    let of = |key: &str| camera[key].as_f64().unwrap();
    let target = Vector3::from_iterator(
        camera["targetOffset"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()),
    );
    let (phi, theta) = (of("phi").to_radians(), of("thetaOffset").to_radians());
    // Lichtblick's CameraStateSettings: spherical coordinates about y with -thetaOffset, then y up turned to z up.
    let (across, along) = ((-theta).sin() * phi.sin(), (-theta).cos() * phi.sin());
    let towards = Vector3::new(across, -along, phi.cos());
    let right = Vector3::new(theta.cos(), -theta.sin(), 0.0);
    let axes = Matrix3::from_columns(&[right, towards.cross(&right), towards]);
    let half = (of("fovy").to_radians() / 2.0).tan();
    let of_place = |place: &Vector3<f64>| {
        let m = axes.tr_mul(&(place - target));
        let depth = of("distance") - m.z;
        (m.x / (half * depth), m.y / (half * depth), depth > 0.0)
    };
    places.iter().map(of_place).collect()
}

#[test]
fn the_arm_and_all_points_are_in_the_picture_and_fill_it() {
    for run in opened() {
        let view = run.of("3D").into_iter().find(|v| v["followTf"] == "world").unwrap();
        let mut places = Vec::new();
        for topic in ["/armcal/arms", "/armcal/scene"] {
            for entity in own(&run.messages, topic).iter().flat_map(|m| list(m, "entities")) {
                let of = |field: &str| {
                    list(&entity, field).iter().map(|s| vector(s, "pose.position")).collect::<Vec<_>>()
                };
                places.extend(of("spheres"));
                if string(&entity, "id") == "scale" {
                    places.extend(of("texts"));
                }
            }
        }
        // Nothing is hidden where the nominal arm reaches a little further.
        let seen = seen(&view["cameraState"], &places);
        let most = |f: fn(&(f64, f64, bool)) -> f64| seen.iter().map(f).fold(0.0, f64::max);
        let (across, up) = (most(|s| s.0.abs() / 1.2), most(|s| s.1.abs()));
        assert!(seen.iter().all(|s| s.2) && across < 1.0 && up < 1.0, "{across} {up}");
        assert!(across.max(up) > 0.7, "{across} {up}");
    }
}

#[test]
fn three_dimensional_panels_are_free_of_frames() {
    for run in opened() {
        let transforms = &own(&run.messages, "/armcal/tf")[0];
        let frames: Vec<String> =
            list(transforms, "transforms").iter().map(|t| string(t, "child_frame_id")).collect();
        for view in run.of("3D") {
            let scene = &view["scene"]["transforms"];
            assert_eq!(
                (&scene["showLabel"], &scene["axisScale"], &scene["lineWidth"]),
                (&false.into(), &0.into(), &0.into())
            );
            // A frame that is not there yet is a problem in the viewer's list.
            assert_eq!(scene["enablePreloading"], true);
            assert!(frames.iter().any(|f| view["followTf"] == f.as_str()), "{frames:?}");
            for (topic, settings) in view["topics"].as_object().unwrap() {
                assert!(settings["visible"].is_boolean(), "{topic}");
                // The black edges of small arrows hide their colour.
                let drawn = ["arms", "scene", "board_map"].iter().any(|name| topic.ends_with(name));
                if drawn || topic.contains("arrows_") {
                    assert_eq!(settings["showOutlines"], false, "{topic}");
                }
            }
        }
        // Axes of a metre otherwise.
        let world = run.of("3D").into_iter().find(|v| v["followTf"] == "world").unwrap();
        assert!(world["topics"]["/armcal/tip_measured"]["axisScale"].as_f64().unwrap() < 0.1);
        // Points have the colours of the arrows, which the legend tells.
        let cloud = &own(&run.messages, "/armcal/errors")[0];
        assert_eq!(world["topics"]["/armcal/errors"]["colorMode"], "rgba-fields");
        let fields: Vec<String> = list(cloud, "fields").iter().map(|f| string(f, "name")).collect();
        assert!(
            ["red", "green", "blue", "alpha"].iter().all(|c| fields.iter().any(|f| f == c)),
            "{fields:?}"
        );
    }
}

#[test]
fn the_map_of_boards_fills_its_panel_and_its_words_do_not_overlap() {
    for run in opened() {
        let view = run.of("3D").into_iter().find(|v| v["followTf"] == "board_map").unwrap();
        let camera = &view["cameraState"];
        assert_eq!(camera["perspective"], false);
        let height = camera["distance"].as_f64().unwrap();
        let middle: Vec<f64> =
            camera["targetOffset"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        let map = &own(&run.messages, "/armcal/board_map")[0];
        let mut words: Vec<[f64; 4]> = Vec::new();
        let discs = list(map, "entities").into_iter().flat_map(|entity| list(&entity, "cylinders"));
        let places: Vec<Vector3<f64>> = discs.map(|disc| vector(&disc, "pose.position")).collect();
        for entity in list(map, "entities") {
            for text in list(&entity, "texts") {
                let (at, tall) = (vector(&text, "pose.position"), number(&text, "font_size"));
                let lines: Vec<usize> = string(&text, "text").lines().map(|l| l.chars().count()).collect();
                let wide = 0.62 * tall * *lines.iter().max().unwrap() as f64;
                let half = [wide / 2.0, tall * lines.len() as f64 / 2.0];
                assert!((at.x - middle[0]).abs() + half[0] <= 1.4 * height / 2.0, "{text:?}");
                assert!((at.y - middle[1]).abs() + half[1] <= height / 2.0, "{text:?}");
                let own = [at.x - half[0], at.x + half[0], at.y - half[1], at.y + half[1]];
                let apart =
                    |w: &[f64; 4]| w[1] <= own[0] || own[1] <= w[0] || w[3] <= own[2] || own[3] <= w[2];
                assert!(words.iter().all(apart), "{own:?} {words:?}");
                // No word lies on a cavity.
                for place in &places {
                    let on = (place.x - at.x).abs() < half[0] && (place.y - at.y).abs() < half[1];
                    assert!(!on, "{text:?} on {place}");
                }
                words.push(own);
            }
            for arrow in list(&entity, "arrows") {
                let length = number(&arrow, "shaft_length") + number(&arrow, "head_length");
                let end = vector(&arrow, "pose.position")
                    + rotation(&arrow, "pose.orientation") * Vector3::x() * length;
                // The largest few may reach out.
                assert!((end.y - middle[1]).abs() < height, "{end}");
            }
        }
        // In one of the two directions the words alone, beyond which arrows reach, take nearly half.
        let used = |from: usize| {
            words.iter().map(|w| w[from + 1]).fold(f64::MIN, f64::max)
                - words.iter().map(|w| w[from]).fold(f64::MAX, f64::min)
        };
        assert!(
            used(0) > 0.45 * 1.4 * height || used(2) > 0.45 * height,
            "{} {} of {height}",
            used(0),
            used(2)
        );
    }
}
