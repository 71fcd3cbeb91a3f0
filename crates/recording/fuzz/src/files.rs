//! Files that people write, and results of earlier runs: the first byte says which file the rest is.
//!
//! None of these may panic or hang; what a reader accepts must also survive what is done with it first.

use armcal_check::reference::Calibrated;
use armcal_config::Pipeline;
use armcal_deploy::set_points::targets;
use armcal_lab::LabConfig;
use armcal_lab::pair::PairConfig;
use armcal_model::{Chain, EffectSpec, EffectTable, Frames, Model, Session};
use armcal_result::open_model;
use armcal_table::Board;
use std::io::Write as _;
use std::path::Path;

const RIGHT_ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");

fn split(bytes: &[u8]) -> Option<(u8, &str)> {
    let (kind, text) = bytes.split_first()?;
    Some((*kind, std::str::from_utf8(text).ok()?))
}

/// 0 a pipeline, 1 one of two arms, 2 a lab, 3 a lab of two arms.
pub fn pipeline(bytes: &[u8]) {
    let Some((kind, text)) = split(bytes) else { return };
    let path = Path::new("file.toml");
    match kind % 4 {
        0 => {
            if let Ok(pipeline) = Pipeline::parse(path, text.to_owned(), Path::new("")) {
                let _ = pipeline.diagnosis.check();
                let _ = pipeline.fit.check();
                let _ = place(&pipeline.effects);
            }
        }
        1 => {
            let two = format!("{text}\n[closed_chain]\nkind = \"same-point\"\n");
            if let Ok(pipeline) = Pipeline::parse(path, two, Path::new("")) {
                let _ = pipeline.arm_files();
            }
        }
        2 => {
            if let Ok(config) = LabConfig::from_toml(text, path) {
                (0..config.recordings.len()).for_each(|i| _ = config.start_ns(i));
            }
        }
        _ => {
            if let Ok(config) = PairConfig::from_toml(text, path) {
                (0..config.recordings.len()).for_each(|i| _ = config.start_ns(i));
            }
        }
    }
}

/// 0 a board, 1 a DH table, 2 a URDF, 3 targets as CSV, 4 as TOML.
pub fn geometry(bytes: &[u8]) {
    let Some((kind, text)) = split(bytes) else { return };
    let path = Path::new("file");
    match kind % 5 {
        0 => {
            if let Ok(board) = Board::from_toml(text, path) {
                assert!(board.cavities.iter().all(|c| c.in_board_m.iter().all(|x| x.is_finite())));
            }
        }
        1 => {
            if let Ok(chain) = Chain::from_dh_toml(text, path) {
                survive(chain.clone());
                let model = Model::new(chain.clone(), Frames::of_bare_arm());
                let values = model.map(|m| m.nominal()[..chain.parameters().len()].to_vec());
                if let Ok(written) = values.and_then(|values| chain.to_dh_toml(&values)) {
                    Chain::from_dh_toml(&written, path).expect("what is written is read back");
                }
            }
        }
        2 => {
            if let Ok(chain) = Chain::from_urdf(text, "base", "tip", path) {
                survive(chain);
            }
        }
        kind => {
            let suffix = if kind == 3 { ".csv" } else { ".toml" };
            let file = in_file(text, suffix);
            let _ = targets::read(file.path());
        }
    }
}

fn survive(chain: Chain) {
    if let Ok(model) = Model::new(chain, Frames::of_bare_arm()) {
        let joints = vec![0.1; model.joint_count()];
        model.tip_in_base(&model.nominal(), &joints);
    }
}

/// 0 `model.json`, 1 `summary.json`, 2 an effect as a word, 3 effects as tables, formulas among them.
pub fn results(bytes: &[u8]) {
    let Some((kind, text)) = split(bytes) else { return };
    match kind % 4 {
        0 => {
            let file = in_file(text, ".json");
            if let Ok(past) = open_model(file.path())
                && let Ok(arms) = past.arms()
            {
                let joints = vec![0.1; arms.model.joint_count()];
                arms.model.tip_in_base(&arms.values, &joints);
                past.session().duration_s();
            }
        }
        1 => {
            let file = in_file(text, ".json");
            if let Ok(calibrated) = Calibrated::open(file.path()) {
                let names: Vec<&str> = calibrated.frame_names().collect();
                names.iter().for_each(|name| _ = calibrated.frame(name));
            }
        }
        2 => {
            let joints = ["joint1", "joint2", "joint3"].map(str::to_owned);
            if let Ok(spec) = EffectSpec::parse(text, &joints) {
                let again = EffectSpec::parse(&spec.to_string(), &joints).map(|s| s.to_string());
                assert_eq!(again.ok(), Some(spec.to_string()), "what is written is read back");
                let _ = place(&[EffectTable::from(&spec)]);
            }
        }
        _ => {
            #[derive(serde::Deserialize)]
            struct File {
                effects: Vec<EffectTable>,
            }
            if let Ok(file) = toml::from_str::<File>(text) {
                let _ = place(&file.effects);
            }
        }
    }
}

/// Puts effects into the paper's arm, and moves it.
fn place(effects: &[EffectTable]) -> Option<()> {
    let chain = Chain::from_dh_toml(RIGHT_ARM, Path::new("right_arm.toml")).ok()?;
    let model = Model::new(chain, Frames::of_bare_arm()).ok()?;
    let joints = model.chain().joint_names();
    let specs = effects.iter().map(|e| e.spec(joints)).collect::<Result<Vec<_>, _>>().ok()?;
    let model = model.with_effects(&specs, &Session::of(&[])).ok()?;
    model.tip_in_base(&model.nominal(), &[0.1, 0.2, 0.3]);
    Some(())
}

fn in_file(text: &str, suffix: &str) -> tempfile::NamedTempFile {
    let folder =
        Some(Path::new("/dev/shm")).filter(|f| f.is_dir()).map_or_else(std::env::temp_dir, Path::to_owned);
    let mut file = tempfile::Builder::new().suffix(suffix).tempfile_in(folder).expect("a temporary file");
    file.write_all(text.as_bytes()).expect("a temporary file");
    file
}
