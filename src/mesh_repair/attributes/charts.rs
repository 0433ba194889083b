//! Charts: where on the first mesh the liquid of new triangles was.

use rayon::prelude::*;

use super::GRAIN;
use super::weights::{Weights, blended, weights};
use crate::geometry::check::deviation::NearestTree;
use crate::geometry::mesh::attributes::{DetailedMesh, MeshArray, On};
use crate::geometry::{DVec3, TriMesh};
use crate::mesh_repair::Source;

/// A triangle is torn if its corners were farther apart at the first frame than this many times its longest edge plus a spacing: liquid that
/// was drawn together by less has a compressed texture.
pub(in crate::mesh_repair::attributes) const TORN: f64 = 3.0;

/// A new triangle that takes the values of the first frame.
pub(in crate::mesh_repair) struct Chart {
    /// Index of the triangle in the new mesh.
    pub number: usize,
    /// Index of each corner among the charts' vertices.
    pub slots: [usize; 3],
    /// A triangle of the first mesh, and the positions on it that are nearest to where the corners were.
    pub triangle: usize,
    pub corners: [Weights; 3],
    /// Whether its corners come from positions far apart.
    pub is_torn: bool,
}

/// All new triangles that take the values of the first frame.
pub(in crate::mesh_repair) struct Charts<'a> {
    pub first: &'a DetailedMesh,
    /// Ascending.
    pub list: Vec<Chart>,
    /// Vertices of the charted triangles in the new mesh, ascending.
    pub vertices: Vec<u32>,
    /// For each of these vertices, the position on the first mesh that is nearest to where its liquid was.
    pub spots: Vec<Spot>,
}

impl<'a> Charts<'a> {
    pub fn of(traced: &Traced<'a>, mesh: &TriMesh, sources: &[Source]) -> Self {
        let first = traced.first;
        let position = |vertex: u32| traced.positions.get(vertex as usize).copied().flatten();
        let known = |(number, source): (usize, &Source)| {
            let [a, b, c] = mesh.triangles[number].map(position);
            if *source == Source::New { Some((number, [a?, b?, c?])) } else { None }
        };
        let known: Vec<(usize, [DVec3; 3])> = match first.mesh.triangles.is_empty() {
            true => Vec::new(),
            false => sources.iter().enumerate().filter_map(known).collect(),
        };
        let mut out = Self { first, list: Vec::new(), vertices: Vec::new(), spots: Vec::new() };
        if known.is_empty() {
            return out;
        }
        let made;
        let tree = match traced.tree {
            Some(tree) => tree,
            None => {
                made = NearestTree::new(&first.mesh);
                &made
            }
        };
        let spot = |position: DVec3| {
            let triangle = tree.nearest(position).map_or(0, |nearest| nearest.triangle);
            Spot { triangle, weights: weights(&first.mesh.corners(triangle), position) }
        };
        out.vertices = known.iter().flat_map(|(number, _)| mesh.triangles[*number]).collect();
        out.vertices.sort_unstable();
        out.vertices.dedup();
        let of_vertex = |vertex: &u32| spot(position(*vertex).unwrap_or_default());
        out.spots = out.vertices.par_iter().with_min_len(GRAIN).map(of_vertex).collect();
        let chart = |(number, positions): &(usize, [DVec3; 3])| {
            let slots = mesh.triangles[*number].map(|vertex| out.slot(vertex));
            let max_distance = TORN * longest(&mesh.corners(*number)) + traced.spacing;
            let on_first = slots.map(|slot| out.position(&out.spots[slot]));
            let is_torn = longest(positions) > max_distance || longest(&on_first) > max_distance;
            let middle = (positions[0] + positions[1] + positions[2]) / 3.0;
            let triangle = spot(if is_torn { nearest_to(middle, positions) } else { middle }).triangle;
            let corners = first.mesh.corners(triangle);
            let corners = positions.map(|position| weights(&corners, position));
            Chart { number: *number, slots, triangle, corners, is_torn }
        };
        out.list = known.par_iter().with_min_len(GRAIN).map(chart).collect();
        out
    }

    /// Index of a vertex among the charts' vertices.
    pub fn slot(&self, vertex: u32) -> usize {
        self.vertices.partition_point(|other| *other < vertex)
    }

    /// The position of a spot (m).
    pub fn position(&self, spot: &Spot) -> DVec3 {
        self.at(spot.triangle, &spot.weights)
    }

    /// A position on a triangle of the first mesh (m).
    pub fn at(&self, triangle: usize, weights: &Weights) -> DVec3 {
        let [a, b, c] = self.first.mesh.corners(triangle);
        a * weights[0] + b * weights[1] + c * weights[2]
    }

    /// For each of the charts' vertices, whether it existed before, or a triangle without a chart uses it too.
    pub fn kept(&self, vertices: &[Option<u32>], triangles: &[[u32; 3]]) -> Vec<bool> {
        let mut is_kept: Vec<bool> = vertices.iter().map(Option::is_some).collect();
        for corners in self.others(triangles).map(|number| &triangles[number]) {
            corners.iter().for_each(|corner| is_kept[*corner as usize] = true);
        }
        self.vertices.iter().map(|vertex| is_kept[*vertex as usize]).collect()
    }

    /// Triangles without a chart, ascending.
    pub fn others(&self, triangles: &[[u32; 3]]) -> impl Iterator<Item = usize> {
        let mut charted = self.list.iter().map(|chart| chart.number).peekable();
        (0..triangles.len()).filter(move |number| charted.next_if_eq(number).is_none())
    }

    /// Writes the first mesh's values into the array with this index, if the first mesh has it too.
    pub fn fill(&self, n: usize, array: &mut MeshArray, is_kept: &[bool]) {
        let is_same =
            |own: &&MeshArray| own.name == array.name && own.on == array.on && own.number == array.number;
        let arrays = &self.first.arrays;
        let own = arrays.get(n).filter(is_same).or_else(|| arrays.iter().find(is_same));
        let Some(own) = own else { return };
        let (values, triangles) = (&mut array.values, &self.first.mesh.triangles);
        match own.on {
            On::Vertices => {
                let made =
                    self.vertices.iter().zip(&self.spots).zip(is_kept).filter(|(_, is_kept)| !**is_kept);
                for ((vertex, spot), _) in made {
                    values[*vertex as usize] = blended(own, triangles, spot.triangle, &spot.weights);
                }
            }
            On::Corners => {
                for chart in &self.list {
                    for (corner, weights) in chart.corners.iter().enumerate() {
                        values[3 * chart.number + corner] = blended(own, triangles, chart.triangle, weights);
                    }
                }
            }
            On::Faces => {
                self.list.iter().for_each(|chart| values[chart.number] = own.values[chart.triangle]);
            }
        }
    }
}

/// The longest edge of a triangle.
pub(in crate::mesh_repair) fn longest([a, b, c]: &[DVec3; 3]) -> f64 {
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

/// Origins of new geometry, with which [`carry_attributes`](crate::mesh_repair::carry_attributes) assigns the values of the first frame.
///
/// A new triangle takes these values if the positions of all three corners are known: the corners take the values at the positions of the
/// first mesh nearest to theirs, all on one side of a seam, and the triangle those of the triangle nearest to its middle. New vertices that
/// only such triangles use take the values at the nearest position. A vertex that other triangles use too keeps its texture coordinates in
/// them. Where the new ones are about the same, the new texture blends into them; where they are not, there is a seam, or, if coordinates
/// are stored at vertices, the triangle is marked.
#[derive(Clone, Copy)]
pub struct Traced<'a> {
    /// The mesh at the first frame, with the attributes that it had then.
    pub first: &'a DetailedMesh,
    /// A search tree of its triangles, for callers that make many changes; none: it is rebuilt each time.
    pub tree: Option<&'a NearestTree>,
    /// For each vertex of the new mesh, where the liquid there was at the first frame (m); none where that is unknown, and for vertices that
    /// no new triangle uses. Empty: unknown for all.
    pub positions: &'a [Option<DVec3>],
    /// Initial distance between particles (m).
    pub spacing: f64,
}

/// A position on the first mesh.
pub(in crate::mesh_repair) struct Spot {
    pub triangle: usize,
    pub weights: Weights,
}

/// The one of three positions that is nearest to another, the first of several.
fn nearest_to(middle: DVec3, [a, b, c]: &[DVec3; 3]) -> DVec3 {
    let far = |position: &DVec3| (position - middle).norm_squared();
    let nearer = if far(b) < far(a) { b } else { a };
    if far(c) < far(nearer) { *c } else { *nearer }
}
