//! Which rows may fill up.

/// For each row, whether columns might fill up to their ceiling in a step, and whether some might be full.
#[derive(Clone, Copy)]
pub struct Filling<'a> {
    pub may_fill: &'a [bool],
    pub may_be_full: &'a [bool],
}
