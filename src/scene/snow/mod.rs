//! Snow in scenes: what its files hold ([`Inputs`]), what a check says of it ([`check`]), what memory it takes, and its
//! stages: the base layer (`base.rs`).

#[cfg(feature = "vdb")]
mod base;
#[cfg(feature = "vdb")]
pub mod check;
#[cfg(feature = "vdb")]
mod inputs;
mod keys;
mod memory;
mod rebuild;
mod relief;
mod settings;
mod walks;

pub(super) use keys::KEYS;

pub use inputs::Inputs;
pub use memory::{check as check_memory, estimate};
pub use rebuild::Rebuild;
pub use walks::Walk;

use super::Scene;
use super::objects::Objects;
use super::shot::{AnyStage, Plan};
use base::Base;

/// The stages of a scene with snow.
pub fn plan<'a>(scene: &'a Scene, inputs: &'a Inputs) -> Plan<'a> {
    let mut stages: Vec<Box<dyn AnyStage + 'a>> = vec![Box::new(Base::new(scene, inputs))];
    if scene.output.objects_usd || scene.output.objects_ply {
        stages.push(Box::new(Objects::new(scene, &inputs.bodies, &inputs.seen)));
    }
    Plan { scene, seen: &inputs.seen, stages }
}
