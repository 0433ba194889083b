//! The ground below a liquid, and the flow points and bodies that a host has set.

use super::flow_points::{AttachedFlow, frz_shallow_flow};
use super::ground::Terrain;
use super::params::{domain, frz_shallow_domain, frz_shallow_params, params};
use crate::capi::ffi::*;
#[cfg(feature = "vdb")]
use crate::capi::grid::sparse::frz_grid;
use crate::capi::mesh::triangles::frz_mesh;
use crate::capi::runtime::context::{creates, frz_context};
use crate::context::Context;
use crate::error::Result;
use crate::shallow::Params;
use crate::shallow::sources::FlowPoint;
use crate::shallow::terrain::Solids;
use crate::shallow::terrain::shapes::Shape;

/// A host's ground.
pub(in crate::capi) enum Ground {
    Mesh(*const frz_mesh),
    /// Its height at the centre of each cell (m).
    Heights(frz_view),
    #[cfg(feature = "vdb")]
    LevelSet(*const frz_grid),
}

/// What a liquid is created from.
pub(in crate::capi) struct Setup {
    pub params: Params,
    pub terrain: Terrain,
    pub solids: Solids,
}

/// A host's parameters, domain and ground.
type HostSetup = (*const frz_shallow_params, *const frz_shallow_domain, Ground);

/// The body of an interface function that creates a liquid on a host's ground.
///
/// # Safety
/// The pointers must be NULL or valid, and so must be the view.
pub(in crate::capi) unsafe fn creates_on<N: HandleType>(
    context: *mut frz_context,
    setup: HostSetup,
    out: *mut *mut N,
    make: impl FnOnce(&Context, Setup) -> Outcome<N::Value>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    unsafe { creates(context, out, |ctx| make(ctx, Setup::new(ctx, setup)?)) }
}

impl Setup {
    /// # Safety
    /// As [`creates_on`].
    unsafe fn new(ctx: &Context, (params, domain, ground): HostSetup) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            let (params, (grid, heights)) = (self::params(params)?, self::domain(ctx, domain)?);
            let (terrain, solids) = match ground {
                Ground::Mesh(mesh) => Terrain::of_mesh(ctx, &read(mesh)?.triangles, grid, heights),
                Ground::Heights(view) => Terrain::of_heights(view.in_place::<f32>("heights")?, grid, heights),
                #[cfg(feature = "vdb")]
                Ground::LevelSet(level_set) => {
                    Terrain::of_level_set(ctx, read(level_set)?.floats()?, grid, heights)
                }
            }?;
            Ok(Self { params, terrain, solids })
        }
    }
}

/// The ground, the flow points and the bodies of a liquid.
pub(in crate::capi) struct Surroundings {
    pub terrain: Terrain,
    /// The host's flow points, in its order.
    pub flows: Vec<AttachedFlow>,
    /// The bodies of the last call.
    pub shapes: Vec<Shape>,
}

impl Surroundings {
    /// Ground without flow points and bodies.
    pub fn new(terrain: Terrain) -> Self {
        Self { terrain, flows: Vec::new(), shapes: Vec::new() }
    }

    /// Replaces the flow points by a host's, if `set` accepts them at their current positions.
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
        let of = |given| AttachedFlow::of(&given, &self.terrain);
        // SAFETY: guaranteed by the caller.
        unsafe { read_list(flows, count, ["flow", "flows"], &mut attached, of) }?;
        let points: Vec<FlowPoint> = attached.iter().map(|flow| flow.point.clone()).collect();
        set(&points)?;
        self.flows = attached;
        Ok(())
    }

    /// Moves the flow points on triangles with them; `move_flow` receives the index and the new position (m) of each.
    pub fn carry_flows(&mut self, mut move_flow: impl FnMut(usize, [f64; 3])) -> Outcome {
        for (index, flow) in self.flows.iter_mut().enumerate() {
            if let Some(triangle) = &flow.triangle {
                flow.point.at = self.terrain.position(triangle)?;
                move_flow(index, flow.point.at);
            }
        }
        Ok(())
    }
}
