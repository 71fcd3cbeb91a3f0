//! `armcal add`: puts an effect into the model and shows what that does on points the fit never saw.

use super::run::result_files;
use super::{Outcome, may_write, print, terminal_style};
use crate::error::Error;
use crate::extended::{extend_pipeline, set_of};
use crate::progress::Progress;
use crate::view::{self, Given};
use armcal_config::Pipeline;
use armcal_core::list_names;
use armcal_diagnose::{Diagnosis, Nested};
use armcal_held_out::{LeftOut, Transfer, transfer_between_recordings};
use armcal_model::EffectSpec;
use armcal_pipeline::Converged;
use armcal_recording::atomic;
use armcal_report::{comparison_text, diagnosis_text, write_all};
use armcal_result::{Comparison, Status, StoredRun};
use armcal_stages::{Fitted, frames};
use armcal_wording::nested_sentence;
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The word for "whatever the diagnosis suggests".
const SUGGESTED: &str = "suggested";

/// What `armcal add` is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Effects such as backlash:1 (see `armcal effects`), or `suggested` for what the diagnosis found.
    #[arg(required = true)]
    pub effects: Vec<String>,
    /// Pipeline file to extend, or the results of its run (their folder or run.mcap): what these concluded is not looked for again.
    pub pipeline: PathBuf,
    /// File for the extended pipeline; beside the original when absent.
    #[arg(long)]
    pub write: Option<PathBuf>,
    /// Folder for the results of the extended pipeline.
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// What is added, what it does to recordings that did not teach it, and what is left out for that.
struct Chosen {
    new: Vec<EffectSpec>,
    /// Of each found effect all names that are the same answer.
    sets: Vec<Vec<String>>,
    transfer: Vec<Transfer>,
    left_out: Vec<LeftOut>,
    nested: Option<Nested>,
}

/// Refits with the effects, compares on held-out points, diagnoses what remains, writes pipeline and results.
pub fn run(request: &Request) -> Result<Outcome, Error> {
    let given = Given::alone(&request.pipeline)?;
    let path = given.pipeline;
    let pipeline = Pipeline::load(&path)?;
    may_write(result_files(&pipeline, &request.out))?;
    let named = parse_effects(&request.effects, &pipeline)?;
    if let Some(new) = &named {
        extend_pipeline(&pipeline, &path, request.write.as_deref(), (new, &[]))?;
    }
    let progress = Progress::new();
    let settled = armcal_pipeline::settle_again(&pipeline, given.concluded, &progress)?;
    let geometry = settled.fitted.geometry.clone();
    let mut effects = frames::effect_specs(&pipeline, &geometry)?;
    let Chosen { new, sets, transfer, left_out, nested } =
        select_effects(named, &pipeline, &settled, &effects, &progress)?;
    let extended = extend_pipeline(&pipeline, &path, request.write.as_deref(), (&new, &sets))?;

    progress.step("calibrating without and with");
    effects.extend(new.iter().cloned());
    let (mut run, recordings) = settled.into_run(&pipeline);
    let before = StoredRun::of(&run);
    armcal_pipeline::recalibrate(&mut run, &extended.pipeline, &geometry, &effects, &progress)?;
    let comparison = Comparison::of(&before, &StoredRun::of(&run));

    progress.step("writing results");
    atomic::write(&extended.path, extended.pipeline.text.as_bytes()).map_err(Error::Output)?;
    write_all(&run, &recordings, &request.out, &extended.pipeline.output)?;
    view::write_source_file(&request.out, &extended.path, &[])?;
    progress.finish();

    let added: Vec<String> = new.iter().map(EffectSpec::to_string).collect();
    if request.json {
        // A name that is no Unicode cannot be told in JSON.
        let pipeline = serde_json::to_value(&extended.path).map_err(Error::Json)?;
        let value = json!({
            "added": added,
            // Of each that stands for one of several all names.
            "one_of": run.ties.iter().cloned().collect::<BTreeMap<_, _>>(),
            // What the diagnosis suggests and another session or recording contradicts.
            "left_out": left_out,
            // Each effect fitted on all recordings but one and judged on that one.
            "transfer": transfer,
            // What the choice is worth on points that had no part in it; null where the user chose, or nothing was held out.
            "nested": nested,
            "pipeline": pipeline,
            "comparison": comparison,
            "remaining": run.diagnosis,
        });
        print(&super::json_text(&super::with_losses(value))?)?;
    } else {
        let one_of = |name: &String| match set_of(name, &sets) {
            Some(set) => format!("{name} (one of {}: these data do not tell which)", list_names(set)),
            None => name.clone(),
        };
        let added = run.in_words(&added.iter().map(one_of).collect::<Vec<_>>().join(", "));
        print(&format!("Added {added} to {}\n\n", path.display()))?;
        for LeftOut { effect, reason } in &left_out {
            print(&format!("Left out: {}: {reason}\n\n", run.in_words(effect)))?;
        }
        print(&comparison_text(&comparison, terminal_style()))?;
        for transfer in &transfer {
            print(&format!("\nTransfer: {}.\n", run.in_words(&transfer.sentence())))?;
        }
        if let Some(nested) = &nested {
            print(&format!("\nThe choice: {}.\n", run.in_words(&nested_sentence(nested))))?;
        }
        print(&format!("\n{}", diagnosis_text(&run, terminal_style())))?;
        let (path, out) = (extended.path.display(), request.out.display());
        print(&format!("\nPipeline with the effect: {path}; its results: {out}\n"))?;
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::CompletedWithWarnings })
}

/// The effects the user named; `None` for those that the diagnosis will suggest.
fn parse_effects(words: &[String], pipeline: &Pipeline) -> Result<Option<Vec<EffectSpec>>, Error> {
    if words.iter().any(|word| word == SUGGESTED) {
        return Ok(None);
    }
    let (_, chain) = frames::nominal_chain(pipeline)?;
    let parsed = words.iter().map(|word| EffectSpec::parse(word, chain.joint_names()));
    parsed.collect::<Result<_, _>>().map(Some).map_err(Error::of_usage)
}

/// What is added: what the user names, or of what the diagnosis suggests that which another session and the other
/// recordings do not contradict. `base` are the pipeline's own effects.
fn select_effects(
    named: Option<Vec<EffectSpec>>,
    pipeline: &Pipeline,
    settled: &Converged,
    base: &[EffectSpec],
    progress: &Progress,
) -> Result<Chosen, Error> {
    let Fitted { geometry, observations, .. } = &settled.fitted;
    let checked = |new: &[EffectSpec]| {
        transfer_between_recordings(pipeline, geometry, (base, new), observations, progress)
    };
    if let Some(new) = named {
        let transfer = checked(&new)?;
        return Ok(Chosen { new, sets: Vec::new(), transfer, left_out: Vec::new(), nested: None });
    }
    let diagnosis = settled.diagnose(pipeline, progress)?;
    let joints = geometry.chain().joint_names();
    let nested = match &diagnosis {
        Some(found) => {
            armcal_pipeline::chosen_again(pipeline, &settled.fitted.calibrated(pipeline), found, progress)?
        }
        None => None,
    };
    let sets = diagnosis.as_ref().map_or_else(Vec::new, Diagnosis::sets);
    let lasting = diagnosis.map(|d| d.lasting(joints, pipeline.recordings.len())).transpose()?;
    let (mut new, of_time) = lasting.unwrap_or_default();
    let mut left_out: Vec<LeftOut> = of_time.iter().map(LeftOut::of_time).collect();
    let mut transfer = checked(&new)?;
    if transfer.iter().any(Transfer::harms) {
        let harmful = transfer.iter().filter(|t| t.harms());
        left_out.extend(harmful.map(|t| LeftOut { effect: t.effect.clone(), reason: t.sentence() }));
        new = new.into_iter().zip(&transfer).filter(|(_, t)| !t.harms()).map(|(effect, _)| effect).collect();
        transfer = checked(&new)?;
    }
    if new.is_empty() {
        let reasons = left_out.iter().map(|l| format!("{}: {}", l.effect, l.reason)).collect();
        return Err(Error::NothingSuggested { pipeline: pipeline.name.clone(), left_out: reasons });
    }
    Ok(Chosen { new, sets, transfer, left_out, nested })
}
