//! What a step of a tracker did.

use super::apart::Apart;
use super::change::Change;
use crate::context::PhaseTime;

/// What warnings of the mesh have in common.
pub(super) const OF_MESH: &str = "of the mesh's";

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
    /// What looks wrong with the particles, and with what became of the mesh, a sentence each.
    pub warnings: Vec<String>,
    /// Time of each phase.
    pub phases: Vec<PhaseTime>,
}

impl StepReport {
    /// How often a change was found: vertices that were not projected, and others beside surface that is not covered.
    pub fn flagged(&self) -> usize {
        self.jumped + self.lost + self.uncovered
    }

    /// The warnings that are news: what is wrong with the particles is said of the first frame only, of which `is_told` keeps note.
    pub fn news<'a>(&'a self, is_told: &'a mut bool) -> impl Iterator<Item = &'a String> {
        self.warnings.iter().filter(|warning| {
            let is_of_mesh = warning.contains(OF_MESH);
            is_of_mesh || !std::mem::replace(is_told, true)
        })
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
            warnings: {
                self.warnings.extend(next.warnings);
                self.warnings
            },
            phases: self.phases,
        }
    }
}
