//! After a change of the terrain, a liquid must be in the same state as one created on the new terrain.

use super::*;
use crate::context::{Context, Pool};
use crate::shallow::Params;
use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights, TOP};
use crate::shallow::columns::{Columns, NONE};
use crate::shallow::free_fall::Falls;
use crate::shallow::params::{Friction, TimeStepping};
use crate::shallow::pipes::{Border, Pipes};

struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 20) as usize % end
    }

    fn height(&mut self, [low, high]: [i32; 2]) -> i32 {
        low + self.below((high - low) as usize) as i32
    }
}

/// Units in a metre.
const METRE: i32 = 1 << 20;

fn heights() -> Heights {
    Heights::between(0.0, 1024.0).unwrap()
}

/// Ground a few metres high, with up to `layers` slabs above; sometimes none.
fn cell(dice: &mut Dice, layers: usize) -> Vec<Solid> {
    let mut solids = vec![[BOTTOMLESS, dice.height([0, 4 * METRE])]];
    for layer in 1..=dice.below(layers + 1) as i32 {
        let bottom = dice.height([layer * 6 * METRE, layer * 6 * METRE + 3 * METRE]);
        solids.push([bottom, bottom + dice.height([1, 2 * METRE])]);
    }
    match dice.below(40) {
        0 => solids.clear(),
        1 => solids[0][0] = -METRE,
        2 => solids.last_mut().unwrap()[1] = TOP,
        _ => {}
    }
    solids
}

fn solids(grid: Grid, cells: &[Vec<Solid>]) -> Solids {
    Solids::new(grid, heights(), cells.iter().cloned())
}

fn params(border: Border) -> Params {
    Params { border, pace: TimeStepping::Realtime(0.01), ..Params::default() }
}

/// The state of every pipe, sorted by its ends (as cells and layers) and side: flux and remainder.
fn carried(shallow: &Shallow) -> Vec<([usize; 7], [u32; 2])> {
    let (columns, flow, links) = (&shallow.columns, &shallow.flow, &shallow.pipes.links);
    let position = |index: usize| {
        let [x, z] = columns.cell(index);
        [x, z, columns.layer(index)]
    };
    let mut all = Vec::new();
    let mut add = |from: usize, to: Option<usize>, side: usize, carried: [f32; 2]| {
        let ([a, b, c], [d, e, f]) = (position(from), to.map_or([usize::MAX; 3], position));
        all.push(([a, b, c, d, e, f, side], carried.map(f32::to_bits)));
    };
    for i in columns.indices() {
        let (strip, position) = (i / STRIP, i % STRIP);
        if shallow.pipes.east[i] > 0.0 {
            add(i, Some(i + 1), 0, [flow.flux[0][i], flow.remainder[0][i]]);
        }
        if shallow.pipes.south[i] > 0.0 {
            let j = columns.south(strip) as usize * STRIP + position;
            add(i, Some(j), 1, [flow.flux[1][i], flow.remainder[1][i]]);
        }
    }
    for link in 0..links.len() {
        let to = (links.to[link] != NONE).then_some(links.to[link] as usize);
        let carried = [flow.links.flux[link], flow.links.remainder[link]];
        add(links.from[link] as usize, to, links.sides[link] as usize, carried);
    }
    all.sort_unstable();
    all
}

/// A new liquid on the same terrain with the same state.
fn created_anew(ctx: &Context, shallow: &Shallow, solids: &Solids) -> Shallow {
    let mut new = Shallow::new(ctx, solids, shallow.params.clone()).unwrap();
    assert!(new.columns == shallow.columns, "different columns");
    assert!(new.pipes == shallow.pipes, "different pipes");
    for index in 0..new.columns.len() {
        let units = i64::from(shallow.flow.depth[index]);
        assert_eq!(new.flow.change_depth(&new.columns, index, units), units);
    }
    new.flow.flux = shallow.flow.flux.clone();
    new.flow.remainder = shallow.flow.remainder.clone();
    new.flow.links = shallow.flow.links.clone();
    new.flow.last = shallow.flow.last;
    new.flow.network.excess_heads_mut().copy_from_slice(shallow.flow.network.excess_heads());
    new.time = shallow.time;
    new.remap.held.set(shallow.remap.held.parcels().iter().copied());
    new
}

fn assert_same(a: &Shallow, b: &Shallow, what: &str) {
    assert!(a.flow.depth == b.flow.depth, "{what}: different depths");
    assert!(carried(a) == carried(b), "{what}: different fluxes");
    assert!(a.remap.held.parcels() == b.remap.held.parcels(), "{what}: different parcels");
}

#[test]
fn liquid_on_changed_terrain_flows_like_on_new_terrain() {
    let ctx = Context::new(Pool::new(0).unwrap());
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    for scene in 0..60 {
        let grid = Grid { cell: 0.5, origin: [0.0; 2], size: [1 + dice.below(60), 1 + dice.below(30)] };
        let border = [Border::Closed, Border::Open, Border::Absorbing][scene % 3];
        let layers = dice.below(4);
        let mut cells: Vec<Vec<Solid>> = (0..grid.cells()).map(|_| cell(&mut dice, layers)).collect();
        cells[0] = vec![[BOTTOMLESS, 0]];
        let mut shallow = Shallow::new(&ctx, &solids(grid, &cells), params(border)).unwrap();
        for change in 0..12 {
            let what = format!("scene {scene}, change {change}");
            for index in 0..shallow.columns.len() {
                if dice.below(4) == 0 && shallow.columns.is_column(index) {
                    shallow.pour(index, f64::from(dice.height([0, METRE])) / f64::from(METRE));
                }
            }
            shallow.step(&ctx, 0.05).unwrap();
            let [nx, nz] = grid.size;
            let range = |dice: &mut Dice, end: usize| {
                let (a, b) = (dice.below(end + 1), dice.below(end + 1));
                a.min(b)..a.max(b)
            };
            let area = [range(&mut dice, nx), range(&mut dice, nz)];
            let is_small = dice.below(3) == 0;
            for z in area[1].clone() {
                for x in area[0].clone() {
                    let at = grid.index([x, z]);
                    if is_small {
                        cells[at].iter_mut().for_each(|solid| solid[1] = (solid[1] + 5).min(TOP));
                    } else if dice.below(3) > 0 {
                        cells[at] = cell(&mut dice, layers);
                    }
                }
            }
            cells[0] = vec![[BOTTOMLESS, 0]];
            let solids = solids(grid, &cells);
            let width = area[0].len();
            let (x, z) = (area[0].start, area[1].start);
            shallow
                .update_cells(area, |at| solids.cell(grid.index([x + at % width, z + at / width])))
                .unwrap();
            // The first cell may lie outside the box.
            shallow.update_cells([0..1, 0..1], |_| solids.cell(0)).unwrap();
            assert_eq!(shallow.balance().error, 0, "{what}");
            let mut new = created_anew(&ctx, &shallow, &solids);
            for _ in 0..2 {
                shallow.step(&ctx, 0.03).unwrap();
                new.step(&ctx, 0.03).unwrap();
                assert_same(&shallow, &new, &what);
            }
        }
    }
}

#[test]
fn pipes_of_cells_that_stay_keep_what_they_carry() {
    let ctx = Context::new(Pool::new(0).unwrap());
    let mut dice = Dice(0x1234_5678_9abc_def1);
    let grid = Grid { cell: 0.5, origin: [0.0; 2], size: [50, 20] };
    let mut cells: Vec<Vec<Solid>> = (0..grid.cells()).map(|_| cell(&mut dice, 3)).collect();
    let mut shallow = Shallow::new(&ctx, &solids(grid, &cells), params(Border::Open)).unwrap();
    for change in 0..50 {
        for index in 0..shallow.columns.len() {
            if dice.below(3) == 0 && shallow.columns.is_column(index) {
                shallow.pour(index, 0.5);
            }
        }
        shallow.step(&ctx, 0.05).unwrap();
        let before = carried(&shallow);
        let mut moved = [(); 2].map(|()| 0);
        let mut stays = vec![true; cells.len()];
        for _ in 0..1 + dice.below(200) {
            let at = dice.below(cells.len());
            (cells[at], stays[at]) = (cell(&mut dice, 3), false);
        }
        shallow.update_terrain(&solids(grid, &cells)).unwrap();
        let after = carried(&shallow);
        for (ends, carried) in &after {
            let is_old = |x: usize, z: usize| z >= 20 || stays[z * 50 + x];
            let both_stay = is_old(ends[0], ends[1]) && is_old(ends[3], ends[4]);
            let Ok(at) = before.binary_search_by_key(ends, |(ends, _)| *ends) else { continue };
            if both_stay && before[at].1 == *carried {
                moved[usize::from(ends[2] != ends[5])] += usize::from(carried[0] << 1 != 0);
            } else if both_stay {
                // Sleeping liquid does not move.
                let wet = |end: &[usize]| {
                    let column = shallow.columns.column([end[0], end[1]], end[2]);
                    column.is_some_and(|column| shallow.flow.depth[column] > 0)
                };
                assert_eq!(*carried, [0; 2], "change {change}: {ends:?}");
                assert!(!wet(&ends[..3]) && !wet(&ends[3..6]), "change {change}: {ends:?}");
            }
        }
        assert!(moved[0] > 50 && moved[1] > 20, "{moved:?}");
    }
}

#[test]
fn flux_follows_a_column_into_another_layer() {
    let ctx = Context::new(Pool::new(0).unwrap());
    let grid = Grid { cell: 0.5, origin: [0.0; 2], size: [3, 3] };
    let floor: Vec<Solid> = vec![[BOTTOMLESS, 50 * METRE]];
    let cellar: Vec<Solid> = vec![[BOTTOMLESS, METRE], [40 * METRE, 50 * METRE]];
    let mut cells = vec![floor.clone(); 9];
    let mut shallow = Shallow::new(&ctx, &solids(grid, &cells), params(Border::Closed)).unwrap();
    for index in shallow.columns.indices().collect::<Vec<_>>() {
        shallow.pour(index, 0.1 + 0.01 * index as f64);
    }
    shallow.step(&ctx, 0.03).unwrap();
    let sum = |shallow: &Shallow| -> Vec<[u32; 2]> {
        let mut all: Vec<_> = carried(shallow).into_iter().map(|(_, carried)| carried).collect();
        all.retain(|carried| carried[0] != 0);
        all.sort_unstable();
        all
    };
    let expected = sum(&shallow);
    assert_eq!(expected.len(), 12, "all pipes flow");
    assert!(shallow.pipes.links.is_empty());
    // A cellar appears below the middle: its four pipes become links, and back.
    cells[4] = cellar.clone();
    shallow.update_terrain(&solids(grid, &cells)).unwrap();
    assert_eq!(shallow.pipes.links.len(), 4);
    assert!(sum(&shallow) == expected);
    // Another cellar, in the adjacent cell: their pipe is regular again.
    cells[5] = cellar;
    shallow.update_terrain(&solids(grid, &cells)).unwrap();
    assert_eq!(shallow.pipes.links.len(), 5);
    assert!(sum(&shallow) == expected);
    cells = vec![floor; 9];
    shallow.update_terrain(&solids(grid, &cells)).unwrap();
    assert!(shallow.pipes.links.is_empty() && sum(&shallow) == expected);
    // A new wall closes the pipes of its cell.
    cells[4] = vec![[BOTTOMLESS, TOP]];
    shallow.update_terrain(&solids(grid, &cells)).unwrap();
    assert_eq!(sum(&shallow).len(), 8);
    assert!(shallow.columns == Columns::new(&solids(grid, &cells)));
    assert!(shallow.pipes == Pipes::new(&shallow.columns, Border::Closed));
}

#[test]
fn cliffs_that_come_and_go_are_links_as_in_new_terrain() {
    let ctx = Context::new(Pool::new(0).unwrap());
    let mut dice = Dice(77);
    let grid = Grid { cell: 0.5, origin: [0.0; 2], size: [40, 12] };
    let falls = Some(Falls { height: 1.0, drop: 0.0, max_packets: 1 << 16, ..Falls::default() });
    let mut cells: Vec<Vec<Solid>> = (0..grid.cells()).map(|_| cell(&mut dice, 2)).collect();
    let params = Params { falls, friction: Friction::Walls, ..params(Border::Open) };
    let mut shallow = Shallow::new(&ctx, &solids(grid, &cells), params).unwrap();
    let flat = Pipes::new(&shallow.columns, Border::Open).links.len();
    assert!(shallow.pipes.links.len() > flat + 100, "cliffs");
    let mut flown = 0;
    for round in 0..60 {
        for index in shallow.columns.indices().collect::<Vec<_>>() {
            shallow.pour(index, 1e-3 * dice.below(300) as f64 - 0.1);
        }
        shallow.step(&ctx, 0.05).unwrap();
        flown += shallow.drops().len();
        let first = dice.below(400);
        cells[first..first + 60].iter_mut().for_each(|old| *old = cell(&mut dice, 2));
        shallow.update_terrain(&solids(grid, &cells)).unwrap();
        let rules = Rules::of(&shallow.params, &shallow.columns, None);
        assert!(shallow.pipes == Pipes::with_rules(&shallow.columns, rules), "round {round}");
        assert_eq!(shallow.falls.waiting.len(), shallow.pipes.links.len());
        assert_eq!(shallow.balance().error, 0, "round {round}");
    }
    assert!(flown > 1000, "{flown}");
}

#[test]
fn a_saved_state_keeps_what_waits_for_room() {
    let ctx = Context::new(Pool::new(0).unwrap());
    let mut dice = Dice(0x5555_1234_9abc_def1);
    let grid = Grid { cell: 0.5, origin: [0.0; 2], size: [30, 20] };
    let mut cells: Vec<Vec<Solid>> = (0..grid.cells()).map(|_| cell(&mut dice, 2)).collect();
    let mut shallow = Shallow::new(&ctx, &solids(grid, &cells), params(Border::Closed)).unwrap();
    shallow.fill(10.0);
    cells[100..400].iter_mut().for_each(|cell| *cell = vec![[BOTTOMLESS, TOP]]);
    shallow.update_terrain(&solids(grid, &cells)).unwrap();
    let (held, balance) = (shallow.remap.held.parcels().to_vec(), shallow.balance());
    assert!(held.len() > 100 && balance.held > 0.0);
    let saved = shallow.save();
    shallow.step(&ctx, 0.05).unwrap();
    let next = shallow.save();
    shallow.remap.held.set(std::iter::empty());
    assert_eq!(shallow.balance().error, held.iter().map(|parcel| parcel.units).sum::<i64>());
    shallow.restore(&saved).unwrap();
    assert!(shallow.remap.held.parcels() == held && shallow.balance() == balance);
    assert_eq!(balance.error, 0);
    shallow.step(&ctx, 0.05).unwrap();
    assert!(shallow.save() == next, "a different state");
}
