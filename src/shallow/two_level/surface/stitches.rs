//! The strip between fine and coarse cells: its triangles.

use crate::numeric::lists::refill;
use crate::shallow::Shallow;
use crate::shallow::columns::NONE;
use crate::shallow::surface::Counts;
use crate::shallow::surface::quartets::cells::Entry;
use crate::shallow::surface::quartets::divide::OTHERS;
use crate::shallow::surface::quartets::odd::add_triangles;
use crate::shallow::two_level::Detail;

/// The cells at the corners of a piece of the strip (north-west, north-east, south-west, south-east): whether each is coarse, and its
/// position.
type Piece = [Option<(bool, [usize; 2])>; 4];

/// The triangles of the strip. Ids are columns of both liquids, those of the coarse one after those of the fine one.
#[derive(Debug, Default)]
pub(super) struct Stitches {
    /// Column ids; the triangles face up.
    pub triangles: Vec<[u32; 3]>,
    /// The same as vertices of the mesh.
    pub indices: Vec<u32>,
    /// Ids of columns that have a vertex in neither mesh, in order.
    pub added: Vec<u32>,
    /// Scratch: the columns at each corner of a piece.
    corners: [Vec<Entry>; 4],
}

/// Maximum counts of vertices that the strip adds to both meshes, and of its triangles.
pub(super) fn bound(detail: &Detail) -> [usize; 2] {
    let (mut columns, mut triangles) = (0, 0);
    each_piece(detail, |piece| {
        let counts = piece.map(|cell| cell.map_or(0, |cell| of_cell(detail, cell).count()));
        // A wet column is in one group of four or in up to three groups of three.
        triangles += 3 * counts.iter().sum::<usize>();
        columns += counts.iter().sum::<usize>();
    });
    [columns, triangles]
}

impl Stitches {
    /// Reserves memory for this many triangles, and layers.
    pub fn reserve(&mut self, triangles: usize, layers: usize) {
        self.clear();
        self.triangles.reserve(triangles);
        self.indices.reserve(3 * triangles);
        // Before duplicates are removed.
        self.added.reserve(3 * triangles);
        self.corners.iter_mut().for_each(|corner| corner.reserve(layers));
    }

    fn clear(&mut self) {
        self.triangles.clear();
        self.indices.clear();
        self.added.clear();
        self.corners.iter_mut().for_each(Vec::clear);
    }

    /// Finds the strip. `columns` are those of both meshes' vertices, in order, except for the extras at the end.
    pub fn find(&mut self, detail: &Detail, depths: [&[i32]; 2], columns: [&Vec<u32>; 2], both: [Counts; 2]) {
        self.clear();
        let Self { triangles, indices, added, corners } = self;
        each_piece(detail, |piece| {
            for (corner, cell) in corners.iter_mut().zip(piece) {
                refill(corner, cell.into_iter().flat_map(|cell| entries(detail, depths, cell)));
            }
            add_piece(corners, triangles);
        });
        let first = detail.fine.columns.len() as u32;
        let vertex = |id: u32| {
            let end = usize::from(id >= first);
            let own = &columns[end][..both[end].vertices - both[end].extras];
            let position = own.binary_search(&(id - [0, first][end])).ok()?;
            Some(([0, both[0].vertices][end] + position) as u32)
        };
        added.extend(triangles.iter().flatten().filter(|id| vertex(**id).is_none()));
        added.sort_unstable();
        added.dedup();
        let first_added = both[0].vertices + both[1].vertices;
        let of_strip = |id: u32| (first_added + added.partition_point(|other| *other < id)) as u32;
        indices.extend(triangles.iter().flatten().map(|&id| vertex(id).unwrap_or_else(|| of_strip(id))));
    }
}

/// Adds the triangles of a piece.
fn add_piece(corners: &[Vec<Entry>; 4], triangles: &mut Vec<[u32; 3]>) {
    for (corner, others) in OTHERS.into_iter().enumerate() {
        for wet in corners[corner].iter().filter(|entry| entry.wet) {
            let mut linked = [None; 4];
            for other in others {
                let holder = corners[other].iter().find(|entry| entry.holds(wet.height));
                linked[other] = holder.filter(|holder| wet.holds(holder.height));
            }
            add_triangles(corner, wet, linked, triangles);
        }
    }
}

/// The liquid of a cell.
fn liquid(detail: &Detail, is_coarse: bool) -> &Shallow {
    if is_coarse { &detail.coarse } else { &detail.fine }
}

fn of_cell(detail: &Detail, (is_coarse, cell): (bool, [usize; 2])) -> impl Iterator<Item = usize> + '_ {
    liquid(detail, is_coarse).columns.of_cell(cell)
}

/// The columns of a cell.
fn entries<'a>(
    detail: &'a Detail,
    depths: [&'a [i32]; 2],
    cell @ (is_coarse, _): (bool, [usize; 2]),
) -> impl Iterator<Item = Entry> + 'a {
    let columns = &liquid(detail, is_coarse).columns;
    let (depth, first) = match is_coarse {
        true => (depths[1], detail.fine.columns.len()),
        false => (depths[0], 0),
    };
    of_cell(detail, cell).map(move |index| {
        let base = columns.bases()[index];
        Entry {
            id: (first + index) as u32,
            layer: columns.layer(index) as u32,
            height: base.wrapping_add(depth[index].max(0)),
            under: columns.unders()[index],
            ceiling: columns.ceilings()[index],
            base,
            wet: depth[index] > 0,
            wall: NONE,
        }
    })
}

/// Calls `visit` with each piece of the strip.
fn each_piece(detail: &Detail, mut visit: impl FnMut(Piece)) {
    let (near, size) = (&detail.near, detail.fine.columns.grid.size);
    // The outermost fine cells of a side, if there are coarse ones beyond.
    let outer = |axis: usize, direction: i32| match direction {
        1 => (near[axis].end < size[axis]).then(|| near[axis].end - 1),
        _ => (near[axis].start > 0).then(|| near[axis].start),
    };
    let beyond = |at: usize, direction: i32| at.wrapping_add_signed(direction as isize) / 2;
    let sides = [(0, -1), (0, 1), (1, -1), (1, 1)];
    for (axis, direction) in sides {
        let Some(across) = outer(axis, direction) else { continue };
        let along = &near[1 - axis];
        // A corner of a piece: the first or the second along the edge, and fine or coarse.
        let corner = |is_second: bool, is_coarse: bool| {
            let bits = [is_coarse == (direction > 0), is_second];
            let [x, z] = if axis == 0 { bits } else { [bits[1], bits[0]] };
            usize::from(x) + 2 * usize::from(z)
        };
        let cell = |across: usize, along: usize| if axis == 0 { [across, along] } else { [along, across] };
        let fine = |along: usize| Some((false, cell(across, along)));
        let coarse = |along: usize| Some((true, cell(beyond(across, direction), along / 2)));
        for first in along.clone().step_by(2) {
            let mut piece = [None; 4];
            piece[corner(false, false)] = fine(first);
            piece[corner(true, false)] = fine(first + 1);
            piece[corner(false, true)] = coarse(first);
            visit(piece);
            if first + 2 < along.end {
                let mut piece = [None; 4];
                for is_second in [false, true] {
                    let at = first + 1 + usize::from(is_second);
                    piece[corner(is_second, false)] = fine(at);
                    piece[corner(is_second, true)] = coarse(at);
                }
                visit(piece);
            }
        }
    }
    for (direction_x, direction_z) in [(-1, -1), (1, -1), (-1, 1), (1, 1)] {
        if let (Some(x), Some(z)) = (outer(0, direction_x), outer(1, direction_z)) {
            // The coarse mesh has the triangle of the three coarse cells.
            let corner = |x: bool, z: bool| {
                usize::from(x == (direction_x > 0)) + 2 * usize::from(z == (direction_z > 0))
            };
            let mut piece = [None; 4];
            piece[corner(false, false)] = Some((false, [x, z]));
            piece[corner(true, false)] = Some((true, [beyond(x, direction_x), z / 2]));
            piece[corner(false, true)] = Some((true, [x / 2, beyond(z, direction_z)]));
            visit(piece);
        }
    }
}
