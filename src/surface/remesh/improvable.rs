//! A mesh whose edges are improved, and the lengths that they were born with.

use crate::geometry::DVec3;
use crate::mesh_repair::Source;

/// A mesh that is improved, lengths in any unit: closed and 2-manifold by index. Arrays have one value for each vertex, or triangle.
pub struct Improvable<'a> {
    /// Positions of vertices.
    pub positions: &'a mut Vec<DVec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: &'a mut Vec<[u32; 3]>,
    /// For each vertex, the lengths of the shortest and of the longest edge around it at its birth, so that no edge is out of range then.
    /// Edges between vertices of size 0 are never out of range.
    pub sizes: &'a mut Vec<Size>,
    /// For each vertex, its index before the frame; none: it was created in this frame.
    pub origins: &'a mut Vec<Option<u32>>,
    /// Displacement of each vertex since a reference some frames ago; not finite: unknown.
    pub drifts: &'a mut Vec<[f32; 3]>,
    /// For each triangle, where it comes from.
    pub sources: &'a mut Vec<Source>,
    /// For each vertex, whether its triangles are left alone: they are rebuilt in the next frame.
    pub flags: &'a mut Vec<bool>,
    /// Change of lengths where the liquid only jitters.
    pub jitter: f64,
}

impl Improvable<'_> {
    /// The range of lengths of an edge: shortest and longest.
    pub fn target(&self, [a, b]: [u32; 2]) -> [f64; 2] {
        between(self.sizes[a as usize], self.sizes[b as usize])
    }

    /// Square of an edge's length over its target; 1 if it is within the range, or has none.
    pub fn stretch(&self, ends: [u32; 2]) -> f64 {
        let [p, q] = ends.map(|end| self.positions[end as usize]);
        let [shortest, longest] = self.target(ends);
        let square = (p - q).norm_squared();
        let stretch = if square > longest * longest {
            square / (longest * longest)
        } else if square < shortest * shortest {
            square / (shortest * shortest)
        } else {
            1.0
        };
        if stretch.is_finite() { stretch } else { 1.0 }
    }

    /// Whether an edge is out of range, by `is_out`, and not at rest.
    pub fn needs_change(&self, ends: [u32; 2], is_out: fn(f64) -> bool) -> bool {
        is_out(self.stretch(ends)) && self.is_strained(ends)
    }

    /// Whether a triangle may be due: if it is unchanged in this frame, only if one of its edges is out of range and not at rest.
    pub fn is_due(&self, [a, b, c]: [u32; 3], source: Source) -> bool {
        if [a, b, c].into_iter().any(|corner| self.flags[corner as usize]) {
            return false;
        }
        let is_out = |ends: [u32; 2]| self.needs_change(ends, is_long) || self.needs_change(ends, is_short);
        !matches!(source, Source::Whole(_)) || [[a, b], [b, c], [c, a]].into_iter().any(is_out)
    }
}

/// Lengths of the shortest and of the longest edge around a vertex.
pub type Size = [f32; 2];

/// The size of a vertex between two others.
pub(in crate::surface::remesh) fn mean(one: Size, two: Size) -> Size {
    [0, 1].map(|end| 0.5 * (one[end] + two[end]))
}

/// The range of lengths of an edge between vertices of two sizes: shortest and longest.
pub(in crate::surface::remesh) fn between(one: Size, two: Size) -> [f64; 2] {
    let [shortest, longest] = [f64::from(one[0].max(two[0])), f64::from(one[1].min(two[1]))];
    // If the sizes do not overlap, since the vertices were not born as neighbours, the mean is taken.
    if shortest <= longest { [shortest, longest] } else { [0.5 * (shortest + longest); 2] }
}

pub(in crate::surface::remesh) fn is_long(stretch: f64) -> bool {
    stretch > TOO_LONG * TOO_LONG
}

pub(in crate::surface::remesh) fn is_short(stretch: f64) -> bool {
    stretch < TOO_SHORT * TOO_SHORT
}

/// Longest edge that is left alone (targets). The halves of a longer one, which is split, have at least 0.75: far from being collapsed.
pub(in crate::surface::remesh) const TOO_LONG: f64 = 1.5;

/// Shortest edge that is left alone (targets).
pub(in crate::surface::remesh) const TOO_SHORT: f64 = 0.5;
