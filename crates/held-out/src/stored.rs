//! A calibrated model of an earlier run among the frames of other recordings.

use crate::error::HeldOutError;
use armcal_config::{FramePose, Pipeline, TipMount};
use armcal_core::{Code, Parameter, Pose, Role, Severity, Stage, Warning};
use armcal_model::{EffectSpec, Family, Model, Session, catalogue};
use armcal_result::{StoredArms, StoredModel, StoredResultError};
use armcal_stages::Placed;
use std::ops::Range;
use std::path::Path;

/// Puts the calibrated arm and its effects into `surroundings`: the nominal arm without effects, base and boards where
/// the pipeline of the new recordings knows them.
///
/// What calibration learned about the base is kept: where the base is measured again, its correction relative to the
/// measured pose; where it is to be estimated, its calibrated pose, to start from; a given pose stays as given. The tip is
/// alike for both arms: kept, each has the one that the calibration recordings gave it; remounted, the one of the pipeline.
///
/// # Errors
/// A nominal arm that differs from the one that was calibrated, or a parameter the result does not have.
pub fn place_model(
    past: &StoredModel,
    result: &Path,
    pipeline: &Pipeline,
    surroundings: &Model,
) -> Result<Placed, HeldOutError> {
    place_arms(&past.arms()?, past.session(), result, pipeline, surroundings)
}

/// The same of arms at hand; `origin` is the file they come from.
///
/// # Errors
/// As [`place_model`].
pub fn place_arms(
    then: &StoredArms,
    session: &Session,
    origin: &Path,
    pipeline: &Pipeline,
    surroundings: &Model,
) -> Result<Placed, HeldOutError> {
    let mut warnings = Vec::new();
    let specs = then.model.effects().iter().map(|e| e.spec.clone());
    let lasting: Vec<EffectSpec> = specs.filter(|s| is_lasting(s, &mut warnings)).collect();
    let model = if lasting.is_empty() {
        surroundings.clone()
    } else {
        surroundings.with_effects(&lasting, session)?
    };
    let mut nominal = model.nominal();
    let mut calibrated = nominal.clone();
    for (at, parameter) in model.parameters().iter().enumerate() {
        if !matches!(parameter.role, Role::Robot | Role::Effect) {
            continue;
        }
        let Parameter { name, nominal: now, .. } = parameter;
        let other =
            |problem| HeldOutError::from(StoredResultError::Unusable { path: origin.to_owned(), problem });
        let known = then.model.index(name).ok_or_else(|| {
            other(format!(
                "has no parameter {name}: its arm is not the one of this pipeline; name the [model] it was calibrated with"
            ))
        })?;
        let nominal_then = then.model.parameters()[known].nominal;
        if parameter.role == Role::Robot && (nominal_then - now).abs() > 1e-9 {
            return Err(other(format!(
                "calibrated an arm whose nominal {name} is {nominal_then}, this pipeline's is {now} (SI); name the [model] it was \
                 calibrated with"
            )));
        }
        calibrated[at] = then.values[known];
    }
    if pipeline.verify.tip == TipMount::Kept {
        keep_tips(&model, (&then.geometry, &then.nominal_values), &mut nominal);
        keep_tips(&model, (&then.model, &then.values), &mut calibrated);
    }
    warnings.extend(tip_overruled(then, pipeline, &model));
    for arm in 0..model.chain().bases() {
        let now = model.arm_base_in_world(&nominal, arm);
        put_frame(model.base_parameters(arm), (now, base_pose(then, pipeline, arm, &now)), &mut calibrated);
    }
    Ok(Placed { model, nominal, calibrated, warnings })
}

/// A tip that is kept from the calibration although the pipeline declares another.
fn tip_overruled(then: &StoredArms, pipeline: &Pipeline, model: &Model) -> Option<Warning> {
    let declared = pipeline.frames.tip.pose != FramePose::Estimated && pipeline.verify.tip == TipMount::Kept;
    let tip_m = |model: &Model| model.tip_in_last_link(&model.nominal()).translation.vector;
    let apart_m = (tip_m(model) - tip_m(&then.model)).norm();
    let message = format!(
        "kept as the calibration had it, although [frames.tip] of this pipeline declares it {:.2} mm from where the calibration's \
         pipeline did; if tool or target were mounted anew since, set tip = \"remounted\" in [verify]",
        apart_m * 1e3
    );
    let differs = declared && apart_m > 1e-9;
    differs.then(|| Warning::new(Severity::Notice, Stage::Calibrate, Code::TipKept, "tip", message))
}

/// Whether an effect holds beyond the recordings it was fitted on; what time does to it is doubtful.
pub fn is_lasting(spec: &EffectSpec, warnings: &mut Vec<Warning>) -> bool {
    let mut say = |code, message: &str| {
        warnings.push(Warning::new(
            Severity::Notice,
            Stage::Calibrate,
            code,
            spec.to_string(),
            message.to_owned(),
        ));
    };
    if spec.since.is_some() {
        say(Code::EventNotCarriedOver, "happened in a recording of the calibration: left out here");
        return false;
    }
    let family = catalogue().iter().find(|kind| kind.name == spec.kind).map(|kind| kind.family);
    if family == Some(Family::Drift) {
        say(
            Code::DriftExtrapolated,
            "was fitted over the time of the calibration and is extrapolated to this one",
        );
    }
    true
}

/// The base of an arm as far as calibration and the new recordings know it together.
fn base_pose(then: &StoredArms, pipeline: &Pipeline, arm: usize, now: &Pose) -> Pose {
    let measured = then.model.arm_base_in_world(&then.model.nominal(), arm);
    let calibrated = then.model.arm_base_in_world(&then.values, arm);
    let of_arm = pipeline.two_arms.as_ref().and_then(|two| two.arms.get(arm));
    match of_arm.map_or(&pipeline.frames.base, |arm| &arm.base).pose {
        FramePose::Given => *now,
        FramePose::Measured => now * measured.inverse() * calibrated,
        FramePose::Estimated => calibrated,
    }
}

/// Puts the tips, what is joined to one, and the length of a link between them where another model has them.
fn keep_tips(model: &Model, (then, values_then): (&Model, &[f64]), values: &mut [f64]) {
    let start = model.nominal();
    for (feature, name) in model.features() {
        let Some((before, _)) = then.features().find(|(_, before)| *before == name) else { continue };
        let (now, kept) = (model.feature_in_link(&start, feature), then.feature_in_link(values_then, before));
        put_frame(model.feature_parameters(feature), (now, kept), values);
    }
    for (name, now) in model.lengths().filter(|(_, now)| model.parameters()[*now].free) {
        let before = then.lengths().find(|(before, _)| *before == name);
        before.into_iter().for_each(|(_, before)| values[now] = values_then[before]);
    }
}

/// Writes a pose into the parameters of a frame that is at `now`: position, and the rotation vector that turns it.
fn put_frame(own: Range<usize>, (now, pose): (Pose, Pose), values: &mut [f64]) {
    let turn_rad = (now.rotation.inverse() * pose.rotation).scaled_axis();
    let at_m = pose.translation.vector;
    let entries = at_m.iter().chain(turn_rad.iter());
    // Of a frame whose rotation is none of its parameters, the position.
    own.clone().zip(entries).for_each(|(at, value)| values[at] = *value);
}
