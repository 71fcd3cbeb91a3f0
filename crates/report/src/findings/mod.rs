//! What a run found, worked out once as the messages that say it: channels write them, layouts point at them.
//!
//! All of it is about the whole run or a whole recording, so each is one message; arrays in one message are parallel,
//! ready for a scatter plot.

mod diagnosis;

use armcal_diagnose::UnknownReport;
use armcal_result::analysis::{error_curve, in_time};
use armcal_result::{Point, Run, Undiagnosed, analysis, proto};
use armcal_wording::{Story, answer, channel_told, driver_told, shown_unlisted};

/// Everything a run found.
pub(crate) struct Findings {
    /// One entry a joint of the model.
    pub joints: Vec<proto::JointErrors>,
    /// Whether each joint's errors are drawn over its gravity torque.
    pub feels_gravity: Vec<bool>,
    /// One entry a recording with a board that was visited.
    pub boards: Vec<proto::BoardErrors>,
    /// Errors over recorded time.
    pub course: proto::Course,
    /// The falling error.
    pub steps: proto::Steps,
    /// The verdict (or that the setup comes first), and what it was weighed against; `None` when nobody asked.
    pub diagnosis: Option<(proto::Diagnosis, proto::Candidates)>,
    /// What was found and the candidates as people read them; empty where nothing was looked for.
    pub effects: proto::EffectTable,
    /// What no name explains, unless that anything does not have one is improbable, each beside where it enters and what it
    /// depends on in words.
    pub curves: Vec<([String; 2], proto::ErrorCurve)>,
    /// Steps of what to do next, and entries of what was found, in words.
    pub next: usize,
    pub told_found: usize,
    /// What the data are like.
    pub quality: proto::Quality,
}

impl Findings {
    /// Works everything out. `points` are those of the run.
    pub fn of(run: &Run, points: &[Point]) -> Findings {
        let in_time = in_time(points);
        let story = Story::of(run);
        let torques_nm = analysis::torques_nm(run);
        Findings {
            joints: analysis::joint_errors(run, points, &in_time, &torques_nm),
            feels_gravity: analysis::feels_gravity(&torques_nm),
            boards: analysis::board_errors(run, points, &in_time),
            course: analysis::course(run, points, &in_time),
            steps: analysis::steps(run),
            diagnosis: match &run.diagnosis {
                Some(d) => {
                    Some((diagnosis::diagnosis_message(run, d), diagnosis::candidates_message(run, d)))
                }
                None if run.undiagnosed == Some(Undiagnosed::NotAsked) => None,
                None => Some((diagnosis::undiagnosed_message(answer(run)), proto::Candidates::default())),
            },
            effects: run.diagnosis.as_ref().map(|d| diagnosis::effect_table(run, d)).unwrap_or_default(),
            curves: unlisted_curves(run),
            next: story.next.len(),
            told_found: story.found.len(),
            quality: analysis::quality(run),
        }
    }
}

/// The same as curves.
pub(crate) fn unlisted_curves(run: &Run) -> Vec<([String; 2], proto::ErrorCurve)> {
    let shown = run.diagnosis.iter().flat_map(shown_unlisted);
    let told = |u: &UnknownReport| [channel_told(&u.channel), driver_told(u.driver)];
    shown.map(|u| (told(u), error_curve(u, run.model.chain()))).collect()
}
