//! Surroundings of a column across a line: contact with other liquid, and walls.
//!
//! Higher ground beyond a side is a wall, up to the liquid's surface. As liquid near the ground moves slowly, the lower part of its depth
//! counts little: by its share of the mean of phi^2. Where both surfaces differ in height as the ground does, up to a cell's edge, there is
//! no wall but a slope with a film on it. A dry edge that is not higher causes no friction.

use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{Columns, NONE, STRIP, strip_from, strip_mut, strip_of};
use crate::shallow::solver::viscous_flux::{Step, max, min};

/// Walls are ignored beside films thinner than `THIN` times a cell's edge, and count fully beside liquid deeper than `THICK` times it: a
/// wall beside a film of `THIN` reduces the flow in the adjacent pipe by (2/5)^1/2 `THIN`, or 4 %.
const THIN: f32 = 1.0 / 16.0;
const THICK: f32 = 3.0 / 32.0;

/// (k / (6/5))^1/2; divided by H it is 1 / delta, where delta is the decay length of a wall's effect, exp(-y / delta).
const REACH: f32 = 1.581_138_8;
const REACH_FULL: f32 = 3.162_277_7;

/// The columns and their liquid.
pub struct Around<'a> {
    pub columns: &'a Columns,
    /// H (units), padded by a strip: SIMD loads may read past the last index.
    pub depth: &'a [i32],
    /// Whether each strip has ceilings, or positions without a column.
    pub roofed: &'a [bool],
    /// Positions of each strip from which links lead to the east, south, west and north.
    pub linked: &'a [[u16; 4]],
}

/// A column with a depth above 0, or another one beyond a side.
#[derive(Clone, Copy)]
pub struct Room {
    pub base: i32,
    pub ceiling: i32,
    pub depth: i32,
}

/// Whether columns of a depth (units) have lateral friction.
pub fn has_friction(step: &Step, depth: i32) -> bool {
    depth as f32 > THIN * step.cell
}

/// Weight of a wall beside liquid of a depth (units).
#[inline(always)]
fn wall_weight(step: &Step, height: f32) -> f32 {
    let part = (height - THIN * step.cell) * (1.0 / ((THICK - THIN) * step.cell));
    min(max(part, 0.0), 1.0)
}

/// The share of the mean of phi^2 in the lowest part x of the depth; phi = 3/2 (2 x - x^2) below a free surface, and 6 (x - x^2) below a
/// ceiling.
#[inline(always)]
fn profile_share<const FULL: bool>(x: f32) -> f32 {
    let cube = x * x * x;
    if FULL { cube * (10.0 - x * (15.0 - 6.0 * x)) } else { cube * (2.5 - x * (1.875 - 0.375 * x)) }
}

/// Effective height (units) of the walls beside liquid of depth `high`: the parts of the depth that are wall on each side, times the
/// friction at a wall relative to that of the same velocity difference between pipes.
///
/// Beside one wall u = 1 - exp(-y / delta), and a pipe has its mean over a cell: dx u'(0) / u is s^2 / (s - 1 + exp(-s)) with s = dx /
/// delta, 2 where cells are small. Between two walls in one cell it is s^2 t / (1 - t), t = tanh(s / 2) / (s / 2), 12 where cells are
/// small. Both are approximated to 2 %.
#[inline(always)]
pub fn walls<const FULL: bool>(step: &Step, high: f32, inverse: f32, parts: [f32; 2]) -> f32 {
    let s = if FULL { REACH_FULL } else { REACH } * step.cell * inverse;
    let one = s + 1.0 + 1.0 / (1.0 + s * (1.0 / 3.0 + 0.057 * s));
    let more = 2.0 + 6.0 / (1.0 + s * (0.25 + 0.03 * s));
    ((parts[0] + parts[1]) * one + parts[0] * parts[1] * more) * high * wall_weight(step, high)
}

/// Effective height (units) of a contact: its height, times its friction relative to that of a linear profile between pipes. This is
/// (s / 2)^2 / sinh^2(s / 2), with the s of the contact's height, approximated likewise.
#[inline(always)]
fn contact_height<const FULL: bool>(step: &Step, contact: f32) -> f32 {
    let reach = if FULL { REACH_FULL * REACH_FULL } else { REACH * REACH };
    let x = contact * (1.0 / step.cell);
    let square = x * x;
    let cube = square * square * square;
    let sinh = cube
        + reach * (1.0 / 12.0) * square * square
        + reach * reach * (1.0 / 360.0) * square
        + reach * reach * reach * (1.0 / 20160.0);
    if x > THIN { contact * (cube / sinh) } else { 0.0 }
}

/// One side of a column: the height (units) in which liquids are in contact ([`contact_height`]), and the part that is wall. `inverse` is
/// 1 / H; a ceiling counts if `ROOFED` and no link leads there.
#[inline(always)]
pub fn side<const FULL: bool, const ROOFED: bool>(
    step: &Step,
    own: Room,
    inverse: f32,
    beyond: Room,
    is_linked: bool,
) -> [f32; 2] {
    let rise = (beyond.base - own.base) as f32;
    let surface_rise = (beyond.base + beyond.depth - (own.base + own.depth)) as f32;
    let (high, other) = (own.depth as f32, beyond.depth as f32);
    // The part of the rise by which the surfaces differ, too, is a slope and not a wall.
    let bound = min(max(rise, -step.cell), step.cell);
    let lean = min(max(surface_rise, min(bound, 0.0)), max(bound, 0.0));
    let foot = rise - lean;
    let up = max(foot, 0.0);
    let contact = max(min(high, foot + other) - up, 0.0);
    let below = profile_share::<FULL>(min(up * inverse, 1.0));
    let wall = if ROOFED {
        let top = min(max((beyond.ceiling - own.base) as f32 * inverse, 0.0), 1.0);
        let top = if is_linked { 1.0 } else { top };
        // Without a ceiling this equals the other branch, to the last bit.
        min(below + (1.0 - profile_share::<FULL>(top)), 1.0)
    } else {
        below
    };
    [contact_height::<FULL>(step, contact), wall]
}

/// Stands in for absent columns.
const ABSENT: [i32; STRIP] = [0; STRIP];

/// Base, ceiling and depth of the columns of a strip.
type Strip<'a> = [&'a [i32; STRIP]; 3];

/// Finds the surroundings of the columns of strips; `out` begins at strip `first`. For pipes to the east: the sum of contact and walls over
/// both sides (units), the contact before them and the contact behind; then the same for pipes to the south.
pub fn find(step: &Step, around: &Around, strips: &[u32], first: usize, mut out: [&mut [f32]; 6]) {
    let out = &mut out;
    dispatch!(find_strips(step: &Step, around: &Around, strips: &[u32], first: usize, out: &mut [&mut [f32]; 6]))
}

#[inline(always)]
fn find_strips(step: &Step, around: &Around, strips: &[u32], first: usize, out: &mut [&mut [f32]; 6]) {
    let Around { columns, roofed, linked, .. } = around;
    let [all_z, before_z, behind_z, all_x, before_x, behind_x] = out;
    for &strip in strips {
        let (strip, position) = (strip as usize, strip as usize - first);
        let (own, links) = (around.strip(strip), linked[strip]);
        let [north, south] = [columns.north(strip), columns.south(strip)];
        let is_roofed =
            (north == NONE || roofed[north as usize]) || (south == NONE || roofed[south as usize]);
        let numbers =
            (strip_mut(all_z, position), strip_mut(before_z, position), strip_mut(behind_z, position));
        find_strip(
            step,
            own,
            [around.beyond(north), around.beyond(south)],
            [links[3], links[1]],
            is_roofed,
            numbers,
        );
        let (has_west, has_east) = (columns.west(strip).is_some(), columns.east(strip).is_some());
        let (mut west, mut east) = (around.shifted(strip, has_west, 1), around.shifted(strip, has_east, 0));
        if !has_west {
            west.iter_mut().for_each(|numbers| numbers[0] = 0);
        }
        if !has_east {
            east.iter_mut().for_each(|numbers| numbers[STRIP - 1] = 0);
        }
        let is_roofed = roofed[strip]
            || !has_west
            || !has_east
            || roofed[strip - usize::from(has_west)]
            || roofed[strip + usize::from(has_east)];
        let numbers =
            (strip_mut(all_x, position), strip_mut(before_x, position), strip_mut(behind_x, position));
        find_strip(step, own, [west.each_ref(), east.each_ref()], [links[2], links[0]], is_roofed, numbers);
    }
}

impl<'a> Around<'a> {
    /// Bases, ceilings and depths of all columns.
    #[inline(always)]
    fn numbers(&self) -> [&'a [i32]; 3] {
        [self.columns.bases(), self.columns.ceilings(), self.depth]
    }

    #[inline(always)]
    fn strip(&self, strip: usize) -> Strip<'a> {
        self.numbers().map(|numbers| strip_of(numbers, strip))
    }

    #[inline(always)]
    fn beyond(&self, strip: u32) -> Strip<'a> {
        if strip == NONE { [&ABSENT; 3] } else { self.strip(strip as usize) }
    }

    /// The columns one position before those of a strip (`before` 1), or after them (0).
    #[inline(always)]
    fn shifted(&self, strip: usize, is_there: bool, before: usize) -> [[i32; STRIP]; 3] {
        let at = (strip * STRIP + 1).wrapping_sub(2 * before);
        if is_there || before == 0 {
            return self.numbers().map(|numbers| *strip_from(numbers, at));
        }
        self.strip(strip).map(|own| {
            let mut west = ABSENT;
            west[1..].copy_from_slice(&own[..STRIP - 1]);
            west
        })
    }
}

/// Outputs for a strip: the sum of contact and walls, contact before, and contact behind.
type Output<'a> = (&'a mut [f32; STRIP], &'a mut [f32; STRIP], &'a mut [f32; STRIP]);

/// Finds the surroundings of a strip across one axis.
#[inline(always)]
fn find_strip(step: &Step, own: Strip, sides: [Strip; 2], links: [u16; 2], is_roofed: bool, out: Output) {
    if is_roofed {
        find_strip_of::<true>(step, own, sides, links, out);
    } else {
        find_strip_of::<false>(step, own, sides, links, out);
    }
}

#[inline(always)]
fn find_strip_of<const ROOFED: bool>(
    step: &Step,
    own: Strip,
    [first, second]: [Strip; 2],
    links: [u16; 2],
    (all, before, behind): Output,
) {
    for x in 0..STRIP {
        let high = own[2][x] as f32;
        let inverse = 1.0 / max(high, 1.0);
        let column = room(own, x);
        let is_linked = [links[0] >> x & 1 == 1, links[1] >> x & 1 == 1];
        let [one, part] = side::<false, ROOFED>(step, column, inverse, room(first, x), is_linked[0]);
        let [two, other_part] = side::<false, ROOFED>(step, column, inverse, room(second, x), is_linked[1]);
        all[x] = (one + two) + walls::<false>(step, high, inverse, [part, other_part]);
        (before[x], behind[x]) = (one, two);
    }
}

#[inline(always)]
fn room([base, ceiling, depth]: Strip, x: usize) -> Room {
    Room { base: base[x], ceiling: ceiling[x], depth: depth[x] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::TOP;

    /// Cells of 1,000 units.
    fn step() -> Step {
        Step { cell: 1000.0, ..Step::without_forces() }
    }

    fn room(base: i32, depth: i32) -> Room {
        Room { base, ceiling: TOP, depth }
    }

    fn between(own: Room, beyond: Room) -> [f32; 2] {
        side::<false, true>(&step(), own, 1.0 / own.depth as f32, beyond, false)
    }

    #[test]
    fn the_profiles_have_a_share_of_1_over_the_whole_depth_and_a_ceilings_is_even() {
        assert_eq!((profile_share::<false>(1.0), profile_share::<true>(1.0)), (1.0, 1.0));
        assert_eq!(profile_share::<true>(0.5), 0.5);
        for (x, free) in [(0.2f32, 2.5 * 0.008 - 1.875 * 0.0016 + 0.375 * 0.00032), (0.5, 0.20703125)] {
            assert!((profile_share::<false>(x) - free).abs() < 1e-6, "{x}");
        }
        let small = profile_share::<false>(0.01);
        assert!((small / 2.5e-6 - 1.0).abs() < 0.01, "by the cube above the ground: {small}");
    }

    #[test]
    fn contact_and_walls_are_fitted_to_the_exponentials_that_solve_a_film_beside_a_wall() {
        let exp = |x: f64| libm::exp(x);
        for depth in [100.0f32, 300.0, 1000.0, 3000.0, 30_000.0] {
            for (is_full, reach) in [(false, REACH), (true, REACH_FULL)] {
                let s = f64::from(reach) * 1000.0 / f64::from(depth);
                let sinh = (exp(0.5 * s) - exp(-0.5 * s)) / 2.0;
                let [contact, one, both] = if is_full {
                    [
                        contact_height::<true>(&step(), depth),
                        walls::<true>(&step(), depth, 1.0 / depth, [1.0, 0.0]),
                        walls::<true>(&step(), depth, 1.0 / depth, [1.0; 2]),
                    ]
                } else {
                    [
                        contact_height::<false>(&step(), depth),
                        walls::<false>(&step(), depth, 1.0 / depth, [1.0, 0.0]),
                        walls::<false>(&step(), depth, 1.0 / depth, [1.0; 2]),
                    ]
                };
                let [contact, one, both] = [contact, one, both].map(|height| f64::from(height / depth));
                // A small contact must come out small.
                let exact = (0.5 * s / sinh).powi(2);
                assert!((contact - exact).abs() < 0.02 * exact + 0.01, "{depth}: {contact}, not {exact}");
                let exact = s * s / (s - 1.0 + exp(-s));
                assert!((one / exact - 1.0).abs() < 0.02, "{depth}: {one}, not {exact}");
                let tanh = libm::tanh(0.5 * s) / (0.5 * s);
                let exact = s * s * tanh / (1.0 - tanh);
                assert!((both / exact - 1.0).abs() < 0.03, "{depth}: {both}, not {exact}");
            }
        }
    }

    #[test]
    fn a_bank_is_a_wall_and_a_slope_with_a_film_is_none() {
        assert_eq!(between(room(0, 2000), room(3000, 0)), [0.0, 1.0], "a dry bank");
        let [contact, wall] = between(room(0, 2000), room(2500, 10));
        assert!(contact == 0.0 && wall > 0.99, "a wet one: {contact}, {wall}");
        let contact_height = |contact: f32| contact_height::<false>(&step(), contact);
        assert_eq!(between(room(0, 2000), room(0, 2000)), [contact_height(2000.0), 0.0], "level ground");
        assert_eq!(
            between(room(0, 1000), room(900, 1000)),
            [contact_height(1000.0), 0.0],
            "a film up the slope"
        );
        assert_eq!(
            between(room(900, 1000), room(0, 1000)),
            [contact_height(1000.0), 0.0],
            "a film down the slope"
        );
        assert_eq!(between(room(0, 1000), room(5000, 1000)), [0.0, 1.0], "a terrace above");
        assert_eq!(between(room(5000, 1000), room(0, 1000)), [0.0, 0.0], "a terrace below");
        assert_eq!(between(room(0, 2000), room(0, 0)), [0.0, 0.0], "a dry edge");
        let [contact, wall] = between(room(0, 2000), room(1000, 1000));
        assert_eq!(
            (contact, wall),
            (contact_height(1000.0), profile_share::<false>(0.5)),
            "a step under a level surface"
        );
        let [back, none] = between(room(1000, 1000), room(0, 2000));
        assert_eq!((back, none), (contact_height(1000.0), 0.0));
    }

    #[test]
    fn columns_that_are_not_there_are_walls_unless_links_lead_there() {
        let nothing = Room { base: 0, ceiling: 0, depth: 0 };
        let own = room(700, 2000);
        assert_eq!(between(own, nothing), [0.0, 1.0]);
        assert_eq!(side::<false, true>(&step(), own, 5e-4, nothing, true), [0.0, 0.0]);
        let low = Room { base: 700, ceiling: 1700, depth: 1000 };
        let wall = 1.0 - profile_share::<false>(0.5);
        assert_eq!(
            between(own, low),
            [contact_height::<false>(&step(), 1000.0), wall],
            "a ceiling below the surface"
        );
    }

    #[test]
    fn thin_contact_does_not_count() {
        assert!(!has_friction(&step(), 62) && has_friction(&step(), 63));
        assert_eq!(between(room(0, 62), room(0, 2000))[0], 0.0);
        assert!((0.0..1.0).contains(&between(room(0, 90), room(0, 2000))[0]));
        assert_eq!(walls::<false>(&step(), 62.0, 1.0 / 62.0, [1.0; 2]), 0.0);
    }
}
