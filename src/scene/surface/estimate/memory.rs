//! Estimates the memory of a mesh that follows a liquid before it is allocated.
//!
//! Bytes of each item, from the structures that hold it; lengths in spacings, r (phi and Gamma: `surface/mod.rs`):
//!
//! | item | contents | bytes |
//! |---|---|---|
//! | particle of a frame in memory | position 24, velocity 12, id 8 | 24 to 44 |
//! | particle of a step | both ends of its path 48, rank 8, velocities at both ends 48 | 56 to 104 |
//! | particle, while vertices are carried | positions before and after 48, in its cell 20 and while sorted 24, its displacement 12 | 104 |
//! | node of the grid of maps | coordinate 12, map 112 twice | 236 |
//! | patch of phi | values twice 512, positions in lists and tables 100, crossings 220 | 832 |
//! | vertex of the particles' surface | position 12 twice, patch 4, connection 8, 2 triangles: twice 12, corners 36 | 156 |
//! | block of distances | values twice 4096, neighbours and slot 200 | 4296 |
//! | vertex of the mesh | in three frames 102, projection 130, files 87 and 16, in 32 bits twice 24 | 359 |
//! | triangle of the mesh | in six copies | 72 |
//!
//! Additionally, if the mesh is rebuilt:
//!
//! | item | contents | bytes |
//! |---|---|---|
//! | patch of phi, vertex of the particles' surface | again, for the next frame | 832, 156 |
//! | particle of the next frame | position 24, in its cell 20 and while sorted 24 | 68 |
//! | part of the mesh as large as a face of a cell | up to 1.7 edges of the grid cross it, 100 each while they are sorted | 170 |
//! | block of Gamma | 512 nodes: value 4, in growing lists 64, equation 125 | 98816 |
//! | triangle near such blocks | in five of them, in 32 bits 132 and a number 4 | 680 |
//! | vertex of the mesh | in cells 24, units 12, as cut 25, before and after 48, names 12, sizes and drifts in four copies 80, state 36 | 237 |
//! | triangle of the mesh | on the grid 12, as cut 20, while its edges are checked 82, state 36 | 150 |
//! | vertex of the mesh in a coming frame, except the next | position 24, distance 4, flags 2, size and drift 20, velocities 24, name 8 | 82 |
//! | triangle of such a mesh | corners twice 24, the mask 8 | 32 |
//! | particle, if particles have ids and the mesh carries data | its id and its first position | 32 |
//! | triangle of the first mesh or of the last edited one, under the same conditions | in a tree | 84 |
//! | number that the mesh carries | in two frames 16, state 16; 8 in each coming frame | 32 |
//! | vertex of a mesh that carries data | source of its numbers | 40 |
//! | triangle of such a mesh | source of its numbers 80, in a tree 84 | 164 |
//!
//! Gamma is freed before the carried data are transferred to the changed mesh: the larger of the two counts. How much of a mesh does not
//! match the liquid is not known beforehand: a quarter is assumed.

use rayon::prelude::*;

use super::disk::FrameSize;
use crate::geometry::{DVec3, DetailedMesh};
use crate::scene::surface::Surface;
use crate::scene::surface::inputs::particle_times::CACHED_FILES;
use crate::surface::Particles;

/// Bytes that every run takes.
const FIXED: f64 = 64e6;
/// Share of the other bytes that is expected to be used: not all of them are at the same time, and less of the mesh changes.
const EXPECTED: f64 = 0.65;
/// Bytes of a particle in each frame in memory: position, velocity, id.
const PARTICLE: [f64; 3] = [24.0, 12.0, 8.0];
/// Bytes of a particle's path in a step, and of the velocities at both its ends.
const PATH: [f64; 2] = [56.0, 48.0];
/// Bytes of a particle and of a node while the mesh is carried.
const CARRYING: [f64; 2] = [104.0, 236.0];
/// Bytes of a patch, of a vertex of the particles' surface, and of a block of distances.
const SURFACE: [f64; 3] = [832.0, 156.0, 4296.0];
/// Bytes of a vertex and of a triangle of the mesh.
const MESH: [f64; 2] = [359.0, 72.0];
/// Bytes of a number that the mesh carries, in memory.
const CARRIED: f64 = 8.0;

/// If the mesh is rebuilt: bytes of a vertex and of a triangle of the mesh in each coming frame except the next.
const COMING: [f64; 2] = [82.0, 32.0];
/// Bytes of a particle's first position with its id, and of a triangle in a tree.
const FIRST_POSITION: f64 = 32.0;
const TREE: f64 = 84.0;
/// Bytes of a particle of the next frame, whose surface is made at the same time.
const AHEAD: f64 = 68.0;
/// Bytes of a part of the mesh as large as a face of a cell, of a block of Gamma, and of a triangle near such blocks.
const CUT: [f64; 3] = [170.0, 98816.0, 680.0];
/// Additional bytes of a vertex and of a triangle of the mesh.
const REBUILT: [f64; 2] = [237.0, 150.0];
/// Additional bytes of a number that the mesh carries, and of a vertex and of a triangle of a mesh that carries any.
const REBUILT_CARRIED: [f64; 3] = [32.0, 40.0, 164.0];
/// Share of the mesh that does not match the liquid in a frame: that of a splashing dam break. More takes more memory.
const MISMATCH: f64 = 0.25;
/// Blocks of Gamma for each face of a cell where the mesh does not match: its own, 8 cells wide, and one on each side.
const BLOCKS_PER_FACE: f64 = 3.0 / 64.0;

/// Count of particles from which a cube of two spacings is full; inside a liquid it has 8.
const FULL_COUNT: usize = 4;
/// Nodes of the grid of maps for each cube of the shell.
const NODES: f64 = 4.0;
/// Range of distances on each side (r): enough for detail of half a spacing.
const REACH: f64 = 2.0;

/// Maxima, over all particle files, of what the estimate depends on.
#[derive(Debug, Default)]
pub(in crate::scene::surface) struct ParticleMaxima {
    /// Bytes of a frame's particles.
    frame: f64,
    /// Bytes of their paths.
    paths: f64,
    /// Bytes of temporary data while they carry the mesh.
    work: f64,
    /// Bytes of their ids and first positions, which are kept to trace textures.
    first_positions: f64,
    /// Bytes of their surface, computed one frame ahead.
    ahead: f64,
    /// Area of their surface (faces of cells).
    area: f64,
    /// Edge of a cell (m).
    edge: f64,
}

impl ParticleMaxima {
    /// Adds the particles of a file, with a spacing of `spacing` (m) and cells of `cell` (r).
    pub fn add(&mut self, particles: &Particles, spacing: f64, cell: f64) {
        let count = particles.positions.len() as f64;
        let (has_ids, has_velocities) = (!particles.ids.is_empty(), !particles.velocities.is_empty());
        let [position, velocity, id] = PARTICLE;
        let each = position + if has_velocities { velocity } else { 0.0 } + if has_ids { id } else { 0.0 };
        let path = PATH[0] + if has_ids && has_velocities { PATH[1] } else { 0.0 };
        let shell = shell(&particles.positions, spacing) as f64;
        let [patches, vertices, _] = surface(shell, cell);
        self.frame = self.frame.max(count * each);
        self.paths = self.paths.max(count * path);
        self.work = self.work.max(work(count, shell, cell));
        self.first_positions = self.first_positions.max(if has_ids { count * FIRST_POSITION } else { 0.0 });
        self.ahead = self.ahead.max(count * AHEAD + patches * SURFACE[0] + vertices * SURFACE[1]);
        self.area = self.area.max(vertices);
        self.edge = cell * spacing;
    }

    /// Estimates the memory (bytes) of a run over `files` files: at most, and as expected.
    pub fn estimate(
        &self,
        surface: &Surface,
        files: usize,
        detail: &DetailedMesh,
        frame: &FrameSize,
    ) -> [u64; 2] {
        let is_between = surface.speed.fract() != 0.0 || surface.offset.fract() != 0.0;
        // The particles of the first frame are kept; between two files both ends of a step are interpolated.
        let frames = files.min(CACHED_FILES) + 1 + if is_between { 2 } else { 0 };
        let mesh = mesh_bytes(counts(detail), MESH) + numbers(detail) * CARRIED;
        let particles = frames as f64 * self.frame + self.paths + self.work;
        let rebuilding =
            if surface.rebuild { self.rebuilding(detail, surface.frames_ahead() - 1) } else { 0.0 };
        let rest = particles + mesh + rebuilding + frame.largest() as f64;
        [1.0, EXPECTED].map(|share| (FIXED + share * rest) as u64)
    }

    /// Additional bytes if the mesh is rebuilt, with `coming` frames kept after the next.
    ///
    /// The mesh grows with the particles' surface, by a vertex and two triangles for each face of a cell.
    fn rebuilding(&self, detail: &DetailedMesh, coming: i32) -> f64 {
        let own_area = detail.mesh.area() / self.edge.powi(2);
        let grown = (self.area - own_area).max(0.0);
        let [vertices, triangles] = counts(detail);
        let now = [vertices + grown, triangles + 2.0 * grown];
        let mesh = mesh_bytes([grown, 2.0 * grown], MESH) + mesh_bytes(now, REBUILT);
        let area = own_area.max(self.area);
        let [faces, blocks, near] = CUT;
        let changing = faces * area + MISMATCH * (blocks * BLOCKS_PER_FACE * area + near * now[1]);
        let ([number, vertex, triangle], count) = (REBUILT_CARRIED, numbers(detail));
        let carrying = if count > 0.0 {
            count * now[1] / triangles.max(1.0) * number + mesh_bytes(now, [vertex, triangle])
        } else {
            0.0
        };
        let coming = f64::from(coming) * (mesh_bytes(now, COMING) + count * CARRIED);
        let source = if count > 0.0 { self.first_positions + TREE * triangles } else { 0.0 };
        self.ahead + mesh + coming + source + changing.max(carrying)
    }
}

/// Counts of vertices and triangles.
fn counts(detail: &DetailedMesh) -> [f64; 2] {
    [detail.mesh.positions.len(), detail.mesh.triangles.len()].map(|count| count as f64)
}

/// Count of the numbers that a mesh carries: a pair of texture coordinates, or of indices into these, counts as one.
fn numbers(detail: &DetailedMesh) -> f64 {
    let arrays: usize = detail.arrays.iter().map(|array| array.values.len()).sum();
    let uvs = detail.uvs.as_ref().map_or(0, |uvs| {
        uvs.coordinates.len() + uvs.corners.as_ref().map_or(0, |corners| corners.len().div_ceil(2))
    });
    (arrays + uvs) as f64
}

/// Bytes of these counts of vertices and triangles.
fn mesh_bytes(counts: [f64; 2], bytes: [f64; 2]) -> f64 {
    counts[0] * bytes[0] + counts[1] * bytes[1]
}

/// Bytes of temporary data for particles whose shell has `shell` cubes, with cells of `cell` (r): while they carry the mesh, or later while
/// their surface and the distances from it are computed.
fn work(particles: f64, shell: f64, cell: f64) -> f64 {
    let carrying = CARRYING[0] * particles + CARRYING[1] * NODES * shell;
    let making: f64 = surface(shell, cell).iter().zip(SURFACE).map(|(count, bytes)| count * bytes).sum();
    carrying.max(making)
}

/// Counts of patches, of vertices and of blocks of distances of a surface whose shell has `shell` cubes, with cells of `cell` (r).
///
/// Over a level surface the shell is two cubes thick. Patches of 4 cells lie within 2 r of it on both sides, each cell of its area has one
/// vertex, and blocks of 8 cells reach as far as distances do, plus half their edge; drops have twice as many blocks.
fn surface(shell: f64, cell: f64) -> [f64; 3] {
    let patches = shell * (1.0 + cell) / (12.0 * cell.powi(3));
    let vertices = shell * 2.0 / cell.powi(2);
    let blocks = shell * (REACH + 4.0 * cell) / (96.0 * cell.powi(3));
    [patches, vertices, blocks]
}

/// Number of cubes of two spacings (m) around the surface of particles at positions (m): those with particles and their neighbours, except
/// full cubes among full ones.
fn shell(positions: &[DVec3], spacing: f64) -> usize {
    // Positions farther away are refused later.
    const FARTHEST: f64 = 1e9;
    let cube_of = |position: &DVec3| {
        [0, 1, 2].map(|axis| (position[axis] / (2.0 * spacing)).floor().clamp(-FARTHEST, FARTHEST) as i32)
    };
    let mut all: Vec<[i32; 3]> = positions.par_iter().with_min_len(4096).map(cube_of).collect();
    all.par_sort_unstable();
    let cubes = all.chunk_by(|a, b| a == b);
    let full: Vec<[i32; 3]> = cubes.filter(|cube| cube.len() >= FULL_COUNT).map(|cube| cube[0]).collect();
    all.dedup();
    let is_inside = |cube: &[i32; 3]| {
        (-1..=1).all(|x| {
            (-1..=1).all(|y| {
                // The three along z are adjacent in the order.
                let low = [cube[0] + x, cube[1] + y, cube[2] - 1];
                let at = full.partition_point(|other| *other < low);
                full.get(at + 2) == Some(&[low[0], low[1], low[2] + 2])
            })
        })
    };
    let flags: Vec<bool> = all.par_iter().with_min_len(64).map(is_inside).collect();
    let (mut inside, mut around) = (Vec::new(), Vec::new());
    for (cube @ [x, y, z], is_inside) in all.into_iter().zip(flags) {
        if is_inside {
            inside.push(cube);
        } else {
            around.extend((0..27).map(|n| [x + n / 9 - 1, y + n / 3 % 3 - 1, z + n % 3 - 1]));
        }
    }
    around.par_sort_unstable();
    around.dedup();
    around.par_iter().filter(|cube| inside.binary_search(cube).is_err()).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::attributes::{MeshArray, Number, On};
    use crate::geometry::{TriMesh, Vec3};
    use crate::mesh_repair::Source;
    use crate::surface::Node;

    /// Particles in a cube with a side of `side` spacings.
    fn block(side: usize) -> Vec<DVec3> {
        let at = |n: usize| [n / (side * side), n / side % side, n % side].map(|x| x as f64 + 0.5);
        (0..side.pow(3)).map(|n| DVec3::from(at(n))).collect()
    }

    #[test]
    fn the_shell_lies_around_the_surface() {
        // A drop of one particle, and a cube of 5 x 5 x 5 cubes, of which the 3 x 3 x 3 in the middle are full among full ones.
        assert_eq!(shell(&[DVec3::repeat(0.5)], 1.0), 27);
        assert_eq!(shell(&block(10), 1.0), 7 * 7 * 7 - 3 * 3 * 3);
        // Drops far from each other, and a position too far for any grid.
        let drops: Vec<DVec3> = (0..10).map(|n| DVec3::repeat(10.0 * f64::from(n))).collect();
        assert_eq!(shell(&drops, 1.0), 270);
        assert_eq!(shell(&[DVec3::repeat(1e300)], 1.0), 27);
    }

    #[test]
    fn finer_cells_and_more_surface_take_more() {
        let cube = shell(&block(20), 1.0) as f64;
        assert!(work(8000.0, cube, 0.25) > 3.0 * work(8000.0, cube, 0.5));
        assert!(work(8000.0, 8000.0 * 27.0, 0.5) > 10.0 * work(8000.0, cube, 0.5));
    }

    /// The bytes for rebuilding a cube's mesh, with particles at these positions, on cells of `cell` (spacings).
    fn rebuilding(positions: Vec<DVec3>, cell: f64, detail: &DetailedMesh) -> f64 {
        let mut maxima = ParticleMaxima::default();
        maxima.add(&Particles { positions, ..Particles::default() }, 1.0, cell);
        maxima.rebuilding(detail, 0)
    }

    #[test]
    fn rebuilding_takes_more_where_there_is_more_surface() {
        let cube = DetailedMesh { mesh: TriMesh::cuboid([0.0; 3], [20.0; 3]), ..DetailedMesh::default() };
        let calm = rebuilding(block(20), 0.5, &cube);
        // A quarter of 9600 faces of cells is in 112 blocks.
        assert!(calm > 112.0 * CUT[1] + 9600.0 * CUT[0], "{calm}");
        // The same number of particles in a sheet.
        let sheet = (0..8000).map(|n| DVec3::new(f64::from(n / 90), 0.5, f64::from(n % 90))).collect();
        let spread = rebuilding(sheet, 0.5, &cube);
        assert!(spread > 2.0 * calm, "{spread} after {calm}");
        let fine = rebuilding(block(20), 0.25, &cube);
        assert!(fine > 3.0 * calm && fine < 10.0 * calm, "{fine} after {calm}");
    }

    #[test]
    fn rebuilding_takes_more_where_the_mesh_is_finer_or_carries_much() {
        let of = |detail: &DetailedMesh| rebuilding(block(20), 0.5, detail);
        let mut detail =
            DetailedMesh { mesh: TriMesh::cuboid([0.0; 3], [20.0; 3]), ..DetailedMesh::default() };
        let plain = of(&detail);
        // Triangles without area.
        detail.mesh.positions.extend(vec![Vec3::zeros(); 3000]);
        detail.mesh.triangles.extend(vec![[0, 1, 1]; 6000]);
        let finer = of(&detail) - plain;
        let expected = 3000.0 * REBUILT[0] + 6000.0 * (REBUILT[1] + MISMATCH * CUT[2]);
        assert!((finer - expected).abs() < 1.0, "{finer} is not {expected}");
        // Few numbers add only the first mesh's tree, as their transfer takes less than Gamma; a million add more.
        let array = |count: usize| MeshArray {
            name: "mask".into(),
            on: On::Vertices,
            number: Number::F32,
            values: vec![0.0; count],
        };
        detail.arrays = vec![array(3008)];
        assert_eq!(of(&detail) - plain, finer + 6012.0 * TREE);
        detail.arrays = vec![array(1_000_000)];
        let more = of(&detail) - plain - finer;
        assert!(more > 10e6, "{more}");
    }

    #[test]
    fn items_are_as_large_as_the_table_says() {
        // A node of Gamma and the index of its value: with half as much again for growth and a result of 4 bytes, 64.
        assert_eq!(size_of::<Node>() + size_of::<(usize, usize)>(), 40);
        // A triangle as cut: corners and source.
        assert_eq!(size_of::<[u32; 3]>() + size_of::<Source>(), 20);
    }
}
