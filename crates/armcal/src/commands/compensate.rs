//! `armcal compensate`: set-points that bring the calibrated arm to Cartesian targets.

use super::{Outcome, joint_range, may_write, print};
use crate::error::Error;
use armcal_compensate::{Compensator, Drive, SetPoint, TargetFrame, resample};
use armcal_core::{FeatureId, Load};
use armcal_deploy::set_points::table::Sheet;
use armcal_deploy::set_points::{
    in_world_m, place_targets, recording, recording_index, target_frame, targets,
};
use armcal_model::Model;
use armcal_recording::atomic;
use armcal_result::{StoredArms, StoredModel, open_model};
use clap::Args;
use std::path::PathBuf;

/// What `armcal compensate` is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Results of `armcal run` or `armcal add`: their folder, run.mcap or model.json.
    pub result: PathBuf,
    /// CSV with a header (x_m, y_m, z_m; name, qx, qy, qz, qw, t_s where wanted) or TOML with [[targets]]. With t_s in
    /// every row it is a path, otherwise the arm stops at each.
    pub targets: PathBuf,
    /// CSV for the set-points.
    #[arg(long, default_value = "set-points.csv")]
    pub out: PathBuf,
    /// MCAP for the set-points as sensor_msgs/JointState.
    #[arg(long, value_name = "FILE")]
    pub mcap: Option<PathBuf>,
    /// Which tip, of several: the name of an arm, or of a marker; the tip when absent, of one robot.
    #[arg(long, value_name = "NAME")]
    pub tip: Option<String>,
    /// Frame of the targets: world, base, or board.RECORDING.
    #[arg(long, default_value = "world")]
    pub frame: String,
    /// Joints where the arm waits before the first target [deg], such as 0,-30,10: decides from where each arrives.
    #[arg(long = "from", value_name = "DEG,..", allow_hyphen_values = true)]
    pub start: Option<String>,
    /// The recording as in which the arm is: its load, temperature, board, what has happened until then. The last when
    /// absent.
    #[arg(long = "as-in", value_name = "RECORDING")]
    pub recording: Option<String>,
    /// Load at the tip [kg], instead of that recording's.
    #[arg(long = "load", value_name = "KG")]
    pub load_kg: Option<f64>,
    /// Temperature [degC], instead of that recording's.
    #[arg(long = "temperature", value_name = "DEGC", allow_hyphen_values = true)]
    pub temperature_c: Option<f64>,
    /// Come to every stop from a point this far before it, all joints in their direction of travel [deg].
    #[arg(long = "approach", default_value_t = 0.0, value_name = "DEG")]
    pub approach_deg: f64,
    /// Time in which a joint that turns back on a path crosses its gap [s]; 0 for a leap.
    #[arg(long = "crossing", default_value_t = 0.4, value_name = "S")]
    pub crossing_s: f64,
    /// Points a second of a path, by cubic splines through the targets; the targets themselves when absent.
    #[arg(long = "rate", value_name = "HZ")]
    pub rate_hz: Option<f64>,
    /// What a joint can do, such as 2=-75..20 [deg]; may be given again.
    #[arg(long = "range", value_name = "JOINT=LOW..HIGH", allow_hyphen_values = true)]
    pub ranges: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Reads model and targets, computes, writes, prints.
pub fn run(request: &Request) -> Result<Outcome, Error> {
    let past = open_model(&request.result)?;
    let arms = past.arms()?;
    let tip = select_tip(&arms.geometry, request.tip.as_deref())?;
    let frame = target_frame(&past, &request.frame)
        .map_err(|problem| option_error("--frame", request.frame.clone(), &problem))?;
    let wanted = targets::read(&request.targets)?;
    may_write([Some(&request.out), request.mcap.as_ref()].into_iter().flatten())?;
    let start = request.start.as_deref().map(|words| parse_joint_positions(words, &arms)).transpose()?;
    let drive = drive_from_request(request, &past, &arms)?;
    let held = held_joints(&arms.geometry, tip, &drive, start.as_deref())?;
    let mut compensator = Compensator::of_result(&past, &arms, (tip, frame), &drive);
    for (joint, at_rad) in &held {
        compensator.limits.0[*joint] = [*at_rad; 2];
    }
    let mut targets = place_targets(&arms, (tip, frame), &wanted)?;
    if let Some(rate_hz) = request.rate_hz {
        if !(rate_hz > 0.0 && rate_hz <= 1e4) {
            return Err(option_error("--rate", rate_hz.to_string(), "give points a second, up to 10000"));
        }
        targets = resample(&targets, rate_hz)?;
    }
    let points = compensator.set_points(&targets, start.as_deref())?;

    let chain = arms.geometry.chain();
    let in_world_m = points.iter().map(|p| in_world_m(&arms, frame, &p.target)).collect();
    let sheet = Sheet {
        chain,
        points: &points,
        in_world_m,
        notes: set_point_notes(&past, &arms, (frame, held.as_slice()), &compensator.conditions),
    };
    atomic::write(&request.out, &sheet.csv()?).map_err(Error::Output)?;
    if let Some(path) = &request.mcap {
        recording::write(path, chain.joint_names(), &points).map_err(Error::Output)?;
    }
    if request.json {
        print(&super::json_text(&sheet.json())?)?;
    } else {
        print(&format!("{}\nWritten to {}\n", sheet.text(), request.out.display()))?;
    }
    Ok(if past.missing.is_empty() && points.iter().all(is_converged) {
        Outcome::Done
    } else {
        Outcome::CompletedWithWarnings
    })
}

/// The tip that is meant: by its name, or by that of its arm.
fn select_tip(model: &Model, asked: Option<&str>) -> Result<FeatureId, Error> {
    let arms = model.chain().arms();
    let called = |name: &str| match asked {
        Some(asked) => name == asked || name == format!("{asked}.tip"),
        // Neither of two arms comes first.
        None => arms.is_empty(),
    };
    let found = model.features().find(|(_, name)| called(name)).map(|(feature, _)| feature);
    found.ok_or_else(|| {
        let names = model.features().map(|(_, name)| name.strip_suffix(".tip").unwrap_or(name));
        let names = names.collect::<Vec<_>>().join(", ");
        option_error(
            "--tip",
            asked.unwrap_or("nothing").to_owned(),
            &format!("the tips and markers of this result are {names}; name one"),
        )
    })
}

/// The joints that stay where they are, and where [rad]: those off the way to the tip, and those that move another branch too,
/// unless a range is given for them.
fn held_joints(
    model: &Model,
    tip: FeatureId,
    drive: &Drive,
    start: Option<&[f64]>,
) -> Result<Vec<(usize, f64)>, Error> {
    let held = armcal_compensate::held_joints(model, tip, drive);
    match (held.first(), start) {
        (None, _) => Ok(Vec::new()),
        (Some(_), Some(start)) => Ok(held.into_iter().map(|joint| (joint, start[joint])).collect()),
        (Some(first), None) => {
            let name = &model.chain().joint_names()[*first];
            let problem = format!(
                "joints off the way to the tip, and those that it shares with another, such as {name}, stay where they are: say \
                 where, all joints in degrees"
            );
            Err(option_error("--from", "nothing".to_owned(), &problem))
        }
    }
}

/// Whether the model predicts the tip at a stop. On a path links wait while a gap is crossed.
fn is_converged(point: &SetPoint) -> bool {
    point.target.time_s.is_some() || point.reached.as_ref().is_none_or(|r| r.after_m < 1e-5)
}

fn drive_from_request(request: &Request, past: &StoredModel, arms: &StoredArms) -> Result<Drive, Error> {
    if request.load_kg.is_some_and(|l| !(l.is_finite() && l >= 0.0)) {
        return Err(option_error(
            "--load",
            format!("{:?}", request.load_kg),
            "give a mass in kg, zero or more",
        ));
    }
    if !(0.0..=45.0).contains(&request.approach_deg) {
        return Err(option_error(
            "--approach",
            request.approach_deg.to_string(),
            "give an angle from 0 to 45 deg",
        ));
    }
    if !(0.0..=10.0).contains(&request.crossing_s) {
        return Err(option_error("--crossing", request.crossing_s.to_string(), "give a time from 0 to 10 s"));
    }
    let names = arms.geometry.chain().joint_names();
    let range = |words: &String| {
        let problem = "write a joint's number or name and its range, such as 2=-75..20";
        joint_range(words, names).ok_or_else(|| option_error("--range", words.clone(), problem))
    };
    let recording = request.recording.as_deref().map(|name| {
        recording_index(past, name).map_err(|problem| option_error("--as-in", name.to_owned(), &problem))
    });
    Ok(Drive {
        recording: recording.transpose()?,
        load_kg: request.load_kg,
        temperature_c: request.temperature_c.filter(|t| t.is_finite()),
        ranges: request.ranges.iter().map(range).collect::<Result<_, Error>>()?,
        approach_deg: request.approach_deg,
        crossing_s: request.crossing_s,
    })
}

/// `0, -30, 10` in display units as a joint vector, SI.
fn parse_joint_positions(words: &str, arms: &StoredArms) -> Result<Vec<f64>, Error> {
    let chain = arms.geometry.chain();
    let parsed: Option<Vec<f64>> = words.split(',').map(|word| word.trim().parse().ok()).collect();
    let expected = chain.joint_names().len();
    let parsed = parsed.filter(|all| all.len() == expected && all.iter().all(|q| q.is_finite()));
    let shown = parsed.ok_or_else(|| {
        option_error(
            "--from",
            words.to_owned(),
            &format!("give {expected} joints in degrees, joined by commas"),
        )
    })?;
    Ok(shown.iter().enumerate().map(|(j, q)| chain.joint_unit(j).from_display(*q)).collect())
}

/// What holds for every set-point.
fn set_point_notes(
    past: &StoredModel,
    arms: &StoredArms,
    (frame, held): (TargetFrame, &[(usize, f64)]),
    conditions: &armcal_compensate::Conditions,
) -> Vec<String> {
    let mut notes = Vec::new();
    if !held.is_empty() {
        let chain = arms.geometry.chain();
        let names: Vec<&str> = held.iter().map(|(joint, _)| chain.joint_names()[*joint].as_str()).collect();
        let tip = arms.geometry.feature_name(conditions.feature);
        notes.push(format!(
            "{tip} is brought to the targets; {} stay where --from has them",
            names.join(", ")
        ));
    }
    if !past.missing.is_empty() {
        notes.push(format!(
            "the diagnosis of `{}` would add {}: what the model lacks stays in the error; `armcal add suggested` first",
            past.pipeline,
            past.missing.join(", ")
        ));
    }
    let recording = past.recordings.get(conditions.recording).map_or("none", |r| r.name.as_str());
    let of_arms = !arms.geometry.chain().arms().is_empty();
    let tested = past.mean_error_m.map_or(String::new(), |mean_m| {
        let error = if of_arms { "mean closing error" } else { "mean error" };
        format!("; the model's {error} where it was tested is {:.2} mm", mean_m * 1e3)
    });
    let temperature = conditions.temperature_c.map_or(String::new(), |t| format!(", {t:.1} degC"));
    let name = |load: &Load| format!(", {} kg at {}", load.kg, arms.model.feature_name(load.at));
    let more: String = conditions.more_loads.iter().map(name).collect();
    let load = format!("load {} kg{more}", conditions.load_kg);
    notes.push(format!("as in recording `{recording}`, {load}{temperature}{tested}"));
    if arms.geometry.chain().is_branched() {
        notes.push(
            "what the run lists as undetermined, such as all that joined tips have in common, is near nominal".into(),
        );
    }
    if arms.model.effects().iter().any(|e| e.spec.kind == "effort_compliance") {
        notes.push("the effort of a motor is not known beforehand: effort_compliance is left at zero".into());
    }
    if let TargetFrame::Board(index) = frame
        && let Some(facts) = past.recordings.get(index)
    {
        notes.push(format!("targets lie on the board where it stood in `{}`", facts.name));
    }
    notes.push(
        "servo errors at rest are taken to be zero, moves between set-points as joint-interpolated without overshoot"
            .into(),
    );
    notes
}

fn option_error(option: &'static str, value: String, problem: &str) -> Error {
    Error::BadOption { option, value, problem: problem.to_owned() }
}
