use crate::support::{paper_pipeline, quick_pipeline, read_json, root, run_pipeline, shipped};
use armcal_config::Pipeline;
use armcal_core::FeatureId;
use armcal_model::Masses;
use armcal_recording::ros2::{Header, joint_state};
use armcal_stages::Silent;
use serde_json::Value;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// A joint state as these tests change it.
struct Row {
    stamp_ns: i64,
    names: Vec<String>,
    position: Vec<f64>,
    effort: Vec<f64>,
}

/// Takes a CDR message apart, value by value.
struct Cdr<'d>(&'d [u8], usize);

impl Cdr<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        self.1 = self.1.next_multiple_of(N);
        let bytes = self.0[self.1..self.1 + N].try_into().expect("so many bytes");
        self.1 += N;
        bytes
    }

    fn count(&mut self) -> usize {
        u32::from_le_bytes(self.bytes()) as usize
    }

    fn text(&mut self) -> String {
        let length = self.count();
        let text = String::from_utf8(self.0[self.1..self.1 + length - 1].to_vec()).expect("UTF-8");
        self.1 += length;
        text
    }

    fn numbers(&mut self) -> Vec<f64> {
        (0..self.count()).map(|_| f64::from_le_bytes(self.bytes())).collect()
    }
}

impl Row {
    fn of(data: &[u8]) -> Row {
        let mut cdr = Cdr(&data[4..], 0);
        let stamp_ns = i64::from(i32::from_le_bytes(cdr.bytes())) * 1_000_000_000 + cdr.count() as i64;
        assert_eq!(cdr.text(), "");
        let names = (0..cdr.count()).map(|_| cdr.text()).collect();
        let (position, _, effort) = (cdr.numbers(), cdr.numbers(), cdr.numbers());
        Row { stamp_ns, names, position, effort }
    }

    fn data(&self) -> Vec<u8> {
        let header = Header { stamp_ns: self.stamp_ns, frame_id: "" };
        joint_state(header, &self.names, &self.position, &[], &self.effort)
    }
}

/// Copies a recording with other joint states; `change` says which rows stay.
fn copy(from: &Path, to: &Path, change: impl Fn(&str, &mut Row) -> bool) {
    let bytes = std::fs::read(from).expect("a recording");
    let mut writer = mcap::Writer::new(std::fs::File::create(to).expect("copy")).expect("copy");
    for message in mcap::MessageStream::new(&bytes).expect("an MCAP") {
        let mut message = message.expect("message");
        if message.channel.topic.ends_with("joint_states") {
            let mut row = Row::of(&message.data);
            if !change(&message.channel.topic, &mut row) {
                continue;
            }
            message.data = Cow::Owned(row.data());
        }
        writer.write(&message).expect("copy");
    }
    writer.finish().expect("copy");
}

/// Encoders of the simulated rigs count so finely [rad].
const COUNT_RAD: f64 = std::f64::consts::TAU / 65536.0;

/// What the encoder of a joint reads whose link is `windup_rad` further than its motor.
fn read(link_rad: f64, windup_rad: f64) -> f64 {
    ((link_rad - windup_rad) / COUNT_RAD).round() * COUNT_RAD
}

/// Efforts that no torque of gravity explains, a function of the pose so that they rest where the arm does [N m].
fn efforts_nm(q: &[f64]) -> [f64; 2] {
    [4.0 * (1.3 * q[1] - 0.7 * q[2]).cos(), 8.0 * (2.3 * q[0] + 1.7 * q[2] + 0.4).sin()]
}

/// Joint 2 of the paper's arm winds up by this much [rad/(N m)].
const COMPLIANCE: f64 = 0.5 / 8.0 * std::f64::consts::PI / 180.0;

/// The paper's recordings with efforts of joints 1 and 2, and in place of that of joint 3 what `third` makes of the list.
fn paper_with_efforts(folder: &Path, third: impl Fn(&mut Vec<f64>)) -> String {
    for name in ["normal.mcap", "roll.mcap", "pitch.mcap"] {
        copy(&root().join("fixtures/paper").join(name), &folder.join(name), |_, row| {
            let efforts = efforts_nm(&row.position);
            row.position[1] = read(row.position[1], COMPLIANCE * efforts[1]);
            row.effort = efforts.to_vec();
            third(&mut row.effort);
            true
        });
    }
    paper_pipeline(folder)
}

fn written(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("pipeline.toml");
    std::fs::write(&path, text).expect("a pipeline");
    path
}

fn parsed(text: String, folder: &Path) -> Result<Pipeline, String> {
    Pipeline::parse(Path::new("pipeline.toml"), text, folder).map_err(|e| e.to_string())
}

fn names(summary: &Value) -> Vec<&str> {
    let names = summary["diagnosis"]["names"].as_array().expect("names");
    names.iter().filter_map(Value::as_str).collect()
}

/// The warnings about efforts of the first recording.
fn gaps(summary: &Value) -> Vec<&Value> {
    let all = summary["recordings"][0]["warnings"].as_array().expect("warnings");
    all.iter().filter(|w| w["code"] == "effort-incomplete").collect()
}

#[test]
fn a_joint_without_effort_costs_only_itself() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let text = paper_with_efforts(folder.path(), |efforts| efforts.push(f64::NAN));
    let pipeline = written(folder.path(), &text);
    let out = folder.path().join("out");
    let summary = run_pipeline(&pipeline, &out, &[0]);
    assert_eq!(names(&summary), ["effort_compliance:2"], "{:#}", summary["diagnosis"]["explanations"]);
    let dwells = &summary["recordings"][0]["dwells"];
    let told = gaps(&summary);
    assert_eq!((told.len(), told[0]["subject"].as_str()), (1, Some("effort of joint3")), "{told:?}");
    let said = told[0]["message"].as_str().expect("a sentence");
    assert!(said.starts_with(&format!("{dwells} of {dwells} dwells have no measured effort")), "{said}");
    let page = std::fs::read_to_string(out.join("report.html")).expect("page");
    assert!(page.contains("effort of joint3"));

    // The gap is carried as one, by joint.
    let observed = read_json(&out.join("observations.json"));
    for o in observed["recordings"][0]["observations"].as_array().expect("observations") {
        assert!(
            o["effort_nm"][0].is_f64() && o["effort_nm"][1].is_f64() && o["effort_nm"][2].is_null(),
            "{o}"
        );
    }
    let largest = &read_json(&out.join("model.json"))["session"]["largest_effort_nm"];
    assert!(largest[1].as_f64().is_some_and(|e| e > 4.0) && largest[2].is_null(), "{largest}");
    // What was written is read again: an arm with the effect, on the same poses.
    armcal_result::StoredObservations::open(&out.join("observations.json")).expect("observations");
    armcal_result::open_model(&out).expect("a model").arms().expect("its arms");

    // What follows the effort of the joint that has none is refused with its name; of another it is fitted.
    let with = |joint: usize| {
        let effect = format!("{text}\n[[effects]]\nkind = \"effort_compliance\"\ntarget = {joint}\n");
        let pipeline = parsed(effect, folder.path()).expect("a pipeline");
        armcal_pipeline::settle(&pipeline, &Silent)
    };
    let refused = with(3).map(|_| ()).expect_err("no effort").to_string();
    assert!(refused.contains("not all dwells have a measured effort of `joint3`"), "{refused}");
    let settled = with(2).expect("a calibration");
    let estimates = &settled.fitted.calibration.fit.estimates;
    let found =
        estimates.iter().find(|e| e.parameter.name == "effort_compliance:2.compliance").expect("fitted");
    let off = (found.value - COMPLIANCE).abs() / found.sigma;
    assert!(off < 4.0 && found.sigma < 0.1 * COMPLIANCE, "{off} of {}", found.sigma);
}

#[test]
fn a_list_of_efforts_that_ends_early_is_of_the_joints_that_come_first() {
    let observed = |third: &dyn Fn(&mut Vec<f64>)| {
        let folder = tempfile::tempdir().expect("temporary folder");
        paper_with_efforts(folder.path(), third);
        let text = quick_pipeline(folder.path());
        let settled = armcal_pipeline::settle(&parsed(text, folder.path()).expect("a pipeline"), &Silent);
        serde_json::to_string(&settled.expect("a calibration").fitted.observations).expect("JSON")
    };
    let short = observed(&|_| ());
    assert!(short.contains(",null]") && short == observed(&|efforts| efforts.push(f64::NAN)));
}

/// The shipped recording of two arms, changed and split in the middle: two recordings.
fn halves(folder: &Path, change: impl Fn(usize, &str, &mut Row)) -> String {
    let from = root().join("fixtures/two-arms/closed.mcap");
    let bytes = std::fs::read(&from).expect("a recording");
    let stamps =
        mcap::MessageStream::new(&bytes).expect("an MCAP").map(|m| Row::of(&m.expect("row").data).stamp_ns);
    let stamps: Vec<i64> = stamps.collect();
    let middle_ns = (stamps.iter().min().expect("rows") + stamps.iter().max().expect("rows")) / 2;
    for (half, name) in ["first.mcap", "second.mcap"].into_iter().enumerate() {
        copy(&from, &folder.join(name), |topic, row| {
            change(half, topic, row);
            (row.stamp_ns > middle_ns) == (half == 1)
        });
    }
    let one =
        format!("paths = [\"{}/../fixtures/two-arms/closed.mcap\"]", root().join("pipelines").display());
    let text = shipped("two-arms.toml");
    assert!(text.contains(&one), "{text}");
    text.replace(&one, "paths = [\"first.mcap\"]\n\n[[recordings]]\npaths = [\"second.mcap\"]")
}

#[test]
fn an_arm_without_effort_leaves_the_other_its_own() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let text = halves(folder.path(), |_, topic, row| {
        if topic.starts_with("/right") {
            let efforts = efforts_nm(&row.position);
            row.position[1] = read(row.position[1], COMPLIANCE * efforts[1]);
            row.effort = vec![efforts[0], efforts[1], 1.0];
        }
    });
    // A load that the stiff left arm does not mind is carried into every output.
    let text =
        text.replace("[\"second.mcap\"]", "[\"second.mcap\"]\nloads = [{ at = \"left.tip\", kg = 0.3 }]");
    let out = folder.path().join("out");
    let summary = run_pipeline(&written(folder.path(), &text), &out, &[0, 3]);
    assert_eq!(names(&summary), ["effort_compliance:2"], "{:#}", summary["diagnosis"]["explanations"]);
    let load = serde_json::json!([{ "at": 1, "kg": 0.3 }]);
    let observed = read_json(&out.join("observations.json"));
    assert_eq!(observed["recordings"][1]["observations"][0]["more_loads"], load);
    assert!(observed["recordings"][0]["observations"][0].get("more_loads").is_none());
    assert_eq!(read_json(&out.join("model.json"))["recordings"][1]["more_loads"], load);
    let holds = |name: &str, text: &str| {
        let bytes = std::fs::read(out.join(name)).expect("a result");
        bytes.windows(text.len()).any(|part| part == text.as_bytes())
    };
    assert!(
        holds("observations.parquet", "load_left.tip_kg")
            && holds("report.html", "all loads on the arm [kg]")
    );
    let told = gaps(&summary);
    assert_eq!(told[0]["subject"], "effort of left.joint1, left.joint2, left.joint3", "{told:?}");
}

/// Torque of a load at the left tip about the left arm's second joint, by what lifting it would cost [N m].
fn torque_of_load_nm(pipeline: &Pipeline, q: &[f64], kg: f64) -> f64 {
    let (_, chain) = armcal_stages::frames::nominal_chain(pipeline).expect("two arms");
    let left = armcal_model::Model::new(chain.arms()[1].chain.clone(), armcal_model::Frames::of_bare_arm());
    let left = left.expect("an arm");
    let height_m = |step: f64| {
        let q = [q[0], q[1] + step, q[2]];
        left.tip_in_base(&left.nominal(), &q).translation.z
    };
    -kg * 9.80665 * (height_m(1e-6) - height_m(-1e-6)) / 2e-6
}

#[test]
fn a_load_at_the_other_arms_tip_is_what_its_spring_feels() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let (kg, compliance) = (2.0, 1.2e-3);
    let shipped_pipeline = parsed(shipped("two-arms.toml"), Path::new("/")).expect("the shipped pipeline");
    let text = halves(folder.path(), |half, topic, row| {
        if half == 1 && topic.starts_with("/left") {
            // The torque is that of the arm as its encoders read it.
            let (link_rad, mut at) = (row.position[1], row.position.clone());
            for _ in 0..4 {
                at[1] = read(link_rad, compliance * torque_of_load_nm(&shipped_pipeline, &at, kg));
            }
            row.position = at;
        }
    });
    let text = text + "\n[[effects]]\nkind = \"compliance\"\ntarget = \"left.joint2\"\n";
    let loads = "paths = [\"second.mcap\"]\nloads = [{ at = \"left.tip\", kg = 2.0 }]";
    let told = text.replace("paths = [\"second.mcap\"]", loads);
    let settled = |text: &str| {
        let pipeline = parsed(text.to_owned(), folder.path()).expect("a pipeline");
        armcal_pipeline::settle(&pipeline, &Silent).expect("a calibration").fitted
    };
    let (told, untold) = (settled(&told), settled(&text));
    for o in &told.observations {
        let expected: &[(FeatureId, f64)] = if o.dwell.recording == 1 { &[(FeatureId(1), kg)] } else { &[] };
        let loads: Vec<(FeatureId, f64)> = o.more_loads.iter().map(|load| (load.at, load.kg)).collect();
        assert_eq!((o.load_kg, &loads[..]), (0.0, expected));
    }
    let fitted = |of: &armcal_stages::Fitted| {
        let estimates = &of.calibration.fit.estimates;
        let own = estimates.iter().find(|e| e.parameter.name.ends_with("compliance_load"));
        own.map(|e| (e.value, e.sigma))
    };
    let (value, sigma) = fitted(&told).expect("a share of its own");
    println!("compliance under the load: {value:.3e} ± {sigma:.1e} rad/(N m), planted {compliance:.3e}");
    // The base was planted upright, and is estimated from arms with errors: its tilt is a share of the torque.
    assert!((value / compliance - 1.0).abs() < 0.03 && sigma < 0.01 * compliance);
    assert!(fitted(&untold).is_none());
    let judged_m = |of: &armcal_stages::Fitted| of.calibration.judged().fitted.mean_m;
    assert!(judged_m(&untold) > 1.3 * judged_m(&told), "{} {}", judged_m(&untold), judged_m(&told));
}

#[test]
fn loads_and_masses_that_cannot_be_are_refused_with_what_there_is() {
    let folder = Path::new("/nowhere");
    let paper = |more: &str| {
        let text = shipped("paper.toml").replacen("[[recordings]]", &format!("[[recordings]]\n{more}"), 1);
        parsed(text, folder).map(|_| ()).expect_err(more)
    };
    let two = |more: &str| {
        let text = shipped("two-arms.toml").replacen("[[recordings]]", &format!("[[recordings]]\n{more}"), 1);
        parsed(text, folder).map(|_| ()).expect_err(more)
    };
    let masses = |text: &str| {
        parsed(shipped("paper.toml").replace("[model]\n", &format!("[model]\n{text}\n")), folder)
            .map(|_| ())
            .expect_err(text)
    };
    for (said, parts) in [
        (
            paper("loads = [{ at = \"l_tip\", kg = 1.2 }]"),
            ["recordings[0].loads", "`l_tip`, which the arm does not have; it has tip"],
        ),
        (two("loads = [{ at = \"tip\", kg = 1.2 }]"), ["`tip`", "it has right.tip, left.tip"]),
        (paper("loads = [{ at = \"tip\", kg = -1 }]"), ["-1 kg at `tip`", "0 kg or more"]),
        (paper("load_kg = nan"), ["recordings[0].load_kg", "0 kg or more"]),
        (paper("load_kg = 1\nloads = [{ at = \"tip\", kg = 1 }]"), ["`tip` two loads", "add them up"]),
        (two("load_kg = 1"), ["load_kg", "unknown field"]),
        (masses("masses = \"urdf\""), ["model.masses", "a DH table gives no masses"]),
        (masses("masses = \"steel\""), ["steel", "uniform"]),
    ] {
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
    let text = shipped("paper.toml").replacen(
        "[[recordings]]",
        "[[recordings]]\nloads = [{ at = \"tip\", kg = 0.4 }]",
        1,
    );
    let pipeline = parsed(text, folder).expect("the same as load_kg");
    assert_eq!(pipeline.loads_of(&pipeline.recordings[0]), (0.4, Vec::new()));
}

#[test]
fn a_link_of_a_urdf_without_a_mass_is_named() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let urdf = std::fs::read_to_string(root().join("fixtures/mukca-panda4/panda.urdf")).expect("URDF");
    let weighing = (1..=7).filter(|link| *link != 3).fold(urdf, |urdf, link| {
        let of = format!("<link name=\"panda_link{link}\">");
        assert!(urdf.contains(&of), "{of}");
        urdf.replace(&of, &format!("{of}<inertial><mass value=\"3.5\"/></inertial>"))
    });
    std::fs::write(folder.path().join("arm.urdf"), weighing).expect("URDF");
    let text = shipped("mukca-panda4.toml");
    let own = format!("{}/../fixtures/mukca-panda4/panda.urdf", root().join("pipelines").display());
    assert!(text.contains(&own));
    let text = text.replace(&own, "arm.urdf") + "\n[diagnosis]\nenabled = false\n";
    for (masses, weighed, says) in [
        ("", Some(Masses::Uniform), Some("all links of its arm weigh 2.5 kg")),
        ("masses = \"urdf\"", None, Some("beside links with masses of their own")),
        ("masses = \"uniform\"", Some(Masses::Uniform), None),
    ] {
        let text = text.replace("[model]\n", &format!("[model]\n{masses}\n"));
        let out = folder.path().join(format!("out{}", masses.len()));
        let summary = run_pipeline(&written(folder.path(), &text), &out, &[0, 3]);
        let all = summary["warnings"].as_array().expect("warnings");
        let told: Vec<&Value> = all.iter().filter(|w| w["code"] == "link-without-mass").collect();
        assert_eq!(told.len(), usize::from(says.is_some()), "{told:?}");
        for (warning, says) in told.iter().zip(says) {
            assert_eq!(warning["subject"], "link panda_link3");
            assert!(warning["message"].as_str().is_some_and(|m| m.contains(says)), "{warning}");
        }
        // The model that is kept for later weighs as much.
        let past = armcal_result::open_model(&out).expect("a model").arms().expect("its arms");
        assert_eq!(past.model.masses(), weighed);
    }
}
