//! `armcal init`: a pipeline proposed from recordings.

use super::{Outcome, json_text, print};
use crate::error::Error;
use crate::progress::Progress;
use armcal_core::printable_name;
use armcal_core::units::format_mm;
use armcal_init::{Asked, Proposal, Told, propose};
use armcal_recording::{Over, RecordingError, atomic, file_has_content, input, may_put, may_write_over};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What `armcal init` is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Recordings (.mcap, .db3, also compressed), folders of them, patterns such as 'lab/*.mcap'; the parts of a split bag
    /// are one recording.
    #[arg(required = true)]
    pub inputs: Vec<String>,
    /// The pipeline to write; what it needs and no file holds is written beside it.
    #[arg(long, default_value = "pipeline.toml", value_name = "FILE")]
    pub out: PathBuf,
    /// URDF of the arm, instead of the /robot_description in the recordings.
    #[arg(long, value_name = "FILE", conflicts_with = "dh")]
    pub urdf: Option<PathBuf>,
    /// DH table of the arm.
    #[arg(long, value_name = "FILE")]
    pub dh: Option<PathBuf>,
    /// Board whose cavities the tip sat in.
    #[arg(long, value_name = "FILE")]
    pub board: Option<PathBuf>,
    /// CSV file in which a laser tracker exported where the tip was, a row a pause; of several recordings once for each, in
    /// their order.
    #[arg(long, value_name = "FILE")]
    pub points: Vec<PathBuf>,
    /// Topic of the joint readings, where several could be it; of a field in a message TOPIC:PATH.
    #[arg(long, value_name = "TOPIC")]
    pub joints: Option<String>,
    /// First link of the arm in the URDF.
    #[arg(long, value_name = "LINK", conflicts_with = "dh")]
    pub base_link: Option<String>,
    /// Last link of the arm in the URDF.
    #[arg(long, value_name = "LINK", conflicts_with = "dh")]
    pub tip_link: Option<String>,
    /// Replace an earlier proposal, with whatever was changed in it since; nothing else is ever written over.
    #[arg(long)]
    pub force: bool,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Proposes, writes, and says what was seen and what was not.
pub fn run(request: &Request) -> Result<Outcome, Error> {
    let given = [&request.urdf, &request.dh, &request.board];
    given.into_iter().flatten().chain(&request.points).for_each(|path| input::register_path(path));
    request.inputs.iter().for_each(|path| input::register_path(Path::new(path)));
    check_replaceable(&request.out, request.force)?;
    let told = Told {
        dh: request.dh.clone(),
        urdf: request.urdf.clone(),
        base_link: request.base_link.clone(),
        tip_link: request.tip_link.clone(),
        joints: request.joints.clone(),
    };
    let asked = Asked {
        inputs: request.inputs.clone(),
        told,
        board: request.board.clone(),
        points: request.points.clone(),
        out: request.out.clone(),
    };
    let progress = Progress::new();
    let proposal = propose(&asked, &progress)?;
    progress.finish();
    // What is there already, word for word, stays: a robot's description has no mark of armcal's.
    let is_new = |(path, text): &&(PathBuf, String)| !file_has_content(path, text.as_bytes());
    let beside: Vec<&(PathBuf, String)> = proposal.beside.iter().filter(is_new).collect();
    for (path, text) in &beside {
        check_replaceable(path, request.force || may_put(path, text.as_bytes()).is_ok() && path.is_file())?;
    }
    let over = if request.force { Over::Changed } else { Over::Unchanged };
    let pipeline = (proposal.out.clone(), proposal.pipeline.text.clone());
    for (path, text) in beside.into_iter().chain([&pipeline]) {
        atomic::write_over(path, text.as_bytes(), over).map_err(Error::Output)?;
    }
    print(&if request.json {
        json_text(&super::with_losses(json_of(&proposal)))?
    } else {
        proposal_text(&proposal)
    })?;
    Ok(if proposal.runs() { Outcome::Done } else { Outcome::CompletedWithWarnings })
}

/// Whether a file may be written: it is not there, or the user wants it replaced and it is one of armcal's.
fn check_replaceable(path: &Path, force: bool) -> Result<(), Error> {
    may_write_over(path, Over::Changed).map_err(Error::Output)?;
    let is_there = path.symlink_metadata().is_ok_and(|about| about.len() > 0);
    if !is_there || force {
        return Ok(());
    }
    let what = match may_write_over(path, Over::Unchanged) {
        Ok(()) => "was proposed earlier; --force replaces it",
        Err(_) => {
            "was proposed earlier and may have been changed since; --force replaces it with all changes"
        }
    };
    Err(Error::Output(RecordingError::NotOurs { path: path.to_owned(), what: what.to_owned() }))
}

fn proposal_text(proposal: &Proposal) -> String {
    let mut out = String::new();
    for (body, cast) in &proposal.bodies {
        let sure = if cast.sure { "" } else { " (unsure)" };
        let _ = writeln!(
            out,
            " {}: {}{sure}: {}",
            printable_name(&body.shown()),
            cast.role.word(),
            printable_name(&cast.why)
        );
    }
    for (what, all) in
        [("Undone", &proposal.mended), ("Unsure", &proposal.unsure), ("Not visible", &proposal.unseen)]
    {
        for said in all {
            let _ = writeln!(out, " {what}: {}", printable_name(said));
        }
    }
    for (topic, why) in &proposal.left {
        let _ = writeln!(out, " Not used: {}: {}", printable_name(topic), printable_name(why));
    }
    match &proposal.tried {
        Some(Ok(tried)) => {
            let [before, after] = tried.mean_m.map(format_mm);
            let goes = if tried.mean_m[1] < tried.mean_m[0] { "falls" } else { "does not fall: it goes" };
            let _ = writeln!(
                out,
                "\n Tried: on {} points the mean error {goes} from {before} to {after} mm.",
                tried.points
            );
            if let Some(few) = &tried.too_few {
                let _ = writeln!(out, " Too few dwells: {}.", printable_name(few));
            }
            for mistake in &tried.mistakes {
                let _ = writeln!(out, " Setup first: {}.", printable_name(mistake));
            }
            if tried.mistakes.is_empty() && !proposal.is_plausible() {
                let _ = writeln!(
                    out,
                    " So large an error is seldom of the arm alone: look at the order, signs, units and zeros of the joints, at which \
                     body is the tip, whether the model is of this arm, and whether anything moved meanwhile."
                );
            }
        }
        Some(Err(why)) => {
            let _ = writeln!(out, "\n Tried, and it does not run yet: {}", printable_name(why));
        }
        None => {}
    }
    let beside: Vec<String> = proposal.beside.iter().map(|(path, _)| path.display().to_string()).collect();
    let _ = writeln!(
        out,
        "\nWritten: {}",
        [vec![proposal.out.display().to_string()], beside].concat().join(", ")
    );
    let next = match proposal.runs() {
        true => format!("armcal run {}", proposal.out.display()),
        false => "mend what is said above, here or in the pipeline; a run tells more of it".to_owned(),
    };
    let _ = writeln!(out, " next:  {next}");
    out
}

fn json_of(proposal: &Proposal) -> Value {
    let bodies = proposal.bodies.iter().map(|(body, cast)| {
        json!({"topic": body.topic, "body": body.body, "role": cast.role.word(), "sure": cast.sure, "why": cast.why})
    });
    let tried = match &proposal.tried {
        Some(Ok(t)) => {
            json!({"points": t.points, "nominal_mm": t.mean_m[0] * 1e3, "calibrated_mm": t.mean_m[1] * 1e3, "too_few": t.too_few, "mistakes": t.mistakes})
        }
        Some(Err(why)) => json!({"why_not": why}),
        None => Value::Null,
    };
    json!({
        "schema": "armcal.init/1",
        "pipeline": proposal.out.display().to_string(),
        "beside": proposal.beside.iter().map(|(path, _)| path.display().to_string()).collect::<Vec<_>>(),
        "bodies": bodies.collect::<Vec<_>>(),
        "undone": proposal.mended,
        "unsure": proposal.unsure,
        "not_visible": proposal.unseen,
        "not_used": proposal.left.iter().map(|(topic, why)| json!({"topic": topic, "why": why})).collect::<Vec<_>>(),
        "tried": tried,
    })
}
