//! Skirts: where the surface ends at a ledge, it comes down to the ground's edge.

use super::ledges::Ledges;
use super::links::{RING, Scene};
use super::strips::Found;
use super::vertices::Vertices;
use super::{Indices, NONE, STRIP, Target};

/// The skirts of a surface; keeps its memory.
#[derive(Debug, Default)]
pub(super) struct Skirts {
    /// Ledges that have one, by place.
    edges: Vec<u32>,
    /// The vertex of each hem, or [`NONE`].
    vertices: Vec<u32>,
}

impl Skirts {
    /// Finds the ledges with wet columns, behind which no liquid is linked with both; the first hem is vertex `first`. Returns the counts of
    /// vertices and of indices.
    pub fn find(
        &mut self,
        scene: Scene<'_>,
        found: &Found,
        ledges: Option<&Ledges>,
        first: u32,
    ) -> [usize; 2] {
        self.edges.clear();
        self.vertices.clear();
        let Some(ledges) = ledges else { return [0; 2] };
        self.edges.reserve(ledges.edges.len());
        self.vertices.resize(ledges.hems.len(), NONE);
        for (at, ledge) in ledges.edges.iter().enumerate() {
            let columns = ledge.hems.map(|hem| ledges.hems[hem as usize].column as usize);
            let [a, b] = columns;
            let is_vertex = |column: usize| found.states[column / STRIP].used >> (column % STRIP) & 1 == 1;
            let is_shown = |column: usize| scene.is_wet(column) && is_vertex(column);
            if !columns.into_iter().all(is_shown) || !scene.are_linked(a, b) {
                continue;
            }
            let beside = |end: usize| scene.wet_beside(columns[end], RING[usize::from(ledge.beyond[end])]);
            // The surface goes on there: to one column, or to two that are linked.
            if let (Some(c), Some(d)) = (beside(0), beside(1))
                && (c == d || scene.are_linked(c, d))
            {
                continue;
            }
            self.edges.push(at as u32);
            ledge.hems.into_iter().for_each(|hem| self.vertices[hem as usize] = 0);
        }
        let mut next = first;
        for vertex in self.vertices.iter_mut().filter(|vertex| **vertex != NONE) {
            *vertex = next;
            next += 1;
        }
        [(next - first) as usize, 6 * self.edges.len()]
    }

    /// Writes the hems behind all other vertices.
    pub fn write_hems(&self, ledges: Option<&Ledges>, vertices: &Vertices<'_>, target: &mut Target<'_>) {
        let Some(ledges) = ledges else { return };
        for (hem, &vertex) in ledges.hems.iter().zip(&self.vertices).filter(|(_, vertex)| **vertex != NONE) {
            vertices.put_hem(vertex as usize, hem, target);
        }
    }

    /// Writes the triangles behind `at` indices; `flipped`: clockwise seen from outside.
    pub fn write_triangles(
        &self,
        ledges: Option<&Ledges>,
        found: &Found,
        at: usize,
        flipped: bool,
        out: &mut Indices<'_>,
    ) {
        let Some(ledges) = ledges else { return };
        match out {
            Indices::None => {}
            Indices::U16(out) => self.put(ledges, found, flipped, &mut out[at..], |vertex| vertex as u16),
            Indices::U32(out) => self.put(ledges, found, flipped, &mut out[at..], |vertex| vertex),
        }
    }

    fn put<I>(&self, ledges: &Ledges, found: &Found, flipped: bool, out: &mut [I], index: impl Fn(u32) -> I) {
        let mut out = out.as_chunks_mut::<3>().0.iter_mut();
        for &edge in &self.edges {
            let hems = ledges.edges[edge as usize].hems;
            let [a, b] = hems.map(|hem| {
                let column = ledges.hems[hem as usize].column as usize;
                found.vertex(column / STRIP, column % STRIP)
            });
            let [c, d] = hems.map(|hem| self.vertices[hem as usize]);
            for (corners, out) in [[b, a, c], [b, c, d]].into_iter().zip(&mut out) {
                let [p, q, r] = corners;
                *out = if flipped { [p, r, q] } else { corners }.map(&index);
            }
        }
    }
}
