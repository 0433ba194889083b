//! The stage of a scene with a liquid on a terrain.

use super::Inputs;
use super::stage::Liquid;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::run::Plan;

/// The stage of a scene with a liquid on a terrain.
///
/// # Errors
/// A scene without one.
pub fn plan<'a>(scene: &'a Scene, inputs: &'a Inputs) -> Result<Plan<'a>> {
    let stage = Liquid::new(scene, scene.shallow()?, inputs);
    Ok(Plan { scene, seen: &inputs.seen, stages: vec![Box::new(stage)] })
}
