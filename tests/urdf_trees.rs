use crate::support::{python_with, root};
use armcal_core::{DwellId, FeatureId, Load, Observation, Pose, Reference};
use armcal_model::{Chain, Frame, Frames, Marker, Model, Session};
use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// Trees that are drawn.
const TREES: u64 = 200;

/// A joint of a drawn tree and the link below it; link `k + 1` is that of joint `k`, link 0 the base.
struct Joint {
    parent: usize,
    kind: &'static str,
    /// The joint it follows, ratio and offset.
    mimic: Option<(usize, f64, f64)>,
    limits: Option<[f64; 2]>,
}

impl Joint {
    fn moves(&self) -> bool {
        self.kind != "fixed"
    }
}

/// A robot with everything that is asked of it.
struct Tree {
    urdf: String,
    joints: Vec<Joint>,
    /// The links that are measured; the first is the tip.
    measured: Vec<usize>,
}

fn drawn(seed: u64) -> Tree {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = rng.random_range(3..15);
    let mut joints: Vec<Joint> = Vec::new();
    for k in 0..count {
        // Mostly a chain, with branches.
        let parent = if rng.random_bool(0.65) { k } else { rng.random_range(0..=k) };
        let kind =
            ["revolute", "continuous", "prismatic", "fixed"][[0, 0, 0, 1, 1, 2, 3][rng.random_range(0..7)]];
        let leaders: Vec<usize> =
            (0..k).filter(|l| joints[*l].moves() && joints[*l].mimic.is_none()).collect();
        let follows = kind != "fixed" && !leaders.is_empty() && rng.random_bool(0.25);
        let mimic = follows.then(|| {
            let leader = leaders[rng.random_range(0..leaders.len())];
            (leader, rng.random_range(-2.0..2.0), rng.random_range(-0.5..0.5))
        });
        let low: f64 = rng.random_range(-1.0..0.5);
        let limits = (kind != "continuous" && kind != "fixed").then_some([low, low + 1.5]);
        joints.push(Joint { parent, kind, mimic, limits });
    }
    if !joints.iter().any(|joint| joint.moves() && joint.mimic.is_none()) {
        joints[0].kind = "revolute";
        joints[0].mimic = None;
        joints[0].limits = Some([-1.0, 1.0]);
    }
    let urdf = written(&joints, &mut rng);
    let links = count + 1;
    // A tip that some joint with a reading moves, and any other links.
    let moved = |link: usize| {
        std::iter::successors(Some(link), |l| (*l > 0).then(|| joints[*l - 1].parent))
            .any(|l| l > 0 && joints[l - 1].moves())
    };
    let tips: Vec<usize> = (1..links).filter(|link| moved(*link)).collect();
    let tip = tips[rng.random_range(0..tips.len())];
    let more = (1..links).filter(|link| *link != tip && rng.random_bool(0.3));
    let measured = [tip].into_iter().chain(more).collect();
    Tree { urdf, joints, measured }
}

/// A tree as a URDF with random places, axes and weights.
fn written(joints: &[Joint], rng: &mut ChaCha8Rng) -> String {
    let mut three = |size: f64| {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|_| rng.random_range(-size..size));
        format!("{x} {y} {z}")
    };
    let mut urdf = String::from("<robot name=\"drawn\"><link name=\"l0\"/>");
    for (k, joint) in joints.iter().enumerate() {
        let (link, place, turn) = (k + 1, three(0.4), three(3.0));
        let _ = write!(
            urdf,
            "<link name=\"l{link}\"><inertial><origin xyz=\"{}\" rpy=\"{}\"/><mass value=\"{}\"/>\
             <inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
             <joint name=\"j{k}\" type=\"{}\"><parent link=\"l{}\"/><child link=\"l{link}\"/>\
             <origin xyz=\"{place}\" rpy=\"{turn}\"/><axis xyz=\"{}\"/>",
            three(0.2),
            three(1.0),
            0.3 + 0.2 * f64::from(u32::try_from(k % 5).expect("small")),
            joint.kind,
            joint.parent,
            three(1.0),
        );
        if let Some((leader, ratio, offset)) = joint.mimic {
            let _ = write!(urdf, "<mimic joint=\"j{leader}\" multiplier=\"{ratio}\" offset=\"{offset}\"/>");
        }
        if let Some([low, high]) = joint.limits {
            let _ = write!(urdf, "<limit lower=\"{low}\" upper=\"{high}\" effort=\"1\" velocity=\"1\"/>");
        }
        urdf += "</joint>";
    }
    urdf + "</robot>"
}

impl Tree {
    fn model(&self) -> Model {
        let links: Vec<String> = self.measured.iter().map(|link| format!("l{link}")).collect();
        let more: Vec<&str> = links[1..].iter().map(String::as_str).collect();
        let chain = Chain::from_urdf_branches(&self.urdf, "l0", &links[0], &more, Path::new("drawn.urdf"))
            .expect("a robot");
        let on = |link: &&str| Marker { link: (*link).into(), frame: Frame::given(*link, Pose::identity()) };
        let frames = Frames { markers: more.iter().map(on).collect(), ..Frames::of_bare_arm() };
        Model::new(chain, frames).expect("a model")
    }

    /// What Python is asked of a pose.
    fn question(&self, model: &Model, joint_rad: &[f64]) -> Value {
        let readings: Vec<(&String, &f64)> = model.chain().joint_names().iter().zip(joint_rad).collect();
        let read: BTreeMap<&str, f64> = readings.iter().map(|(name, q)| (name.as_str(), **q)).collect();
        let parameters = model.parameters();
        let kept = |name: &str| parameters.iter().any(|p| p.name == format!("{name}.x"));
        let (mut following, mut resting) = (Vec::new(), Vec::new());
        for (k, joint) in self.joints.iter().enumerate().filter(|(_, joint)| joint.moves()) {
            let name = format!("j{k}");
            match joint.mimic {
                Some((leader, ratio, offset)) if kept(&name) => {
                    following.push(json!([name, format!("j{leader}"), ratio, offset]));
                }
                // What hangs beside stands as near to zero as its limits let it be.
                _ if !read.contains_key(name.as_str()) => {
                    let [low, high] = joint.limits.unwrap_or([0.0, 0.0]);
                    resting.push(json!([name, 0f64.clamp(low, high)]));
                }
                _ => {}
            }
        }
        let links: Vec<String> = self.measured.iter().map(|link| format!("l{link}")).collect();
        json!({"urdf": self.urdf, "links": links, "readings": readings, "following": following, "resting": resting})
    }
}

/// Largest difference between our numbers and those of one answer: places [m], motions, torques [N m].
fn differences(model: &Model, o: &Observation, answer: &Value) -> [f64; 3] {
    let p = model.nominal();
    let number = |pointer: String| answer.pointer(&pointer).and_then(Value::as_f64).expect("a number");
    let [mut place, mut motion, mut torque] = [0f64; 3];
    for (k, (feature, _)) in model.features().enumerate() {
        let at = model.feature_in_world(&p, feature, o).to_homogeneous();
        let jacobian = model.feature_jacobian(&p, feature, o);
        for r in 0..3 {
            for c in 0..4 {
                place = place.max((at[(r, c)] - number(format!("/places/{k}/{r}/{c}"))).abs());
            }
        }
        for (r, c) in (0..6).flat_map(|r| (0..jacobian.ncols()).map(move |c| (r, c))) {
            motion = motion.max((jacobian[(r, c)] - number(format!("/motions/{k}/{r}/{c}"))).abs());
        }
    }
    // A second link joined to the first: what closes is the difference of both, joints that both have in common included.
    if model.features().count() > 1 {
        let o = Observation {
            reference: Reference::Joined { to: armcal_core::Against::Feature(FeatureId(1)) },
            ..o.clone()
        };
        let (gap_m, jacobian) = (model.residual(&p, &o).position_m, model.joint_jacobian(&p, &o));
        let between = |what: &str, r: usize, c: usize| {
            number(format!("/{what}/0/{r}/{c}")) - number(format!("/{what}/1/{r}/{c}"))
        };
        for r in 0..3 {
            place = place.max((gap_m[r] + between("places", r, 3)).abs());
            for c in 0..jacobian.ncols() {
                motion = motion.max((jacobian[(r, c)] - between("motions", r, c)).abs());
            }
        }
    }
    let session = Session::of(std::slice::from_ref(o));
    for (j, own) in model.drivers(&session, o).torque().iter().enumerate() {
        torque = torque.max((own.links_nm - number(format!("/torques/{j}"))).abs());
        // By virtual work: what a reading lifts of each load.
        let lifted = |load: Load| -9.80665 * load.kg * number(format!("/motions/{}/2/{j}", load.at.0));
        torque = torque.max((own.load_nm - o.loads().map(lifted).sum::<f64>()).abs());
    }
    [place, motion, torque]
}

#[test]
fn two_hundred_trees_move_and_weigh_as_pinocchio_says() {
    let Some(python) = python_with("pinocchio, numpy") else { return };
    let mut rng = ChaCha8Rng::seed_from_u64(9283);
    let mut cases = Vec::new();
    for seed in 0..TREES {
        let tree = drawn(seed);
        let model = tree.model();
        let joint_rad: Vec<f64> = (0..model.joint_count()).map(|_| rng.random_range(-1.5..1.5)).collect();
        let question = tree.question(&model, &joint_rad);
        let nowhere = Reference::position(Vector3::zeros());
        let mut o = Observation::bare(DwellId { recording: 0, dwell: 0 }, joint_rad, nowhere);
        o.load_kg = rng.random_range(0.0..2.0);
        let more = model.features().skip(1).map(|(at, _)| Load { at, kg: rng.random_range(0.0..2.0) });
        o.more_loads = more.collect();
        cases.push((model, o, question));
    }
    let branched = cases.iter().filter(|(model, ..)| model.features().count() > 1).count();
    let following =
        cases.iter().filter(|(.., q)| q["following"].as_array().is_some_and(|f| !f.is_empty())).count();
    let hanging =
        cases.iter().filter(|(.., q)| q["resting"].as_array().is_some_and(|f| !f.is_empty())).count();
    assert!(branched > 100 && following > 40 && hanging > 40, "{branched} {following} {hanging}");
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("cases.json");
    let questions: Vec<&Value> = cases.iter().map(|(.., question)| question).collect();
    std::fs::write(&path, serde_json::to_vec(&questions).expect("JSON")).expect("writing the cases");
    let output = Command::new(python)
        .arg(root().join("tests/python/pinocchio_trees.py"))
        .arg(&path)
        .output()
        .expect("starting python");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let answers: Vec<Value> = serde_json::from_slice(&output.stdout).expect("answers");
    assert_eq!(answers.len(), cases.len());
    let mut largest = [0f64; 3];
    for ((model, o, question), answer) in cases.iter().zip(&answers) {
        let own = differences(model, o, answer);
        assert!(own[0] < 1e-12 && own[1] < 1e-10 && own[2] < 1e-9, "{own:?} in {question}");
        largest = std::array::from_fn(|k| largest[k].max(own[k]));
    }
    println!(
        "places to {:.1e} m, Jacobians to {:.1e}, torques to {:.1e} N m",
        largest[0], largest[1], largest[2]
    );
    assert_eq!(FeatureId::TIP, cases[0].0.features().next().expect("a tip").0);
}

/// Links of a description that is large in one way.
const MANY: usize = 30_000;

/// Time is in proportion to a description, however its links hang together: what grew with the square of their number would
/// take minutes, and twenty seconds are allowed.
#[test]
fn a_large_description_is_read_in_proportion() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let mesh = "<visual><geometry><mesh filename=\"a.stl\"/></geometry></visual><collision><geometry><box size=\"1 1 1\"/>\
                </geometry></collision>";
    let kinds = [
        ("a chain", MANY, "", "fixed"),
        ("a star", 5, "", "fixed"),
        ("meshes", MANY, mesh, "fixed"),
        ("joints that follow each other", MANY, "", "revolute"),
    ];
    for (what, longest, inside, kind) in kinds {
        let mut text = "<robot name=\"r\"><link name=\"l0\"/>".to_owned();
        for k in 1..=MANY {
            let (kind, mimic) = match k {
                ..=6 => ("revolute", String::new()),
                _ if kind == "fixed" => (kind, String::new()),
                _ => (kind, format!("<mimic joint=\"j{}\"/>", k - 1)),
            };
            write!(
                text,
                "<link name=\"l{k}\">{inside}</link><joint name=\"j{k}\" type=\"{kind}\"><parent link=\"l{}\"/>\
                 <child link=\"l{k}\"/><axis xyz=\"0 0 1\"/>{mimic}</joint>",
                (k - 1).min(longest)
            )
            .expect("a string");
        }
        text += "</robot>";
        let urdf = folder.path().join("large.urdf");
        std::fs::write(&urdf, text).expect("written");
        let out = folder.path().join("proposed.toml");
        let output = Command::new("sh")
            .args(["-c", "ulimit -t 20; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_armcal"), "init"])
            .arg(root().join("fixtures/paper/normal.mcap"))
            .args(["--urdf".as_ref(), urdf.as_os_str(), "--out".as_ref(), out.as_os_str()])
            .output()
            .expect("starting sh");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{what}: {said}");
        assert!(said.contains("no topic has the joints"), "{what}: {said}");
    }
}
