//! Openness of regular pipes (thesis 4.1.1), strip by strip.
//!
//! The thesis derives viscosity for level ground. On ground of slope S a film of vertical depth H is thinner by the cosine of the slope,
//! and driven along it: its discharge is that on level ground divided by (1 + S^2)^2. Rises are differences of integers, so that results
//! are the same from either side.

use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{Columns, NONE, STRIP, strip_mut, strip_of};

/// Maximum square of a slope (60 degrees); steeper ones are clamped: a step of the ground is not a slope, and liquid falls over its edge.
const MAX_SQUARE: f64 = 3.0;

/// A quantity of the columns of a strip.
type Lanes = [i32; STRIP];
/// Stands in for an absent strip.
const ABSENT: Lanes = [0; STRIP];

/// Twice the rises of the ground (units) over a cell at the columns of a row, along x and along z: indexed from the row's first column,
/// padded by one strip.
///
/// Each is the difference of the bases on both sides of a column, over regular pipes; if only one side has such a pipe, twice the
/// difference over it.
#[derive(Debug, Clone, Default)]
pub(super) struct Rises {
    pub x: Vec<i32>,
    pub z: Vec<i32>,
}

impl Rises {
    /// Finds the rises of a row; a rise of more than `wall_rise` units on only one side is a wall.
    pub fn find(&mut self, columns: &Columns, row: usize, wall_rise: i32) {
        let len = (columns.row(row).len() + 1) * STRIP;
        self.x.resize(len, 0);
        self.z.resize(len, 0);
        let rises = self;
        if wall_rise == i32::MAX {
            dispatch!(at most avx2: rise::<false>(columns: &Columns, row: usize, rises: &mut Rises, wall_rise: i32));
        } else {
            dispatch!(at most avx2: rise::<true>(columns: &Columns, row: usize, rises: &mut Rises, wall_rise: i32));
        }
    }
}

/// Factor from four times a rise (units) to a slope.
pub(super) fn scale(columns: &Columns) -> f64 {
    columns.heights.unit / (4.0 * columns.grid.cell)
}

/// 1 / (1 + slope^2)^2 of the ground between two columns, from four times its rise along their pipe and across: the discharge of a film on
/// it relative to that of a film of the same vertical depth and drop on level ground.
#[inline(always)]
pub(super) fn openness(along: f64, across: f64, scale: f64) -> f32 {
    let (along, across) = (along * scale, across * scale);
    let square = along * along + across * across;
    let steep = 1.0 + if square < MAX_SQUARE { square } else { MAX_SQUARE };
    (1.0 / (steep * steep)) as f32
}

/// Openness of the regular pipes that a row owns, to the east and to the south; `rises` are those of the row and of the next one.
pub(super) fn open_row(
    columns: &Columns,
    row: usize,
    rises: [&Rises; 2],
    east: &mut [f32],
    south: &mut [f32],
) {
    dispatch!(at most avx2: open_strips(columns: &Columns, row: usize, rises: [&Rises; 2], east: &mut [f32], south: &mut [f32]));
}

/// The numbers of a strip, with the adjacent one to the west and to the east; 0 where there is none.
#[inline(always)]
fn window(numbers: &[i32], strip: usize, [west, east]: [bool; 2]) -> [i32; STRIP + 2] {
    let mut window = [0; STRIP + 2];
    window[1..=STRIP].copy_from_slice(strip_of(numbers, strip));
    if west {
        window[0] = numbers[strip * STRIP - 1];
    }
    if east {
        window[STRIP + 1] = numbers[(strip + 1) * STRIP];
    }
    window
}

/// The numbers of a neighbouring strip; 0 if there is none.
#[inline(always)]
fn beyond(numbers: &[i32], strip: u32) -> &Lanes {
    if strip == NONE { &ABSENT } else { strip_of(numbers, strip as usize) }
}

/// All bits set where liquid can pass between columns with these bases and ceilings. An absent column has both at 0: nothing passes.
#[inline(always)]
fn passes(base: [i32; 2], ceiling: [i32; 2]) -> i32 {
    -i32::from(base[0].max(base[1]) < ceiling[0].min(ceiling[1]))
}

/// Twice the rise, from the rises over both sides and masks of those that exist. Where liquid passes, bases are within 0 to 2^30 - 1, and
/// their sum fits.
#[inline(always)]
fn twice([before, behind]: [i32; 2], [has_before, has_behind]: [i32; 2]) -> i32 {
    (behind | (before & !has_behind)) + (before | (behind & !has_before))
}

/// All bits set for the sides that are walls: the ground there rises or falls by over `wall_rise`, unless it continues likewise on the
/// other side.
#[inline(always)]
fn walls([before, behind]: [i32; 2], wall_rise: i32) -> [i32; 2] {
    let is_steep = [before, behind].map(|step| -i32::from(step.abs() > wall_rise));
    let goes_on = is_steep[0] & is_steep[1] & !((before ^ behind) >> 31);
    is_steep.map(|steep| steep & !goes_on)
}

/// Twice the rise over open sides, from the steps over both and masks of those that are open.
#[inline(always)]
fn rise_of<const WALLED: bool>(steps: [i32; 2], open: [i32; 2], wall_rise: i32) -> i32 {
    let steps = [steps[0] & open[0], steps[1] & open[1]];
    if WALLED {
        let walls = walls(steps, wall_rise);
        let open = [open[0] & !walls[0], open[1] & !walls[1]];
        twice([steps[0] & open[0], steps[1] & open[1]], open)
    } else {
        twice(steps, open)
    }
}

#[inline(always)]
fn rise<const WALLED: bool>(columns: &Columns, row: usize, rises: &mut Rises, wall_rise: i32) {
    let (bases, ceilings) = (columns.bases(), columns.ceilings());
    for (position, strip) in columns.row(row).enumerate() {
        let beside = [columns.west(strip).is_some(), columns.east(strip).is_some()];
        let base = window(bases, strip, beside);
        let ceiling = window(ceilings, strip, beside);
        let along = strip_mut(&mut rises.x, position);
        for x in 0..STRIP {
            let open_west = passes([base[x], base[x + 1]], [ceiling[x], ceiling[x + 1]]);
            let open_east = passes([base[x + 1], base[x + 2]], [ceiling[x + 1], ceiling[x + 2]]);
            let steps = [base[x + 1].wrapping_sub(base[x]), base[x + 2].wrapping_sub(base[x + 1])];
            along[x] = rise_of::<WALLED>(steps, [open_west, open_east], wall_rise);
        }
        let (base, ceiling) = (strip_of(bases, strip), strip_of(ceilings, strip));
        let (north, south) = (columns.north(strip), columns.south(strip));
        let (north_base, north_ceiling) = (beyond(bases, north), beyond(ceilings, north));
        let (south_base, south_ceiling) = (beyond(bases, south), beyond(ceilings, south));
        let across = strip_mut(&mut rises.z, position);
        for x in 0..STRIP {
            let open_north = passes([north_base[x], base[x]], [north_ceiling[x], ceiling[x]]);
            let open_south = passes([base[x], south_base[x]], [ceiling[x], south_ceiling[x]]);
            let steps = [base[x].wrapping_sub(north_base[x]), south_base[x].wrapping_sub(base[x])];
            across[x] = rise_of::<WALLED>(steps, [open_north, open_south], wall_rise);
        }
    }
}

#[inline(always)]
fn open_strips(columns: &Columns, row: usize, rises: [&Rises; 2], east: &mut [f32], south: &mut [f32]) {
    let (bases, ceilings, scale) = (columns.bases(), columns.ceilings(), scale(columns));
    let strips = columns.row(row);
    for (position, strip) in strips.clone().enumerate() {
        let (base, ceiling) = (strip_of(bases, strip), strip_of(ceilings, strip));
        let beside = [false, columns.east(strip).is_some()];
        let east_base = window(bases, strip, beside);
        let east_ceiling = window(ceilings, strip, beside);
        let across = &rises[0].z[position * STRIP..][..=STRIP];
        let open = strip_mut(east, strip);
        for x in 0..STRIP {
            let passes = passes([base[x], east_base[x + 2]], [ceiling[x], east_ceiling[x + 2]]);
            let along = 4.0 * (f64::from(east_base[x + 2]) - f64::from(base[x]));
            let across = f64::from(across[x]) + f64::from(across[x + 1]);
            let openness = openness(along, across, scale);
            open[x] = f32::from_bits(openness.to_bits() & passes as u32);
        }
        let open = strip_mut(south, strip);
        if columns.south(strip) == NONE {
            open.fill(0.0);
            continue;
        }
        let behind = columns.south(strip) as usize;
        let (south_base, south_ceiling) = (strip_of(bases, behind), strip_of(ceilings, behind));
        let along_own = strip_of(&rises[0].x, position);
        let along_behind = strip_of(&rises[1].x, behind - strips.end);
        for x in 0..STRIP {
            let passes = passes([base[x], south_base[x]], [ceiling[x], south_ceiling[x]]);
            let along = 4.0 * (f64::from(south_base[x]) - f64::from(base[x]));
            let across = f64::from(along_own[x]) + f64::from(along_behind[x]);
            let openness = openness(along, across, scale);
            open[x] = f32::from_bits(openness.to_bits() & passes as u32);
        }
    }
}
