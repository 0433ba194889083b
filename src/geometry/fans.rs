//! The triangles around the vertices of a closed mesh that is changed by edge splits, collapses and flips. It stays a closed 2-manifold by
//! index: two neighbours are merged only if the link condition holds (Dey, Edelsbrunner, Guha and Nekhayev 1999, "Topology preserving edge
//! contraction").

use super::lists::Lists;

/// The slot of a vertex around which no triangle was added or removed.
const NONE: u32 = u32::MAX;

/// The corners of the triangles a b c and b a d after their common edge was flipped.
pub fn flipped([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[c, a, d], [d, b, c]]
}

/// The triangles around vertices.
pub struct Fans {
    /// Triangles around each input vertex, ascending.
    first: Lists<u32>,
    /// For each vertex, the index of its triangles in `own`; [`NONE`]: they are those of the input.
    slots: Vec<u32>,
    /// Triangles around vertices where some were added or removed, in no order.
    own: Vec<Vec<u32>>,
    /// For each triangle, whether a collapse has removed it.
    is_dead: Vec<bool>,
}

impl Fans {
    /// The triangles around the wanted vertices; those around other vertices must not change. Takes two passes over all triangles.
    pub fn of(vertices: usize, triangles: &[[u32; 3]], is_wanted: impl Fn(u32) -> bool) -> Self {
        let of_triangle = |(corners, triangle): (&[u32; 3], u32)| corners.map(|corner| (corner, triangle));
        let uses = triangles.iter().zip(0..).flat_map(of_triangle);
        let first = Lists::new(vertices, uses.filter(|(corner, _)| is_wanted(*corner)));
        Self { first, slots: vec![NONE; vertices], own: Vec::new(), is_dead: vec![false; triangles.len()] }
    }

    /// For each triangle, whether a collapse has removed it.
    pub fn are_dead(&self) -> &[bool] {
        &self.is_dead
    }

    /// The triangles around a vertex; none if it was merged into another, or is not wanted.
    pub fn around(&self, vertex: u32) -> &[u32] {
        let at = vertex as usize;
        self.own.get(self.slots[at] as usize).map_or_else(|| self.first.get(at), Vec::as_slice)
    }

    /// The neighbours of a vertex, ascending.
    pub fn ring(&self, triangles: &[[u32; 3]], vertex: u32) -> Vec<u32> {
        let corners = self.around(vertex).iter().flat_map(|&triangle| triangles[triangle as usize]);
        let mut ring: Vec<u32> = corners.filter(|&corner| corner != vertex).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// Whether two vertices are neighbours.
    pub fn are_neighbours(&self, triangles: &[[u32; 3]], a: u32, b: u32) -> bool {
        self.around(a).iter().any(|&triangle| triangles[triangle as usize].contains(&b))
    }

    /// Whether two neighbours may be merged: their only common neighbours are the two corners opposite their edge, and each of these, which
    /// loses a triangle, keeps at least three. That also preserves tetrahedra.
    pub fn may_join(&self, triangles: &[[u32; 3]], a: u32, b: u32) -> bool {
        let [mut shared, other] = [a, b].map(|vertex| self.ring(triangles, vertex));
        shared.retain(|vertex| other.binary_search(vertex).is_ok());
        shared.len() == 2 && shared.iter().all(|&corner| self.around(corner).len() > 3)
    }

    /// The triangles around a vertex that a collapse merges into `to`, and if this moves `to`, those around it.
    pub fn moving(
        &self,
        triangles: &[[u32; 3]],
        [from, to]: [u32; 2],
        is_moved: bool,
    ) -> impl Iterator<Item = u32> {
        let around = if is_moved { self.around(to) } else { &[] };
        let others = around.iter().filter(move |&&triangle| !triangles[triangle as usize].contains(&from));
        self.around(from).iter().chain(others).copied()
    }

    /// Adds a vertex on the common edge of triangles `one` (a b c) and `two` (b a d). `one` keeps corner a and `two` corner b; the new
    /// triangles `three` and `four` have corners b and a.
    pub fn split(&mut self, [one, two]: [u32; 2], [three, four]: [u32; 2], [a, b, c, d]: [u32; 4]) {
        self.slots.push(self.own.len() as u32);
        self.own.push(vec![one, two, three, four]);
        self.is_dead.extend([false; 2]);
        self.remove(a, two);
        self.remove(b, one);
        for (vertex, triangle) in [(a, four), (b, three), (c, three), (d, four)] {
            self.add(vertex, triangle);
        }
    }

    /// Updates the lists after a flip of the common edge of triangles `one` (a b c) and `two` (b a d): see [`flipped`].
    pub fn flip(&mut self, [one, two]: [u32; 2], [a, b, c, d]: [u32; 4]) {
        self.remove(a, two);
        self.remove(b, one);
        self.add(c, two);
        self.add(d, one);
    }

    /// Merges a vertex into a neighbour.
    pub fn collapse(&mut self, triangles: &mut [[u32; 3]], [from, to]: [u32; 2]) {
        for triangle in std::mem::take(self.own_mut(from)) {
            let corners = &mut triangles[triangle as usize];
            if corners.contains(&to) {
                self.is_dead[triangle as usize] = true;
                corners.iter().for_each(|&corner| self.remove(corner, triangle));
            } else {
                *corners = corners.map(|corner| if corner == from { to } else { corner });
                self.add(to, triangle);
            }
        }
    }

    /// The triangles around a vertex, for modification.
    fn own_mut(&mut self, vertex: u32) -> &mut Vec<u32> {
        let at = vertex as usize;
        if self.slots[at] == NONE {
            let own = self.around(vertex).to_vec();
            self.slots[at] = self.own.len() as u32;
            self.own.push(own);
        }
        &mut self.own[self.slots[at] as usize]
    }

    fn add(&mut self, vertex: u32, triangle: u32) {
        self.own_mut(vertex).push(triangle);
    }

    fn remove(&mut self, vertex: u32, triangle: u32) {
        self.own_mut(vertex).retain(|&other| other != triangle);
    }
}
