//! The columns of a run of cells in two rows, for quartets that are searched column by column.

use super::links::LiquidColumns;
use super::strips::Found;
use crate::numeric::lists::refill;
use crate::shallow::columns::{Columns, NONE, STRIP};
use crate::shallow::surface::rim::boundary::{Wall, walls_of};

/// A column, or an extra.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow) struct Entry {
    /// Index of the column; for an extra, count of indices + position of its wall among the walls.
    pub id: u32,
    /// Layer of the column.
    pub layer: u32,
    /// Height and room (units); an extra has no room.
    pub height: i32,
    pub under: i32,
    pub ceiling: i32,
    pub base: i32,
    pub wet: bool,
    /// Position of its wall among the walls, or [`NONE`]; it links the entry with the wall's members.
    pub wall: u32,
}

impl Entry {
    #[inline(always)]
    pub fn holds(&self, height: i32) -> bool {
        (self.under <= height) & (height < self.ceiling)
    }

    /// Whether two columns of neighbouring cells are linked, one of them wet.
    #[inline(always)]
    pub fn is_linked(&self, other: &Self) -> bool {
        self.holds(other.height) & other.holds(self.height)
    }

    /// Whether the surface of this wet column ends at the solid of `wall`, whose room holds its height.
    pub fn ends_at(&self, wall: &Self) -> bool {
        self.height < self.ceiling && self.ceiling <= wall.base
    }
}

/// Cells in a row of a block, plus the next one.
const CELLS: usize = STRIP + 1;

#[derive(Debug, Default)]
struct Row {
    /// Strips by layer: of the block, and of the one to the east.
    strips: [Vec<usize>; 2],
    /// Entries cell by cell, from the lowest up.
    entries: Vec<Entry>,
    ends: [usize; CELLS + 1],
}

/// The cells of a block's quartets.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Cells {
    rows: [Row; 2],
    /// Of each layer of the block: its full quartets.
    full: Vec<u16>,
}

impl Cells {
    /// Reserves memory for this many layers.
    pub fn reserve(&mut self, layers: usize) {
        for row in &mut self.rows {
            row.strips.iter_mut().for_each(|strips| strips.reserve(layers));
            // Each column may be a wall, with at most an extra for each column around it.
            row.entries.reserve(CELLS * layers * (1 + 8 * layers));
        }
        self.full.reserve(layers);
    }

    /// Loads the cells of some quartets of a block.
    pub fn load(
        &mut self,
        liquid: LiquidColumns<'_>,
        found: &Found,
        walls: &[Wall],
        block: usize,
        quartets: u16,
    ) {
        let (row, at) = (block / found.across, block % found.across);
        let reaches_east = quartets >> 15 == 1;
        for (cells, row) in self.rows.iter_mut().zip(row..) {
            let [own, east] = &mut cells.strips;
            find_layers(liquid, [row, at], own);
            east.clear();
            if reaches_east {
                find_layers(liquid, [row, at + 1], east);
            }
        }
        refill(&mut self.full, self.rows[0].strips[0].iter().map(|&strip| found.states[strip].full));
        let cells = u32::from(quartets) | u32::from(quartets) << 1;
        self.rows.iter_mut().for_each(|row| row.load(liquid, found, walls, cells));
    }

    /// Columns and extras at a corner of a quartet: 0 north-west, 1 north-east, 2 south-west, 3 south-east.
    #[inline(always)]
    pub fn corner(&self, quartet: usize, corner: usize) -> &[Entry] {
        let (row, cell) = (&self.rows[corner >> 1], quartet + (corner & 1));
        &row.entries[row.ends[cell]..row.ends[cell + 1]]
    }

    /// Whether a column of a quartet is in a full group: it is then in no other.
    #[inline(always)]
    pub fn is_done(&self, quartet: usize, entry: &Entry) -> bool {
        self.full.get(entry.layer as usize).is_some_and(|full| full >> quartet & 1 == 1)
    }
}

/// Finds the strips of a block by layer.
fn find_layers(liquid: LiquidColumns<'_>, at: [usize; 2], out: &mut Vec<usize>) {
    refill(out, std::iter::successors(liquid.lowest(at), |&strip| liquid.above(strip)));
}

impl Row {
    fn load(&mut self, liquid: LiquidColumns<'_>, found: &Found, walls: &[Wall], cells: u32) {
        let columns = liquid.columns;
        let Self { strips, entries, ends } = self;
        entries.clear();
        for cell in 0..CELLS {
            let position = cell % STRIP;
            if cells >> cell & 1 == 1 {
                for (layer, &strip) in strips[cell / STRIP].iter().enumerate() {
                    if columns.present(strip) >> position & 1 == 0 {
                        break;
                    }
                    let index = strip * STRIP + position;
                    entries.push(Entry {
                        id: index as u32,
                        layer: layer as u32,
                        height: liquid.height(index),
                        under: columns.unders()[index],
                        ceiling: columns.ceilings()[index],
                        base: columns.bases()[index],
                        wet: liquid.is_wet(index),
                        wall: NONE,
                    });
                    if found.states[strip].walls >> position & 1 == 1 {
                        add_walls(columns, walls, entries);
                    }
                }
            }
            ends[cell + 1] = entries.len();
        }
    }
}

/// Adds the extras of the last column, which is a wall.
fn add_walls(columns: &Columns, walls: &[Wall], entries: &mut Vec<Entry>) {
    let Some(column) = entries.len().checked_sub(1) else { return };
    for position in walls_of(walls, entries[column].id) {
        let wall = position as u32;
        if walls[position].is_own {
            entries[column].wall = wall;
        } else {
            let (id, height) = (columns.len() as u32 + wall, walls[position].height);
            entries.push(Entry { id, height, under: 0, ceiling: 0, wet: false, wall, ..entries[column] });
        }
    }
}
