//! Colliders of grains: moving meshes, the ground, the base layer.

pub(in crate::snow) mod field;
pub(super) mod ground;
pub(super) mod nearby;
pub(super) mod renewal;
pub(super) mod search;
pub(in crate::snow) mod set;
pub(in crate::snow) mod shell;
pub(super) mod touch;
