//! Report of a tracker's step.

use super::topology::change::Change;
use super::topology::uncovered_parts::UncoveredPart;
use crate::context::PhaseTime;

/// Report of a step.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Vertices whose projection jumped: the liquid merged or split there.
    pub jumped: usize,
    /// Vertices whose projection did not find the surface.
    pub lost: usize,
    /// Vertices beside uncovered surface: a merge or split has begun there.
    pub uncovered: usize,
    /// Count of parts into which the frame was divided.
    pub parts: usize,
    /// Count of particles that appeared, and of those that disappeared.
    pub born: usize,
    /// See `born`.
    pub died: usize,
    /// Triangles of the particles' own surface.
    pub triangles: usize,
    /// Parts of that surface that the mesh does not cover, the largest first: drops and bubbles.
    pub uncovered_parts: Vec<UncoveredPart>,
    /// Changes to the mesh where it was rebuilt or improved; none: vertices and triangles are as before.
    pub change: Option<Change>,
    /// A sentence that describes how ids, velocities and positions of the particles contradict each other.
    pub particle_warning: Option<String>,
    /// Warnings that over half of the mesh was lost or rebuilt, one sentence each.
    pub mesh_warnings: Vec<String>,
    /// Time of each phase.
    pub phases: Vec<PhaseTime>,
}

impl StepReport {
    /// Count of vertices at which a change was found: those that were not projected, and those beside uncovered surface.
    pub fn flagged(&self) -> usize {
        self.jumped + self.lost + self.uncovered
    }

    /// All warnings.
    pub fn warnings(&self) -> impl Iterator<Item = &String> {
        self.mesh_warnings.iter().chain(&self.particle_warning)
    }

    /// Warnings to log: all about the mesh, and the one about the particles, if there is one, unless `has_warned` is already set; it is set
    /// by that warning.
    pub fn new_warnings(&self, has_warned: &mut bool) -> impl Iterator<Item = &String> {
        let of_particles = self.particle_warning.as_ref().filter(|_| !std::mem::replace(has_warned, true));
        self.mesh_warnings.iter().chain(of_particles)
    }

    /// The combined report of two successive steps; flagged vertices are those of the second.
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
            uncovered_parts: next.uncovered_parts,
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
