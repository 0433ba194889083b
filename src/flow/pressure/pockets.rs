//! Pockets: groups of connected cells that solids cut off from the air outside all tiles. The pressure in a pocket is known up to a
//! constant, and the net inflow that its walls cause cannot escape: the pocket's mean inflow and its mean pressure are subtracted.

use rayon::prelude::*;

use super::operator::{Operator, layer};
use super::stencil::Stencil;
use crate::flow::tiles::{FACES, NONE, Tile};
use crate::geometry::check::topology::Sets;

/// Label of a cell that does not take part.
const SOLID: u16 = u16::MAX;

/// The connected components of a tile.
struct Components {
    /// Component of each cell; none: the tile is a single component.
    labels: Option<Box<[u16; 512]>>,
    count: u32,
    /// Whether each component touches the outside.
    opens: Vec<bool>,
}

/// The pockets of a set of tiles.
#[derive(Default)]
pub struct Pockets {
    /// Cells of each pocket: tiles and, for a tile that belongs to it only in part, the cells.
    pockets: Vec<Vec<(u32, Option<Vec<u16>>)>>,
}

impl Pockets {
    /// Finds the pockets.
    pub fn find(operator: &Operator) -> Self {
        if !operator.has_stencils() {
            // Without solids, everything is connected to the outside.
            return Self::default();
        }
        let active = operator.tiles.active();
        let components: Vec<Components> =
            (0..active).into_par_iter().with_min_len(8).map(|slot| components_of(operator, slot)).collect();
        let mut first = Vec::with_capacity(active);
        let mut count = 0u32;
        for components in &components {
            first.push(count);
            count += components.count;
        }
        let mut groups = Sets::new(count as usize);
        for slot in 0..active {
            for axis in 0..3 {
                let above = operator.tiles.neighbours()[slot][FACES[2 * axis + 1]] as usize;
                if above < active {
                    let pair = [(first[slot], &components[slot]), (first[above], &components[above])];
                    join_tiles(&mut groups, axis, pair, operator.stencil(slot));
                }
            }
        }
        let mut is_open = vec![false; count as usize];
        for (slot, components) in components.iter().enumerate() {
            for (component, _) in components.opens.iter().enumerate().filter(|(_, opens)| **opens) {
                is_open[groups.root(first[slot] + component as u32) as usize] = true;
            }
        }
        let mut numbers = vec![NONE; count as usize];
        let mut pockets: Vec<Vec<(u32, Option<Vec<u16>>)>> = Vec::new();
        for (slot, components) in components.iter().enumerate() {
            for component in 0..components.count {
                let root = groups.root(first[slot] + component) as usize;
                if is_open[root] {
                    continue;
                }
                if numbers[root] == NONE {
                    numbers[root] = pockets.len() as u32;
                    pockets.push(Vec::new());
                }
                let cells = components.labels.as_ref().map(|labels| {
                    (0..512u16).filter(|cell| u32::from(labels[usize::from(*cell)]) == component).collect()
                });
                pockets[numbers[root] as usize].push((slot as u32, cells));
            }
        }
        Self { pockets }
    }

    /// Subtracts each pocket's mean.
    pub fn subtract_means(&self, field: &mut [Tile]) {
        for pocket in &self.pockets {
            let (mut sum, mut count) = (0.0f64, 0usize);
            for (slot, cells) in pocket {
                let tile = &field[*slot as usize];
                match cells {
                    Some(cells) => {
                        sum += cells.iter().map(|cell| f64::from(tile[usize::from(*cell)])).sum::<f64>();
                        count += cells.len();
                    }
                    None => {
                        sum += tile.iter().map(|value| f64::from(*value)).sum::<f64>();
                        count += 512;
                    }
                }
            }
            let mean = (sum / count.max(1) as f64) as f32;
            for (slot, cells) in pocket {
                let tile = &mut field[*slot as usize];
                match cells {
                    Some(cells) => cells.iter().for_each(|cell| tile[usize::from(*cell)] -= mean),
                    None => tile.iter_mut().for_each(|value| *value -= mean),
                }
            }
        }
    }
}

/// Finds the components of a tile by flood fill.
fn components_of(operator: &Operator, slot: usize) -> Components {
    let active = operator.tiles.active();
    let is_outside = FACES.map(|at| operator.tiles.neighbours()[slot][at] as usize >= active);
    let Some(stencil) = operator.stencil(slot) else {
        return Components { labels: None, count: 1, opens: vec![is_outside.contains(&true)] };
    };
    let mut labels = Box::new([SOLID; 512]);
    let mut opens = Vec::new();
    let mut stack = Vec::new();
    for seed in 0..512usize {
        if labels[seed] != SOLID || stencil.inverse[seed] == 0.0 {
            continue;
        }
        let component = opens.len() as u16;
        opens.push(false);
        labels[seed] = component;
        stack.push(seed);
        while let Some(cell) = stack.pop() {
            for (face, is_outside) in is_outside.iter().enumerate() {
                let (axis, is_upper) = (face / 2, face % 2 == 1);
                if open(stencil, axis, is_upper, cell) == 0.0 {
                    continue;
                }
                match within(axis, is_upper, cell) {
                    Some(next) if labels[next] == SOLID && stencil.inverse[next] > 0.0 => {
                        labels[next] = component;
                        stack.push(next);
                    }
                    None if *is_outside => opens[usize::from(component)] = true,
                    _ => (),
                }
            }
        }
    }
    Components { labels: Some(labels), count: opens.len() as u32, opens }
}

/// The cell behind a face, if it is in the same tile.
fn within(axis: usize, is_upper: bool, cell: usize) -> Option<usize> {
    let step = 64 >> (3 * axis);
    let at = cell / step % 8;
    match is_upper {
        true => (at < 7).then(|| cell + step),
        false => (at > 0).then(|| cell - step),
    }
}

/// Open fraction of a face of a cell.
fn open(stencil: &Stencil, axis: usize, is_upper: bool, cell: usize) -> f32 {
    match (is_upper, within(axis, true, cell)) {
        (false, _) => stencil.lower[axis][cell],
        (true, Some(next)) => stencil.lower[axis][next],
        (true, None) => stencil.upper[axis][layer(axis, cell)],
    }
}

/// Joins the components of two tiles through the faces between them.
fn join_tiles(
    groups: &mut Sets,
    axis: usize,
    [below, above]: [(u32, &Components); 2],
    stencil: Option<&Stencil>,
) {
    let component = |(first, components): (u32, &Components), cell: usize| match &components.labels {
        Some(labels) => (labels[cell] != SOLID).then(|| first + u32::from(labels[cell])),
        None => Some(first),
    };
    let step = 64 >> (3 * axis);
    for at in 0..64 {
        let low = super::operator::first(axis, at);
        let last = low + 7 * step;
        if stencil.is_none_or(|stencil| open(stencil, axis, true, last) > 0.0)
            && let (Some(a), Some(b)) = (component(below, last), component(above, low))
        {
            groups.join(a, b);
        }
    }
}
