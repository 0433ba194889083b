//! One correction of eight pairs of grains: impulses, pushes, and which grains are supported or woken.

use super::density::SURROUNDED;
use super::pairs::Batch;
use super::rest::{self, Rest};
use super::rows::{Part, Row, SUPPORTED, Shared, V, V8, add, dot, scaled, sub};
use crate::numeric::lanes::{LaneMask, Lanes};

/// Share of an overlap that a sub-step removes.
const REMOVED: f32 = 0.8;
/// Maximum correction of an overlap in a sub-step (diameters).
pub const MAX_CORRECTION: f32 = 0.5;
/// Maximum gap (diameters) at which a contact still supports and keeps its impulse.
pub const TOUCHING: f32 = 0.02;
/// Gap (diameters) that counts as closed, and overlap (`SLOP`) that contacts may keep. If every overlap were removed, a heap
/// would never come to rest: each push opens and closes contacts around it.
const SLACK: f32 = 0.01;
/// See [`SLACK`].
const SLOP: f32 = 0.02;
/// The same for grains that attract each other: a larger value would let walls crack.
const SLOP_OF_WALLS: f32 = 0.005;
/// If a supported grain lies directly above another supported one, an impulse changes the velocity of the upper one by this share more
/// than with equal masses, and that of the lower one by this share less. Masses thus decrease upward by a factor e^(-2 x this) per
/// diameter, and one upward sweep nearly finds the impulses of a deep bed. Equal masses never do: a bed creeps down slopes of a third of
/// its angle of repose. Grains that attract each other have equal masses: their strength is a force, and with unequal masses walls of any
/// height would stand.
const LIGHTER_ABOVE: f32 = 0.2;
/// Minimum distance (diameters) between two grains that defines a direction.
const MIN_DISTANCE: f32 = 1.0e-6;
/// Minimum upward component of the direction from a grain to one that it supports.
pub const MIN_UPWARD: f32 = 0.2;

/// Eight grains of a batch.
#[derive(Clone, Copy)]
pub struct EightGrains {
    position: V8,
    /// Inverse masses.
    pub weight: Lanes,
    /// Whether a chain of contacts led down to something fixed in the last sub-step.
    pub supported: LaneMask,
    velocity: V8,
    still: Lanes,
}

impl EightGrains {
    /// # Safety
    /// As for [`Shared::gather`].
    #[inline(always)]
    pub unsafe fn load(rows: Shared<'_, Row>, slots: &[u32; 8]) -> Self {
        // SAFETY: the caller's promise.
        let ([x, y, z, mass_state], [u, v, w, still]) =
            unsafe { (rows.gather(slots, Part::Position), rows.gather(slots, Part::Velocity)) };
        let free = mass_state.is_less(Lanes::all(SUPPORTED));
        let weight = free.choose(mass_state, mass_state - Lanes::all(SUPPORTED));
        let supported = Lanes::all(1.5).is_less(mass_state);
        Self { position: [x, y, z], weight, supported, velocity: [u, v, w], still }
    }

    /// Writes the velocities.
    ///
    /// # Safety
    /// As for [`Shared::scatter`].
    #[inline(always)]
    pub unsafe fn store(&self, rows: Shared<'_, Row>, slots: &[u32; 8]) {
        let [u, v, w] = self.velocity;
        // SAFETY: the caller's promise.
        unsafe { rows.scatter(slots, Part::Velocity, &[u, v, w, self.still]) };
    }

    /// Applies an impulse.
    #[inline(always)]
    fn kicked(self, impulse: V8, weight: Lanes) -> Self {
        Self { velocity: add(self.velocity, scaled(impulse, weight)), ..self }
    }
}

/// Geometry and masses of eight pairs.
pub struct Contact {
    /// From the other grains to the owners.
    normal: V8,
    /// Upward component of the normal.
    upward: Lanes,
    /// Gap between the surfaces (diameters).
    pub gap: Lanes,
    /// Sum of the inverse masses, and its inverse.
    weights: Lanes,
    inverse: Lanes,
    /// Change of velocity per impulse, of the owners and of the others.
    shares: [Lanes; 2],
}

impl Contact {
    /// The contacts of a batch.
    #[inline(always)]
    pub fn between(a: &EightGrains, b: &EightGrains, batch: &Batch, c: &Coefficients) -> Self {
        let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
        let weights = a.weight + b.weight;
        // 1 / weights, exact for 1 and 2.
        let inverse = Lanes::all(1.5) - Lanes::all(0.5) * weights;
        let apart = sub(sub(a.position, batch.shift()), b.position);
        let distance = dot(apart, apart).sqrt();
        let [x, y, z] = scaled(apart, one / distance.max(Lanes::all(MIN_DISTANCE)));
        // Two grains at the same position separate vertically.
        let is_none = distance.is_less(Lanes::all(MIN_DISTANCE));
        let normal = [is_none.choose(zero, x), is_none.choose(one, y), is_none.choose(zero, z)];
        let upward = dot(normal, c.up.map(Lanes::all));
        let lighter = Lanes::all(if c.attraction > 0.0 { 0.0 } else { LIGHTER_ABOVE });
        // Resting grains have infinite mass.
        let tilt = upward * lighter * a.weight * b.weight;
        let tilt = (a.supported & b.supported).choose(tilt, zero);
        let shares = [a.weight * (one + tilt), zero - b.weight * (one - tilt)];
        Self { normal, upward, gap: distance - one, weights, inverse, shares }
    }

    /// Applies opposite impulses to both grains of each pair.
    #[inline(always)]
    pub fn kick(&self, a: EightGrains, b: EightGrains, impulse: V8) -> (EightGrains, EightGrains) {
        let [up, down] = self.shares;
        (a.kicked(impulse, up), b.kicked(impulse, down))
    }
}

/// One correction of the velocities and impulses of eight pairs.
#[inline(always)]
pub fn collide(
    a: EightGrains,
    b: EightGrains,
    batch: &mut Batch,
    c: &Coefficients,
) -> (EightGrains, EightGrains, Contact) {
    let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
    let contact = Contact::between(&a, &b, batch, c);
    let Contact { normal, gap, weights, inverse, .. } = contact;
    let relative = sub(a.velocity, b.velocity);
    let along = dot(relative, normal);
    let closing = |gap: Lanes| zero - gap.max(zero) * Lanes::all(c.diameter / c.dt);
    let (min_impulse, wanted) = if c.attraction > 0.0 {
        let attracts = gap.is_less(Lanes::all(c.band));
        let min_impulse = attracts.choose(Lanes::all(-c.attraction), zero);
        (min_impulse, attracts.choose(zero, closing(gap)))
    } else {
        (zero, closing(gap - Lanes::all(SLACK)))
    };
    let before = batch.impulse;
    let before_along = dot(before, normal);
    let total = (before_along + (wanted - along) * inverse).max(min_impulse);
    let sliding = sub(relative, scaled(normal, along));
    let tangential = sub(sub(before, scaled(normal, before_along)), scaled(sliding, inverse));
    let slides = Lanes::all(c.slides).is_less(dot(sliding, sliding));
    let friction = slides.choose(Lanes::all(c.friction_of_sliding), Lanes::all(c.friction));
    let max_friction = friction * (total - min_impulse);
    let square = dot(tangential, tangential);
    let exceeds = (max_friction * max_friction).is_less(square);
    let share = exceeds.choose(max_friction / square.sqrt().max(Lanes::all(1.0e-30)), one);
    let impulse = add(scaled(normal, total), scaled(tangential, share));
    let moves = zero.is_less(weights);
    for (axis, impulse) in impulse.into_iter().enumerate() {
        batch.impulse[axis] = moves.choose(impulse, before[axis]);
    }
    let change = sub(batch.impulse, before);
    let (a, b) = contact.kick(a, b, change);
    (a, b, contact)
}

impl Contact {
    /// Unsupported grains bounce: the impulse that stopped them gives them their approach speed (Poisson's hypothesis).
    #[inline(always)]
    pub fn bounce(
        &self,
        a: EightGrains,
        b: EightGrains,
        is_held: LaneMask,
        impulse: &V8,
        c: &Coefficients,
    ) -> (EightGrains, EightGrains) {
        let zero = Lanes::all(0.0);
        let stopped = dot(*impulse, self.normal) * self.weights;
        let closing = self.gap.max(zero) * Lanes::all(c.diameter / c.dt);
        let approach = stopped + closing;
        let meets = zero.is_less(stopped) & Lanes::all(c.bouncing).is_less(approach);
        let wanted = is_held.choose(zero, meets.choose(approach * Lanes::all(c.restitution) + closing, zero));
        let change = scaled(self.normal, wanted * self.inverse);
        self.kick(a, b, change)
    }

    /// Pushes of eight pairs, and marks for grains that are supported or woken.
    #[inline(always)]
    pub fn push(
        &self,
        a: &EightGrains,
        b: &EightGrains,
        pushes: [[Lanes; 4]; 2],
        c: &Coefficients,
    ) -> [[Lanes; 4]; 2] {
        let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
        let upward = self.upward;
        let moves = zero.is_less(self.weights);
        let [[ax, ay, az, a_marks], [bx, by, bz, b_marks]] = pushes;
        let (a_push, b_push) = ([ax, ay, az], [bx, by, bz]);
        // Overlap is removed; a gap must not close.
        let overlap = zero - self.gap;
        let slop = Lanes::all(if c.attraction > 0.0 { SLOP_OF_WALLS } else { SLOP });
        let some = ((overlap - slop).max(zero) * Lanes::all(REMOVED)).min(Lanes::all(MAX_CORRECTION));
        let removed = zero.is_less(self.gap).choose(overlap, some);
        let missing = removed - dot(sub(a_push, b_push), self.normal);
        let is_up = zero.is_less(upward);
        let (a_holds, b_holds) = (a.supported.choose(one, zero), b.supported.choose(one, zero));
        let share = upward * is_up.choose(b_holds, a_holds) * a.weight * b.weight;
        let amount = (zero.is_less(missing) & moves).choose(missing * self.inverse, zero);
        let push = scaled(self.normal, amount);
        let [ax, ay, az] = add(a_push, scaled(push, a.weight * (one + share)));
        let [bx, by, bz] = sub(b_push, scaled(push, b.weight * (one - share)));
        // Support spreads upward along chains of contacts that begin at something fixed.
        let (half, woken) = (Lanes::all(0.5), Lanes::all(rest::WOKEN));
        let (a_rests, b_rests) = (a.weight.is_less(half), b.weight.is_less(half));
        let (a_wakes, b_wakes) = (Lanes::all(1.5).is_less(a_marks), Lanes::all(1.5).is_less(b_marks));
        let a_stands = a_wakes.choose(a_marks - woken, a_marks);
        let b_stands = b_wakes.choose(b_marks - woken, b_marks);
        let touching = self.gap.is_less(Lanes::all(TOUCHING));
        let steep = if c.attraction > 0.0 { -2.0 } else { MIN_UPWARD };
        let up = touching & Lanes::all(steep).is_less(upward) & (half.is_less(b_stands) | b_rests);
        let down = touching & upward.is_less(Lanes::all(-steep)) & (half.is_less(a_stands) | a_rests);
        let (a_stands, b_stands) = (up.choose(one, a_stands), down.choose(one, b_stands));
        // A grain that moves wakes its neighbours.
        let near = self.gap.is_less(Lanes::all(rest::NEAR));
        let moving = Lanes::all(c.rest.map_or(0.0, |rule| rule.moving));
        let a_moves = half.is_less(a.weight) & a.still.is_less(moving);
        let b_moves = half.is_less(b.weight) & b.still.is_less(moving);
        let a_marks = a_stands + (a_wakes | (near & a_rests & b_moves)).choose(woken, zero);
        let b_marks = b_stands + (b_wakes | (near & b_rests & a_moves)).choose(woken, zero);
        [[ax, ay, az, a_marks], [bx, by, bz, b_marks]]
    }
}

/// Constants of a sub-step.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// Length of the sub-step (s).
    pub dt: f32,
    /// Diameter (m).
    pub diameter: f32,
    /// Gravity (m/s2).
    pub gravity: V,
    /// Direction opposite to gravity; 0 without gravity.
    pub up: V,
    /// Share of the velocity that drag removes in a sub-step: 1 - beta^dt.
    pub air: f32,
    /// The same by the number of neighbours that shelter a grain; none: neighbours do not shelter it.
    pub air_by_neighbours: Option<[f32; SURROUNDED + 1]>,
    /// Friction between grains that do not yet slide over each other.
    pub friction: f32,
    /// Friction between grains that slide.
    pub friction_of_sliding: f32,
    /// Square of the speed (m2/s2) above which a grain slides over another, or over a collider.
    pub slides: f32,
    /// Maximum impulse of attraction in a sub-step (m/s).
    pub attraction: f32,
    /// Speed that gravity adds in a sub-step (m/s).
    pub weight: f32,
    /// Share of its speed that a grain keeps in a bounce.
    pub restitution: f32,
    /// Minimum approach speed of a bounce (m/s): contacts that carry weight do not bounce.
    pub bouncing: f32,
    /// Maximum gap (diameters) at which grains attract each other.
    pub band: f32,
    /// When grains come to rest; none: never.
    pub rest: Option<Rest>,
    /// Whether all contacts are visited, even where all grains rest: the result is the same.
    pub visits_all: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::{Context, Pool};
    use crate::geometry::DVec3;
    use crate::snow::grains::Params;
    use crate::snow::grains::colliders::set::Colliders;
    use crate::snow::grains::heap::Heap;
    use crate::snow::grains::params::Division;

    /// Velocities (m/s) of a grain and of another that lands on it at 1 m/s, both supported.
    fn velocities_after_landing(attraction: f32) -> [f32; 2] {
        let params = Params { gravity: 0.0, friction: 0.0, rests: false, ..Params::for_cell(1.5) };
        let mut heap = Heap::new(2.0 * params.radius);
        for (id, speed) in [(0, 0.0), (1, -1.0)] {
            let position = DVec3::new(0.5, 0.5 + f64::from(id), 0.5) * heap.diameter;
            heap.add(id, position, [0.0, speed, 0.0]).unwrap();
        }
        heap.rows.iter_mut().for_each(|row| row.mass_state = 1.0 + SUPPORTED);
        let division = Division { dt: 1.0e-3, sub_steps: 1 };
        let coefficients = params.coefficients(&division);
        let coefficients = Coefficients { up: [0.0, 1.0, 0.0], air: 0.0, attraction, ..coefficients };
        let ctx = Context::new(Pool::new(1).unwrap());
        let step = || heap.step(&ctx, division, coefficients, &mut Colliders::default());
        ctx.step(1, || ctx.phase("move", step)).unwrap();
        [0, 1].map(|slot: usize| heap.rows[slot].velocity[1])
    }

    #[test]
    fn the_upper_of_two_supported_grains_is_lighter_unless_they_attract() {
        let [lower, upper] = velocities_after_landing(0.0);
        assert!((lower + 0.4).abs() < 1.0e-5 && (upper + 0.4).abs() < 1.0e-5, "{lower} {upper}");
        let [lower, upper] = velocities_after_landing(1.0e-9);
        assert!((lower + 0.5).abs() < 1.0e-5 && (upper + 0.5).abs() < 1.0e-5, "{lower} {upper}");
    }
}
