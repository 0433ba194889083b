//! All that a scene with `[shallow]` reads before its first frame.

mod attached;
mod consistency;
pub(in crate::scene::shallow) mod flow_points;
pub(in crate::scene::shallow) mod obstacles;
pub(in crate::scene::shallow) mod pours;
pub(in crate::scene::shallow) mod scalars;
pub(in crate::scene::shallow) mod terrain;

use std::path::Path;
use std::sync::Arc;

use super::estimate;
use super::{Shallow, TimedFlowPoint};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::orientation::Orientation;
use crate::geometry::{DVec3, TriMesh, mesh};
use crate::io::files::source;
use crate::io::records::input_hashes::InputHashes;
use crate::motion::Space;
use crate::scene::Scene;
use crate::shallow::columns::grid::{Grid, Heights, MAX_CELLS, TOP};
use crate::shallow::terrain::facing::facing;
use crate::shallow::terrain::{Solids, triangles};
use attached::{Attached, attach};
use terrain::{Terrain, read_mesh};

/// Default margin above the terrain: share of the terrain's height, and the minimum (m).
const MARGIN: (f64, f64) = (0.25, 0.1);
/// A terrain wider than this (m) is probably in millimetres or centimetres.
const MAX_LIKELY_WIDTH: f64 = 20.0;

/// The warning about a mesh (m) so far from the origin that 32-bit numbers round it too much.
fn rounding_warning(path: &Path, mesh: &TriMesh, cell: f64) -> Option<String> {
    mesh::too_far_warning(&path.display().to_string(), mesh.farthest(), 1.0, cell, mesh::BY_KEY)
}

/// Contents of a scene's files.
pub struct Inputs {
    /// The cells.
    pub grid: Grid,
    /// The heights of ground and liquid.
    pub heights: Heights,
    /// Minimum and maximum corner of the terrain at the first frame (m).
    pub bounds: [DVec3; 2],
    /// Triangles of the terrain, if it is a mesh.
    pub triangles: Option<usize>,
    /// The terrain at the first frame, with the meshes that stand on it.
    pub(super) solids: Solids,
    /// The meshes that stand on it (m).
    pub(super) meshes: Vec<TriMesh>,
    /// The terrain at the first frame, if it is a mesh that moves.
    pub(super) moving_terrain: Option<TriMesh>,
    /// The terrain, if it is a mesh that does not move and minimum heights, skirts or stains are wanted.
    pub(super) still_terrain: Option<TriMesh>,
    /// For each flow point of the scene, the position on the terrain that it follows, if it follows any.
    pub(super) attached: Vec<Option<Attached>>,
    /// Which of the terrain's triangles are flipped, at every frame.
    pub(super) orientation: Orientation,
    /// Whether all triangles are then flipped, as they face down.
    pub(super) is_turned: bool,
    /// Contents of the files when they were read.
    pub(in crate::scene) input_hashes: Arc<InputHashes>,
    /// Warnings about the files, one sentence each; they are logged too.
    pub warnings: Vec<String>,
}

impl Inputs {
    /// Reads the terrain of the first frame and the meshes on it, after checking that no file of any frame is missing.
    ///
    /// # Errors
    /// Errors in files or keys, with file and key; cells that need more memory than the context allows; cancel.
    pub fn load(ctx: &Context, scene: &Scene) -> Result<Self> {
        let (setup, frames) = (scene.shallow()?, scene.shot.frames);
        if setup.output.vdb && !cfg!(feature = "vdb") {
            let what = "output.volume = [\"vdb\"] needs OpenVDB, which this frazil was built without";
            return Err(Error::file(&scene.path, what));
        }
        if setup.sequence().is_some() {
            frames.iter().try_for_each(|frame| source::open(&setup.terrain_at(frame)).map(drop))?;
        }
        let input_hashes = Arc::new(InputHashes::default());
        let path = setup.terrain_at(frames.first);
        let mut terrain = Terrain::read(setup, frames.first, &input_hashes)?;
        let bounds = terrain.bounds();
        let grid = grid(setup, &bounds).map_err(|error| error.in_file(&scene.path))?;
        let heights = heights(setup, &bounds).map_err(|error| error.in_file(&scene.path))?;
        let mut warnings = Vec::new();
        if let Terrain::Mesh(mesh) = &terrain {
            warnings.extend(unit_warning(setup, &path, &bounds));
            warnings.extend(rounding_warning(&path, mesh, grid.cell));
        }
        // A terrain in millimetres by mistake has too many cells.
        estimate::allow_cells(ctx, &grid)
            .inspect_err(|_| warnings.iter().for_each(|warning| log::warn!("{warning}")))?;
        let orientation = terrain.turn_outward();
        warnings.extend(orientation.warning().map(|what| format!("{}: {what}", path.display())));
        let (mut solids, is_turned) = solids(ctx, &mut terrain, &path, grid, heights)?;
        if is_turned {
            warnings.push(format!("{}: its triangles face down: they are turned round", path.display()));
        }
        let meshes = add_meshes(setup, frames.first, &input_hashes, &mut solids, &mut warnings)?;
        let mesh = match terrain {
            Terrain::Mesh(mesh) => Some(mesh),
            #[cfg(any(feature = "cli", feature = "vdb"))]
            _ => None,
        };
        let triangles = mesh.as_ref().map(|mesh| mesh.triangles.len());
        let (moving_terrain, still_terrain) =
            if setup.sequence().is_some() { (mesh, None) } else { (None, mesh) };
        let still_terrain =
            still_terrain.filter(|_| setup.minimum_heights || setup.skirts || setup.staining.is_some());
        let attached = moving_terrain.as_ref().map(|mesh| attach(ctx, setup, mesh)).unwrap_or_default();
        if let Some(mesh) = &moving_terrain {
            warnings.extend(attachment_warnings(scene, setup, mesh, &attached));
        }
        let inputs = Self {
            grid,
            heights,
            bounds,
            triangles,
            solids,
            meshes,
            moving_terrain,
            still_terrain,
            attached,
            orientation,
            is_turned,
            input_hashes,
            warnings,
        };
        inputs.warnings.iter().for_each(|warning| log::warn!("{warning}"));
        Ok(inputs)
    }

    /// The mesh of the terrain at a frame, if it moves: it must have as many vertices as at the first frame, and the same triangles.
    ///
    /// # Errors
    /// A file that cannot be read; a different mesh; a mesh that extends beyond the heights.
    pub(super) fn terrain_at(&self, setup: &Shallow, frame: i32) -> Result<Option<TriMesh>> {
        let Some(first) = &self.moving_terrain else { return Ok(None) };
        let path = setup.terrain_at(frame);
        let mut mesh = read_mesh(&path, setup.space, &self.input_hashes)?;
        let other = |mesh: &TriMesh| {
            let count = |mesh: &TriMesh| {
                format!("{} vertices and {} triangles", mesh.positions.len(), mesh.triangles.len())
            };
            let what = format!(
                "is another mesh than that of the first frame, {} and not {}, or has other triangles: a terrain that moves keeps them",
                count(mesh),
                count(first)
            );
            Error::file(&path, what)
        };
        // Oriented as at the first frame.
        if !self.orientation.fits(mesh.triangles.len()) {
            return Err(other(&mesh));
        }
        mesh = self.orientation.applied_to(mesh);
        if self.is_turned {
            mesh = mesh.reversed();
        }
        if mesh.positions.len() != first.positions.len() || mesh.triangles != first.triangles {
            return Err(other(&mesh));
        }
        self.check_heights(&mesh).map_err(|error| error.in_file(&path))?;
        Ok(Some(mesh))
    }

    /// Fails if a mesh extends beyond the heights.
    fn check_heights(&self, mesh: &TriMesh) -> Result<()> {
        let (low, high) = mesh.bounds().unwrap_or_default();
        let [from, to] = [self.heights.low, self.heights.metres(TOP)];
        for (name, height, is_beyond) in
            [("bottom", low.y, f64::from(low.y) < from), ("top", high.y, f64::from(high.y) > to)]
        {
            if is_beyond {
                return Err(Error::argument(format!(
                    "reaches {height} m, beyond the heights from {from} to {to} m: give shallow.{name}"
                )));
            }
        }
        Ok(())
    }
}

/// The solids of a terrain, and whether it was reversed, which happens to a mesh without a triangle that faces up.
///
/// # Errors
/// A terrain without a surface that faces up; cancel.
fn solids(
    ctx: &Context,
    terrain: &mut Terrain,
    path: &Path,
    grid: Grid,
    heights: Heights,
) -> Result<(Solids, bool)> {
    let found = terrain.solids(ctx, grid, heights).map_err(|error| error.in_file(path))?;
    if found.layers() > 0 {
        return Ok((found, false));
    }
    if let Terrain::Mesh(mesh) = terrain {
        *mesh = std::mem::take(mesh).reversed();
        let found = triangles::solids(&mesh.positions, &mesh.triangles, grid, heights)?;
        if found.layers() > 0 {
            return Ok((found, true));
        }
    }
    let [x0, z0, x1, z1] = area(&grid);
    let what = format!(
        "has no surface that faces up within x {x0:.6} to {x1:.6} m and z {z0:.6} to {z1:.6} m (shallow.area, cells of {} m)",
        grid.cell
    );
    Err(Error::file(path, what))
}

/// Reads the meshes that stand on a terrain, and adds them to its solids.
///
/// # Errors
/// A file that cannot be read, or that has too many layers.
fn add_meshes(
    setup: &Shallow,
    first: i32,
    input_hashes: &InputHashes,
    solids: &mut Solids,
    warnings: &mut Vec<String>,
) -> Result<Vec<TriMesh>> {
    let mut meshes = obstacles::meshes(setup, first, input_hashes)?;
    for (mesh, own) in meshes.iter_mut().zip(setup.obstacles.iter().filter_map(|own| own.file())) {
        let orientation = facing(mesh);
        *mesh = orientation.applied_to(std::mem::take(mesh));
        warnings.extend(orientation.warning().map(|what| format!("{}: {what}", own.display())));
        let on_it = triangles::solids(&mesh.positions, &mesh.triangles, solids.grid, solids.heights);
        let on_it = on_it.map_err(|error| error.in_file(own))?;
        warnings.extend(rounding_warning(own, mesh, solids.grid.cell));
        if orientation.has_open() && orientation.warning().is_none() {
            let what = "is not closed: all below a surface of it that faces up is solid";
            warnings.push(format!("{}: {what}", own.display()));
        }
        *solids = united(solids, &on_it);
    }
    Ok(meshes)
}

/// The union of two sets of solids.
pub(super) fn united(a: &Solids, b: &Solids) -> Solids {
    let of_cell = |cell: usize| a.cell(cell).iter().chain(b.cell(cell)).copied().collect();
    Solids::new(a.grid, a.heights, (0..a.grid.cells()).map(of_cell))
}

/// The cells: the area's size in whole cells, centred in it.
fn grid(setup: &Shallow, bounds: &[DVec3; 2]) -> Result<Grid> {
    let [low, high] = bounds;
    let [x0, z0, x1, z1] = setup.area.unwrap_or([low.x, low.z, high.x, high.z]);
    let cell = setup.cell;
    let counts = [x1 - x0, z1 - z0].map(|length| (length / cell).round().max(1.0));
    if let Some(count) = counts.into_iter().find(|count| *count > MAX_CELLS as f64) {
        return Err(Error::argument(format!(
            "shallow.cell = {cell} m makes {count} cells of {:.6} x {:.6} m, over {MAX_CELLS} along an axis",
            x1 - x0,
            z1 - z0
        )));
    }
    let start = |from: f64, to: f64, count: f64| 0.5 * (from + to) - 0.5 * count * cell;
    let origin = [start(x0, x1, counts[0]), start(z0, z1, counts[1])];
    let grid = Grid { cell, origin, size: counts.map(|count| count as usize) };
    grid.validate()?;
    Ok(grid)
}

/// Minimum and maximum x and z of cells (m): `[x0, z0, x1, z1]`.
pub(super) fn area(grid: &Grid) -> [f64; 4] {
    let [x, z] = grid.origin;
    [x, z, x + grid.size[0] as f64 * grid.cell, z + grid.size[1] as f64 * grid.cell]
}

/// The heights of ground and liquid.
fn heights(setup: &Shallow, bounds: &[DVec3; 2]) -> Result<Heights> {
    let [low, high] = bounds.each_ref().map(|corner| corner.y);
    let margin = (MARGIN.0 * (high - low)).max(MARGIN.1);
    let below = if setup.sequence().is_some() { low - margin } else { low };
    let bottom = setup.bottom.unwrap_or(below);
    let top = setup.top.unwrap_or(high.max(setup.fill.unwrap_or(high)) + margin);
    if top <= bottom {
        return Err(Error::argument(format!(
            "the heights of ground and liquid go from {bottom} m up to {top} m: give shallow.bottom and shallow.top"
        )));
    }
    Heights::between(bottom, top)
}

/// Warnings about points that are attached to a position to one side of them, as happens high above a slope.
fn attachment_warnings(
    scene: &Scene,
    setup: &Shallow,
    mesh: &TriMesh,
    attached: &[Option<Attached>],
) -> Vec<String> {
    let warning = |(point, attached): (&TimedFlowPoint, &Option<Attached>)| {
        let [x, y, z] = attached.as_ref()?.position(mesh);
        let [own_x, _, own_z] = point.flow_point.at;
        let off = ((x - own_x).powi(2) + (z - own_z).powi(2)).sqrt();
        (off > point.flow_point.radius.max(2.0 * setup.cell)).then(|| {
            format!(
                "{}: {}: the point of the terrain that is nearest to it, with which it moves, lies {off:.6} m beside it, at ({x:.6}, {y:.6}, {z:.6})",
                scene.path.display(),
                point.title()
            )
        })
    };
    setup.points.iter().zip(attached).filter_map(warning).collect()
}

/// The warning about a mesh that is probably in another unit.
fn unit_warning(setup: &Shallow, path: &Path, [low, high]: &[DVec3; 2]) -> Option<String> {
    let size = high - low;
    let is_unscaled = setup.space.scale == Space::OWN.scale;
    (is_unscaled && size.x.max(size.z) > MAX_LIKELY_WIDTH).then(|| {
        format!(
            "{}: the terrain is {:.1} x {:.1} x {:.1} m (x, y, z): shallow.scale = 0.001 takes millimetres, 0.01 centimetres",
            path.display(),
            size.x,
            size.y,
            size.z
        )
    })
}
