//! Grains in motion: pairs, contacts, rest, and corrections at the end of a step.

pub(super) mod blocks;
pub(in crate::snow) mod collide;
pub(super) mod contacts;
pub(super) mod crowd;
pub(super) mod density;
mod distance_rule;
pub(super) mod layout;
pub(super) mod pairs;
pub(super) mod rest;
pub(super) mod rows;
#[doc(hidden)]
pub mod solve;
mod surfaces;
pub(super) mod trapped;
