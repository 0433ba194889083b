//! The handle of a shallow liquid.

use super::surface::prepared::{FlowFields, FoundHeights, FoundLedges};
use super::surroundings::{Setup, Surroundings};
use crate::capi::ffi::*;
use crate::context::Context;
use crate::shallow::free_fall::Droplet;
use crate::shallow::free_fall::mesh::Balls;
use crate::shallow::surface::Surface;
use crate::shallow::{Load, Moved, Shallow};

/// A small amount of liquid on the ground (blood, coffee or paint), computed in a fraction of a frame's time.
///
/// Real-time calls, which a host makes in each frame, follow stricter rules than all others. These calls are frz_shallow_step, _replay,
/// _update_terrain, _update_heights, _set_bodies, _loads, _save, _restore, _surface, _find_lifts, _find_ledges, _drops, _drops_mesh,
/// _read_scalar and _probe, frz_shallow_stains_update, _read and _soaked, and frz_shallow_snapshot_take, _surface, _drops, _drops_mesh and
/// _probe. With a pool of 0 threads, from their second call on, they allocate nothing, take no lock, log and poll nothing, and make no
/// system call except to read the thread's clock when a step has a budget. Memory grows only when more is needed than ever before, for
/// instance more columns because a body uncovers another layer; failing calls may allocate too.
///
/// A cancel takes effect at the beginning of such a call, and also during a frame that may take a long time: one with exact steps, one
/// whose columns times its steps exceed about two million, or one with many full columns. Such a frame first copies what it changes, so
/// that a cancel leaves the liquid as it was. None of these calls has phases, which all other work has: frz_context_progress and
/// frz_context_timings do not see them. Phases take locks and memory, and a poll between them may take longer than the few milliseconds of
/// a frame.
pub struct frz_shallow {
    _opaque: [u8; 0],
}

handle!(frz_shallow, ShallowHandle, "shallow liquid", 9);

/// The value of a liquid's handle.
pub(in crate::capi) struct ShallowHandle {
    pub shallow: Shallow,
    pub surroundings: Surroundings,
    /// Builds surfaces of this liquid.
    pub surface: Surface,
    pub found_heights: FoundHeights,
    pub found_ledges: FoundLedges,
    /// Velocities and concentrations for surfaces.
    pub flow_fields: FlowFields,
    /// Builds and holds meshes of the liquid in the air.
    pub balls: Balls,
    /// Drops of the last such mesh.
    pub drops: Vec<Droplet>,
    /// Velocities of the bodies (m/s) and their loads, of the last frz_shallow_loads.
    pub velocities_of_bodies: Vec<[f64; 3]>,
    pub loads: Vec<Load>,
    /// Lengths of the steps of a replay (s).
    pub steps: Vec<f64>,
}

impl ShallowHandle {
    /// Dry ground.
    pub fn new(ctx: &Context, setup: Setup) -> Outcome<Self> {
        let shallow = ctx.phase("columns", || Shallow::new(ctx, &setup.solids, setup.params))?;
        let mut surface = Surface::default();
        surface.reserve(shallow.columns());
        let max_packets = shallow.params().falls.map_or(0, |falls| falls.max_packets);
        let mut balls = Balls::default();
        balls.reserve(max_packets);
        Ok(Self {
            shallow,
            surroundings: Surroundings::new(setup.terrain),
            surface,
            found_heights: FoundHeights::default(),
            found_ledges: FoundLedges::default(),
            flow_fields: FlowFields::default(),
            balls,
            drops: Vec::with_capacity(max_packets),
            velocities_of_bodies: Vec::new(),
            loads: Vec::new(),
            steps: Vec::with_capacity(1024),
        })
    }

    /// Marks minimum heights and ledges as outdated if the ground has moved.
    pub fn ground_changed(&mut self, moved: Moved) -> Moved {
        if moved.cells > 0 {
            self.found_heights.is_current = false;
            self.found_ledges.is_current = false;
        }
        moved
    }
}
