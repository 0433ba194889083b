//! Level sets of solids that are cut out of the liquid.

use std::path::{Path, PathBuf};

use frazil::io::sequence::Pattern;
use frazil::scene::FrameChoice;
use frazil::surface::HALF_WIDTH;
use frazil::vdb::level_set::{difference, to_mesh};
use frazil::vdb::{FloatGrid, file};
use frazil::{Error, Result};

use super::of_frame;
use super::shape::level_set_of;
use crate::cli::session::Session;
use crate::cli::vdb::{far_mesh, read_level_set};

/// How much a length may differ (of itself) and be taken for the same.
const ROUNDING: f64 = 1e-6;

/// One file, or a file for each frame.
struct Collider {
    path: PathBuf,
    is_sequence: bool,
    /// What the next frame takes instead of reading a file.
    known: Option<FloatGrid>,
}

/// All solids that are cut out.
pub struct Colliders(Vec<Collider>);

impl Colliders {
    /// Reads what the first frame needs, and sees whether the files of all others are there and hold level sets.
    pub fn open(paths: &[PathBuf], frames: &FrameChoice) -> Result<Self> {
        let open = |path: &PathBuf| {
            let is_sequence = Pattern::parse(path).is_some();
            if is_sequence {
                frames.iter().try_for_each(|frame| check(&of_frame(path, frame)))?;
            }
            let known = Some(read(&of_frame(path, frames.first()))?);
            Ok(Collider { path: path.clone(), is_sequence, known })
        };
        paths.iter().map(open).collect::<Result<_>>().map(Self)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Cuts those of a frame out of a liquid.
    pub fn cut(&mut self, session: &Session, liquid: &mut FloatGrid, frame: i32) -> Result<()> {
        let ctx = &session.ctx;
        for collider in &mut self.0 {
            let path = of_frame(&collider.path, frame);
            let grid = match collider.known.take() {
                Some(grid) => grid,
                None => read(&path)?,
            };
            let solid = fitted(session, grid, &path, liquid.voxel_size())?;
            if !collider.is_sequence {
                collider.known = Some(solid.deep_copy()?);
            }
            ctx.phase("subtract", || difference(ctx, liquid, solid))?;
        }
        Ok(())
    }
}

/// Refuses a file that has no level set, by its description alone.
fn check(path: &Path) -> Result<()> {
    let grids = file::describe(path)?;
    if grids.iter().any(|grid| grid.class == "level set") {
        return Ok(());
    }
    Err(Error::file(path, "holds no level set"))
}

fn read(path: &Path) -> Result<FloatGrid> {
    let grid = read_level_set(path, None)?;
    if grid.background() > 0.0 {
        return Ok(grid);
    }
    let what =
        format!("grid \"{}\" is solid everywhere outside of its voxels: turn it inside out", grid.name());
    Err(Error::file(path, what))
}

/// A solid on the liquid's cells (m), with a band as wide as the liquid's: what lies otherwise is made anew from its surface.
fn fitted(session: &Session, grid: FloatGrid, path: &Path, cell: f64) -> Result<FloatGrid> {
    let width = f64::from(HALF_WIDTH) * cell;
    let is_same = |a: f64, b: f64| (a - b).abs() <= ROUNDING * b;
    // Combining asks for cells that are the same to nine digits.
    let has_cells = grid.is_world_fixed() && (grid.voxel_size() - cell).abs() <= 1e-9 * cell;
    if has_cells && is_same(f64::from(grid.background()), width) {
        return Ok(grid);
    }
    let ctx = &session.ctx;
    let mesh = ctx.phase("collider", || to_mesh(ctx, &grid, 0.0, 0.0))?;
    if let Some(what) = far_mesh(path, &mesh, cell) {
        log::warn!("{what}");
    }
    level_set_of(session, mesh, cell)
}
