//! One triangle mesh of the surface of fine and coarse cells, without a crack between them.
//!
//! The meshes of both liquids ([`crate::shallow::surface`]) end at the centres of their outermost columns. The strip of 1.5 fine cells
//! between them is stitched from vertex to vertex: a triangle on each coarse column and its two fine ones, two between it and the next, and
//! one at each corner of the near cells (`stitches.rs`). Columns are linked across it as within a liquid. A column of the strip that has no
//! vertex in either mesh gets one (`added_vertices.rs`). Where a surface ends at a wall beyond the edge, it ends at the column before the
//! wall.

mod added_vertices;
mod stitches;

use super::Detail;
use crate::error::Result;
use crate::shallow::columns::NONE;
use crate::shallow::surface::{self, Counts, Depths, Indices, Layout, Target};
use added_vertices::AddedVertices;
use stitches::Stitches;

/// The maximum counts that the surface of any liquid in these columns can have.
pub fn bound(detail: &Detail) -> Counts {
    let [fine, coarse] = [&detail.fine, &detail.coarse].map(|liquid| surface::bound(&liquid.columns));
    let [added, triangles] = stitches::bound(detail);
    Counts {
        vertices: fine.vertices + coarse.vertices + added,
        extras: fine.extras + coarse.extras,
        indices: fine.indices + coarse.indices + 3 * triangles,
    }
}

/// Builds surfaces; reuses its memory.
#[derive(Debug, Default)]
pub struct Surface {
    /// Of fine and of coarse cells.
    liquids: [surface::Surface; 2],
    /// Columns of the vertices of both meshes.
    columns: [Vec<u32>; 2],
    /// Vertex indices of the coarse mesh, starting from 0.
    indices: Vec<u32>,
    stitches: Stitches,
    added: AddedVertices,
}

impl Surface {
    /// Reserves memory for any liquid: from then on [`Surface::build`] allocates nothing until the near cells or the ground change.
    pub fn reserve(&mut self, detail: &Detail) {
        let liquids = [&detail.fine, &detail.coarse];
        for ((own, liquid), columns) in self.liquids.iter_mut().zip(liquids).zip(&mut self.columns) {
            own.reserve(&liquid.columns);
            columns.clear();
            columns.reserve(surface::bound(&liquid.columns).vertices);
        }
        self.indices.clear();
        self.indices.reserve(surface::bound(&detail.coarse.columns).indices);
        let [added, triangles] = stitches::bound(detail);
        let [fine, coarse] = liquids.map(|liquid| liquid.columns.layers());
        self.stitches.reserve(triangles, fine.max(coarse));
        self.added.reserve(added, triangles);
    }

    /// Size of the mesh that [`Surface::build`] would write. `depths` are those of the fine liquid and of the coarse one; their ledges are
    /// ignored.
    ///
    /// # Errors
    /// As [`Surface::build`], for the depths.
    pub fn count(&mut self, detail: &Detail, depths: [&Depths<'_>; 2]) -> Result<Counts> {
        let depths = depths.map(without_ledges);
        let depths = depths.each_ref();
        let both = self.find(detail, depths)?;
        Ok(self.sum(both))
    }

    /// Writes the mesh and returns its size, at most [`bound`]. The vertices of fine cells come first, then those of coarse ones, then
    /// those of the strip between them. [`Target::columns`] are indices of the fine columns, followed by those of the coarse ones, which
    /// start at the count of the fine ones, `detail.fine().columns().len()`.
    ///
    /// # Errors
    /// As [`surface::Surface::build`]: nothing is written.
    pub fn build(
        &mut self,
        detail: &Detail,
        depths: [&Depths<'_>; 2],
        layout: &Layout,
        target: &mut Target<'_>,
    ) -> Result<Counts> {
        layout.validate()?;
        let depths = depths.map(without_ledges);
        let depths = depths.each_ref();
        depths.iter().try_for_each(|depths| target.check_wanted(depths))?;
        let both = self.find(detail, depths)?;
        let counts = self.sum(both);
        target.check(&counts)?;
        let [fine, coarse] = both;
        let Self { liquids, columns, indices, stitches, added } = self;
        liquids[0].build(&detail.fine.columns, depths[0], layout, target)?;
        indices.resize(coarse.indices, 0);
        let mut coarse_target = skip_vertices(target, fine.vertices);
        coarse_target.indices = Indices::U32(indices);
        liquids[1].build(&detail.coarse.columns, depths[1], layout, &mut coarse_target)?;
        let first_added = fine.vertices + coarse.vertices;
        added.write(detail, depths, layout, stitches, &mut skip_vertices(target, first_added));
        if let Some(out) = &mut target.columns {
            let first = detail.fine.columns.len() as u32;
            let coarse = columns[1].iter().map(|&column| if column == NONE { NONE } else { first + column });
            let ids = coarse.chain(stitches.added.iter().copied());
            out[fine.vertices..].iter_mut().zip(ids).for_each(|(out, column)| *out = column);
        }
        let coarse = indices.iter().map(|vertex| fine.vertices as u32 + vertex);
        let stitched = stitches.indices.as_chunks::<3>().0.iter();
        let stitched = stitched.flat_map(|&[a, b, c]| if layout.left_handed { [a, c, b] } else { [a, b, c] });
        put_indices(coarse.chain(stitched), fine.indices, &mut target.indices);
        Ok(counts)
    }

    /// Finds the sizes of both meshes, and the strip between them.
    fn find(&mut self, detail: &Detail, depths: [&Depths<'_>; 2]) -> Result<[Counts; 2]> {
        let liquids = [&detail.fine, &detail.coarse];
        let mut both = [Counts::default(); 2];
        for at in 0..2 {
            let columns = &liquids[at].columns;
            both[at] = self.liquids[at].count(columns, depths[at])?;
            self.columns[at].resize(both[at].vertices, 0);
            let mut target = Target { columns: Some(&mut self.columns[at]), ..Target::default() };
            self.liquids[at].build(columns, depths[at], &Layout::default(), &mut target)?;
        }
        self.stitches.find(detail, depths.map(|depths| depths.depth), self.columns.each_ref(), both);
        Ok(both)
    }

    fn sum(&self, [fine, coarse]: [Counts; 2]) -> Counts {
        Counts {
            vertices: fine.vertices + coarse.vertices + self.stitches.added.len(),
            extras: fine.extras + coarse.extras,
            indices: fine.indices + coarse.indices + self.stitches.indices.len(),
        }
    }
}

/// Drops ledges: they belong to one liquid's columns, but along the edge of the near cells its surface continues.
fn without_ledges<'a>(depths: &Depths<'a>) -> Depths<'a> {
    Depths { ledges: None, ..*depths }
}

/// The part of a target after its first vertices, without `indices` and `columns`.
fn skip_vertices<'t>(target: &'t mut Target<'_>, first: usize) -> Target<'t> {
    let Target { positions, normals, depths, opacities, velocities, carried, layers, .. } = target;
    Target {
        positions: positions.as_deref_mut().map(|out| &mut out[3 * first..]),
        normals: normals.as_deref_mut().map(|out| &mut out[3 * first..]),
        depths: depths.as_deref_mut().map(|out| &mut out[first..]),
        opacities: opacities.as_deref_mut().map(|out| &mut out[first..]),
        velocities: velocities.as_deref_mut().map(|out| &mut out[3 * first..]),
        carried: carried.each_mut().map(|out| out.as_deref_mut().map(|out| &mut out[first..])),
        layers: layers.as_deref_mut().map(|out| &mut out[first..]),
        columns: None,
        indices: Indices::None,
    }
}

/// Writes vertex indices, starting at a position.
fn put_indices(indices: impl Iterator<Item = u32>, first: usize, out: &mut Indices<'_>) {
    match out {
        Indices::None => {}
        Indices::U16(out) => {
            out[first..].iter_mut().zip(indices).for_each(|(out, index)| *out = index as u16);
        }
        Indices::U32(out) => out[first..].iter_mut().zip(indices).for_each(|(out, index)| *out = index),
    }
}
