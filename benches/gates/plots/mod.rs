//! Plots of what was measured against theory.

pub mod chart;
pub mod font;
