//! Where the time of a run goes, stage by stage, in one thread: what is left to gain, and what bounds it.

use crate::campaign::Weighed;
use crate::clock::{Spent, spent};
use crate::page::{Section, Table};
use crate::walk::walk;
use crate::{Options, Result, batch, campaign};
use armcal_config::Pipeline;
use armcal_pipeline::add_refits;
use armcal_report::write_all;
use armcal_setup as setup;
use armcal_stages::Silent;
use armcal_stages::{frames, preprocess};
use std::hint::black_box;
use std::path::{Path, PathBuf};

/// Poses of the campaigns, and how many of them are weighed.
const CAMPAIGNS: [(usize, Weighed); 4] =
    [(2_000, Weighed::Default), (2_000, Weighed::All), (16_811, Weighed::None), (16_811, Weighed::All)];
const STAGES: [&str; 6] = [
    "reading, clocks, dwells",
    "fit and hold-out",
    "checking the setup",
    "diagnosis",
    "fits of what it proposes",
    "writing every output",
];

/// Those of them that do little else than evaluate the model, or work with what that gave.
const OF_EVALUATIONS: [usize; 3] = [1, 3, 4];

/// Dwells in which the model is evaluated to measure one evaluation, at least.
const EVALUATED: usize = 1_000_000;
/// A fit to all and ten turns of the hold-out.
const FITS: f64 = 11.0;

/// What one run spends.
struct Costs {
    title: String,
    stages: [Spent; 6],
    dwells: usize,
    /// The recordings inflated, their records stepped over.
    walk_s: f64,
    /// The model and its derivatives once in every dwell.
    evaluation_s: f64,
}

pub fn section(options: &Options) -> Result<Section> {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut section = Section::new("Where the time goes");
    section.say(
        "CPU seconds of the stages of `armcal run`, one thread, in one process: of one recording of the batch (which itself \
         leaves out the last two stages, but for a summary), and of campaigns of the part on growth. Below them what no program \
         that reads these recordings and fits this model can leave out: inflating the chunks, and an evaluation of the model with its \
         derivatives by every parameter in every dwell, at least one for the fit and one for each of ten turns of the hold-out. \
         A fit takes a few evaluations, the products of their rows, its start and its intervals; a diagnosis fits what it \
         finds to all poses, again without each name (with all turns only where that is not clear), and weighs its catalogue on those of `max_weighed` \
         beside each of these fits. The system counts time on a processor in ticks of some milliseconds, which shows in the first \
         column.",
    );
    let mut all = vec![one.install(|| costs("a recording of the batch".into(), &batch::one(options)?))?];
    for (poses, weighed) in CAMPAIGNS.into_iter().filter(|(poses, _)| *poses <= options.poses) {
        let (pipeline, how) = (campaign::place(options, poses, weighed)?, weighed.word());
        all.push(one.install(|| costs(format!("{poses} poses, {how}"), &pipeline))?);
    }
    let titles: Vec<&str> = std::iter::once("stage").chain(all.iter().map(|c| c.title.as_str())).collect();
    let mut table = Table::new(&titles);
    let mut row = |title: &str, cell: &dyn Fn(&Costs) -> String| {
        table.row(std::iter::once(title.to_owned()).chain(all.iter().map(cell)));
    };
    for (k, stage) in STAGES.into_iter().enumerate() {
        row(stage, &|c| format!("{:.3}", c.stages[k].cpu_s));
    }
    row("together", &|c| format!("{:.3}", c.stages.iter().map(|s| s.cpu_s).sum::<f64>()));
    row("inflating and walking alone", &|c| format!("{:.4}", c.walk_s));
    row("one evaluation", &|c| format!("{:.5}", c.evaluation_s));
    row("of it a dwell [us]", &|c| format!("{:.1}", c.evaluation_s / c.dwells as f64 * 1e6));
    row("floor: the walk and eleven evaluations", &|c| format!("{:.3}", c.walk_s + FITS * c.evaluation_s));
    for k in OF_EVALUATIONS {
        row(&format!("{}, in evaluations", STAGES[k]), &|c| {
            format!("{:.0}", c.stages[k].cpu_s / c.evaluation_s)
        });
    }
    section.table(table);
    Ok(section)
}

/// Stage by stage, as `armcal run` goes through them.
fn costs(title: String, pipeline: &Path) -> Result<Costs> {
    let (pipeline, silent) = (Pipeline::load(pipeline)?, Silent);
    let paths = pipeline.recordings.iter().flat_map(|entry| &entry.paths).map(|path| pipeline.resolve(path));
    let paths: Vec<PathBuf> = paths.collect();
    let (walked, walking) = spent(|| paths.iter().map(|path| walk(path, false)).collect::<Result<Vec<_>>>());
    walked?;
    let (_, chain) = frames::nominal_chain(&pipeline)?;
    let read = || -> Result<()> {
        let recordings = preprocess::open_all(&pipeline, &silent)?;
        drop(preprocess::dwells_of_all(&pipeline, &chain, &recordings, &silent, &mut drop)?);
        Ok(())
    };
    let (done, reading) = spent(read);
    done?;
    let settled = armcal_pipeline::settle(&pipeline, &silent)?;
    let (fitted, fitting) = spent(|| armcal_stages::fit_places(&settled.inputs, &mut ()));
    let fitted = fitted?;
    let values = fitted.calibration.fit.values();
    let observations: Vec<_> = fitted.observations.iter().collect();
    let times = EVALUATED.div_ceil(observations.len().max(1));
    let evaluated = || {
        for _ in 0..times {
            let each = &mut |_: &_, residual, jacobian| drop(black_box((residual, jacobian)));
            fitted.model.residuals_with_jacobians(&values, &observations, (&|_| true, true), each);
        }
    };
    let ((), evaluations) = spent(evaluated);
    let (_, checking) = spent(|| setup::examine(&settled.inputs, &fitted));
    let ((mut run, recordings), diagnosing) = spent(|| settled.diagnosed(&pipeline, &silent));
    let (refitted, refitting) = spent(|| add_refits(&mut run, &pipeline, &silent));
    refitted?;
    let out = pipeline.resolve(Path::new("stages-out"));
    let (written, writing) = spent(|| write_all(&run, &recordings, &out, &pipeline.output));
    written?;
    std::fs::remove_dir_all(&out)?;
    let stages = [reading, fitting, checking, diagnosing, refitting, writing];
    let evaluation_s = evaluations.cpu_s / times as f64;
    // Shorter than the ticks in which the system counts time on a processor.
    Ok(Costs { title, stages, dwells: observations.len(), walk_s: walking.wall_s, evaluation_s })
}
