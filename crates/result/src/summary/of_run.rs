//! The parts of a summary that no sentence is needed for, from a run.

use super::{
    CovarianceSummary, ErrorsSummary, FitSummary, FrameEntry, JointSummary, PaperSummary, ParameterSummary,
    PlaceSummary, RecordingSummary, RefitSummary, RejectedSummary, SideSummary,
};
use crate::{
    RecordingRun, Refit, ResultError, Run, effect_part_names, role_word, status_word, visited_intervals,
};
use armcal_calibrate::{Calibration, Estimate, Fit, SideErrors};
use armcal_core::{Dwell, ErrorStats, FeatureId, Pose, RollPitchYaw};
use armcal_table::{Assignment, Place};

impl<'a> RecordingSummary<'a> {
    /// Of a recording of a run.
    ///
    /// # Errors
    /// A file that cannot be read once more for its hash.
    pub fn of(run: &Run, r: &'a RecordingRun) -> Result<RecordingSummary<'a>, ResultError> {
        let clock = r.clock.as_ref();
        // What is declared has no standard error.
        let estimated = clock.filter(|c| !c.declared);
        let rejected = |x: &'a armcal_core::Rejection| RejectedSummary { dwell: x.dwell.dwell, why: &x.why };
        Ok(RecordingSummary {
            name: &r.name,
            // Bytes that are not Unicode become U+FFFD so that the document stays valid JSON.
            path: r.paths.first().map(|p| p.to_string_lossy().into_owned()).unwrap_or_default(),
            sha256: r.sha256()?,
            files: r.files(),
            dwells: r.found(),
            associated: run.associated(r),
            rejected: r.rejections.iter().map(rejected).collect(),
            places: r
                .dwells
                .iter()
                .enumerate()
                .map(|(i, d)| place_summary(d, r.assignments().get(i)))
                .collect(),
            clock_offset_ms: r.earlier.is_none().then(|| clock.map_or(0.0, |c| c.first_offset_s()[0] * 1e3)),
            clock_offset_sigma_ms: estimated.map(|c| c.first_offset_s()[1] * 1e3),
            clock_drift_ppm: clock.map(|c| c.drift * 1e6),
            clock_drift_sigma_ppm: estimated.map(|c| c.drift_sigma * 1e6),
            clock_reference_ns: clock.map(|c| c.first_ns),
            warnings: r.all_warnings(),
        })
    }
}

fn place_summary<'a>(dwell: &Dwell, assignment: Option<&'a Assignment>) -> PlaceSummary<'a> {
    let place = assignment.map(|a| &a.place);
    let (cavity, confidence) = match place {
        Some(Place::Seated { cavity, confidence }) => (Some(cavity.as_str()), Some(*confidence)),
        _ => (None, None),
    };
    PlaceSummary {
        dwell: dwell.id.dwell,
        start_ns: dwell.start_ns,
        end_ns: dwell.end_ns,
        place: place.map_or("no_board", Place::word),
        cavity,
        confidence,
    }
}

impl FitSummary<'_> {
    /// Of the calibration of a run.
    pub fn of(run: &Run) -> FitSummary<'_> {
        let c = &run.calibration;
        let all: Vec<usize> = (0..c.fit.estimates.len()).collect();
        let covered = if run.is_pool() { run.shared_parameters() } else { all };
        let paper = |p: armcal_calibrate::PaperObjective| PaperSummary {
            sum_of_distances_mm: p.sum_of_distances_m * 1e3,
            limit_mm: p.limit_m * 1e3,
            feasible: p.feasible,
        };
        FitSummary {
            objective: &c.fit.objective,
            effects: effect_part_names(c),
            status: status_word(c.fit.status),
            iterations: c.fit.iterations,
            noise_floor_mm: c.noise_floor_m * 1e3,
            sigma_scale: c.fit.sigma_scale,
            rank: c.fit.rank,
            train: (&c.train).into(),
            holdout: (&c.holdout).into(),
            parameters: c.fit.estimates.iter().map(ParameterSummary::from).collect(),
            covariance: CovarianceSummary::of(&c.fit, &covered),
            undetermined: c.fit.undetermined.iter().map(|u| u.text.as_str()).collect(),
            paper: c.fit.paper.map(paper),
        }
    }
}

impl From<&SideErrors> for SideSummary {
    fn from(errors: &SideErrors) -> SideSummary {
        SideSummary {
            n: errors.fitted.n,
            nominal_mm: (&errors.nominal).into(),
            fitted_mm: (&errors.fitted).into(),
        }
    }
}

impl From<&ErrorStats> for ErrorsSummary {
    fn from(stats: &ErrorStats) -> ErrorsSummary {
        let mm = |value_m: f64| (stats.n > 0).then_some(value_m * 1e3);
        let [mean, rms, p95, max] = [stats.mean_m, stats.rms_m, stats.p95_m, stats.max_m].map(mm);
        ErrorsSummary { mean, rms, p95, max }
    }
}

impl<'a> From<&'a Estimate> for ParameterSummary<'a> {
    fn from(e: &'a Estimate) -> ParameterSummary<'a> {
        ParameterSummary {
            name: &e.parameter.name,
            unit: e.parameter.unit,
            nominal: e.parameter.nominal,
            value: e.value,
            sigma: e.sigma,
            ci95: e.ci95,
            determined: e.determined,
            at_bound: e.at_bound,
            free: e.parameter.free,
            role: role_word(e.parameter.role),
            meaning: &e.parameter.meaning,
        }
    }
}

impl CovarianceSummary<'_> {
    /// Of those of these parameters that are free.
    pub fn of<'a>(fit: &'a Fit, index: &[usize]) -> CovarianceSummary<'a> {
        let free: Vec<usize> = index.iter().copied().filter(|&i| fit.estimates[i].parameter.free).collect();
        let block = fit.covariance.block(&free);
        CovarianceSummary {
            names: free.iter().map(|&i| fit.estimates[i].parameter.name.as_str()).collect(),
            rows: block.row_iter().map(|row| row.iter().copied().collect()).collect(),
        }
    }
}

impl JointSummary<'_> {
    /// Of every joint of a run.
    pub fn all(run: &Run) -> Vec<JointSummary<'_>> {
        let chain = run.model.chain();
        let each = visited_intervals(&run.model, &run.observations).into_iter().enumerate();
        each.map(|(index, visited)| JointSummary {
            name: &chain.joint_names()[index],
            unit: chain.joint_unit(index),
            visited,
        })
        .collect()
    }
}

impl FrameEntry {
    /// Of a pose.
    pub fn of(frame: String, parent: &str, pose: &Pose) -> FrameEntry {
        let RollPitchYaw { xyz_m, rpy_deg } = pose.into();
        FrameEntry { frame, parent: parent.into(), xyz_m, rpy_deg }
    }

    /// Base and tip, those of the last recording where each has its own, and the board of every recording that has one, as
    /// calibrated.
    pub fn all(run: &Run) -> Vec<FrameEntry> {
        let p = run.calibration.fit.values();
        let (last, last_p) = run.model.in_recording(run.recordings.len().saturating_sub(1), &p);
        let arms: Vec<String> = run.model.chain().arms().iter().map(|arm| format!("{}.", arm.name)).collect();
        let one = [String::new()];
        let mut frames = Vec::new();
        for (arm, prefix) in if arms.is_empty() { &one[..] } else { &arms[..] }.iter().enumerate() {
            let (base, tip) =
                (last.arm_base_in_world(&last_p, arm), last.feature_in_link(&last_p, FeatureId(arm)));
            frames.push(FrameEntry::of(format!("{prefix}base"), "world", &base));
            frames.push(FrameEntry::of(format!("{prefix}tip"), "last link", &tip));
        }
        for (index, recording) in run.recordings.iter().enumerate() {
            if let Some(board) = run.model.board_in_world(&p, index) {
                frames.push(FrameEntry::of(format!("board.{}", recording.name), "world", &board));
            }
        }
        frames
    }
}

impl<'a> From<&'a Refit> for RefitSummary<'a> {
    fn from(refit: &'a Refit) -> RefitSummary<'a> {
        let Calibration { noise_floor_m, train, holdout, .. } = &refit.calibration;
        RefitSummary {
            effects: &refit.effects,
            noise_floor_mm: noise_floor_m * 1e3,
            train: train.into(),
            holdout: holdout.into(),
        }
    }
}
