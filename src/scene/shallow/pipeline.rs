//! The stage of a scene with a liquid on a terrain.

use super::Inputs;
use super::stage::Liquid;
use super::stage::liquid_state::LiquidState;
use crate::context::Context;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::run::Pipeline;

/// The stage of a scene with a liquid on a terrain.
///
/// # Errors
/// A scene without one; a source inside solid, before anything is written; cancel.
pub fn pipeline<'a>(ctx: &Context, scene: &'a Scene, inputs: &'a Inputs) -> Result<Pipeline<'a>> {
    LiquidState::begin(ctx, (scene, scene.shallow()?, inputs))?;
    let stage = Liquid { scene, setup: scene.shallow()?, inputs };
    Ok(Pipeline { scene, input_hashes: &inputs.input_hashes, stages: vec![Box::new(stage)] })
}
