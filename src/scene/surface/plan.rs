//! The stages of a scene with a mesh that follows a liquid.

use super::Inputs;
use super::track::Track;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::run::Plan;

/// The stages of a scene with a mesh that follows a liquid.
///
/// # Errors
/// A scene without one.
pub fn plan<'a>(scene: &'a Scene, inputs: &'a Inputs) -> Result<Plan<'a>> {
    let stage = Track { scene, surface: scene.surface()?, inputs };
    Ok(Plan { scene, seen: &inputs.seen, stages: vec![Box::new(stage)] })
}
