//! The proposal: what was found, as the sections of a pipeline.

use super::Tried;
use super::draft::Draft;
use super::known::Known;
use super::page::{Page, toml_string};
use super::roles::{Cast, Role};
use super::topics::BodyTopic;
use crate::error::InitError;
use armcal_config::Pipeline;
use armcal_recording::{atomic, seal_text};
use std::path::{Path, PathBuf};

/// First line of a proposal: what makes it one of armcal's files.
const MARK: &str = "armcal.pipeline/1, proposed by `armcal init`; every line may be changed";

/// A pipeline that may be written.
pub struct Proposal {
    /// The pipeline, as the program reads it.
    pub pipeline: Pipeline,
    /// Its file.
    pub out: PathBuf,
    /// Files that it names and that are still to be written.
    pub beside: Vec<(PathBuf, String)>,
    /// The bodies and their roles.
    pub bodies: Vec<(BodyTopic, Cast)>,
    /// Mistakes that it undoes where the recordings are read.
    pub mended: Vec<String>,
    /// What may be otherwise.
    pub unsure: Vec<String>,
    /// What nothing in the recordings shows, and where to fill it in.
    pub unseen: Vec<String>,
    /// Topics that are not used, and why.
    pub left: Vec<(String, String)>,
    /// What a first calibration came to, or why there was none.
    pub tried: Option<Result<Tried, String>>,
}

/// A calibration that leaves less than this share of the nominal errors, or less than this [m], is of the arm that was recorded.
const PLAUSIBLE_SHARE: f64 = 0.2;
const PLAUSIBLE_M: f64 = 4e-3;

impl Proposal {
    /// Mean error that a first calibration leaves [m]; infinite where there was none.
    pub fn error_m(&self) -> f64 {
        match &self.tried {
            Some(Ok(tried)) => tried.mean_m[1],
            _ => f64::INFINITY,
        }
    }

    /// Whether a first calibration leaves errors as of an arm that is read rightly.
    pub fn is_plausible(&self) -> bool {
        let nominal_m = match &self.tried {
            Some(Ok(tried)) => tried.mean_m[0],
            _ => 0.0,
        };
        self.error_m() < PLAUSIBLE_M.max(PLAUSIBLE_SHARE * nominal_m)
    }

    /// The noise per axis that a first calibration left, where the sensor shows none by itself and less was left than is assumed [mm].
    pub fn quieter_mm(&self) -> Option<f64> {
        let told = matches!(&self.tried, Some(Ok(tried)) if tried.too_few.is_none());
        let assumed_mm = if told { self.pipeline.observations.sensor_sigma_mm } else { 0.0 };
        // The length of three errors of one size has this mean.
        let left_mm = self.error_m() * 1e3 / (8.0 / std::f64::consts::PI).sqrt();
        (left_mm > 0.0 && left_mm < assumed_mm).then_some(left_mm)
    }

    /// Whether a first calibration with it went well.
    pub fn runs(&self) -> bool {
        let sound =
            matches!(&self.tried, Some(Ok(tried)) if tried.mistakes.is_empty() && tried.too_few.is_none());
        sound && self.is_plausible()
    }

    /// The same pipeline with the unwritten files in another folder.
    pub fn in_folder(&self, folder: &Path) -> Result<Pipeline, InitError> {
        let mut pipeline = self.pipeline.clone();
        for (path, text) in &self.beside {
            let copy = folder.join(path.file_name().unwrap_or_default());
            atomic::write(&copy, text.as_bytes()).map_err(InitError::Output)?;
            if path.extension().is_some_and(|e| e == "urdf") {
                pipeline.model.urdf = Some(copy);
            } else if let Some(table) = &mut pipeline.table {
                table.board = copy;
            }
        }
        Ok(pipeline)
    }
}

impl Known<'_> {
    /// The proposal, parsed by the very reader of pipelines.
    pub fn propose(&self, mut left: Vec<(String, String)>) -> Result<Proposal, InitError> {
        let folder = self.asked.out.parent().unwrap_or(Path::new("")).to_owned();
        let (beside, unsure, unseen) = (Vec::new(), self.arm.unsure.clone(), Vec::new());
        let mut draft = Draft { known: self, page: Page::default(), folder, beside, unsure, unseen };
        draft.recordings();
        draft.streams();
        draft.table();
        draft.model()?;
        draft.frames();
        draft.holdout();
        let Draft { page, folder, beside, unsure, unseen, .. } = draft;
        let mut head = Page::default();
        head.note(MARK);
        let mended = self.mended.to_vec();
        let notes = [("undone", &mended), ("unsure", &unsure), ("not visible in the recordings", &unseen)];
        for (what, all) in notes {
            all.iter().for_each(|said| head.note(&format!("{what}: {said}")));
        }
        let name = self.asked.out.file_stem().unwrap_or_default().to_string_lossy();
        head.line(&format!("name = {}", toml_string(&name)), "");
        let text = seal_text(&(head.text() + &page.text())).into_owned();
        let pipeline = Pipeline::proposed(&self.asked.out, text, &folder)?;
        left.extend(self.read.left.clone());
        let bodies = self.read.bodies.iter().cloned().zip(self.cast.iter().cloned()).collect();
        Ok(Proposal {
            pipeline,
            out: self.asked.out.clone(),
            beside,
            bodies,
            mended,
            unsure,
            unseen,
            left,
            tried: None,
        })
    }

    /// The body with this role.
    pub fn of_role(&self, role: Role) -> Option<usize> {
        self.cast.iter().position(|c| c.role == role)
    }

    /// Bodies on the links of the arm beside the tip.
    pub fn markers(&self) -> impl Iterator<Item = (usize, usize, &Cast)> {
        let marker = |(at, cast): (usize, &'_ Cast)| match cast.role {
            Role::Marker(link) => Some((at, link)),
            _ => None,
        };
        self.cast
            .iter()
            .enumerate()
            .filter_map(move |(at, cast)| marker((at, cast)).map(|(at, link)| (at, link, cast)))
    }

    /// Pauses of the joints in all recordings.
    pub fn pauses(&self) -> usize {
        self.read.recordings.iter().map(|r| r.dwells.len()).sum()
    }
}
