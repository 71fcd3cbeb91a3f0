//! What two of the new recordings both hold counts once.

use armcal_config::Pipeline;
use armcal_core::{Code, JointSamples, Samples, Severity, Stage, Warning};
use armcal_recording::{Fingerprint, SharedTime};
use armcal_stages::RecordingData;
use armcal_stages::preprocess::find_repeats;

/// New recordings, each with its samples; no time is in two of them.
pub struct Distinct {
    /// The pipeline on the recordings that are left.
    pub pipeline: Pipeline,
    /// What each showed.
    pub seen: Vec<RecordingData>,
    /// What each holds.
    pub samples: Vec<Samples>,
    /// What was left out.
    pub warnings: Vec<Warning>,
}

/// Leaves out of every recording what an earlier one holds: dwells and readings of the common time, or all of it.
pub fn distinct_recordings(
    pipeline: &Pipeline,
    mut seen: Vec<RecordingData>,
    mut samples: Vec<Samples>,
) -> Distinct {
    let fingerprints: Vec<&Fingerprint> = seen.iter().map(|s| s.fingerprint.as_ref()).collect();
    let mut warnings = Vec::new();
    for repeat in find_repeats(&fingerprints) {
        let (of, all) = (seen[repeat.first].name.clone(), seen[repeat.second].dwells.len());
        let own = &mut seen[repeat.second];
        let joints = &mut samples[repeat.second].joints;
        let rows = joints.len();
        leave_out(joints, &repeat.shared);
        if joints.len() == rows {
            // All of it is in a third one too.
            continue;
        }
        own.dwells.retain(|d| !covers(&repeat.shared, d.mid_ns()));
        let message = format!(
            "the {:.1} s that it has in common with `{of}` count once: {} of its {all} dwells are left out here",
            repeat.shared.duration_s(),
            all - own.dwells.len()
        );
        let subject = format!("recording `{}`", own.name);
        warnings.push(Warning::new(Severity::Notice, Stage::Recording, Code::CountedOnce, subject, message));
    }
    let mut pipeline = pipeline.clone();
    // Two rows are the least between which anything moves.
    let left: Vec<bool> = samples.iter().map(|s| s.joints.len() > 1).collect();
    retain_by_mask(&mut pipeline.recordings, &left);
    retain_by_mask(&mut seen, &left);
    retain_by_mask(&mut samples, &left);
    for (recording, seen) in seen.iter_mut().enumerate() {
        seen.dwells.iter_mut().for_each(|d| d.id.recording = recording);
    }
    Distinct { pipeline, seen, samples, warnings }
}

fn covers(shared: &SharedTime, time_ns: i64) -> bool {
    (shared.start_ns..=shared.end_ns).contains(&time_ns)
}

fn retain_by_mask<T>(all: &mut Vec<T>, left: &[bool]) {
    let mut left = left.iter();
    all.retain(|_| left.next().is_some_and(|left| *left));
}

/// Takes the readings of a time out of a stream.
fn leave_out(joints: &mut JointSamples, shared: &SharedTime) {
    let left: Vec<bool> = joints.time_ns.iter().map(|t| !covers(shared, *t)).collect();
    retain_by_mask(&mut joints.time_ns, &left);
    let efforts = joints.effort_nm.iter_mut().flatten();
    joints.joint_rad.iter_mut().chain(efforts).for_each(|column| retain_by_mask(column, &left));
}
