//! The exact state of a flow: what a failed step restores, and the bytes from which a run resumes.

use rayon::prelude::*;

use super::Flow;
use super::scratch::first_tiles;
use super::tiles::{Coord, Field, Tile, Tiles};
use crate::error::{Error, Result, fail_if};
use crate::numeric::bytes::{Reader, Writer};

/// The state that a flow carries from step to step.
#[derive(Debug, Default)]
pub struct FlowState {
    tiles: Tiles,
    velocity: [Field; 3],
    density: Field,
    pressure: Field,
    around: Option<Box<FlowState>>,
}

/// Maximum absolute coordinate of a tile.
const MAX_COORD: i32 = 1 << 26;
/// Bytes of a tile of one field.
const TILE: usize = 4 * 512;

impl FlowState {
    /// Copies the persistent state of a flow into the memory that this state holds.
    pub fn copy_from(&mut self, flow: &Flow) {
        self.tiles.clone_from(&flow.tiles);
        for (to, from) in self.velocity.iter_mut().zip(&flow.velocity) {
            copy(from, to);
        }
        copy(&flow.density, &mut self.density);
        copy(&flow.pressure, &mut self.pressure);
        if let Some(around) = &flow.around {
            self.around.get_or_insert_default().copy_from(around);
        }
    }
}

fn copy(from: &[Tile], to: &mut Field) {
    to.truncate(from.len());
    first_tiles(to, from.len()).par_iter_mut().zip(from).with_min_len(64).for_each(|(to, from)| *to = *from);
}

impl Flow {
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

    /// Restores this flow from `kept`, whose contents are then undefined; only its memory can be reused.
    pub fn restore(&mut self, kept: &mut FlowState) {
        self.solids = None;
        std::mem::swap(&mut self.tiles, &mut kept.tiles);
        std::mem::swap(&mut self.velocity, &mut kept.velocity);
        std::mem::swap(&mut self.density, &mut kept.density);
        std::mem::swap(&mut self.pressure, &mut kept.pressure);
        if let (Some(own), Some(around)) = (&mut self.around, &mut kept.around) {
            own.restore(around);
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

    /// Reads a state that [`Flow::save`] wrote for a flow with the same cell size.
    ///
    /// # Errors
    /// Bytes that are not such a state; the flow is then unchanged.
    pub fn load(&mut self, from: &mut Reader<'_>) -> Result<()> {
        let mut kept = self.read(from)?;
        self.restore(&mut kept);
        Ok(())
    }

    fn read(&self, from: &mut Reader<'_>) -> Result<FlowState> {
        let count = from.count(12)?;
        let coords: Vec<Coord> = (0..count).map(|_| from.i32s()).collect::<Result<_>>()?;
        if !coords.is_sorted_by(|a, b| a < b)
            || coords.iter().flatten().any(|at| !(-MAX_COORD..=MAX_COORD).contains(at))
        {
            return Err(Error::Bytes("has tiles out of order, or too far from the origin".into()));
        }
        // All fields of active tiles must be present before memory for them is allocated.
        fail_if(from.rest().len() / TILE < 5 * count, || Error::Bytes("the state is cut short".into()))?;
        let tiles = Tiles::new(&coords);
        let mut field = |count: usize| (0..count).map(|_| from.f32s()).collect::<Result<Vec<Tile>>>();
        let all = tiles.count();
        let velocity = [field(all)?, field(all)?, field(all)?];
        let (density, pressure) = (field(tiles.active())?, field(all)?);
        let around = match &self.around {
            Some(around) => Some(Box::new(around.read(from)?)),
            None => None,
        };
        Ok(FlowState { tiles, velocity, density, pressure, around })
    }
}
