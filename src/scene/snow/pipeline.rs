//! The stages of a scene with snow.

use super::Inputs;
use super::stages::base::Base;
use super::stages::grains::Grains;
use super::stages::mist::Mist;
use super::stages::volumes::Volumes;
use super::{has_grains, has_mist};
use crate::scene::Scene;
use crate::scene::objects::Objects;
use crate::scene::run::{AnyStage, Pipeline};

/// The stages of a scene with snow.
pub fn pipeline<'a>(scene: &'a Scene, inputs: &'a Inputs) -> Pipeline<'a> {
    let mut stages: Vec<Box<dyn AnyStage + 'a>> = vec![Box::new(Base { scene, inputs })];
    if has_grains(&scene.values) {
        stages.push(Box::new(Grains::new(scene, inputs)));
    }
    if has_mist(&scene.values) {
        stages.push(Box::new(Mist { scene, inputs }));
    }
    let volumes = scene.output.volumes;
    if volumes.fog() || volumes.snow || volumes.mesh() {
        stages.push(Box::new(Volumes::new(scene, inputs)));
    }
    if (scene.output.objects_usd || scene.output.objects_ply) && !inputs.bodies.is_empty() {
        stages.push(Box::new(Objects::new(scene, &inputs.bodies, &inputs.input_hashes)));
    }
    Pipeline { scene, input_hashes: &inputs.input_hashes, stages }
}
