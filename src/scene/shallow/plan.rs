//! The stage of a scene with a liquid on a terrain.

use super::Inputs;
use super::stage::Liquid;
use super::stage::liquid_over_time::LiquidState;
use crate::context::Context;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::run::Plan;

/// The stage of a scene with a liquid on a terrain.
///
/// # Errors
/// A scene without one; a source inside solid, before anything is written; cancel.
pub fn plan<'a>(ctx: &Context, scene: &'a Scene, inputs: &'a Inputs) -> Result<Plan<'a>> {
    LiquidState::begin(ctx, (scene, scene.shallow()?, inputs))?;
    let stage = Liquid { scene, of: scene.shallow()?, inputs };
    Ok(Plan { scene, seen: &inputs.seen, stages: vec![Box::new(stage)] })
}
