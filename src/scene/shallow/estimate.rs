//! Estimated memory and disk space of a liquid on a terrain. Disk space is the maximum, as if all columns were wet.

use crate::context::Context;
use crate::error::Result;
use crate::scene::shallow::Shallow;
use crate::shallow::columns::grid::Grid;
use crate::shallow::free_fall::mesh::bound;
use crate::shallow::params::Friction;

/// Bytes that every run takes.
const FIXED: u64 = 50_000_000;
/// Bytes of a cell while the terrain is converted to columns: its crossings and solids, in two copies.
const CELL: u64 = 64;
/// Bytes of a column: liquid, pipes and scratch data 100; its vertex and triangles while they are made 150; in up to three steps that wait
/// for the writer, 120 each; in files and states 100; minimum heights 20.
const COLUMN: u64 = 730;
/// Bytes of a scalar in a column: its amount 8, its concentration 4, and 50 in waiting steps, files and states.
const SCALAR: u64 = 62;
/// Additional bytes of a column for friction at walls, and for viscosity that depends on a scalar.
const WALLS: u64 = 108;
const THICK: u64 = 12;
/// Bytes of a drop: its own data 500; its ball and strand 5,600 while they are made, and in each of up to three steps that
/// wait for the writer.
const DROP: u64 = 22_900;
/// Bytes of a triangle of the terrain: corners and a position, in two copies and with scratch data while it is read or while minimum
/// heights are found.
const TRIANGLE: u64 = 110;
/// Additional bytes of a triangle that the liquid stains: stains, and the mesh in up to three steps that wait for the writer.
const STAINED: u64 = 110;

/// Fails, before the cells are made, if they would exceed the context's memory limit.
///
/// # Errors
/// [`crate::Error::Memory`], naming the cells.
pub(in crate::scene::shallow) fn allow_cells(ctx: &Context, grid: &Grid) -> Result<()> {
    let [across, along] = grid.size;
    let what = format!("shallow.cell = {} m, {across} x {along} cells,", grid.cell);
    ctx.allow(&what, FIXED + (CELL + COLUMN) * grid.cells() as u64)
}

/// Share of the bytes of drops, and of all others, that is expected to be used: few drops are in the air, and few columns are wet.
const EXPECTED_OF_DROPS: f64 = 0.03;
const EXPECTED_OF_REST: f64 = 0.7;

/// Bytes of a run: at most, and as expected.
pub(in crate::scene::shallow) fn memory(
    setup: &Shallow,
    grid: &Grid,
    columns: u64,
    triangles: u64,
) -> [u64; 2] {
    let walls = if setup.params.friction == Friction::Walls { WALLS } else { 0 };
    let thick = if setup.params.thickening.is_some() { THICK } else { 0 };
    let triangle = TRIANGLE + if setup.staining.is_some() { STAINED } else { 0 };
    let column = COLUMN + SCALAR * setup.scalars.len() as u64 + walls + thick;
    let drops = DROP * setup.params.falls.map_or(0, |falls| falls.max_packets as u64);
    let rest = CELL * grid.cells() as u64 + column * columns + triangle * triangles;
    let expected = EXPECTED_OF_REST * rest as f64 + EXPECTED_OF_DROPS * drops as f64;
    [FIXED + rest + drops, FIXED + expected as u64]
}

/// Bytes of an index in a USD file, packed.
const INDEX: u64 = 2;
/// Bytes of a column in the exact state, unpacked; of a scalar in a column; and of a drop, with the volume waiting at a link.
const STATE: u64 = 20;
const STATE_OF_SCALAR: u64 = 8;
const STATE_OF_DROP: u64 = 220;
/// Bytes of the voxels of a column, of which there are about two.
const VOXEL: u64 = 2 * 4;
/// Bytes of a triangle of a terrain in a .ply and a USD file: its corners (in USD also those of its normals), and for half a vertex the
/// position, the normal in USD, the stain and the colour; and of the stain in the exact state.
const TERRAIN_PLY: u64 = 13 + (12 + 16) / 2;
const TERRAIN_USD: u64 = 2 * 3 * INDEX + (12 + 12 + 16) / 2;
const STATE_OF_STAIN: u64 = 12 / 2;
/// Bytes of a frame's report and record.
const RECORDS: u64 = 3000;

/// Maximum bytes of a frame's files with these counts of columns and triangles of the terrain: if all columns are wet, and the air holds
/// the maximum number of drops.
pub(in crate::scene::shallow) fn frame_bytes(setup: &Shallow, columns: u64, triangles: u64) -> u64 {
    let output = setup.output;
    let scalars = setup.scalars.len() as u64;
    let (carried, falling) =
        (if output.scalars { scalars } else { 0 }, u64::from(output.falling && setup.params.falls.is_some()));
    let if_asked = |is_asked: bool, bytes: u64| if is_asked { bytes } else { 0 };
    let arrays = if_asked(output.depth, 4)
        + if_asked(output.alpha, 4)
        + if_asked(output.layer, 2)
        + 4 * carried
        + falling;
    let vertex = 12 + if_asked(output.velocities, 12) + arrays;
    // Two triangles for each vertex, each with a byte for its count of corners.
    // A colour goes with the opacity.
    let ply = vertex + if_asked(output.alpha, 3) + 2 * 13;
    // Position, velocity and normal.
    let numbers = 9 + u64::from(output.depth) + u64::from(output.alpha) + u64::from(output.layer);
    let usd = 4 * (numbers + carried + falling) + 2 * 3 * INDEX;
    let state = STATE + STATE_OF_SCALAR * scalars;
    let each = if_asked(output.ply, ply) + if_asked(output.usd, usd) + if_asked(output.vdb, VOXEL) + state;
    let drops = setup.params.falls.map_or(0, |falls| falls.max_packets);
    // A drop's mesh has two triangles for each vertex.
    let in_air = bound(drops).vertices as u64 * (if_asked(output.ply, ply) + if_asked(output.usd, usd));
    let has_terrain = setup.staining.is_some() || setup.sequence().is_some();
    let terrain = if_asked(output.terrain_ply, TERRAIN_PLY) + if_asked(output.terrain_usd, TERRAIN_USD);
    let stain = if_asked(setup.staining.is_some(), STATE_OF_STAIN);
    let terrain = (if_asked(has_terrain, terrain) + stain) * triangles;
    columns * each + in_air + terrain + drops as u64 * STATE_OF_DROP + RECORDS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{TriMesh, Vec3};
    use crate::io::mesh::{Carried, ply_bytes};
    use crate::scene::Scene;
    use crate::scene::shallow::stage::liquid_mesh::LiquidMesh;
    use std::path::Path;

    #[test]
    fn a_ply_file_is_as_large_as_estimated_but_for_its_header() {
        let text = "[shot]\nframes = \"1-2\"\n[shallow]\nterrain = \"a.obj\"\ncell = 0.01\nfalls = true\nfalls_most = 1\n\
                    [output]\nliquid = [\"ply\"]\n[[scalar]]\nname = \"dye\"\n";
        let scene = Scene::parse(text, Path::new("/s/shot.toml"), &[]).unwrap();
        let setup = scene.shallow().unwrap();
        let count = 1000;
        let surface = LiquidMesh {
            mesh: TriMesh { positions: vec![Vec3::zeros(); count], triangles: vec![[0, 1, 2]; 2 * count] },
            velocities: vec![Vec3::zeros(); count],
            depths: vec![0.0; count],
            alpha: vec![0.0; count],
            layers: vec![0; count],
            falling: Some(900),
            scalars: vec![("dye".into(), vec![0.0; count])],
        };
        let colours = crate::scene::shallow::stage::colours::srgb(&vec![[0.0; 3]; count]);
        let arrays: Vec<_> = surface.arrays(setup.output).into_iter().chain(colours).collect();
        let carried = Carried {
            velocities: &surface.velocities,
            uvs: None,
            arrays: &arrays.iter().collect::<Vec<_>>(),
        };
        let bytes = ply_bytes(&surface.mesh, &carried).len() as u64;
        let more = (STATE + STATE_OF_SCALAR) * count as u64;
        let estimate = (frame_bytes(setup, count as u64, 9) - frame_bytes(setup, 0, 0)) - more;
        assert!(bytes > estimate && bytes < estimate + 500, "{bytes} bytes, {estimate} estimated");
        // The ball of a drop has at least 42 vertices.
        assert!(frame_bytes(setup, 0, 0) > RECORDS + STATE_OF_DROP + 42 * 12, "{}", frame_bytes(setup, 0, 0));
    }
}
