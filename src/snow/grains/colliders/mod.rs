//! Colliders of grains: moving meshes, the ground, the base layer.

pub(in crate::snow) mod field;
pub(in crate::snow::grains) mod ground;
pub(in crate::snow::grains) mod nearby;
pub(in crate::snow::grains) mod renewal;
pub(in crate::snow::grains) mod search;
pub(in crate::snow) mod set;
pub(in crate::snow) mod shell;
pub(in crate::snow::grains) mod touch;
