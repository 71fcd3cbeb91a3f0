//! A small finished run made by hand: three recordings of a board at three tilts, a planted arm, and a
//! "calibration" that is the planted arm plus a known slip.

use crate::input::input;
use armcal_calibrate::{Calibration, Estimate, Fit, Residual, SideErrors, Status, UndeterminedDirection};
use armcal_core::{
    Arrival, Code, Dwell, DwellId, ErrorStats, Observation, Pose, Reference, Rejection, SetupReport,
    Severity, Stage, TipMeasurement, Warning,
};
use armcal_dwell::ClockAlignment;
use armcal_model::{Chain, Frame, Frames, Model, Session};
use armcal_recording::Recording;
use armcal_result::{RecordingRun, Run, Undiagnosed};
use armcal_table::{Assignment, Association, Board, Place};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};

pub const DH: &str = r#"
name = "right arm"
[[rows]]
name = "joint1"
theta_deg = 0.0
d_mm = 76.0
a_mm = 0.0
alpha_deg = 90.0
[[rows]]
name = "joint2"
theta_deg = 90.0
d_mm = 0.0
a_mm = 400.0
alpha_deg = 0.0
[[rows]]
name = "joint3"
theta_deg = 0.0
d_mm = -12.0
a_mm = 354.3
alpha_deg = { nominal = 90.0, free = false }
"#;

const BOARD: &str = r#"
name = "four"
cavity_sigma_mm = 0.1
seat_sigma_mm = 0.05
[[cavities]]
name = "c1"
xyz_mm = [40, 0, 0]
[[cavities]]
name = "c2"
xyz_mm = [0, 40, 0]
[[cavities]]
name = "c3"
xyz_mm = [-40, 0, 0]
[[cavities]]
name = "c4"
xyz_mm = [0, -40, 0]
"#;

pub const PIPELINE: &str = "name = \"three tilts\"\n[holdout]\nseed = 7\n";
/// Survives JSON, TOML, HTML, file systems and terminals only if it is escaped everywhere.
pub const HOSTILE: &str = "pitch \"11.8°\" </script>\n/../\u{1b}[31m\\ 'ü' 板";
pub const NAMES: [&str; 3] = ["normal", "roll", HOSTILE];
/// Start of the recordings [ns]; far enough from 0 that f64 seconds would lose nanoseconds.
const EPOCH_NS: i64 = 1_790_000_000_123_456_789;
const START_RAD: [f64; 3] = [0.1, 0.5, -0.9];

/// A run and the recordings it came from, in a folder that lives as long as the value.
pub struct Synthetic {
    pub run: Run,
    pub recordings: Vec<Recording>,
    pub paths: Vec<PathBuf>,
    pub folder: tempfile::TempDir,
}

pub fn synthetic() -> Synthetic {
    let folder = tempfile::tempdir().unwrap();
    let paths: Vec<PathBuf> = (0..3).map(|i| input(folder.path(), i)).collect();
    let recordings: Vec<Recording> =
        paths.iter().map(|p| Recording::open(std::slice::from_ref(p)).unwrap()).collect();
    let board = Board::from_toml(BOARD, Path::new("board.toml")).unwrap();
    let model = model();
    let planted = planted(&model);
    let slip = |i: usize| if model.parameters()[i].free { 1e-5 * ((i % 3) as f64 - 1.0) } else { 0.0 };
    let fitted: Vec<f64> = planted.iter().enumerate().map(|(i, p)| p + slip(i)).collect();
    let mut runs = Vec::new();
    let mut observations = Vec::new();
    for (index, name) in NAMES.iter().enumerate() {
        let (run, own) =
            recording_run(index, name, &recordings[index], &paths[index], &board, &model, &planted);
        runs.push(run);
        observations.extend(own);
    }
    observations.push(tracked(&runs[0].dwells[5], &model, &planted));
    let calibration = calibration(&model, &observations, &fitted);
    let run = Run {
        pipeline_name: "three tilts".into(),
        pipeline_text: PIPELINE.into(),
        model_texts: vec![DH.into()],
        recordings: runs,
        board: Some(board),
        model,
        session: Session::of(&observations),
        observations,
        calibration,
        setup: SetupReport::default(),
        diagnosis: None,
        undiagnosed: Some(Undiagnosed::NotAsked),
        wanted_mm: None,
        ties: Vec::new(),
        steps: Vec::new(),
        alternatives: Vec::new(),
        transfer: None,
        warnings: vec![warning(Code::AssociationUnsettled, "association", "two dwells changed cavities")],
    };
    Synthetic { run, recordings, paths, folder }
}

fn model() -> Model {
    let chain = Chain::from_dh_toml(DH, Path::new("arm.toml")).unwrap();
    let at_start = {
        let bare = Model::new(chain.clone(), Frames::of_bare_arm()).unwrap();
        bare.tip_in_base(&bare.nominal(), &START_RAD).translation
    };
    let tilts = [(0.0, 0.0), (0.2, 0.0), (0.0, 0.2)];
    let boards = tilts.iter().zip(NAMES).map(|((roll, pitch), name)| {
        let pose = Pose::from_parts(at_start, UnitQuaternion::from_euler_angles(*roll, *pitch, 0.0));
        let name = format!("board.{name}");
        if *pitch > 0.0 { Frame::estimated(name, pose) } else { Frame::given(name, pose) }
    });
    let frames = Frames {
        base: Frame::given("base", Pose::identity()),
        tip: Frame::given("tip", Pose::identity()),
        markers: Vec::new(),
        boards: boards.collect(),
    };
    Model::new(chain, frames).unwrap()
}

/// The arm as it really is.
fn planted(model: &Model) -> Vec<f64> {
    let mut p = model.nominal();
    for (name, by) in
        [("joint2.theta", 0.02), ("joint2.a", 0.003), ("joint3.theta", -0.015), ("joint1.d", 0.001)]
    {
        p[model.index(name).unwrap()] += by;
    }
    p
}

fn recording_run(
    index: usize,
    name: &str,
    recording: &Recording,
    path: &Path,
    board: &Board,
    model: &Model,
    planted: &[f64],
) -> (RecordingRun, Vec<Observation>) {
    let mut dwells = Vec::new();
    let mut assignments = Vec::new();
    let mut observations = Vec::new();
    for (i, cavity) in board.cavities.iter().enumerate() {
        let slip_m = Vector3::new(1e-4, -5e-5, 8e-5) * (i as f64 - 1.5);
        let observation = seated(index, i, cavity.name.clone(), cavity.in_board_m, slip_m, model, planted);
        dwells.push(dwell(index, i, &observation.joint_rad));
        assignments.push(Assignment {
            dwell: observation.dwell,
            place: Place::Seated { cavity: cavity.name.clone(), confidence: 0.999 },
            distance_m: slip_m.norm(),
        });
        observations.push(observation);
    }
    dwells.push(dwell(index, 4, &START_RAD));
    dwells.push(dwell(index, 5, &[0.3, 0.2, -0.4]));
    let hovering = DwellId { recording: index, dwell: 4 };
    let place = Place::Hovering { height_m: 0.031, above: "c1".into() };
    assignments.push(Assignment { dwell: hovering, place, distance_m: 0.031 });
    let free = DwellId { recording: index, dwell: 5 };
    assignments.push(Assignment { dwell: free, place: Place::FreeSpace, distance_m: f64::NAN });
    let mut rejections =
        vec![Rejection { dwell: hovering, why: "the tip hovers 31.0 mm above `c1`; seat it".into() }];
    if index > 0 {
        rejections.push(Rejection { dwell: free, why: "the sensor did not see the tip during it".into() });
    }
    let board_in_world = model.board_in_world(planted, index).unwrap();
    let run = RecordingRun {
        name: name.into(),
        paths: vec![path.to_owned()],
        report: recording.report().clone(),
        clock: (index == 0).then_some(ClockAlignment {
            offset_s: 0.0123,
            offset_sigma_s: 0.0002,
            drift: 4e-6,
            drift_sigma: 1e-6,
            reference_ns: EPOCH_NS,
            first_ns: EPOCH_NS,
            correlation: 0.998,
            displacement_ratio: 1.003,
            declared: false,
        }),
        dwells,
        association: Some(Association { assignments, board_in_world, warnings: Vec::new() }),
        rejections,
        earlier: None,
        warnings: match index {
            1 => vec![warning(
                Code::DwellSplitByGap,
                "/joint_states",
                "a gap of 2.1 s; check the network of the robot",
            )],
            _ => Vec::new(),
        },
    };
    (run, observations)
}

fn seated(
    recording: usize,
    dwell: usize,
    cavity: String,
    in_board_m: Vector3<f64>,
    slip_m: Vector3<f64>,
    model: &Model,
    planted: &[f64],
) -> Observation {
    let seated = Reference::Seated { cavity, in_board_m };
    let mut o = Observation {
        time_ns: time_ns(recording, dwell) + 500_000_000,
        joint_sigma_rad: vec![1e-5; 3],
        arrival: vec![Arrival::Positive, Arrival::Negative, Arrival::Unknown],
        load_kg: 0.2,
        covariance_m2: Matrix3::from_diagonal_element(1.25e-8),
        ..Observation::bare(DwellId { recording, dwell }, START_RAD.to_vec(), seated)
    };
    // Inverse kinematics of the planted arm by Newton's method.
    for _ in 0..50 {
        let error_m =
            model.measured_tip_in_world(planted, &o) + slip_m - model.predicted_tip_in_world(planted, &o);
        let jacobian = Matrix3::from_columns(&[
            model.joint_jacobian(planted, &o).column(0).into_owned(),
            model.joint_jacobian(planted, &o).column(1).into_owned(),
            model.joint_jacobian(planted, &o).column(2).into_owned(),
        ]);
        let step = jacobian.try_inverse().unwrap() * error_m;
        o.joint_rad.iter_mut().zip(step.iter()).for_each(|(q, dq)| *q += dq);
    }
    let left_m =
        model.measured_tip_in_world(planted, &o) + slip_m - model.predicted_tip_in_world(planted, &o);
    assert!(left_m.norm() < 1e-12, "the cavity is out of reach: {left_m}");
    o
}

/// A dwell in free space that the sensor saw.
fn tracked(dwell: &Dwell, model: &Model, planted: &[f64]) -> Observation {
    let tip = dwell.tip.as_ref().unwrap();
    let position_m =
        model.tip_in_base(planted, &dwell.joint_rad).translation.vector + Vector3::new(0.0, 1e-4, 0.0);
    let (orientation, orientation_sigma_rad) = (tip.orientation, tip.orientation_sigma_rad);
    let seen = Reference::Tracked { position_m, orientation, orientation_sigma_rad };
    Observation {
        time_ns: dwell.mid_ns(),
        joint_sigma_rad: dwell.joint_sigma_rad.clone(),
        arrival: dwell.arrival.clone(),
        temperature_c: dwell.temperature_c,
        load_kg: 0.2,
        covariance_m2: tip.covariance_m2,
        ..Observation::bare(dwell.id, dwell.joint_rad.clone(), seen)
    }
}

fn dwell(recording: usize, dwell: usize, joint_rad: &[f64]) -> Dwell {
    let start_ns = time_ns(recording, dwell);
    Dwell {
        id: DwellId { recording, dwell },
        start_ns,
        end_ns: start_ns + 1_000_000_000,
        joint_rad: joint_rad.to_vec(),
        joint_spread_rad: vec![2e-5; 3],
        joint_sigma_rad: vec![1e-5; 3],
        effort_nm: (dwell == 0).then(|| vec![1.0, -2.5, 0.5]),
        samples: 500,
        effective_samples: 120.5,
        arrival: vec![Arrival::Positive, Arrival::Negative, Arrival::Unknown],
        path_memory_rad: joint_rad.iter().map(|q| vec![q - 0.1, *q]).collect(),
        pair_memory_rad: Vec::new(),
        moved_rad: None,
        tip: (dwell == 5 && recording == 0).then(|| TipMeasurement {
            position_m: Vector3::new(0.4, 0.05, 0.3),
            covariance_m2: Matrix3::from_diagonal_element(4e-10),
            orientation: Some(UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3)),
            orientation_sigma_rad: 1e-4,
            samples: 100,
            effective_samples: 30.0,
        }),
        markers: Default::default(),
        temperature_c: (recording == 1).then_some(23.5),
        gauges: Default::default(),
    }
}

/// When a dwell begins [ns].
pub fn time_ns(recording: usize, dwell: usize) -> i64 {
    EPOCH_NS + recording as i64 * 3_600_000_000_000 + dwell as i64 * 5_000_000_000
}

fn calibration(model: &Model, observations: &[Observation], fitted: &[f64]) -> Calibration {
    let nominal = model.nominal();
    let residuals: Vec<Residual> = observations
        .iter()
        .map(|o| {
            let fitted_m = model.residual(fitted, o).position_m;
            Residual {
                dwell: o.dwell,
                held_out: o.dwell.recording == 2,
                nominal_m: model.residual(&nominal, o).position_m,
                fitted_m,
                whitened: fitted_m / o.covariance_m2[(0, 0)].sqrt(),
                weight: if o.dwell.dwell == 3 { 0.4 } else { 1.0 },
                expected_norm_m: 1.8e-4,
            }
        })
        .collect();
    let side = |held_out: bool| {
        let own: Vec<&Residual> = residuals.iter().filter(|r| r.held_out == held_out).collect();
        let stats =
            |f: fn(&Residual) -> f64| ErrorStats::of_norms(&own.iter().map(|r| f(r)).collect::<Vec<_>>());
        SideErrors { nominal: stats(|r| r.nominal_m.norm()), fitted: stats(|r| r.fitted_m.norm()) }
    };
    let (train, holdout) = (side(false), side(true));
    Calibration {
        fit: fit(model, observations.len(), fitted),
        nominal_values: nominal,
        residuals,
        train,
        holdout,
        noise_floor_m: 1.8e-4,
        prediction_factor: 1.1,
        turn_sigma_ratio: Vec::new(),
        turn_nominal_values: Vec::new(),
        warnings: Vec::new(),
    }
}

fn fit(model: &Model, observations: usize, fitted: &[f64]) -> Fit {
    let estimates = model.parameters().iter().zip(fitted).map(|(parameter, &value)| {
        let sigma = if parameter.free { 1e-4 } else { 0.0 };
        Estimate {
            value,
            sigma,
            ci95: [value - 1.96 * sigma, value + 1.96 * sigma],
            determined: parameter.free && parameter.name != "joint2.d",
            at_bound: parameter.name == "joint1.theta",
            parameter: parameter.clone(),
        }
    });
    Fit {
        objective: "robust least squares (Huber)".into(),
        estimates: estimates.collect(),
        covariance: nalgebra::DMatrix::zeros(fitted.len(), fitted.len()).into(),
        weights: vec![1.0; observations],
        sigma_scale: 1.04,
        rank: 12,
        undetermined: vec![UndeterminedDirection {
            shares: vec![("joint2.d".into(), 0.7), ("joint3.d".into(), -0.7)],
            text: "joint2.d against joint3.d: axes 2 and 3 are parallel, so an offset along one is the same as an \
                   offset along the other"
                .into(),
        }],
        paper: None,
        status: Status::Converged,
        iterations: 9,
        warnings: Vec::new(),
    }
}

fn warning(code: Code, subject: &str, message: &str) -> Warning {
    Warning::new(Severity::Notice, Stage::Dwell, code, subject, message)
}
