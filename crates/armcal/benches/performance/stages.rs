//! Where the time of a run goes, stage by stage, in one thread: what is left to gain, and what bounds it.

use crate::campaign::Weighed;
use crate::clock::{Spent, spent};
use crate::page::{Section, Table};
use crate::{Options, Result, batch, campaign};
use armcal::pipeline::Pipeline;
use armcal::progress::Progress;
use armcal::refits::add_refits;
use armcal::stages::{frames, perceive};
use armcal::{setup, story};
use armcal_report::write_all;
use std::path::{Path, PathBuf};

/// Poses of the campaigns, and how many of them are weighed.
const CAMPAIGNS: [(usize, Weighed); 3] =
    [(2_000, Weighed::Default), (2_000, Weighed::All), (16_811, Weighed::None)];
const STAGES: [&str; 6] = [
    "reading, clocks, dwells",
    "fit and hold-out",
    "checking the setup",
    "diagnosis",
    "fits of what it proposes",
    "writing every output",
];

/// What one run spends.
struct Costs {
    title: String,
    stages: [Spent; 6],
    dwells: usize,
    /// The model and its derivatives once in every dwell.
    evaluation: Spent,
}

pub fn section(options: &Options) -> Result<Section> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut section = Section::new("Where the time goes");
    section.say(
        "CPU seconds of the stages of `armcal run`, one thread: of one recording of the batch, and of campaigns of the \
         part on growth. An evaluation is the model with its derivatives by every parameter, once in every dwell: a fit needs a \
         few of them, a hold-out of ten turns one or more a turn.",
    );
    let mut all = vec![one.install(|| costs("a recording of the batch".into(), &batch::one(options)?))?];
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../pipelines/models").canonicalize()?;
    for (poses, weighed) in CAMPAIGNS.into_iter().filter(|(poses, _)| *poses <= options.poses) {
        let folder = options.data.join(format!("campaign-{poses}"));
        let pipeline = campaign::place(&folder, poses, weighed, &models)?;
        let how = match weighed {
            Weighed::None => "no diagnosis",
            Weighed::Default => "as shipped",
            Weighed::All => "all weighed",
        };
        all.push(one.install(|| costs(format!("{poses} poses, {how}"), &pipeline))?);
    }
    let titles: Vec<&str> = std::iter::once("stage").chain(all.iter().map(|c| c.title.as_str())).collect();
    let mut table = Table::new(&titles);
    for (k, stage) in STAGES.into_iter().enumerate() {
        let cells = all.iter().map(|c| format!("{:.3}", c.stages[k].cpu_s));
        table.row(std::iter::once(stage.to_owned()).chain(cells));
    }
    let totals = all.iter().map(|c| format!("{:.3}", c.stages.iter().map(|s| s.cpu_s).sum::<f64>()));
    table.row(std::iter::once("together".to_owned()).chain(totals));
    let evaluations = all.iter().map(|c| format!("{:.4}", c.evaluation.cpu_s));
    table.row(std::iter::once("one evaluation".to_owned()).chain(evaluations));
    let each = all.iter().map(|c| format!("{:.1}", c.evaluation.cpu_s / c.dwells as f64 * 1e6));
    table.row(std::iter::once("of it a dwell [us]".to_owned()).chain(each));
    let many = all.iter().map(|c| format!("{:.0}", c.stages[1].cpu_s / c.evaluation.cpu_s));
    table.row(std::iter::once("fit and hold-out, in evaluations".to_owned()).chain(many));
    section.table(table);
    Ok(section)
}

/// Stage by stage, as `armcal run` goes through them.
fn costs(title: String, pipeline: &Path) -> Result<Costs> {
    let (pipeline, silent) = (Pipeline::load(pipeline)?, Progress::silent());
    let (_, chain) = frames::nominal_chain(&pipeline)?;
    let read = || -> Result<()> {
        let recordings = perceive::open_all(&pipeline, &silent)?;
        drop(perceive::dwells_of_all(&pipeline, &chain, &recordings, &silent, &mut drop)?);
        Ok(())
    };
    let (done, reading) = spent(read);
    done?;
    let settled = story::settle(&pipeline, &silent)?;
    let (fitted, fitting) = spent(|| story::fit_places(&settled.inputs, &mut |_| ()));
    let fitted = fitted?;
    let values = fitted.calibration.fit.values();
    let observations: Vec<_> = fitted.observations.iter().collect();
    let every = || {
        fitted.model.residuals_with_jacobians(&values, &observations, (&|_| true, true), &mut |_, _, _| ());
    };
    let ((), evaluation) = spent(every);
    let (_, checking) = spent(|| setup::examine(&settled.inputs, &fitted));
    let ((mut run, recordings), diagnosing) = spent(|| settled.diagnosed(&pipeline, &silent));
    let (refitted, refitting) = spent(|| add_refits(&mut run, &pipeline, &silent));
    refitted?;
    let out: PathBuf = pipeline.resolve(Path::new("stages-out"));
    let (written, writing) = spent(|| write_all(&run, &recordings, &out, &pipeline.output));
    written?;
    std::fs::remove_dir_all(&out)?;
    let stages = [reading, fitting, checking, diagnosing, refitting, writing];
    Ok(Costs { title, stages, dwells: observations.len(), evaluation })
}
