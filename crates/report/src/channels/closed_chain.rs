//! The channels of two arms in a closed chain, under the names that one arm has.
//!
//! | topic | messages |
//! |---|---|
//! | `/armcal/arms` | one a dwell: both arms, nominal and calibrated |
//! | `/armcal/arrows_calibrated` | one a dwell: its closing error, exaggerated; none where the tips were not joined |
//! | `/armcal/dwells` | one a dwell, the joints of the first arm before those of the second |
//! | `/armcal/residuals` | one a joined dwell: `measured_m` is where the first arm has the joined point, `predicted_m` the \
//!   second |
//! | `/armcal/parameters`, `/armcal/parameter_table`, `/armcal/report`, `/armcal/log` | as for one arm |
//! | `/armcal/story`, `/armcal/course` | as for one arm, of closing errors |
//! | `/armcal/scene` | one a run: the scale of the arrows |
//! | `/armcal/tf` | one a dwell: both arms link by link, nominal and calibrated |
//! | `/armcal/right/nominal/robot_description`, ... | one a run: URDF of each arm, whose links are frames of `/armcal/tf` |

use super::arrows::{INK, all};
use super::shapes::{Rgba, arrow, entity, label, note};
use super::{Messages, ResultMessage, closed_arms, closed_story, facts, log};
use crate::closed_chain::ClosedRun;
use crate::findings::round_factor;
use crate::text::{conclusion_about, printable};
use armcal_core::Dwell;
use armcal_core::robust::percentile;
use foxglove::messages as fox;
use foxglove::messages::log::Level;

/// The 95th percentile of the closing errors is drawn this long [m].
const LONG_ARROW_M: f64 = 0.05;
const ARROW: Rgba = [0.9, 0.35, 0.1, 1.0];

/// All result messages in the order of their log times.
pub(crate) fn closed_messages(run: &ClosedRun) -> Vec<ResultMessage> {
    let (mut out, begin_ns) = (Messages::default(), run.start_ns());
    let (calibration, fit) = (&run.calibration, &run.calibration.fit);
    let conclusion = conclusion_about(calibration, "closing error");
    out.put("/armcal/parameters", begin_ns, &facts::parameters(fit, begin_ns));
    let report = facts::calibration(&run.pipeline_name, calibration, conclusion.clone(), begin_ns);
    out.put("/armcal/report", begin_ns, &report);
    let names = run.recording_names();
    for warning in run.overall_warnings() {
        log::put_warning(&mut out, begin_ns, &names.warning(warning));
    }
    closed_story::put(run, &mut out);
    closed_arms::put_first(run, &mut out);
    let nothing = fox::SceneUpdate { deletions: vec![all(begin_ns)], entities: Vec::new() };
    out.put("/armcal/arrows_calibrated", begin_ns, &nothing);
    let errors_m: Vec<f64> = calibration.residuals.iter().map(|r| r.fitted_m.norm()).collect();
    let factor = round_factor(LONG_ARROW_M / percentile(&errors_m, 0.95).max(1e-6));
    out.put("/armcal/scene", begin_ns, &scale(run, factor));
    for recording in &run.recordings {
        let start_ns = recording.dwells.first().map_or(begin_ns, |d| d.start_ns);
        for warning in recording.all_warnings() {
            log::put_warning(&mut out, start_ns, &names.warning(warning));
        }
        for dwell in &recording.dwells {
            let time_ns = dwell.mid_ns();
            out.put("/armcal/dwells", time_ns, &facts::dwell_message(&recording.name, dwell));
            closed_arms::put(run, dwell, time_ns, &mut out);
            put_error(run, &recording.name, dwell, factor, &mut out);
        }
        for open in &recording.open {
            let time_ns =
                recording.dwells.iter().find(|d| d.id == open.dwell).map_or(start_ns, Dwell::mid_ns);
            let why = format!("dwell {} not used: {}", open.dwell.dwell, open.why);
            log::put(&mut out, time_ns, Level::Debug, "armcal.dwell", &recording.name, why);
        }
    }
    log::put(&mut out, run.end_ns(), Level::Info, "armcal.calibrate", "", conclusion);
    out.messages.sort_by_key(|m| m.log_ns);
    out.messages
}

/// How much the arrows are exaggerated.
fn scale(run: &ClosedRun, factor: f64) -> fox::SceneUpdate {
    let mut scale = entity("scale", run.start_ns());
    let [first, second] = run.chain.arms();
    let words = format!(
        "arrow: closing error x {factor}, from where {} puts\nthe joined point to where {} puts it",
        printable(&second.name),
        printable(&first.name)
    );
    scale.texts.extend(closed_arms::closed_places_m(run).last().map(|m| label(m, INK, words)));
    fox::SceneUpdate { deletions: Vec::new(), entities: vec![scale] }
}

/// The closing error of a dwell as numbers and as an arrow; an open dwell takes the arrow before it away.
fn put_error(run: &ClosedRun, recording: &str, dwell: &Dwell, factor: f64, out: &mut Messages) {
    let time_ns = dwell.mid_ns();
    let mut drawn = entity("errors/calibrated", time_ns);
    drawn.metadata.push(note("exaggeration", factor));
    let at = run.observations.iter().position(|o| o.dwell() == dwell.id);
    if let Some((o, r)) = at.map(|i| (&run.observations[i], &run.calibration.residuals[i])) {
        let fitted = run.calibration.fit.values();
        let second = &run.chain.arms()[1].model;
        let predicted_m = second.predicted_tip_in_world(run.chain.of_arm(1, &fitted), &o.arms[1]);
        let measured_m = predicted_m + r.fitted_m;
        let mut message = facts::error(recording, time_ns, r);
        (message.measured_m, message.predicted_m) =
            (Some(facts::vector(&measured_m)), Some(facts::vector(&predicted_m)));
        out.put("/armcal/residuals", time_ns, &message);
        drawn.arrows.extend(arrow(&measured_m, &(r.fitted_m * factor), 0.0015, ARROW));
    }
    let update = fox::SceneUpdate { deletions: vec![all(time_ns)], entities: vec![drawn] };
    out.put("/armcal/arrows_calibrated", time_ns, &update);
}
