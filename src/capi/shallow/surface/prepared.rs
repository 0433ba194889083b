//! What surfaces need besides depths: velocities and concentrations, minimum heights and ledges.

use crate::capi::ffi::*;
use crate::error::Result;
use crate::shallow::Shallow;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::Depths;
use crate::shallow::surface::heights::minimum_heights::MinimumHeights;
use crate::shallow::surface::rim::ledges::Ledges;
use crate::shallow::surface::rim::silhouette::Silhouette;

/// Which fields of the flow a surface needs.
pub(in crate::capi) struct NeededFields {
    pub velocities: bool,
    pub scalars: [bool; MAX_SCALARS],
}

/// Fields of the flow, over all column indices; those that the last surface did not need are empty.
#[derive(Default)]
pub(in crate::capi) struct FlowFields {
    /// Mean velocities (m/s).
    velocities: Vec<[f32; 2]>,
    /// Concentrations of scalars.
    concentrations: [Vec<f32>; MAX_SCALARS],
}

impl FlowFields {
    /// The depths of a liquid, and the needed fields of its flow.
    pub(in crate::capi) fn depths<'a>(
        &'a mut self,
        shallow: &'a Shallow,
        needed_fields: &NeededFields,
    ) -> Result<Depths<'a>> {
        let len = |is_needed: bool| if is_needed { shallow.columns().len() } else { 0 };
        for (scalar, numbers) in self.concentrations.iter_mut().enumerate() {
            numbers.resize(len(needed_fields.scalars[scalar]), 0.0);
            if needed_fields.scalars[scalar] {
                shallow.concentrations(scalar, numbers)?;
            }
        }
        self.velocities.resize(len(needed_fields.velocities), [0.0; 2]);
        if needed_fields.velocities {
            shallow.velocities(&mut self.velocities)?;
        }
        Ok(Depths {
            depth: shallow.depths(),
            velocity: &self.velocities,
            active: Some(shallow.active()),
            carried: self.concentrations.each_ref().map(|numbers| &numbers[..]),
            ..Depths::default()
        })
    }
}

/// Ledges as last found.
#[derive(Default)]
pub(in crate::capi) struct FoundLedges {
    pub ledges: Ledges,
    /// Locates them on the ground's mesh.
    pub silhouette: Silhouette,
    /// Whether they match the current ground.
    pub is_current: bool,
}

impl FoundLedges {
    /// The ledges if a surface is skirted; a failure if they do not match the current ground. `when` completes the error.
    pub(in crate::capi) fn requested(&self, is_skirted: bool, when: &str) -> Outcome<Option<&Ledges>> {
        refuse(is_skirted && !self.is_current, || {
            format!("FRZ_SHALLOW_SKIRTED: frz_shallow_find_ledges was not called {when}")
        })?;
        Ok(is_skirted.then_some(&self.ledges))
    }

    /// Copies another liquid's ledges, if they match its current ground.
    pub(in crate::capi) fn copy_from(&mut self, other: &Self) {
        self.is_current = other.is_current;
        if self.is_current {
            self.ledges.copy_from(&other.ledges);
        }
    }
}

/// Minimum heights as last found.
#[derive(Default)]
pub(in crate::capi) struct FoundHeights {
    pub heights: MinimumHeights,
    /// Whether they match the current ground.
    pub is_current: bool,
}

impl FoundHeights {
    /// Minimum and sunk depths, if they match the current ground.
    pub(in crate::capi) fn known(&self) -> Option<(&[i32], &[i32])> {
        self.is_current.then(|| (self.heights.least(), self.heights.sunk()))
    }
}

/// The minimum and sunk depths if a surface is lifted; a failure if there are no `known` ones. `when` completes the error.
pub(in crate::capi) fn requested_heights<'a>(
    is_lifted: bool,
    known: Option<(&'a [i32], &'a [i32])>,
    when: &str,
) -> Outcome<(&'a [i32], &'a [i32])> {
    refuse(is_lifted && known.is_none(), || {
        format!("FRZ_SHALLOW_LIFTED: frz_shallow_find_lifts was not called {when}")
    })?;
    Ok(known.filter(|_| is_lifted).unwrap_or_default())
}
