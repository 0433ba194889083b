//! Skirts: where the surface ends between wet columns, it comes down to the ground.
//!
//! An edge between two wet columns with a triangle on one side only lies between a full quartet and an odd one, or within odd ones. All
//! other edges are known to be closed, so few are examined.

use super::ledges::Ledges;
use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, NONE, STRIP};
use crate::shallow::surface::buffers::vertices::Vertices;
use crate::shallow::surface::quartets::links::{RING, Scene, cell_at};
use crate::shallow::surface::quartets::odd::Search;
use crate::shallow::surface::quartets::strips::{Found, positions, some};
use crate::shallow::surface::rim::hem::Hem;
use crate::shallow::surface::{Indices, Target};

/// The skirts of a surface; reuses its memory.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Skirts {
    /// Edges of odd quartets and of full ones beside them, between wet columns, in the direction of their triangles.
    edges: Vec<[u32; 2]>,
    /// For each column, the directions of such edges from it: a bit per position of the ring of cells around. Reset to 0 between surfaces.
    ways: Vec<u8>,
    /// The edges that have a skirt.
    open: Vec<[u32; 2]>,
    /// Hems, in order of their vertices, and the first of these.
    pub(super) hems: Vec<Hem>,
    first: u32,
    /// For each column, the position of its hem, or [`NONE`], to which all are reset between surfaces.
    positions: Vec<u32>,
}

impl Skirts {
    /// Finds the edges that have a triangle on one side only; the first hem is vertex `first`. Returns the counts of vertices and indices.
    pub fn find(
        &mut self,
        scene: Scene<'_>,
        found: &Found,
        search: &Search,
        ledges: Option<&Ledges>,
        first: u32,
    ) -> [usize; 2] {
        let len = scene.columns.len();
        self.forget();
        self.first = first;
        let Self { edges, ways, open, hems, positions, .. } = self;
        let Some(ledges) = ledges else { return [0; 2] };
        if ways.len() != len {
            reset(ways, len, 0);
            reset(positions, len, NONE);
        }
        // For the same count of columns nothing is allocated again: a column has at most eight directions.
        edges.reserve(8 * ledges.most);
        open.reserve(ledges.most);
        hems.reserve(ledges.most);
        edges_of_full(scene, found, |edge| edges.push(edge));
        let is_column = |id: u32| (id as usize) < len;
        for [a, b, c] in search.triangles() {
            edges.extend(
                [[a, b], [b, c], [c, a]].into_iter().filter(|edge| edge.iter().all(|&end| is_column(end))),
            );
        }
        edges.retain(|edge| edge.iter().all(|&end| scene.is_wet(end as usize)));
        let way = |edge: &[u32; 2]| way(scene.columns, *edge).unwrap_or(0);
        for edge in edges.iter() {
            ways[edge[0] as usize] |= 1 << way(edge);
        }
        for edge in edges.iter() {
            let (at, back) = (way(edge), (way(edge) + 4) % 8);
            let has = |end: usize, way: u8| ways[edge[end] as usize] >> way & 1 == 1;
            if !has(0, at) || has(1, back) || !ends_within(scene, *edge, at) {
                continue;
            }
            // Once, if two triangles have it.
            ways[edge[0] as usize] &= !(1 << at);
            open.push(*edge);
            for (end, side) in edge.iter().zip(sides(at)) {
                let position = &mut positions[*end as usize];
                if *position == NONE {
                    *position = hems.len() as u32;
                    hems.push(Hem { column: *end, sides: [None; 4], rise: 0.0 });
                }
                hems[*position as usize].sides[usize::from(side)] = Some(0.0);
            }
        }
        edges.iter().for_each(|[from, _]| ways[*from as usize] = 0);
        hems.iter_mut().for_each(|hem| ledges.reach(hem));
        [hems.len(), 6 * open.len()]
    }

    /// Writes the hems after all other vertices.
    pub fn write_hems(&self, vertices: &Vertices<'_>, target: &mut Target<'_>) {
        for (vertex, hem) in (self.first as usize..).zip(&self.hems) {
            vertices.put_hem(vertex, hem, target);
        }
    }

    /// Writes the triangles after `at` indices; `flipped`: clockwise seen from outside.
    pub fn write_triangles(&self, found: &Found, at: usize, flipped: bool, out: &mut Indices<'_>) {
        match out {
            Indices::None => {}
            Indices::U16(out) => self.put(found, flipped, &mut out[at..], |vertex| vertex as u16),
            Indices::U32(out) => self.put(found, flipped, &mut out[at..], |vertex| vertex),
        }
    }

    fn put<I>(&self, found: &Found, flipped: bool, out: &mut [I], index: impl Fn(u32) -> I) {
        let mut out = out.as_chunks_mut::<3>().0.iter_mut();
        for edge in &self.open {
            let [a, b] = edge.map(|end| found.vertex(end as usize / STRIP, end as usize % STRIP));
            let [c, d] = edge.map(|end| self.first + self.positions[end as usize]);
            for (corners, out) in [[b, a, c], [b, c, d]].into_iter().zip(&mut out) {
                let [p, q, r] = corners;
                *out = if flipped { [p, r, q] } else { corners }.map(&index);
            }
        }
    }

    /// Clears the previous surface.
    fn forget(&mut self) {
        self.hems.iter().for_each(|hem| self.positions[hem.column as usize] = NONE);
        self.edges.clear();
        self.open.clear();
        self.hems.clear();
    }
}

/// Position, in the ring of cells around a column, of another column.
fn way(columns: &Columns, [from, to]: [u32; 2]) -> Option<u8> {
    if from == NONE || to == NONE {
        return None;
    }
    let [from, to] = [from, to].map(|column| columns.cell(column as usize));
    RING.iter().position(|&step| cell_at(from, step) == to).map(|way| way as u8)
}

/// The side to the right of a step between two columns, for each of them: nothing is there. For a diagonal step it is the corner between
/// both.
fn sides(way: u8) -> [u8; 2] {
    let turns = if way.is_multiple_of(2) { [6, 6] } else { [7, 5] };
    turns.map(|turn| (way + turn) % 8 / 2)
}

/// Whether the cells to the right of an edge are in the domain: at its border the surface ends without a skirt.
fn ends_within(scene: Scene<'_>, edge: [u32; 2], way: u8) -> bool {
    let [nx, nz] = scene.columns.grid.size;
    edge.iter().zip(sides(way)).all(|(end, side)| {
        let [x, z] = cell_at(scene.columns.cell(*end as usize), RING[usize::from(2 * side)]);
        x < nx && z < nz
    })
}

/// Calls `add` with the edges of full quartets beside quartets of the same layer that were searched and are not full.
fn edges_of_full(scene: Scene<'_>, found: &Found, mut add: impl FnMut([u32; 2])) {
    let columns = scene.columns;
    let full = |strip: Option<usize>| strip.map_or(0, |strip| found.states[strip].full);
    // A column at a position of a strip, or the first one of the strip to the east.
    let at = |strip: usize, position: usize| match position {
        STRIP => columns.east(strip).map(|east| (east * STRIP) as u32),
        _ => Some((strip * STRIP + position) as u32),
    };
    let mut join = |from: Option<u32>, to: Option<u32>| {
        if let (Some(from), Some(to)) = (from, to) {
            add([from, to]);
        }
    };
    for block in found.odd.iter() {
        let searched = found.blocks[block].searched;
        let (row, along) = (block / found.across, block % found.across);
        let layers =
            |row: usize| std::iter::successors(scene.lowest([row, along]), |&strip| scene.above(strip));
        // To the north of a quartet, and to its south.
        for strip in row.checked_sub(1).into_iter().flat_map(layers) {
            let edge = some(columns.south(strip));
            for position in positions(full(Some(strip)) & searched & !full(edge)) {
                join(edge.and_then(|edge| at(edge, position)), edge.and_then(|edge| at(edge, position + 1)));
            }
        }
        for strip in layers(row + 1) {
            for position in positions(full(Some(strip)) & searched & !full(some(columns.north(strip)))) {
                join(at(strip, position + 1), at(strip, position));
            }
        }
        for strip in layers(row) {
            let (own, south) = (full(Some(strip)), some(columns.south(strip)));
            let west = own << 1 | full(columns.west(strip)) >> 15;
            for position in positions(west & searched & !own) {
                join(south.and_then(|south| at(south, position)), at(strip, position));
            }
            let east = own >> 1 & 0x7fff & searched & !own;
            for position in positions(east) {
                join(at(strip, position + 1), south.and_then(|south| at(south, position + 1)));
            }
        }
        // Over the block's east side, where there may be no strip of the layer in it.
        if searched >> 15 == 1 {
            let layers = std::iter::successors(scene.lowest([row, along + 1]), |&strip| scene.above(strip));
            for strip in
                layers.filter(|&strip| full(Some(strip)) & 1 & !(full(columns.west(strip)) >> 15) == 1)
            {
                join(at(strip, 0), some(columns.south(strip)).and_then(|south| at(south, 0)));
            }
        }
    }
}
