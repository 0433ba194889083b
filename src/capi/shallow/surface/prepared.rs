//! What surfaces are built with besides the depths: velocities and concentrations; minimum heights and ledges, and whether these match the
//! current ground.

use crate::capi::ffi::*;
use crate::error::Result;
use crate::shallow::Shallow;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::Depths;
use crate::shallow::surface::heights::minimum_heights::MinimumHeights;
use crate::shallow::surface::rim::ledges::Ledges;
use crate::shallow::surface::rim::silhouette::Silhouette;

/// What a surface shows of the flow.
pub(in crate::capi) struct Needs {
    pub velocities: bool,
    pub scalars: [bool; MAX_SCALARS],
}

/// What surfaces show of the flow, for all column indices; empty unless the last one needed it.
#[derive(Default)]
pub(in crate::capi) struct Shown {
    /// Mean velocities (m/s).
    velocities: Vec<[f32; 2]>,
    /// Concentrations of scalars.
    concentrations: [Vec<f32>; MAX_SCALARS],
}

impl Shown {
    /// The depths of a liquid, and what else a surface needs of its flow.
    pub(in crate::capi) fn depths<'a>(
        &'a mut self,
        shallow: &'a Shallow,
        needs: &Needs,
    ) -> Result<Depths<'a>> {
        let len = |is_needed: bool| if is_needed { shallow.columns().len() } else { 0 };
        for (scalar, numbers) in self.concentrations.iter_mut().enumerate() {
            numbers.resize(len(needs.scalars[scalar]), 0.0);
            if needs.scalars[scalar] {
                shallow.concentrations(scalar, numbers)?;
            }
        }
        self.velocities.resize(len(needs.velocities), [0.0; 2]);
        if needs.velocities {
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
        refuse(is_skirted && !self.is_current, || {
            format!("FRZ_SHALLOW_SKIRTED: frz_shallow_find_ledges has found no ledges {when}")
        })?;
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
    pub lifts: MinimumHeights,
    /// Whether they match the current ground.
    pub is_current: bool,
}

impl Lifted {
    /// Minimum and sunk depths, if they match the current ground.
    pub(in crate::capi) fn known(&self) -> Option<(&[i32], &[i32])> {
        self.is_current.then(|| (self.lifts.least(), self.lifts.sunk()))
    }
}

/// The minimum and sunk depths, if a surface needs them; a failure if it needs them and there are none.
pub(in crate::capi) fn wanted_lifts<'a>(
    is_lifted: bool,
    known: Option<(&'a [i32], &'a [i32])>,
    when: &str,
) -> Outcome<(&'a [i32], &'a [i32])> {
    refuse(is_lifted && known.is_none(), || {
        format!("FRZ_SHALLOW_LIFTED: frz_shallow_find_lifts has found no minimum heights {when}")
    })?;
    Ok(known.filter(|_| is_lifted).unwrap_or_default())
}
