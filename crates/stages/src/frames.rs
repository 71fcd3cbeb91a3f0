//! The nominal model of a pipeline: chain, base, tip and one board frame a recording.

use crate::RunError;
use crate::declared::{declare_parameters, override_parameters};
use crate::seen::RecordingData;
use crate::two_arms;
use armcal_config::{
    BoardPose, ConfigError, FrameSection, MarkerSection, MarkersOn, ModelSection, Pipeline, TableSection,
    Vertical, pose_knowledge,
};
use armcal_core::{Code, Observation, Pose, Severity, Stage, Warning, list_names};
use armcal_model::{
    Arm, ArmFrames, Chain, EffectSpec, Frame, Frames, Knowledge, Marker, Model, RecordingStart, Session,
};
use armcal_recording::input;
use armcal_table::{Association, Board, Tilt};
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;

/// Reads the DH or URDF file of the pipeline, of two arms both: the texts and the chain in them.
pub fn nominal_chain(pipeline: &Pipeline) -> Result<(Vec<String>, Chain), RunError> {
    let measured: Vec<&str> = pipeline.markers.values().map(|marker| marker.link.as_str()).collect();
    let read =
        |model| chain_of(model, &measured, &pipeline.folder).map_err(|e| e.where_data_come_from(pipeline));
    let chains = pipeline.models().into_iter().map(read).collect::<Result<Vec<_>, RunError>>()?;
    let (texts, mut chains): (Vec<String>, Vec<Chain>) = chains.into_iter().unzip();
    let chain = match &pipeline.two_arms {
        None => chains.swap_remove(0),
        Some(two) => Chain::joined(two.arms.iter().map(|arm| arm.name.clone()).zip(chains).collect())?,
    };
    Ok((texts, chain))
}

/// The chain alone: bases at the world's origin, tips at the last links, nothing in doubt.
pub fn bare_model(chain: &Chain, markers: Vec<Marker>) -> Result<Model, RunError> {
    if chain.arms().is_empty() {
        return Ok(Model::new(chain.clone(), Frames { markers, ..Frames::of_bare_arm() })?);
    }
    let given = |arm: &Arm, what: &str| Frame::given(format!("{}.{what}", arm.name), Pose::identity());
    let frames = |arm: &Arm| ArmFrames { base: given(arm, "base"), tip: given(arm, "tip") };
    Ok(Model::of_arms(chain.clone(), chain.arms().iter().map(frames).collect())?)
}

/// Reads the DH or URDF file of a model section: its text and the chain in it, of a URDF with the branches to what is measured.
fn chain_of(model: &ModelSection, measured: &[&str], folder: &Path) -> Result<(String, Chain), RunError> {
    if let Some(dh) = &model.dh {
        let path = folder.join(dh);
        let text = read_file_text("DH model", &path)?;
        let chain = Chain::from_dh_toml(&text, &path)?;
        return Ok((text, chain));
    }
    let path = folder.join(model.urdf.as_deref().unwrap_or(Path::new("")));
    let link = |name: &Option<String>| name.clone().unwrap_or_default();
    let text = read_file_text("URDF", &path)?;
    let (base, tip) = (link(&model.base_link), link(&model.tip_link));
    let chain =
        Chain::from_urdf_branches(&text, &base, &tip, measured, &path)?.with_masses(model.masses, &path)?;
    let chain = match &model.deviation {
        Some(declared) => chain.with_deviation(declared, &path)?,
        None => chain,
    };
    Ok((text, chain))
}

/// Says which links weigh nothing in a file that lets others weigh something.
pub fn links_without_mass(pipeline: &Pipeline, chain: &Chain) -> Option<Warning> {
    let links = chain.links_without_mass();
    let asked = pipeline.models().iter().any(|model| model.masses.is_some());
    let then = match asked {
        true => "so it weighs 2.5 kg for every metre beside links with masses of their own",
        false => {
            "so all links of its arm weigh 2.5 kg for every metre, whatever the file says of the others; masses = \"urdf\" under \
             [model] takes those"
        }
    };
    let said = format!("the URDF gives it no mass, {then}. Write its <inertial>");
    let warning =
        |subject| Warning::new(Severity::Notice, Stage::Calibrate, Code::LinkWithoutMass, subject, said);
    (!links.is_empty()).then(|| warning(format!("link {}", list_names(&links))))
}

/// Reads the board file, if the pipeline has a table.
pub fn read_board(pipeline: &Pipeline) -> Result<Option<Board>, RunError> {
    let Some(table) = &pipeline.table else { return Ok(None) };
    let path = pipeline.resolve(&table.board);
    let text = read_file_text("board", &path).map_err(|e| e.where_data_come_from(pipeline))?;
    Ok(Some(Board::from_toml(&text, &path)?))
}

/// The model before calibration, every frame where it is known or assumed to be.
pub fn nominal_model(
    pipeline: &Pipeline,
    chain: &Chain,
    board: Option<&Board>,
    seen: &[RecordingData],
) -> Result<Model, RunError> {
    let (places, lengths) = (pipeline.places(), pipeline.lengths());
    if let Some(two) = &pipeline.two_arms {
        let mut model = two_arms::nominal_pair(two, chain)?.against(&places, &lengths)?;
        override_parameters(&mut model, &pipeline.parameters)?;
        return Ok(model);
    }
    let boards = match (&pipeline.table, board) {
        (Some(table), Some(board)) => seen
            .iter()
            .zip(&pipeline.recordings)
            .map(|(seen, entry)| board_frame(table, board, entry.tilt, seen))
            .collect::<Result<Vec<Frame>, RunError>>()?,
        _ => Vec::new(),
    };
    let bases: Vec<Pose> = seen.iter().filter_map(|s| s.base.as_ref().map(|b| b.pose)).collect();
    let frames = Frames {
        base: base_frame(&pipeline.frames.base, &bases),
        tip: pipeline.frames.tip.frame("tip", pipeline.fit.use_orientation),
        markers: markers(pipeline),
        boards,
    };
    let mut model = Model::new(chain.clone(), frames)?.against(&places, &lengths)?;
    declare_parameters(&mut model, pipeline)?;
    let own = &pipeline.pool.per_recording;
    if seen.len() > 1 && !own.is_empty() {
        let base = |s: &RecordingData| s.base.as_ref().map(|base| base.pose);
        let start = |s: &RecordingData| RecordingStart { name: s.name.clone(), base_in_world: base(s) };
        model.ask_own(seen.iter().map(start).collect(), own.clone());
    }
    Ok(model)
}

/// The markers of the pipeline, in the order of their names.
pub fn markers(pipeline: &Pipeline) -> Vec<Marker> {
    let turns = pipeline.fit.use_orientation;
    let marker = |(name, section): (&String, &MarkerSection)| Marker {
        link: section.link.clone(),
        frame: section.frame().frame(name, turns),
    };
    pipeline.markers.iter().map(marker).collect()
}

/// What the pipeline's effects need to know about all observations together.
pub fn session(pipeline: &Pipeline, observations: &[Observation]) -> Session {
    let mut session = Session::of(observations);
    if pipeline.frames.vertical == Vertical::Base {
        session.gravity_in_base_mps2 = Some(session.gravity_in_world_mps2);
    }
    session
}

/// The effects of the pipeline, in its order.
pub fn effect_specs(pipeline: &Pipeline, model: &Model) -> Result<Vec<EffectSpec>, RunError> {
    if let Some(two) = &pipeline.two_arms {
        return two_arms::effect_specs(two, pipeline, model);
    }
    let joints = model.chain().joint_names();
    pipeline.effects.iter().map(|table| table.spec(joints).map_err(RunError::Model)).collect()
}

/// Effects of the pipeline that stand for one of several names: how it is spelt, and all of them.
pub fn effect_ties(pipeline: &Pipeline, model: &Model) -> Vec<(String, Vec<String>)> {
    let joints = model.chain().joint_names();
    let tied = pipeline.effects.iter().filter(|table| table.one_of.len() > 1);
    tied.filter_map(|table| Some((table.spec(joints).ok()?.to_string(), table.one_of.clone()))).collect()
}

/// Starts every estimated board frame where the association found the board.
pub fn start_frames(pipeline: &Pipeline, model: &mut Model, places: &[Option<Association>]) {
    if pipeline.table.as_ref().is_none_or(|t| t.pose != BoardPose::Estimated) {
        return;
    }
    for (recording, association) in places.iter().enumerate() {
        if let Some(association) = association {
            model.set_board_start(recording, association.board_in_world);
        }
    }
}

fn read_file_text(what: &'static str, path: &Path) -> Result<String, RunError> {
    let read = input::read_to_string(path, input::Kind::Text);
    Ok(read.map_err(|source| ConfigError::ReadFile { what, path: path.to_owned(), source })?)
}

/// The base: one frame for all recordings, at the mean of what each recording `measured`.
pub fn base_frame(section: &FrameSection, measured: &[Pose]) -> Frame {
    let base = section.frame("base", true);
    Frame { pose: mean_of(measured).unwrap_or(base.pose), ..base }
}

/// Mean of poses that differ by little: rotations are averaged in the tangent space of the first.
fn mean_of(poses: &[Pose]) -> Option<Pose> {
    let first = poses.first()?.rotation;
    let n = poses.len() as f64;
    let position_m = poses.iter().map(|p| p.translation.vector).sum::<Vector3<f64>>() / n;
    let turn_rad =
        poses.iter().map(|p| (first.inverse() * p.rotation).scaled_axis()).sum::<Vector3<f64>>() / n;
    Some(Pose::from_parts(position_m.into(), first * UnitQuaternion::new(turn_rad)))
}

fn board_frame(
    table: &TableSection,
    board: &Board,
    tilt: Tilt,
    seen: &RecordingData,
) -> Result<Frame, RunError> {
    let tilted = board.tilted(tilt)?;
    let at = Pose::from(table.at);
    let measured_pose = seen.table.as_ref().map(|t| t.pose);
    let (pose, knowledge) = match (table.pose, measured_pose) {
        (BoardPose::Measured, Some(subject)) => {
            let board = match table.markers_on {
                MarkersOn::Board => subject * at,
                MarkersOn::Frame => subject * at * tilted,
            };
            (board, pose_knowledge(table.sigma_mm, table.sigma_deg))
        }
        (BoardPose::Estimated, _) => (at * tilted, Knowledge::Estimated),
        (BoardPose::Given | BoardPose::Measured, _) => {
            (at * tilted, pose_knowledge(table.sigma_mm, table.sigma_deg))
        }
    };
    Ok(Frame { name: format!("board.{}", seen.name), pose, knowledge, free_rotation: true })
}
