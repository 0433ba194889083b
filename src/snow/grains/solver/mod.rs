//! Grains in motion: pairs, contacts, rest, and corrections at the end of a step.

pub(in crate::snow::grains) mod blocks;
pub(in crate::snow) mod collide;
pub(in crate::snow::grains) mod contacts;
pub(in crate::snow::grains) mod crowd;
pub(in crate::snow::grains) mod density;
mod distance_rule;
pub(in crate::snow::grains) mod layout;
pub(in crate::snow::grains) mod pairs;
pub(in crate::snow::grains) mod rest;
pub(in crate::snow::grains) mod rows;
#[doc(hidden)]
pub mod solve;
mod surfaces;
pub(in crate::snow::grains) mod trapped;
