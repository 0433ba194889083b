//! What surfaces are built with besides the liquid: minimum heights and ledges, and whether they match the current ground.

use crate::capi::ffi::guard::{Failure, Outcome};
use crate::shallow::surface::heights::minimum_heights::Lifts;
use crate::shallow::surface::rim::ledges::Ledges;
use crate::shallow::surface::rim::silhouette::Silhouette;

/// Ledges of a liquid.
#[derive(Default)]
pub(in crate::capi) struct Ledged {
    pub ledges: Ledges,
    /// Fits them to the ground's mesh.
    pub silhouette: Silhouette,
    /// Whether they match the current ground.
    pub is_current: bool,
}

impl Ledged {
    /// The ledges, if a surface needs them; a failure if it needs them and there are none.
    pub(in crate::capi) fn wanted(&self, is_skirted: bool, when: &str) -> Outcome<Option<&Ledges>> {
        if is_skirted && !self.is_current {
            return Err(Failure::argument(format!(
                "FRZ_SHALLOW_SKIRTED: frz_shallow_find_ledges has found no ledges {when}"
            )));
        }
        Ok(is_skirted.then_some(&self.ledges))
    }

    /// Takes another object's ledges, if they match its current ground.
    pub(in crate::capi) fn copy_from(&mut self, other: &Self) {
        self.is_current = other.is_current;
        if self.is_current {
            self.ledges.copy_from(&other.ledges);
        }
    }
}

/// Minimum heights of a liquid.
#[derive(Default)]
pub(in crate::capi) struct Lifted {
    pub lifts: Lifts,
    /// Whether they match the current ground.
    pub is_current: bool,
}

impl Lifted {
    /// Minimum and sunk depths, if they match the current ground.
    pub(in crate::capi) fn known(&self) -> Option<(&[i32], &[i32])> {
        self.is_current.then(|| (self.lifts.least(), self.lifts.sunk()))
    }

    /// The same; a failure if they do not match.
    pub(in crate::capi) fn current(&self) -> Outcome<(&[i32], &[i32])> {
        self.known().ok_or_else(|| no_lifts("since the ground or a body moved"))
    }
}

/// The failure of a surface without minimum heights.
pub(in crate::capi) fn no_lifts(when: &str) -> Failure {
    Failure::argument(format!(
        "FRZ_SHALLOW_LIFTED: frz_shallow_find_lifts has found no minimum heights {when}"
    ))
}
