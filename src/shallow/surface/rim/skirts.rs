//! Skirts: where the surface ends between wet columns, it comes down to the ground.
//!
//! An edge between two wet columns with a triangle on one side only lies between a full quartet and an odd one, or within odd ones. All
//! other edges are known to be closed, so few are examined.

use super::ledges::Ledges;
use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, NONE, STRIP};
use crate::shallow::surface::buffers::vertices::Vertices;
use crate::shallow::surface::quartets::links::{LiquidColumns, RING, cell_at};
use crate::shallow::surface::quartets::odd::Search;
use crate::shallow::surface::quartets::strips::{Found, neighbour, positions};
use crate::shallow::surface::rim::skirt_vertex::SkirtVertex;
use crate::shallow::surface::{Indices, Target};

/// The skirts of a surface; reuses its memory.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Skirts {
    /// Edges of odd quartets and of full ones beside them, between wet columns, in the direction of their triangles.
    edges: Vec<[u32; 2]>,
    /// For each column, the directions of such edges that start at it: a bit per position in the ring of cells around. All are 0 between
    /// calls.
    directions: Vec<u8>,
    /// Edges with a triangle on one side only, which get a skirt.
    open: Vec<[u32; 2]>,
    /// In the order in which they are appended to the mesh's vertices.
    pub(super) skirt_vertices: Vec<SkirtVertex>,
    /// Number of the first skirt vertex in the mesh.
    first: u32,
    /// For each column, the position of its skirt vertex, or [`NONE`].
    positions: Vec<u32>,
}

impl Skirts {
    /// Finds the edges that have a triangle on one side only. `first` is the number of the first skirt vertex in the mesh. Returns how many
    /// vertices and indices the skirts add.
    pub fn find(
        &mut self,
        liquid: LiquidColumns<'_>,
        found: &Found,
        search: &Search,
        ledges: Option<&Ledges>,
        first: u32,
    ) -> [usize; 2] {
        let len = liquid.columns.len();
        self.clear();
        self.first = first;
        let Self { edges, directions, open, skirt_vertices, positions, .. } = self;
        let Some(ledges) = ledges else { return [0; 2] };
        if directions.len() != len {
            reset(directions, len, 0);
            reset(positions, len, NONE);
        }
        // A column has at most eight directions: for the same count of columns nothing is allocated again.
        edges.reserve(8 * ledges.max_vertices);
        open.reserve(ledges.max_vertices);
        skirt_vertices.reserve(ledges.max_vertices);
        edges_of_full(liquid, found, |edge| edges.push(edge));
        let is_column = |id: u32| (id as usize) < len;
        for [a, b, c] in search.triangles() {
            edges.extend(
                [[a, b], [b, c], [c, a]].into_iter().filter(|edge| edge.iter().all(|&end| is_column(end))),
            );
        }
        edges.retain(|edge| edge.iter().all(|&end| liquid.is_wet(end as usize)));
        let direction = |edge: &[u32; 2]| direction(liquid.columns, *edge).unwrap_or(0);
        for edge in edges.iter() {
            directions[edge[0] as usize] |= 1 << direction(edge);
        }
        for edge in edges.iter() {
            let (at, back) = (direction(edge), (direction(edge) + 4) % 8);
            let has = |end: usize, direction: u8| directions[edge[end] as usize] >> direction & 1 == 1;
            if !has(0, at) || has(1, back) || !ends_within(liquid, *edge, at) {
                continue;
            }
            // Two triangles may have the same edge: add it once.
            directions[edge[0] as usize] &= !(1 << at);
            open.push(*edge);
            for (end, side) in edge.iter().zip(sides(at)) {
                let position = &mut positions[*end as usize];
                if *position == NONE {
                    *position = skirt_vertices.len() as u32;
                    skirt_vertices.push(SkirtVertex { column: *end, sides: [None; 4], rise: 0.0 });
                }
                skirt_vertices[*position as usize].sides[usize::from(side)] = Some(0.0);
            }
        }
        edges.iter().for_each(|[from, _]| directions[*from as usize] = 0);
        skirt_vertices.iter_mut().for_each(|skirt_vertex| ledges.reach(skirt_vertex));
        [skirt_vertices.len(), 6 * open.len()]
    }

    /// Writes the skirt vertices after all other vertices.
    pub fn write_vertices(&self, vertices: &Vertices<'_>, target: &mut Target<'_>) {
        for (vertex, skirt_vertex) in (self.first as usize..).zip(&self.skirt_vertices) {
            vertices.put_skirt_vertex(vertex, skirt_vertex, target);
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
    fn clear(&mut self) {
        self.skirt_vertices
            .iter()
            .for_each(|skirt_vertex| self.positions[skirt_vertex.column as usize] = NONE);
        self.edges.clear();
        self.open.clear();
        self.skirt_vertices.clear();
    }
}

/// Direction of an edge: the position of its end in the ring of cells around its start.
fn direction(columns: &Columns, [from, to]: [u32; 2]) -> Option<u8> {
    if from == NONE || to == NONE {
        return None;
    }
    let [from, to] = [from, to].map(|column| columns.cell(column as usize));
    RING.iter().position(|&step| cell_at(from, step) == to).map(|position| position as u8)
}

/// The side of each of two columns that lies to the right of the edge between them, where the surface is open. For a diagonal edge these
/// are the two sides that meet at the corner.
fn sides(direction: u8) -> [u8; 2] {
    let turns = if direction.is_multiple_of(2) { [6, 6] } else { [7, 5] };
    turns.map(|turn| (direction + turn) % 8 / 2)
}

/// Whether the cells to the right of an edge are in the domain: at its border the surface ends without a skirt.
fn ends_within(liquid: LiquidColumns<'_>, edge: [u32; 2], direction: u8) -> bool {
    let [nx, nz] = liquid.columns.grid.size;
    edge.iter().zip(sides(direction)).all(|(end, side)| {
        let [x, z] = cell_at(liquid.columns.cell(*end as usize), RING[usize::from(2 * side)]);
        x < nx && z < nz
    })
}

/// Calls `add` with the edges of full quartets beside quartets of the same layer that were searched and are not full.
fn edges_of_full(liquid: LiquidColumns<'_>, found: &Found, mut add: impl FnMut([u32; 2])) {
    let columns = liquid.columns;
    let full = |strip: Option<usize>| strip.map_or(0, |strip| found.states[strip].full);
    // The column at a position of a strip; a position of 16 is the first one of the strip to the east.
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
            |row: usize| std::iter::successors(liquid.lowest([row, along]), |&strip| liquid.above(strip));
        // To the north of a quartet, and to its south.
        for strip in row.checked_sub(1).into_iter().flat_map(layers) {
            let edge = neighbour(columns.south(strip));
            for position in positions(full(Some(strip)) & searched & !full(edge)) {
                join(edge.and_then(|edge| at(edge, position)), edge.and_then(|edge| at(edge, position + 1)));
            }
        }
        for strip in layers(row + 1) {
            for position in positions(full(Some(strip)) & searched & !full(neighbour(columns.north(strip)))) {
                join(at(strip, position + 1), at(strip, position));
            }
        }
        for strip in layers(row) {
            let (own, south) = (full(Some(strip)), neighbour(columns.south(strip)));
            let west = own << 1 | full(columns.west(strip)) >> 15;
            for position in positions(west & searched & !own) {
                join(south.and_then(|south| at(south, position)), at(strip, position));
            }
            let east = own >> 1 & 0x7fff & searched & !own;
            for position in positions(east) {
                join(at(strip, position + 1), south.and_then(|south| at(south, position + 1)));
            }
        }
        // Full quartets to the east of the block, on layers that the block itself may lack.
        if searched >> 15 == 1 {
            let layers = std::iter::successors(liquid.lowest([row, along + 1]), |&strip| liquid.above(strip));
            for strip in
                layers.filter(|&strip| full(Some(strip)) & 1 & !(full(columns.west(strip)) >> 15) == 1)
            {
                join(at(strip, 0), neighbour(columns.south(strip)).and_then(|south| at(south, 0)));
            }
        }
    }
}
