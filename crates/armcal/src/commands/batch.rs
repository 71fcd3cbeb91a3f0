//! `armcal batch`, `armcal map`, `armcal reduce`: a whole archive, on one machine or many.

use super::{Outcome, may_write, print, terminal_style};
use crate::error::Error;
use crate::progress::Progress;
use armcal_archive::{Counter as _, Request, Shard, batch, completion_marker_file};
use armcal_config::{Manifest, Pipeline};
use armcal_recording::input;
use armcal_report::{campaign_files, campaign_json, campaign_text};
use armcal_result::Campaign;
use armcal_result::Status;
use std::path::{Path, PathBuf};

/// What a user asked for.
pub(crate) struct Job<'a> {
    pub manifest: Manifest,
    pub pipeline: Option<&'a Path>,
    pub out: &'a Path,
    pub full: bool,
    pub jobs: Option<usize>,
}

impl Job<'_> {
    fn pipeline(&self) -> Result<Pipeline, Error> {
        let path = self.pipeline.or(self.manifest.pipeline.as_deref()).ok_or(Error::NoPipeline)?;
        Ok(Pipeline::load_for_others(path)?)
    }

    /// Notes the recordings, so that no result is begun in the place of one.
    fn note_inputs(&self) {
        self.manifest
            .entries
            .iter()
            .flat_map(|entry| &entry.paths)
            .for_each(|path| input::register_path(path));
    }

    fn request<'a>(&'a self, pipeline: &'a Pipeline) -> Request<'a> {
        let Job { manifest, out, full, jobs, .. } = self;
        Request { manifest, pipeline, out, full: *full, jobs: *jobs }
    }
}

/// All of it.
pub(crate) fn run(job: &Job<'_>, json: bool) -> Result<Outcome, Error> {
    let pipeline = job.pipeline()?;
    job.note_inputs();
    may_write(campaign_files(job.out))?;
    let progress = Progress::new();
    let (campaign, written, skipped) = batch(&job.request(&pipeline), &progress)?;
    progress.finish();
    if skipped > 0 {
        progress.say(&format!("{skipped} results were there already"));
    }
    print_campaign(&campaign, job.out, &written, json)
}

/// One share.
pub(crate) fn map(job: &Job<'_>, shard: Option<&str>) -> Result<Outcome, Error> {
    let shard = shard_of(shard)?;
    let pipeline = job.pipeline()?;
    job.note_inputs();
    may_write([completion_marker_file(shard, job.out)])?;
    let progress = Progress::new();
    let completion_marker = armcal_archive::map(&job.request(&pipeline), shard, &progress)?;
    progress.finish();
    let (all, failed, skipped) =
        (completion_marker.done.len(), completion_marker.failed(), completion_marker.skipped);
    print(&format!("share {shard}: {all} recordings, {failed} failed, {skipped} were there already\n"))?;
    Ok(if failed > 0 { Outcome::CompletedWithWarnings } else { Outcome::Done })
}

/// The share that was asked for, or that of this task of a Slurm job array.
fn shard_of(shard: Option<&str>) -> Result<Shard, Error> {
    match (shard, Shard::of_slurm()) {
        (Some(text), _) => text.parse().map_err(Error::Shard),
        (None, Some(of_slurm)) => of_slurm.map_err(Error::Shard),
        (None, None) => Err(Error::Shard("is missing; write 1/3, 2/3 and 3/3 for three shares".into())),
    }
}

/// The shares together.
pub(crate) fn reduce(out: &Path, json: bool) -> Result<Outcome, Error> {
    may_write(campaign_files(out))?;
    let (campaign, written) = armcal_archive::reduce(out)?;
    print_campaign(&campaign, out, &written, json)
}

fn print_campaign(
    campaign: &Campaign,
    out: &Path,
    written: &[PathBuf],
    json: bool,
) -> Result<Outcome, Error> {
    if json {
        print(&campaign_json(campaign))?;
    } else {
        print(&campaign_text(campaign, terminal_style()))?;
        super::print_written(out, written)?;
    }
    Ok(if campaign.status() == Status::Ok { Outcome::Done } else { Outcome::CompletedWithWarnings })
}
