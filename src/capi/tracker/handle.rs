//! The handle of a tracker.

use crate::capi::ffi::saved::Saved;
use crate::capi::ffi::*;
use crate::geometry::DVec3;
use crate::mesh_repair::Source;
use crate::surface::{Change, Outlook, Tracker};

/// A detailed mesh that follows the particles of a liquid.
pub struct frz_tracker {
    _opaque: [u8; 0],
}

handle!(frz_tracker, TrackerHandle, "tracker", 8);

/// How a step changed the mesh.
pub(in crate::capi) struct Edits {
    /// For each vertex its index before the step; `None`: it is new.
    pub origins: Vec<Option<u32>>,
    /// For each triangle its origin.
    pub sources: Vec<Source>,
    /// Positions (m) to which the step took the previous vertices.
    pub before: Vec<DVec3>,
}

impl From<Change> for Edits {
    fn from(change: Change) -> Self {
        let Change { origins, sources, before, .. } = change;
        Self { origins, sources, before }
    }
}

/// The value of a tracker's handle.
pub(in crate::capi) struct TrackerHandle {
    pub tracker: Tracker,
    /// How the last step changed the mesh; `None`: no triangle changed, or there was no step yet.
    pub edits: Option<Edits>,
    /// Steps computed in advance.
    pub outlook: Outlook,
    pub saved: Saved,
    /// Whether a warning about contradictory ids and velocities was logged.
    pub has_warned: bool,
}
