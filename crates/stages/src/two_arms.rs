//! The nominal model of two arms with a file each, and their effects.

use crate::RunError;
use crate::declared::override_parameters;
use armcal_config::{ArmSection, ParameterOverride, Pipeline, TwoArms};
use armcal_model::{Chain, EffectSpec, Model};

/// Both nominal arms in one world, their chains read already.
pub fn nominal_pair(two: &TwoArms, chain: &Chain) -> Result<Model, RunError> {
    let frames = |arm: &ArmSection| armcal_model::ArmFrames {
        base: arm.base.frame(&format!("{}.base", arm.name), true),
        tip: arm.tip.frame(&format!("{}.tip", arm.name), false),
    };
    let all = two.arms.iter().map(frames).collect();
    let mut model = Model::of_arms(chain.clone(), all)?;
    for (arm, of_chain) in two.arms.iter().zip(chain.arms()) {
        let named = |p: &ParameterOverride| ParameterOverride {
            name: of_chain.parameter_among_all(&p.name),
            ..p.clone()
        };
        let own: Vec<ParameterOverride> = arm.parameters.iter().map(named).collect();
        override_parameters(&mut model, &own)?;
    }
    Ok(model)
}

/// The effects of both arms, then those of the pipeline.
pub fn effect_specs(two: &TwoArms, pipeline: &Pipeline, model: &Model) -> Result<Vec<EffectSpec>, RunError> {
    let mut specs = Vec::new();
    for (at, (arm, of_chain)) in two.arms.iter().zip(model.chain().arms()).enumerate() {
        for table in &arm.effects {
            let own = table.spec(of_chain.chain.joint_names())?;
            specs.push(of_chain.effect_among_all(at + 1, own)?);
        }
    }
    let joints = model.chain().joint_names();
    let of_all = pipeline.effects.iter().map(|table| table.spec(joints));
    specs.extend(of_all.collect::<Result<Vec<_>, _>>()?);
    Ok(specs)
}
