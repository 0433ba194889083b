//! The stages of a scene with a mesh that follows a liquid.

use super::Inputs;
use super::track::Track;
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::run::Pipeline;

/// The stages of a scene with a mesh that follows a liquid.
///
/// # Errors
/// A scene without one.
pub fn pipeline<'a>(scene: &'a Scene, inputs: &'a Inputs) -> Result<Pipeline<'a>> {
    let stage = Track { scene, surface: scene.surface()?, inputs };
    Ok(Pipeline { scene, input_hashes: &inputs.input_hashes, stages: vec![Box::new(stage)] })
}
