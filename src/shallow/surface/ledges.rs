//! Ledges: edges between columns behind which films end over nothing, as at the rim of a shelf or of a hole in it. There the surface of a film would
//! end half a cell before the ground does, and be open below: a skirt (`skirts.rs`) closes it.
//!
//! | word | meaning |
//! |---|---|
//! | ledge | two columns side by side, or at the corners of a cell's diagonal, that a film links, with no film to link them with on one side |
//! | hem | where the surface of a column at a ledge comes down to the ground: towards the sides where nothing is |
//! | silhouette | where the ground itself ends, between the middles of the cells |

use super::links::{RING, Scene, cell_at};
use super::{Columns, Depths, Indices, Layout, NONE, Surface, Target, bound};
use crate::base::Vec3;
use crate::error::{Error, Result};

/// How far hems are from the middle of their cell where no mesh says where the ground ends (cells).
const HALF: f32 = 0.5;

/// Two columns between which the surface ends: as seen from above, nothing is to the right of the way from the first to the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ledge {
    /// Their hems.
    pub hems: [u32; 2],
    /// From each of them, the place in the ring of cells around that nothing is linked with.
    pub beyond: [u8; 2],
}

/// Where the surface of a column at a ledge ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hem {
    /// Index of the column.
    pub column: u32,
    /// Whether it ends to the east, north, west and south, and how far the ground reaches there (cells).
    pub sides: [Option<f32>; 4],
    /// How much higher the ground is there than the column's base (m).
    pub rise: f32,
}

impl Hem {
    /// From the middle of the cell along x and z (cells).
    pub fn offset(&self) -> [f32; 2] {
        let [east, north, west, south] = self.sides.map(|reach| reach.unwrap_or(0.0));
        [east - west, south - north]
    }
}

/// The ledges of columns: see [`Depths::ledges`].
#[derive(Debug, Clone, Default)]
pub struct Ledges {
    pub(super) edges: Vec<Ledge>,
    /// In order of their columns.
    pub(super) hems: Vec<Hem>,
    /// Count of indices of the columns.
    pub(super) columns: usize,
}

impl Ledges {
    /// Finds the ledges of columns; the surface goes on for half a cell behind the middle of the last one. To be called again when the
    /// columns have changed.
    ///
    /// 2 ms for 200 x 200 cells with a few layers.
    pub fn find(&mut self, columns: &Columns) {
        let Self { edges, hems, columns: count } = self;
        edges.clear();
        hems.clear();
        *count = columns.len();
        let (ways, triangles) = films(columns);
        let mut found: Vec<([u32; 2], [u8; 2])> = Vec::new();
        for triangle in triangles {
            let [a, b, c] = triangle;
            for ends in [[a, b], [b, c], [c, a]] {
                let Some(way) = way(columns, ends) else { continue };
                if ways[ends[1] as usize] >> ((way + 4) % 8) & 1 == 1 {
                    continue;
                }
                // To the right of a way along an axis; of a diagonal, the cell in the corner.
                let turns = if way % 2 == 0 { [6, 6] } else { [7, 5] };
                let beyond = turns.map(|turn| (way + turn) % 8);
                let is_inside = |end: u32, ring: u8| {
                    let [x, z] = cell_at(columns.cell(end as usize), RING[usize::from(ring)]);
                    x < columns.grid.size[0] && z < columns.grid.size[1]
                };
                if is_inside(ends[0], beyond[0]) && is_inside(ends[1], beyond[1]) {
                    found.push((ends, beyond));
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        hems.extend(found.iter().flat_map(|(ends, _)| ends).map(|&column| Hem {
            column,
            sides: [None; 4],
            rise: 0.0,
        }));
        hems.sort_unstable_by_key(|hem| hem.column);
        hems.dedup_by_key(|hem| hem.column);
        for (ends, beyond) in found {
            let at = ends.map(|column| hems.partition_point(|hem| hem.column < column));
            for (hem, ring) in at.into_iter().zip(beyond) {
                hems[hem].sides[usize::from(ring / 2)] = Some(HALF);
            }
            edges.push(Ledge { hems: at.map(|hem| hem as u32), beyond });
        }
    }

    /// Finds the ledges of columns, and where the ground of a mesh, which the columns were made from, ends: the surface goes on to there.
    ///
    /// # Errors
    /// `Argument`: a vertex that is not finite, or a face with a vertex that is not there.
    pub fn fit(&mut self, columns: &Columns, positions: &[Vec3], faces: &[[u32; 3]]) -> Result<()> {
        if positions.iter().flatten().any(|number| !number.is_finite()) {
            return Err(Error::argument("a vertex of the ground is not finite"));
        }
        if faces.iter().flatten().any(|&vertex| vertex as usize >= positions.len()) {
            return Err(Error::argument("a face of the ground has a vertex that is not there"));
        }
        self.find(columns);
        let mut ends = vec![[None; 4]; self.hems.len()];
        for face in faces {
            let corners = face.map(|vertex| <[f32; 3]>::from(positions[vertex as usize]).map(f64::from));
            self.cut(columns, corners, &mut ends);
        }
        for (hem, ends) in self.hems.iter_mut().zip(ends) {
            let mut rise: Option<f64> = None;
            for (reach, end) in hem.sides.iter_mut().zip(ends) {
                if let (Some(reach), Some(End { at, height })) = (reach, end) {
                    *reach = at as f32;
                    rise = Some(rise.map_or(height, |other| other.min(height)));
                }
            }
            hem.rise = rise.unwrap_or(0.0) as f32;
        }
        Ok(())
    }

    /// Looks how far a triangle reaches from the columns at ledges.
    fn cut(&self, columns: &Columns, corners: [[f64; 3]; 3], ends: &mut [[Option<End>; 4]]) {
        let (grid, heights) = (columns.grid, columns.heights);
        let bounds = |axis: usize| {
            let of = corners.map(|corner| corner[axis]);
            [of[0].min(of[1]).min(of[2]), of[0].max(of[1]).max(of[2])]
        };
        // Middles of cells that reach it within a cell.
        let cells = |axis: usize, size: usize| {
            let [low, high] = bounds([0, 2][axis]).map(|at| (at - grid.origin[axis]) / grid.cell - 0.5);
            let first = (low - 1.0).ceil().clamp(0.0, size as f64) as usize;
            first..((high + 1.0).floor() + 1.0).clamp(first as f64, size as f64) as usize
        };
        let [nx, nz] = grid.size;
        let (xs, zs) = (cells(0, nx), cells(1, nz));
        for z in zs {
            let row = columns.row(z);
            let own =
                |strip: usize| self.hems.partition_point(|hem| (hem.column as usize) < strip * super::STRIP);
            for (number, hem) in (own(row.start)..own(row.end)).map(|at| (at, &self.hems[at])) {
                let [x, _] = columns.cell(hem.column as usize);
                if !xs.contains(&x) {
                    continue;
                }
                let [cx, cz] = grid.centre([x, z]);
                let base = heights.low + f64::from(columns.bases()[hem.column as usize]) * heights.unit;
                let local = corners.map(|[x, y, z]| [(x - cx) / grid.cell, y - base, (z - cz) / grid.cell]);
                for (side, end) in
                    ends[number].iter_mut().enumerate().filter(|(side, _)| hem.sides[*side].is_some())
                {
                    let [dx, dz] = RING[2 * side].map(f64::from);
                    // Along the side, and across it.
                    let line = local.map(|[x, y, z]| [x * dx + z * dz, y, z * dx - x * dz]);
                    let reached = crossing(line).filter(|end| end.height.abs() <= grid.cell);
                    if let Some(reached) = reached
                        && end.is_none_or(|end| end.is_before(&reached))
                    {
                        *end = Some(reached);
                    }
                }
            }
        }
    }

    /// The most that skirts add to a surface.
    pub fn bound(&self) -> super::Counts {
        super::Counts { vertices: self.hems.len(), extras: 0, indices: 6 * self.edges.len() }
    }
}

/// How far ground reaches from the middle of a cell (cells), and how much higher than there it then is (m).
#[derive(Debug, Clone, Copy, PartialEq)]
struct End {
    at: f64,
    height: f64,
}

impl End {
    /// Whether another one is farther, or as far and higher.
    fn is_before(&self, other: &Self) -> bool {
        (self.at, self.height) < (other.at, other.height)
    }
}

/// Where a triangle, of corners along a line, up and across it, ends on the line from 0 to 1. None where it does not cross it, or is upright.
fn crossing(corners: [[f64; 3]; 3]) -> Option<End> {
    let mut points = [[0.0; 2]; 2];
    let mut count = 0;
    for [from, to] in [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|end: usize| corners[end])) {
        if (from[2] >= 0.0) != (to[2] >= 0.0) && count < 2 {
            let part = from[2] / (from[2] - to[2]);
            points[count] = [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
            count += 1;
        }
    }
    let [mut near, mut far] = points;
    if near[0] > far[0] {
        std::mem::swap(&mut near, &mut far);
    }
    let length = far[0] - near[0];
    if count < 2 || length <= 0.0 || far[0] <= 0.0 || near[0] > 1.0 {
        return None;
    }
    let at = far[0].min(1.0);
    Some(End { at, height: near[1] + (at - near[0]) / length * (far[1] - near[1]) })
}

/// The triangles of a film on all columns, and of each column the ways that edges lead from it: a bit for each place of the ring of cells around.
fn films(columns: &Columns) -> (Vec<u8>, Vec<[u32; 3]>) {
    let depth: Vec<i32> = (0..columns.len())
        .map(|index| {
            i32::from(columns.is_column(index) && columns.ceilings()[index] > columns.bases()[index])
        })
        .collect();
    let most = bound(columns);
    let (mut of_vertices, mut indices) = (vec![NONE; most.vertices], vec![0; most.indices]);
    let depths = Depths { depth: &depth, ..Depths::default() };
    let mut target =
        Target { columns: Some(&mut of_vertices), indices: Indices::U32(&mut indices), ..Target::default() };
    let built = Surface::default().build(columns, &depths, &Layout::default(), &mut target);
    let count = built.map_or(0, |counts| counts.indices);
    let mut ways = vec![0; columns.len()];
    let mut triangles: Vec<[u32; 3]> = indices[..count].as_chunks().0.to_vec();
    for triangle in &mut triangles {
        *triangle = triangle.map(|vertex| of_vertices[vertex as usize]);
        let [a, b, c] = *triangle;
        for ends in [[a, b], [b, c], [c, a]] {
            if let Some(way) = way(columns, ends) {
                ways[ends[0] as usize] |= 1 << way;
            }
        }
    }
    let scene = Scene { columns, depth: &depth, above: &[] };
    triangles
        .retain(|triangle| triangle.iter().all(|&column| column != NONE && scene.is_wet(column as usize)));
    (ways, triangles)
}

/// Place in the ring of cells around a column where another one is.
fn way(columns: &Columns, [from, to]: [u32; 2]) -> Option<u8> {
    if from == NONE || to == NONE {
        return None;
    }
    let [from, to] = [from, to].map(|column| columns.cell(column as usize));
    RING.iter().position(|&step| cell_at(from, step) == to).map(|way| way as u8)
}
