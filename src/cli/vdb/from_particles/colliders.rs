//! Level sets of solids that are cut out of the liquid.

use std::path::{Path, PathBuf};

use crate::cli::options::frame_path;
use crate::cli::session::Session;
use crate::cli::vdb::far_mesh;
use frazil::geometry::TriMesh;
use frazil::io::files::sequence::Pattern;
use frazil::surface::HALF_WIDTH;
use frazil::sweep::{Settings, voxelise_within};
use frazil::vdb::level_set::{difference, to_mesh};
use frazil::vdb::{FloatGrid, file};
use frazil::{Context, Error, Result};

/// Relative difference below which two lengths are equal.
const TOLERANCE: f64 = 1e-6;

/// Margin (voxels) around a liquid in which a solid is resampled too.
const MARGIN: i32 = 16;

/// One file, or a file for each frame.
struct Collider {
    path: PathBuf,
    is_sequence: bool,
    /// The level sets of a single file, until the first frame takes them.
    shared: Option<Vec<FloatGrid>>,
    /// The solids of the previous frame, or of all frames.
    solids: Vec<Solid>,
}

/// A solid to cut out of a liquid.
enum Solid {
    /// A level set on the liquid's cells, with a band of the same width.
    Ready(FloatGrid),
    /// The surface, and the last level set made from it, with the box of voxels in which that is valid.
    Surface(TriMesh, Option<([[i32; 3]; 2], FloatGrid)>),
}

/// All solids that are cut out.
pub struct Colliders(Vec<Collider>);

impl Colliders {
    /// Reads the files that all frames share; files of single frames are read when their frame is made.
    pub fn open(ctx: &Context, paths: &[PathBuf]) -> Result<Self> {
        let open = |path: &PathBuf| {
            let is_sequence = Pattern::parse(path).is_some();
            let shared = if is_sequence { None } else { Some(read(ctx, path)?) };
            Ok(Collider { path: path.clone(), is_sequence, shared, solids: Vec::new() })
        };
        paths.iter().map(open).collect::<Result<_>>().map(Self)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Cuts the solids of a frame out of a liquid.
    pub fn cut(&mut self, session: &Session, liquid: &mut FloatGrid, frame: i32) -> Result<()> {
        self.0.iter_mut().try_for_each(|collider| {
            let path = frame_path(&collider.path, frame);
            collider.cut(&session.ctx, liquid, &path).map_err(|error| with_path(&path, error))
        })
    }
}

impl Collider {
    /// Cuts the level sets in a frame's file out of a liquid.
    fn cut(&mut self, ctx: &Context, liquid: &mut FloatGrid, path: &Path) -> Result<()> {
        let cell = liquid.voxel_size();
        if self.is_sequence || self.solids.is_empty() {
            let grids = match self.shared.take() {
                Some(grids) => grids,
                None => read(ctx, path)?,
            };
            let solid = |grid: FloatGrid| Solid::new(ctx, grid, path, cell);
            self.solids = grids.into_iter().map(solid).collect::<Result<_>>()?;
        }
        for solid in &mut self.solids {
            // Earlier cuts may have removed all of the liquid.
            let Some((low, high)) = liquid.active_bbox() else { return Ok(()) };
            let solid = solid.within(ctx, [low, high], cell)?;
            ctx.phase("subtract", || difference(ctx, liquid, solid))?;
        }
        Ok(())
    }
}

impl Solid {
    /// A solid for a liquid with cells of this edge (m).
    fn new(ctx: &Context, grid: FloatGrid, path: &Path, cell: f64) -> Result<Self> {
        let width = f64::from(HALF_WIDTH) * cell;
        let is_same = |a: f64, b: f64| (a - b).abs() <= TOLERANCE * b;
        // Combining requires cells that agree to nine digits.
        let has_cells = grid.is_world_fixed() && (grid.voxel_size() - cell).abs() <= 1e-9 * cell;
        if has_cells && is_same(f64::from(grid.background()), width) {
            return Ok(Self::Ready(grid));
        }
        let surface = ctx.phase("collider", || to_mesh(ctx, &grid, 0.0, 0.0))?;
        if let Some(what) = far_mesh(path, &surface, cell) {
            log::warn!("{what}");
        }
        if !surface.is_closed() {
            let (path, name) = (path.display(), grid.name());
            log::warn!(
                "{path}: grid \"{name}\" ends inside the solid, so that its surface has holes: they are closed by cones"
            );
        }
        Ok(Self::Surface(surface, None))
    }

    /// Its level set in a box of a liquid's voxels, on cells of this edge (m).
    fn within(&mut self, ctx: &Context, [low, high]: [[i32; 3]; 2], cell: f64) -> Result<FloatGrid> {
        let (mesh, cache) = match self {
            Self::Ready(grid) => return grid.deep_copy(),
            Self::Surface(mesh, _) if mesh.triangles.is_empty() => {
                return FloatGrid::level_set(cell, HALF_WIDTH);
            }
            Self::Surface(mesh, cache) => (mesh, cache),
        };
        let holds = |bounds: &[[i32; 3]; 2]| {
            (0..3).all(|axis| bounds[0][axis] <= low[axis] && high[axis] <= bounds[1][axis])
        };
        match cache {
            Some((bounds, grid)) if holds(bounds) => grid.deep_copy(),
            _ => {
                // A liquid that moves a little stays within the margin.
                let bounds = [low.map(|at| at - MARGIN), high.map(|at| at + MARGIN)];
                let settings = Settings { half_width: HALF_WIDTH, ..Settings::new(cell) };
                let grid = voxelise_within(ctx, mesh.clone(), &settings, bounds)?;
                let (_, grid) = cache.insert((bounds, grid));
                grid.deep_copy()
            }
        }
    }
}

/// An error that arose while a solid was cut out, with the name of its file.
fn with_path(path: &Path, error: Error) -> Error {
    let path = path.display();
    match error {
        Error::Memory { needed, limit, .. } => {
            Error::Memory { what: format!("{path}: the solid on the liquid's cells"), needed, limit }
        }
        Error::Argument(what) => Error::Argument(format!("{path}: {what}")),
        Error::OpenVdb(what) => Error::OpenVdb(format!("{path}: {what}")),
        other => other,
    }
}

/// The names of the level sets of a file, ascending.
///
/// # Errors
/// A level set that is not of 32-bit floats.
fn names(path: &Path) -> Result<Vec<String>> {
    let mut grids = file::describe(path)?;
    grids.retain(|grid| grid.class == "level set");
    if let Some(grid) = grids.iter().find(|grid| !grid.value_type.starts_with("Tree_float")) {
        let what = format!("level set \"{}\" is not of 32-bit floats but {}", grid.name, grid.value_type);
        return Err(Error::file(path, what));
    }
    let mut names: Vec<String> = grids.into_iter().map(|grid| grid.name).collect();
    names.sort_unstable();
    Ok(names)
}

/// All level sets of a file.
fn read(ctx: &Context, path: &Path) -> Result<Vec<FloatGrid>> {
    let names = names(path)?;
    if let Some(duplicate) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::file(
            path,
            format!("has two level sets \"{}\": give them other names", duplicate[0]),
        ));
    }
    if names.len() < 2 {
        return Ok(vec![solid(ctx, path, None)?]);
    }
    names.iter().map(|name| solid(ctx, path, Some(name))).collect()
}

fn solid(ctx: &Context, path: &Path, name: Option<&str>) -> Result<FloatGrid> {
    let grid = file::read_level_set(ctx, path, name)?;
    if grid.background() > 0.0 {
        return Ok(grid);
    }
    let what =
        format!("grid \"{}\" is solid everywhere outside of its voxels: turn it inside out", grid.name());
    Err(Error::file(path, what))
}
