//! A deep layer of snow that objects move through (thesis chapter 3).

pub mod base_layer;
