//! The motion of vertices from one frame to the next, through changes of the mesh.

use crate::geometry::check::topology::around;
use crate::geometry::{DVec3, Vec3};
use crate::surface::Change;

/// Number of passes in which new vertices take the mean velocity of their neighbours.
const PASSES: usize = 4;

/// The vertices of a frame on their path to the next.
pub struct Trail {
    /// Their initial positions (m).
    from: Vec<DVec3>,
    /// The displacement of each so far (m), and the share of the frame that it took.
    gone: Vec<(DVec3, f64)>,
    /// For each current vertex, the vertex of the frame that it was; `None`: it is new.
    names: Vec<Option<u32>>,
}

impl Trail {
    /// Vertices that start from these positions (m).
    pub fn of(from: &[DVec3]) -> Self {
        let names = (0..from.len() as u32).map(Some).collect();
        Self { from: from.to_vec(), gone: vec![(DVec3::zeros(), 0.0); from.len()], names }
    }

    /// Records positions (m) when a share of the frame has passed.
    pub fn follow(&mut self, positions: &[DVec3], share: f64) {
        for (position, name) in positions.iter().zip(&self.names) {
            if let Some(name) = name {
                let at = *name as usize;
                self.gone[at] = (position - self.from[at], share);
            }
        }
    }

    /// Applies a change: some vertices are gone, others are new.
    pub fn change(&mut self, change: &Change) {
        let name = |origin: &Option<u32>| origin.and_then(|at| self.names[at as usize]);
        self.names = change.origins.iter().map(name).collect();
    }

    /// Velocities over the frame, at `fps` frames per second: vertices that are gone keep their last velocity.
    pub fn way(&self, after: &[DVec3], triangles: &[[u32; 3]], fps: f64) -> Way {
        let speed = |(gone, share): &(DVec3, f64)| -> Vec3 {
            if *share > 0.0 { (gone * (fps / share)).cast() } else { Vec3::zeros() }
        };
        let of_before: Vec<Vec3> = self.gone.iter().map(speed).collect();
        if after.len() == self.from.len() && self.names.iter().zip(0..).all(|(name, at)| *name == Some(at)) {
            return Way { of_after: of_before.clone(), of_before };
        }
        let mut known: Vec<Option<Vec3>> =
            self.names.iter().map(|name| name.map(|name| of_before[name as usize])).collect();
        for _ in 0..PASSES {
            let sums = around(known.len(), triangles, |vertex| known[vertex as usize]);
            for (known, (sum, count)) in known.iter_mut().zip(sums) {
                if known.is_none() && count > 0 {
                    *known = Some(sum / count as f32);
                }
            }
        }
        let of_after = known.into_iter().map(Option::unwrap_or_default).collect();
        Way { of_before, of_after }
    }
}

/// The motion of vertices from the previous frame to this one.
#[derive(Default)]
pub(in crate::scene::surface) struct Way {
    /// Velocities over the step (m/s) of the previous frame's vertices; empty at the first frame.
    pub of_before: Vec<Vec3>,
    /// Velocities over the step of the vertices at its end.
    pub of_after: Vec<Vec3>,
}
