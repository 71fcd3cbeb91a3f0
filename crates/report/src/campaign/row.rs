//! The row of one recording, taken from its run.

use armcal_calibrate::Estimate;
use armcal_campaign::{ErrorFigures, Quantity, Row};
use armcal_core::{ErrorStats, RollPitchYaw, Unit, Warning};
use armcal_result::Run;
use armcal_table::Tilt;
use armcal_wording::answer;

/// The row of a run on a single recording.
///
/// Errors are those on held-out points where there are any. The board's pose is taken in the robot's base: there a moved
/// camera does not show, a bumped table or robot does.
pub fn campaign_row(run: &Run, tilt: Tilt, load_kg: f64) -> Option<Row> {
    let recording = run.recordings.first()?;
    let calibration = &run.calibration;
    let judged = calibration.judged();
    let overall = run.overall_warnings();
    let mut warnings: Vec<&Warning> = recording.all_warnings().into_iter().chain(&overall).collect();
    warnings.sort_by_key(|w| std::cmp::Reverse(w.severity));
    let tilt = tilt_text(tilt);
    Some(Row {
        recording: recording.name.clone(),
        paths: recording.paths.iter().map(|p| p.to_string_lossy().into_owned()).collect(),
        bytes: recording.files().iter().map(|f| f.bytes).sum(),
        identity: recording.files().into_iter().map(|f| f.identity).collect(),
        load_kg,
        start_ns: recording.dwells.first().map_or(0, |d| d.mid_ns()),
        end_ns: recording.dwells.last().map_or(0, |d| d.mid_ns()),
        dwells: recording.dwells.len(),
        associated: run.associated(recording),
        rejected: recording.rejections.len(),
        status: run.status(),
        nominal: error_figures(&judged.nominal),
        calibrated: error_figures(&judged.fitted),
        noise_floor_m: calibration.noise_floor_m,
        verdict: answer(run).sentence,
        missing: missing_effects(run),
        warnings: warnings.iter().map(|w| run.in_words(&w.to_string())).collect(),
        severities: warnings.iter().map(|w| w.severity.word().to_owned()).collect(),
        quantities: run_quantities(run, &judged.fitted, &tilt),
        tilt,
    })
}

fn tilt_text(tilt: Tilt) -> String {
    let parts = [("roll", tilt.roll_rad), ("pitch", tilt.pitch_rad)];
    let tilted = parts.iter().filter(|(_, angle_rad)| *angle_rad != 0.0);
    let words: Vec<String> =
        tilted.map(|(axis, rad)| format!("{axis} {:.6}", rad.to_degrees())).map(without_zeros).collect();
    if words.is_empty() { String::new() } else { words.join(" deg, ") + " deg" }
}

fn without_zeros(text: String) -> String {
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn error_figures(stats: &ErrorStats) -> ErrorFigures {
    let some = |value_m: f64| Some(value_m).filter(|v| stats.n > 0 && v.is_finite());
    ErrorFigures {
        n: stats.n,
        mean_m: some(stats.mean_m),
        rms_m: some(stats.rms_m),
        p95_m: some(stats.p95_m),
        max_m: some(stats.max_m),
    }
}

fn missing_effects(run: &Run) -> Vec<String> {
    let Some(diagnosis) = &run.diagnosis else { return Vec::new() };
    let found = diagnosis.suggested(run.model.chain().joint_names()).unwrap_or_default();
    found.iter().map(ToString::to_string).collect()
}

fn run_quantities(run: &Run, errors: &ErrorStats, tilt: &str) -> Vec<Quantity> {
    let known = |name: String, unit, value| Quantity {
        name: name.into(),
        unit,
        value,
        sigma: None,
        determined: true,
        at_bound: false,
    };
    let calibration = &run.calibration;
    let own = |e: &&Estimate| e.parameter.free && !e.parameter.name.starts_with("board.");
    let mut all: Vec<Quantity> =
        calibration.fit.estimates.iter().filter(own).map(parameter_quantity).collect();
    let p = calibration.fit.values();
    if let Some(board) = run.model.board_in_world(&p, 0) {
        let pose = RollPitchYaw::from(&(run.model.base_in_world(&p).inverse() * board));
        let under = if tilt.is_empty() { String::new() } else { format!(" at {tilt}") };
        let axis = |name, unit, value| known(format!("board_in_base.{name}{under}"), unit, value);
        all.extend(["x", "y", "z"].iter().zip(pose.xyz_m).map(|(n, m)| axis(n, Unit::Metre, m)));
        let turns = ["roll", "pitch", "yaw"].iter().zip(pose.rpy_deg);
        all.extend(turns.map(|(n, deg)| axis(n, Unit::Radian, deg.to_radians())));
    }
    if errors.n > 0 {
        all.push(known("error.mean".into(), Unit::Metre, errors.mean_m));
    }
    // What is declared was not measured.
    if let Some(clock) = run.recordings[0].clock.as_ref().filter(|c| !c.declared) {
        let drift = known("clock.drift".into(), Unit::One, clock.drift);
        all.push(Quantity { sigma: Some(clock.drift_sigma).filter(|s| s.is_finite()), ..drift });
    }
    all.retain(|q| q.value.is_finite());
    all
}

fn parameter_quantity(e: &Estimate) -> Quantity {
    Quantity {
        name: e.parameter.name.as_str().into(),
        unit: e.parameter.unit,
        value: e.value,
        sigma: Some(e.sigma).filter(|s| s.is_finite()),
        determined: e.determined,
        at_bound: e.at_bound,
    }
}
