//! Relieves crowding at the end of a step. An object fills the volume that it sweeps, so the snow of a slice as thick as its
//! displacement must leave through a closing gap. Grains that push each other aside get no farther than about ten diameters
//! in a frame; the rest would overlap more with every frame. At the end of the step, surplus grains are therefore moved along
//! the surfaces and through the grains around them, by the shortest path, to cells with free space: up the front of a plough,
//! out from under a sole.
//!
//! Grains are counted in cells of two diameters. They keep their velocity.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::layout::world;
use super::rest;
use super::rows::{Row, V, add};
use super::surfaces::{Side, Surfaces};
use crate::context::Context;
use crate::error::Result;
#[cfg(test)]
use crate::geometry::DVec3;
use crate::snow::grains::colliders::set::Colliders;
use crate::snow::grains::heap::Heap;
use crate::snow::grains::solver::blocks::{BlockIndex, EDGE};

/// Edge of a cell (diameters): it holds 2 x 2 x 2 grains side by side.
const CELL: f32 = 2.0;
/// Cells along a block's edge.
const PER_BLOCK: i32 = (EDGE / CELL) as i32;

/// Grains that a crowded cell keeps in addition to one for each octant that is clear of surfaces.
const EXTRA_KEPT: usize = 2;
/// A cell with fewer grains than this has free space.
const FREE_BELOW: usize = 7;
/// Maximum length of a grain's path (cells).
const MAX_PATH: usize = 100;
/// Minimum distance (diameters) from a surface at which a moved grain is placed.
const CLEARANCE: f64 = 0.5;
/// Largest offset (diameters) of a moved grain from the centre of its octant, along each axis.
const JITTER: f32 = 0.25;
/// Largest distance (diameters) of such a position from the centre of its cell.
const MAX_OFF_CENTRE: f64 = 1.3;
/// A path does not enter cells whose centre is at least this deep (diameters) in a surface: half a cell edge, so that paths
/// can run between two surfaces that touch.
const MAX_DEPTH: f64 = 1.0;
/// Margin around a block (cells of a level set).
const MARGIN: f64 = 2.0;

type Cell = [i32; 3];
/// Cells of a block, and a count of grains for each.
const CELLS: usize = (PER_BLOCK * PER_BLOCK * PER_BLOCK) as usize;
type Counts = [u32; CELLS];
/// Grains that a task counts.
const CHUNK: usize = 16_384;

impl Heap {
    /// Moves grains out of cells that hold more than `max` into cells with free space. Meshes are at their current pose.
    ///
    /// # Errors
    /// Cancel; errors of a grid.
    pub(in crate::snow::grains) fn make_room(
        &mut self,
        ctx: &Context,
        colliders: &Colliders<'_>,
        max: usize,
    ) -> Result<()> {
        let crowded = self.crowded(max);
        if crowded.is_empty() {
            return Ok(());
        }
        let slots = (0u32..).zip(self.rows.iter().zip(&self.at));
        let mut slots: Vec<(Cell, u32)> =
            slots.map(|(slot, (row, at))| (cell(*at, row.position), slot)).collect();
        slots.par_sort_unstable();
        let mut map =
            Map { slots, rows: &self.rows, colliders, diameter: self.diameter, blocks: HashMap::new() };
        let moves = CrowdSearch::start_all(&mut map, &crowded)?.run(ctx, &mut map)?;
        for Move { slot, cell, position } in &moves {
            let row = &mut self.rows[*slot as usize];
            (row.position, self.at[*slot as usize]) = (*position, block(*cell));
            rest::wake(row);
            rest::restart_wait(row);
        }
        let slots: HashSet<u32> = moves.iter().map(|Move { slot, .. }| *slot).collect();
        self.pair_impulses.retain(|held| !held.grains.iter().any(|slot| slots.contains(slot)));
        self.touches.retain(|touch| !slots.contains(&touch.grain));
        let ids: HashSet<u32> = slots.iter().map(|slot| self.ids[*slot as usize]).collect();
        self.trapped.retain(|id| !ids.contains(id));
        Ok(())
    }
}

impl Heap {
    /// Cells that hold more than `max` grains, ascending.
    fn crowded(&self, max: usize) -> Vec<Cell> {
        let chunks = self.rows.par_chunks(CHUNK).zip(self.at.par_chunks(CHUNK));
        let counts = chunks.map(|(rows, at)| {
            let mut counts = HashMap::<BlockIndex, Counts>::new();
            // Grains of a block lie next to each other.
            let mut first = 0;
            for at in at.chunk_by(|a, b| a == b) {
                let counts = counts.entry(at[0]).or_insert([0; CELLS]);
                rows[first..first + at.len()].iter().for_each(|row| counts[index_of(row.position)] += 1);
                first += at.len();
            }
            counts
        });
        let all = counts.reduce(HashMap::new, |mut all, part| {
            for (at, part) in part {
                let counts = all.entry(at).or_insert([0; CELLS]);
                counts.iter_mut().zip(part).for_each(|(count, more)| *count += more);
            }
            all
        });
        let is_crowded = |(_, count): &(usize, &u32)| **count as usize > max;
        let cells = all.iter().flat_map(|(at, counts)| {
            counts.iter().enumerate().filter(is_crowded).map(|(index, _)| cell_of(*at, index))
        });
        let mut cells: Vec<Cell> = cells.collect();
        cells.sort_unstable();
        cells
    }
}

/// A grain to move.
struct Move {
    slot: u32,
    cell: Cell,
    /// Position within its block (diameters).
    position: V,
}

/// Positions of grains and surfaces.
struct Map<'a, 'b> {
    /// The cell and slot of each grain, ascending.
    slots: Vec<(Cell, u32)>,
    rows: &'a [Row],
    colliders: &'a Colliders<'b>,
    /// Diameter of a grain (m).
    diameter: f64,
    /// Surfaces around the blocks visited so far.
    blocks: HashMap<BlockIndex, Surfaces<'a>>,
}

/// Contents of a cell.
struct CellContents {
    /// Side of the surfaces that its centre is on.
    side: Side,
    /// Count of grains in it.
    count: usize,
    /// For each octant that is clear of surfaces, a position in it (diameters, within the block) and whether it holds grains.
    octants: Vec<(V, bool)>,
}

impl Map<'_, '_> {
    /// Reads the surfaces around cells.
    fn load_surfaces(&mut self, cells: impl Iterator<Item = Cell>) -> Result<()> {
        let mut new: Vec<BlockIndex> = cells.map(block).filter(|at| !self.blocks.contains_key(at)).collect();
        new.sort_unstable();
        new.dedup();
        let around = Surfaces::around(self.colliders, &new, self.diameter, MARGIN)?;
        self.blocks.extend(new.into_iter().zip(around));
        Ok(())
    }

    /// Slots of the grains of a cell.
    fn grains(&self, cell: Cell) -> impl Iterator<Item = u32> + '_ {
        let first = self.slots.partition_point(|(of, _)| *of < cell);
        self.slots[first..].iter().take_while(move |(of, _)| *of == cell).map(|(_, slot)| *slot)
    }

    /// Which side of the surfaces a position (diameters, within the cell's block) is on.
    fn side_of(&self, cell: Cell, position: V) -> Side {
        let at = block(cell);
        self.blocks[&at].side(world(at, position, self.diameter))
    }

    /// Slots of the grains of a cell: those on the same side of meshes as its centre, and the others.
    fn by_side(&self, cell: Cell, centre: &Side) -> [Vec<u32>; 2] {
        let is_beyond = |slot: &u32| {
            !centre.out.is_empty() && self.side_of(cell, self.rows[*slot as usize].position).is_across(centre)
        };
        let (beyond, here) = self.grains(cell).partition(is_beyond);
        [here, beyond]
    }

    /// Contents of a cell whose surfaces have been read. Octants are listed only if the cell has free space or `always` is
    /// set.
    fn contents(&self, cell: Cell, always: bool) -> CellContents {
        let side = |position: V| self.side_of(cell, position);
        let corner = cell.map(|at| at.rem_euclid(PER_BLOCK) as f32 * CELL);
        let known = side(add(corner, [0.5 * CELL; 3]));
        let grains: Vec<u32> = self.grains(cell).collect();
        let count = grains.len();
        let mut octants = Vec::new();
        if known.distance > -MAX_DEPTH && (always || count < FREE_BELOW) {
            let is_in = |slot: &u32, octant: usize| {
                let position = self.rows[*slot as usize].position;
                (0..3).all(|axis| (position[axis] - corner[axis] >= 0.5 * CELL) == (octant >> axis & 1 == 1))
            };
            for octant in 0..8 {
                let position = add(corner, jittered_position(cell, octant));
                let is_clear = || {
                    let beside = side(position);
                    beside.distance >= CLEARANCE && !beside.is_across(&known)
                };
                if known.distance >= CLEARANCE + MAX_OFF_CENTRE || is_clear() {
                    octants.push((position, grains.iter().any(|slot| is_in(slot, octant))));
                }
            }
        }
        CellContents { side: known, count, octants }
    }
}

/// A breadth-first search from all crowds at once for cells with free space. A crowd lies on one side of each mesh: grains of
/// one cell on two sides of a sheet are two crowds, and crowds on two sides never share a cell.
struct CrowdSearch {
    /// The crowd that reached each cell first, and the index of the cell's side.
    reached_by: HashMap<Cell, (u32, usize)>,
    /// Sides of the cells and grains that paths start from.
    sides: Vec<Side>,
    /// Union-find: the crowd that each crowd was merged into, or itself.
    parents: Vec<u32>,
    /// Slots of the surplus grains of each crowd.
    pools: Vec<Vec<u32>>,
    /// Cells that crowds reached in the last round, each with its crowd and the index of its side.
    front: Vec<(Cell, u32, usize)>,
}

impl CrowdSearch {
    /// One crowd per crowded cell, and another of the grains that a mesh separates from the cell's centre.
    fn start_all(map: &mut Map<'_, '_>, crowded: &[Cell]) -> Result<Self> {
        map.load_surfaces(crowded.iter().copied())?;
        let known: Vec<(CellContents, [Vec<u32>; 2])> = crowded
            .par_iter()
            .map(|&cell| {
                let known = map.contents(cell, true);
                let grains = map.by_side(cell, &known.side);
                (known, grains)
            })
            .collect();
        let (reached_by, sides, parents) = Default::default();
        let mut search = Self { reached_by, sides, parents, pools: Vec::new(), front: Vec::new() };
        for (&cell, (known, [here, beyond])) in crowded.iter().zip(known) {
            let crowd = search.start(cell, known.side, here.get(known.octants.len() + EXTRA_KEPT..));
            search.reached_by.insert(cell, crowd);
            if let Some(first) = beyond.first() {
                let side = map.side_of(cell, map.rows[*first as usize].position);
                search.start(cell, side, beyond.get(EXTRA_KEPT..));
            }
        }
        Ok(search)
    }

    /// A new crowd in a cell, on a side, with its surplus grains. Returns it and the index of the side.
    fn start(&mut self, cell: Cell, side: Side, surplus: Option<&[u32]>) -> (u32, usize) {
        let (crowd, index) = (self.pools.len() as u32, self.sides.len());
        self.sides.push(side);
        self.parents.push(crowd);
        self.pools.push(surplus.unwrap_or_default().to_vec());
        self.front.push((cell, crowd, index));
        (crowd, index)
    }

    /// The moves of grains.
    ///
    /// # Errors
    /// Cancel; errors of a grid.
    fn run(mut self, ctx: &Context, map: &mut Map<'_, '_>) -> Result<Vec<Move>> {
        let mut moves = Vec::new();
        for _ in 0..MAX_PATH {
            ctx.check()?;
            let visits = self.advance();
            if visits.is_empty() {
                break;
            }
            let mut cells: Vec<Cell> = visits.iter().map(|(cell, _)| *cell).collect();
            cells.sort_unstable();
            cells.dedup();
            map.load_surfaces(cells.iter().copied())?;
            let known: Vec<CellContents> = cells.par_iter().map(|cell| map.contents(*cell, false)).collect();
            let first = self.sides.len();
            let (sides, known): (Vec<Side>, Vec<_>) = known
                .into_iter()
                .map(|CellContents { side, count, octants }| (side, (count, octants)))
                .unzip();
            self.sides.extend(sides);
            let mut front = Vec::new();
            for (cell, from) in visits {
                let index = cells.partition_point(|other| *other < cell);
                let (_, crowd, side) = self.front[from];
                let reached = &self.sides[first + index];
                if reached.distance <= -MAX_DEPTH || reached.is_across(&self.sides[side]) {
                    continue;
                }
                let crowd = self.root(crowd);
                match self.reached_by.entry(cell) {
                    Entry::Occupied(entry) => {
                        let (other, _) = *entry.get();
                        self.merge(crowd, other);
                    }
                    Entry::Vacant(entry) => {
                        entry.insert((crowd, first + index));
                        let (count, octants) = &known[index];
                        let room = FREE_BELOW.saturating_sub(*count);
                        for (position, _) in octants.iter().filter(|(_, is_taken)| !is_taken).take(room) {
                            let Some(slot) = self.pools[crowd as usize].pop() else { break };
                            moves.push(Move { slot, cell, position: *position });
                        }
                        front.push((cell, crowd, first + index));
                    }
                }
            }
            self.front = front;
        }
        Ok(moves)
    }

    /// Unvisited cells next to the front, each with the index of the front's cell that may reach it. Crowds that meet on the
    /// same side are merged.
    fn advance(&mut self) -> Vec<(Cell, usize)> {
        let mut visits = Vec::new();
        for from in 0..self.front.len() {
            let (cell, crowd, side) = self.front[from];
            let crowd = self.root(crowd);
            if self.pools[crowd as usize].is_empty() {
                continue;
            }
            for step in (0..27).filter(|step| *step != 13) {
                let [x, y, z] = cell;
                let near = [x + step / 9 - 1, y + step / 3 % 3 - 1, z + step % 3 - 1];
                match self.reached_by.get(&near) {
                    None => visits.push((near, from)),
                    Some(&(other, beside)) if !self.sides[beside].is_across(&self.sides[side]) => {
                        self.merge(crowd, other);
                    }
                    Some(_) => (),
                }
            }
        }
        visits
    }

    /// The crowd that a crowd was merged into.
    fn root(&self, crowd: u32) -> u32 {
        let mut crowd = crowd;
        while self.parents[crowd as usize] != crowd {
            crowd = self.parents[crowd as usize];
        }
        crowd
    }

    /// Merges two crowds that meet.
    fn merge(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            let (into, from) = (a.min(b), a.max(b));
            self.parents[from as usize] = into;
            let pool = std::mem::take(&mut self.pools[from as usize]);
            self.pools[into as usize].extend(pool);
        }
    }
}

/// The cell of a position in a block.
fn cell(at: BlockIndex, position: V) -> Cell {
    [0, 1, 2].map(|axis| at[axis] * PER_BLOCK + (position[axis] / CELL) as i32)
}

/// Index of the cell of a position in its block.
fn index_of(position: V) -> usize {
    position.iter().fold(0, |index, x| index * PER_BLOCK as usize + (x / CELL) as usize)
}

/// The cell of an index in a block.
fn cell_of(at: BlockIndex, index: usize) -> Cell {
    let edge = PER_BLOCK as usize;
    let within = [index / edge / edge, index / edge % edge, index % edge];
    [0, 1, 2].map(|axis| at[axis] * PER_BLOCK + within[axis] as i32)
}

/// The block of a cell.
fn block(cell: Cell) -> BlockIndex {
    cell.map(|at| at.div_euclid(PER_BLOCK))
}

/// A jittered position in an octant of a cell (diameters, from the cell's minimum corner).
fn jittered_position(cell: Cell, octant: usize) -> V {
    let hash = crate::snow::grains::birth::sourcing::hash(octant as u64, 0, cell.map(i64::from));
    [0, 1, 2].map(|axis: usize| {
        let share = (hash >> (21 * axis) & 0x1f_ffff) as f32 / 1_048_576.0 - 1.0;
        0.25 * CELL + 0.5 * CELL * (octant >> axis & 1) as f32 + JITTER * share
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Pool;
    use crate::geometry::mesh::TriMesh;
    use crate::snow::grains::colliders::set::Floor;
    use crate::snow::grains::colliders::shell::Shell;
    use crate::snow::grains::heap::MAX_IN_CELL;

    /// Positions (m) of grains of diameter 1 m on a floor, beside a mesh, after crowding was relieved.
    fn spread(positions: &[DVec3], mesh: Option<(TriMesh, bool)>) -> Vec<DVec3> {
        let mut heap = Heap::new(1.0);
        for (id, position) in (0..).zip(positions) {
            heap.add(id, *position, [0.0; 3]).unwrap();
        }
        let floor = Some(Floor { height: 0.0, friction: 0.5 });
        let mut colliders = Colliders { floor, ..Colliders::default() };
        if let Some((mesh, closed)) = mesh {
            let pose: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast::<f64>()).collect();
            let mut shell = Shell::new(0.5, mesh.triangles, closed, pose.clone());
            shell.advance(&pose);
            colliders.shells.push((shell, Box::new(|_, _| Ok(()))));
        }
        let ctx = Context::new(Pool::new(2).unwrap());
        ctx.step(1, || ctx.phase("move", || heap.make_room(&ctx, &colliders, MAX_IN_CELL))).unwrap();
        assert_eq!(heap.ids(), (0..positions.len() as u32).collect::<Vec<u32>>());
        heap.positions().collect()
    }

    fn fullest(positions: &[DVec3]) -> usize {
        let mut counts = HashMap::new();
        positions
            .iter()
            .for_each(|position| *counts.entry(position.map(|x| (x / 2.0).floor() as i64)).or_insert(0) += 1);
        counts.into_values().max().unwrap_or(0)
    }

    #[test]
    fn grains_at_one_position_spread_and_stay_above_the_floor() {
        let positions = spread(&[DVec3::new(0.3, 0.6, -0.2); 3000], None);
        assert!(fullest(&positions) <= MAX_IN_CELL, "{}", fullest(&positions));
        assert!(positions.iter().all(|position| position.y >= 0.5), "one is in the floor");
        // A hemisphere with seven grains per eight cubic diameters.
        let farthest = positions.iter().map(|position| position.norm()).fold(0.0, f64::max);
        assert!(
            farthest < 1.8 * (3000.0 * 8.0 / 7.0 / (2.0 / 3.0 * std::f64::consts::PI)).cbrt(),
            "{farthest}"
        );
    }

    #[test]
    fn grains_leave_a_closed_gap_along_it() {
        // A plate on the floor, 30 by 30 and too thick for any grain to pass through.
        let plate = TriMesh::cuboid([-15.0, 0.1, -15.0], [15.0, 30.0, 15.0]);
        let at = |n: i32| DVec3::new(f64::from(n % 40) * 0.05 - 1.0, 0.05, f64::from(n / 40) * 0.05 - 1.0);
        let before: Vec<DVec3> = (0..1600).map(at).collect();
        let after = spread(&before, Some((plate, true)));
        let moved: Vec<&DVec3> =
            after.iter().zip(&before).filter(|(a, b)| (*a - *b).norm() > 0.01).map(|(a, _)| a).collect();
        assert!(moved.len() > 1400, "{}", moved.len());
        let is_beside =
            |position: &&DVec3| position.x.abs().max(position.z.abs()) >= 15.4 && position.y >= 0.5;
        assert!(moved.iter().all(is_beside), "{:?}", moved.iter().find(|position| !is_beside(position)));
    }

    #[test]
    fn no_grain_goes_through_a_sheet() {
        let sheet = TriMesh::cuboid([0.0, -1.0, -60.0], [0.0, 60.0, 60.0]);
        for (side, turn) in [(-1.0, 0.0), (1.0, 0.0), (1.0, 30.0), (-1.0, 45.0), (1.0, 75.0)] {
            let (sine, cosine) = f64::to_radians(turn).sin_cos();
            let [normal, along] = [DVec3::new(cosine, 0.0, sine), DVec3::new(-sine, 0.0, cosine)];
            for shift in [0.0, 0.7, 1.3, 1.9] {
                let mut turned = sheet.clone();
                for position in &mut turned.positions {
                    let to =
                        normal * shift + along * f64::from(position.z) + DVec3::y() * f64::from(position.y);
                    *position = to.cast::<f32>();
                }
                let from = normal * (shift + 0.7 * side) + DVec3::y() * 0.6;
                let positions = spread(&[from; 2000], Some((turned, false)));
                assert!(fullest(&positions) <= MAX_IN_CELL);
                let is_beside = |position: &DVec3| (position.dot(&normal) - shift) * side >= 0.49;
                assert!(
                    positions.iter().all(is_beside),
                    "one is on the other side, {turn} degrees at {shift}"
                );
            }
        }
    }
}
