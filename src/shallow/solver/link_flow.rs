//! The flow through links, and what lies beyond them.

use std::iter::repeat_n;
use std::ops::Range;

use crate::shallow::columns::Columns;
use crate::shallow::pipes::Links;
use crate::shallow::scalars::MAX_SCALARS;

/// The flow through each link.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinkFlow {
    /// Flux (units per step).
    pub flux: Vec<f32>,
    /// Remainder of the transfer (units).
    pub remainder: Vec<f32>,
    /// Transfer in this step (units).
    pub transfer: Vec<f32>,
    /// Amounts of each scalar that fell freely over each link in the last step.
    pub fallen: [Vec<f64>; MAX_SCALARS],
    /// Units that have left the domain so far.
    pub lost: i64,
    /// Units that have entered over an absorbing border.
    pub gained: i64,
}

impl LinkFlow {
    /// No flow.
    pub fn new(links: &Links) -> Self {
        let none = vec![0.0; links.len()];
        Self { flux: none.clone(), remainder: none.clone(), transfer: none, ..Self::default() }
    }

    /// Sets the count of scalars of liquid that falls freely.
    pub(super) fn set_scalar_count(&mut self, scalars: usize) {
        for (at, fallen) in self.fallen.iter_mut().enumerate() {
            *fallen = vec![0.0; if at < scalars { self.flux.len() } else { 0 }];
        }
    }

    /// Replaces a range of links by others with these fluxes and remainders.
    pub fn replace(&mut self, part: Range<usize>, flux: &[f32], remainder: &[f32], scalars: usize) {
        debug_assert_eq!(flux.len(), remainder.len());
        self.flux.splice(part.clone(), flux.iter().copied());
        self.remainder.splice(part.clone(), remainder.iter().copied());
        self.transfer.splice(part.clone(), repeat_n(0.0, flux.len()));
        for fallen in self.fallen.iter_mut().take(scalars) {
            fallen.splice(part.clone(), repeat_n(0.0, flux.len()));
        }
    }
}

/// The far end of a link that leaves the domain: its surface and its depth above the base of the link's column (units), and whether it is
/// liquid at rest.
pub(super) fn beyond(links: &Links, columns: &Columns, link: usize, still: i32) -> (i32, i32, bool) {
    let (eta, is_still) = links.outside(columns, link, still);
    (eta, if is_still { eta - columns.bases()[links.from[link] as usize] } else { 0 }, is_still)
}
