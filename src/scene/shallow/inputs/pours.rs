//! Liquid that a scene pours at given frames.

use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::shallow::{ML, Pour, Shallow};
use crate::shallow::{self, columns::Columns};

/// Pours the liquid of a frame.
///
/// # Errors
/// A pour above nothing but solid, outside the area, or that does not fit, with its name.
pub(in crate::scene::shallow) fn pour(
    scene: &Scene,
    setup: &Shallow,
    liquid: &mut shallow::Shallow,
    frame: i32,
) -> Result<()> {
    let first = scene.shot.frames.first;
    for (index, pour) in
        setup.pours.iter().enumerate().filter(|(_, pour)| pour.frame.unwrap_or(first) == frame)
    {
        let refused = |what: String| Error::file(&scene.path, format!("pour.{}: {what}", index + 1));
        let columns = pour.columns(liquid.columns());
        if columns.is_empty() {
            let [x, y, z] = pour.at;
            return Err(refused(format!(
                "at ({x}, {y}, {z}) there is only solid, or it lies outside of the area"
            )));
        }
        liquid.set_poured(&pour.carries)?;
        let missing = pour.volume - spread(liquid, &columns, pour.volume);
        // Rounding of depths leaves less than a unit in each column.
        let (cell, unit) = (liquid.columns().grid.cell, liquid.columns().heights.unit);
        if missing > 1e-6 * pour.volume + columns.len() as f64 * unit * cell * cell {
            let what = format!(
                "{} ml do not fit into its circle: {:.6} ml are left (give a greater radius or shallow.top)",
                pour.volume / ML,
                missing / ML
            );
            return Err(refused(what));
        }
    }
    Ok(())
}

/// Adds a volume (m3) to columns, in equal depths as far as each has room; returns the added volume.
fn spread(liquid: &mut shallow::Shallow, columns: &[usize], volume: f64) -> f64 {
    let cell = liquid.columns().grid.cell;
    let unit = liquid.columns().heights.unit;
    let (mut open, mut left) = (columns.to_vec(), volume / (cell * cell));
    while !open.is_empty() {
        let each = left / open.len() as f64;
        if each < unit {
            break;
        }
        let mut full = 0;
        open.retain(|&column| {
            let added = liquid.pour(column, each);
            left -= added;
            let takes_all = added > each - unit;
            full += usize::from(!takes_all);
            takes_all
        });
        if full == 0 {
            break;
        }
    }
    volume - left * cell * cell
}

impl Pour {
    /// The columns in its circle, chosen as for a source: in each cell the one that contains its centre's height, or is nearest to it.
    fn columns(&self, columns: &Columns) -> Vec<usize> {
        let [x, y, z] = self.at;
        let mut cells: Vec<[usize; 2]> = columns.grid.in_circle([x, z], self.radius).collect();
        if cells.is_empty() {
            cells.extend(columns.grid.cell_at([x, z]));
        }
        cells.into_iter().filter_map(|cell| Some(columns.nearest(cell, y)?.0)).collect()
    }
}
