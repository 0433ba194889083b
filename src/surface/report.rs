//! What a step of a tracker did.

use super::topology::change::Change;
use super::topology::uncovered_parts::Apart;
use crate::context::PhaseTime;

/// What a step did.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Vertices whose projection jumped: the liquid merged or split there.
    pub jumped: usize,
    /// Vertices whose projection did not find the surface.
    pub lost: usize,
    /// Vertices beside which there is surface that the mesh does not cover: something has begun to merge or to split there.
    pub uncovered: usize,
    /// Parts into which the frame was divided.
    pub parts: usize,
    /// Particles that are new, and that are gone.
    pub born: usize,
    /// See `born`.
    pub died: usize,
    /// Triangles of the particles' own surface.
    pub triangles: usize,
    /// Parts of that surface which the mesh does not cover, the largest first: drops and bubbles.
    pub apart: Vec<Apart>,
    /// What the mesh became where it was rebuilt or improved; none: vertices and triangles are those before.
    pub change: Option<Change>,
    /// How ids, velocities and positions of the particles contradict each other, in a sentence.
    pub particle_warning: Option<String>,
    /// That over half of the mesh was lost or made anew, a sentence each.
    pub mesh_warnings: Vec<String>,
    /// Time of each phase.
    pub phases: Vec<PhaseTime>,
}

impl StepReport {
    /// How often a change was found: vertices that were not projected, and others beside surface that is not covered.
    pub fn flagged(&self) -> usize {
        self.jumped + self.lost + self.uncovered
    }

    /// All warnings.
    pub fn warnings(&self) -> impl Iterator<Item = &String> {
        self.mesh_warnings.iter().chain(&self.particle_warning)
    }

    /// Warnings to log: all of the mesh, and the first one of the particles, after which `has_warned` is set.
    pub fn new_warnings(&self, has_warned: &mut bool) -> impl Iterator<Item = &String> {
        let of_particles = self.particle_warning.as_ref().filter(|_| !std::mem::replace(has_warned, true));
        self.mesh_warnings.iter().chain(of_particles)
    }

    /// What two steps did, one after the other; what is flagged is so after the second.
    pub fn followed_by(mut self, next: Self) -> Self {
        for phase in next.phases {
            match self.phases.iter_mut().find(|own| own.name == phase.name) {
                Some(own) => own.time += phase.time,
                None => self.phases.push(phase),
            }
        }
        Self {
            jumped: next.jumped,
            lost: next.lost,
            uncovered: next.uncovered,
            parts: self.parts + next.parts,
            born: self.born + next.born,
            died: self.died + next.died,
            triangles: next.triangles,
            apart: next.apart,
            change: match (self.change, next.change) {
                (Some(first), Some(second)) => Some(second.after(&first)),
                (first, second) => second.or(first),
            },
            particle_warning: self.particle_warning.or(next.particle_warning),
            mesh_warnings: [self.mesh_warnings, next.mesh_warnings].concat(),
            phases: self.phases,
        }
    }
}
