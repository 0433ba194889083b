//! The exact state of a flow: what a step that fails puts back, and the bytes from which a run resumes.

use rayon::prelude::*;

use super::Flow;
use super::tiles::{Coord, Field, Tile, Tiles};
use crate::base::bytes::{Reader, Writer};
use crate::error::{Error, Result};

/// What a flow carries from step to step.
#[derive(Debug, Clone, Default)]
pub struct Kept {
    tiles: Tiles,
    velocity: [Field; 3],
    density: Field,
    pressure: Field,
    around: Option<Box<Kept>>,
}

/// Greatest coordinate of a tile, either way.
const OUTERMOST: i32 = 1 << 26;
/// Bytes of a tile of one field.
const TILE: usize = 4 * 512;

/// A copy of a field, made by all threads: most of its time goes to memory that the system hands out for the first time.
fn copied(field: &[Tile]) -> Field {
    field.par_iter().with_min_len(64).copied().collect()
}

impl Flow {
    /// A copy of what is carried from step to step.
    pub fn keep(&self) -> Kept {
        Kept {
            tiles: self.tiles.clone(),
            velocity: self.velocity.each_ref().map(|field| copied(field)),
            density: copied(&self.density),
            pressure: copied(&self.pressure),
            around: self.around.as_ref().map(|around| Box::new(around.keep())),
        }
    }

    /// A flow with the same state.
    pub fn copy(&self) -> Self {
        Self {
            cell: self.cell,
            ambient: self.ambient,
            tiles: self.tiles.clone(),
            velocity: self.velocity.clone(),
            density: self.density.clone(),
            pressure: self.pressure.clone(),
            around: self.around.as_ref().map(|around| Box::new(around.copy())),
            ..Self::default()
        }
    }

    /// Puts back what was kept of this flow.
    pub fn put_back(&mut self, kept: Kept) {
        let Kept { tiles, velocity, density, pressure, around } = kept;
        (self.tiles, self.velocity, self.density, self.pressure) = (tiles, velocity, density, pressure);
        if let (Some(own), Some(around)) = (&mut self.around, around) {
            own.put_back(*around);
        }
    }

    /// Writes the exact state.
    pub fn save(&self, to: &mut Writer) {
        to.count(self.tiles.active());
        self.tiles.coords()[..self.tiles.active()].iter().for_each(|coord| to.i32s(coord));
        let fields = self.velocity.iter().chain([&self.density, &self.pressure]);
        fields.flatten().for_each(|tile| to.f32s(tile));
        if let Some(around) = &self.around {
            around.save(to);
        }
    }

    /// Reads a state that [`Flow::save`] wrote of a flow with the same cells.
    ///
    /// # Errors
    /// Bytes that are not such a state; the flow is then as it was.
    pub fn load(&mut self, from: &mut Reader<'_>) -> Result<()> {
        let kept = self.read(from)?;
        self.put_back(kept);
        Ok(())
    }

    fn read(&self, from: &mut Reader<'_>) -> Result<Kept> {
        let count = from.count(12)?;
        let coords: Vec<Coord> = (0..count).map(|_| from.i32s()).collect::<Result<_>>()?;
        if !coords.is_sorted_by(|a, b| a < b)
            || coords.iter().flatten().any(|at| !(-OUTERMOST..=OUTERMOST).contains(at))
        {
            return Err(Error::Bytes("has tiles out of order, or too far from the origin".into()));
        }
        // All fields of active tiles must be there before memory for them is taken.
        if from.rest().len() / TILE < 5 * count {
            return Err(Error::Bytes("the state is cut short".into()));
        }
        let tiles = Tiles::new(&coords);
        let mut field = |count: usize| (0..count).map(|_| from.f32s()).collect::<Result<Vec<Tile>>>();
        let all = tiles.count();
        let velocity = [field(all)?, field(all)?, field(all)?];
        let (density, pressure) = (field(tiles.active())?, field(all)?);
        let around = match &self.around {
            Some(around) => Some(Box::new(around.read(from)?)),
            None => None,
        };
        Ok(Kept { tiles, velocity, density, pressure, around })
    }
}
