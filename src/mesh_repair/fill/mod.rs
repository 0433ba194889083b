//! The surface inside a set of cells: marching cubes, sewn to the cut around it.
//!
//! On a face between two cells of the set, the surface runs as in [`crate::geometry::marching_cubes`]; on an outer face it follows the cut
//! point by point. In each cell these paths join to rings, which are filled with triangles. Two cells have the same points on their common
//! face, and so have cells and cut on outer faces: the result is closed.

pub(in crate::mesh_repair) mod holes;

use super::cut::exact::{GridEdge, GridFace, Point, cells_around};
use super::cut::{Cut, Shape, Trouble};
use super::region::{CellSet, Inside};
use crate::geometry::Coord;
use crate::geometry::marching_cubes::{Edge, FACES, cases, filled, lines};

/// Minimum distance of a rebuilt surface from a node along an edge of the grid (cells): below it, triangles would be slivers.
const NEAR: f64 = 0.02;

/// The rebuilt surface.
#[derive(Default)]
pub struct Fill {
    pub triangles: Vec<[Point; 3]>,
    /// Positions of points that are not on the mesh, as fractions of the grid edges on which they lie; ascending.
    pub shares: Vec<(GridEdge, f64)>,
    /// The middles of rings, ascending, each with the ring's points.
    pub middles: Vec<(Point, Vec<Point>)>,
}

/// The paths of the cut on outer faces, from grid edge to grid edge.
pub struct Rim {
    /// Ascending by face.
    paths: Vec<(GridFace, Vec<Point>)>,
}

impl Rim {
    /// Joins the segments of a cut.
    ///
    /// # Errors
    /// The cells beyond the faces on which the segments form a closed ring or do not join.
    pub fn of(cut: &Cut, set: &CellSet) -> Result<Self, Trouble> {
        let (mut paths, mut trouble) = (Vec::new(), Vec::new());
        for segments in cut.rim.chunk_by(|a, b| a.0 == b.0) {
            let face = segments[0].0;
            match joined(segments) {
                Some(joined) => paths.extend(joined.into_iter().map(|path| (face, path))),
                None => trouble.extend(
                    super::cut::exact::cells_beside(face).into_iter().filter(|cell| !set.holds(*cell)),
                ),
            }
        }
        if trouble.is_empty() { Ok(Self { paths }) } else { Err(Trouble(trouble)) }
    }

    fn on(&self, face: GridFace) -> &[(GridFace, Vec<Point>)] {
        let first = self.paths.partition_point(|(other, _)| *other < face);
        let count = self.paths[first..].iter().take_while(|(other, _)| *other == face).count();
        &self.paths[first..first + count]
    }
}

/// Paths from one grid edge to another; none if the segments of a face, ascending by their first points, do not join to such paths.
fn joined(segments: &[(GridFace, [Point; 2])]) -> Option<Vec<Vec<Point>>> {
    if segments.windows(2).any(|pair| pair[0].1[0] == pair[1].1[0]) {
        return None;
    }
    let is_end = |point: Point| matches!(point, Point::OnTriangle(..));
    let mut paths = Vec::new();
    let mut used = 0;
    for (_, [from, _]) in segments.iter().filter(|(_, ends)| is_end(ends[0])) {
        let mut path = vec![*from];
        loop {
            let at = segments.binary_search_by(|(_, ends)| ends[0].cmp(path.last().unwrap_or(from))).ok()?;
            used += 1;
            let to = segments[at].1[1];
            path.push(to);
            if is_end(to) {
                break;
            }
            if path.len() > segments.len() + 1 {
                return None;
            }
        }
        paths.push(path);
    }
    (used == segments.len()).then_some(paths)
}

/// Fills a set of cells.
///
/// # Errors
/// Cells in which the paths do not join to rings.
pub fn fill(shape: &Shape, set: &CellSet, inside: &impl Inside, rim: &Rim) -> Result<Fill, Trouble> {
    let mut out = Fill::default();
    let mut trouble = Vec::new();
    for cell in set.iter() {
        let cube = Cube { shape, set, inside, rim, cell };
        if cube.fill(&mut out).is_none() {
            trouble.push(cell);
        }
    }
    out.shares.sort_unstable_by_key(|share| share.0);
    out.shares.dedup_by_key(|share| share.0);
    out.middles.sort_unstable_by_key(|middle| middle.0);
    if trouble.is_empty() { Ok(out) } else { Err(Trouble(trouble)) }
}

/// A cell that is filled.
struct Cube<'a, I> {
    shape: &'a Shape,
    set: &'a CellSet,
    inside: &'a I,
    rim: &'a Rim,
    cell: Coord,
}

impl<I: Inside> Cube<'_, I> {
    /// The edge of the grid that is an edge of the cube.
    fn edge(&self, (corner, axis): Edge) -> GridEdge {
        (axis, self.node(corner))
    }

    fn node(&self, corner: usize) -> Coord {
        [0, 1, 2].map(|axis| self.cell[axis] + (corner >> (2 - axis) & 1) as i32)
    }

    /// Where the surface crosses an edge of the cube; on an outer edge, where the mesh does.
    fn point(&self, edge: Edge, out: &mut Fill) -> Option<Point> {
        let edge = self.edge(edge);
        if cells_around(edge).iter().all(|cell| self.set.holds(*cell)) {
            out.shares.push((edge, self.share(edge).clamp(NEAR, 1.0 - NEAR)));
            return Some(Point::OnGrid(edge));
        }
        match self.shape.pierces.on(edge) {
            [one] => Some(Point::OnTriangle(one.triangle, edge)),
            _ => None,
        }
    }

    /// Where the surface crosses an inner edge: where `inside` puts it, or where the mesh's winding number passes 0.
    fn share(&self, edge: GridEdge) -> f64 {
        if let Some(share) = self.inside.share(edge) {
            return share;
        }
        let mut winding = self.shape.pierces.winding(edge.1);
        let mut through = Vec::new();
        for pierce in self.shape.pierces.on(edge) {
            let next = winding + pierce.change;
            if (winding > 0) != (next > 0) {
                through.push(pierce.share);
            }
            winding = next;
        }
        through.get(through.len() / 2).copied().unwrap_or(0.5)
    }

    fn fill(&self, out: &mut Fill) -> Option<()> {
        let case =
            (0..8).fold(0, |case, corner| case | usize::from(self.inside.at(self.node(corner))) << corner);
        let is_outer: [bool; 6] = std::array::from_fn(|face| {
            let mut beside = self.cell;
            beside[face / 2] += if face % 2 == 0 { -1 } else { 1 };
            !self.set.holds(beside)
        });
        if is_outer == [false; 6] {
            for triangle in &cases()[case] {
                let [a, b, c] = triangle.map(|edge| self.point(edge, out));
                out.triangles.push([a?, b?, c?]);
            }
            return Some(());
        }
        let mut paths: Vec<Vec<Point>> = Vec::new();
        for (face, corners) in FACES.iter().enumerate() {
            if is_outer[face] {
                let mut behind = self.cell;
                behind[face / 2] += (face % 2) as i32;
                paths.extend(self.rim.on((face / 2, behind)).iter().map(|(_, path)| path.clone()));
            } else {
                for [from, to] in lines(case, corners) {
                    paths.push(vec![self.point(from, out)?, self.point(to, out)?]);
                }
            }
        }
        let rings = rings(paths)?;
        for (ring, number) in rings.into_iter().zip(0..) {
            self.fill_ring(ring, number, out);
        }
        Some(())
    }

    fn fill_ring(&self, ring: Vec<Point>, number: u32, out: &mut Fill) {
        let on_edges: Option<Vec<Edge>> = ring.iter().map(|point| self.edge_of(*point)).collect();
        let flat = on_edges.as_ref().and_then(|edges| filled(edges).map(|triangles| (edges, triangles)));
        if let Some((edges, triangles)) = flat {
            let point =
                |edge: Edge| edges.iter().position(|other| *other == edge).map_or(ring[0], |at| ring[at]);
            out.triangles.extend(triangles.into_iter().map(|corners| corners.map(point)));
            return;
        }
        let middle = Point::Middle(self.cell, number);
        let next = ring.iter().cycle().skip(1);
        out.triangles.extend(ring.iter().zip(next).map(|(from, to)| [*from, *to, middle]));
        out.middles.push((middle, ring));
    }

    /// The edge of the cube on which a point lies; none if it lies inside a face.
    fn edge_of(&self, point: Point) -> Option<Edge> {
        let (Point::OnTriangle(_, (axis, node)) | Point::OnGrid((axis, node))) = point else { return None };
        let corner = (0..8).find(|corner| self.node(*corner) == node)?;
        Some((corner, axis))
    }
}

/// Joins paths to rings, each point once; none if they do not join.
fn rings(mut paths: Vec<Vec<Point>>) -> Option<Vec<Vec<Point>>> {
    let mut rings = Vec::new();
    while let Some(mut ring) = paths.pop() {
        loop {
            let to = ring.pop()?;
            if to == ring[0] {
                break;
            }
            let next = paths.iter().position(|path| path[0] == to)?;
            ring.extend(paths.swap_remove(next));
        }
        rings.push(ring);
    }
    Some(rings)
}
