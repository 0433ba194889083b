//! What a liquid flows over, and what a host has set in it.

use super::flow_points::{Attached, frz_shallow_flow};
use super::ground::Terrain;
use super::params::{domain, frz_shallow_domain, frz_shallow_params, params};
use crate::capi::ffi::*;
use crate::context::Context;
use crate::error::Result;
use crate::shallow::Params;
use crate::shallow::columns::grid::{Grid, Heights};
use crate::shallow::sources::FlowPoint;
use crate::shallow::terrain::Solids;
use crate::shallow::terrain::shapes::Shape;

/// What a liquid is created from.
pub(in crate::capi) struct Setup {
    pub params: Params,
    pub terrain: Terrain,
    pub solids: Solids,
}

impl Setup {
    /// A host's parameters, and the terrain on its domain.
    ///
    /// # Safety
    /// The pointers must be NULL or valid.
    pub unsafe fn new(
        ctx: &Context,
        params: *const frz_shallow_params,
        domain: *const frz_shallow_domain,
        terrain: impl FnOnce(Grid, Heights) -> Outcome<(Terrain, Solids)>,
    ) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        let (params, (grid, heights)) = unsafe { (self::params(params)?, self::domain(ctx, domain)?) };
        let (terrain, solids) = terrain(grid, heights)?;
        Ok(Self { params, terrain, solids })
    }
}

/// The ground, the flow points and the bodies of a liquid.
pub(in crate::capi) struct Surroundings {
    /// What it flows over.
    pub terrain: Terrain,
    /// The host's flow points, in its order.
    pub flows: Vec<Attached>,
    /// The bodies of the last call.
    pub shapes: Vec<Shape>,
}

impl Surroundings {
    /// Bare ground.
    pub fn new(terrain: Terrain) -> Self {
        Self { terrain, flows: Vec::new(), shapes: Vec::new() }
    }

    /// Replaces the flow points by a host's, once `set` has accepted them as they are now.
    ///
    /// # Safety
    /// As [`read_list`].
    pub unsafe fn set_flows(
        &mut self,
        flows: *const frz_shallow_flow,
        count: usize,
        set: impl FnOnce(&[FlowPoint]) -> Result<()>,
    ) -> Outcome {
        let mut attached = Vec::new();
        let of = |given| Attached::of(&given, &self.terrain);
        // SAFETY: guaranteed by the caller.
        unsafe { read_list(flows, count, ["flow", "flows"], &mut attached, of) }?;
        let points: Vec<FlowPoint> = attached.iter().map(|flow| flow.point.clone()).collect();
        set(&points)?;
        self.flows = attached;
        Ok(())
    }

    /// Moves the flow points on triangles with these; `move_flow` receives the index and the new position (m) of each.
    pub fn carry_flows(&mut self, mut move_flow: impl FnMut(usize, [f64; 3])) -> Outcome {
        for (index, flow) in self.flows.iter_mut().enumerate() {
            if let Some(on) = &flow.on {
                flow.point.at = self.terrain.position(on)?;
                move_flow(index, flow.point.at);
            }
        }
        Ok(())
    }
}
