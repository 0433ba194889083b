//! The flux of a pipe: driven by gravity, held back by viscous drag (thesis Eq. 4.1 and 4.5).
//!
//! A flux is kept as the depth (units) that it moves in a step: w = f dt / (dx^2 unit). In these, Eq. 4.1 with the wetted section
//! A = dx H reads w' = zeta w + (dt^2 g unit / dx^2) H (eta_i - eta_j), and Eq. 4.5 w'' = w' H^2 / (H^2 + 3 dt nu (1 + S^2)^2); H is the depth
//! of the column that gives.

use super::fast_films::unpacked;
use crate::shallow::columns::{STRIP, strip_from, strip_mut, strip_of};

/// The numbers of a step that all pipes share.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// zeta = omega^dt, times the step over the last one, in whose measure fluxes are kept.
    pub kept: f32,
    /// dt^2 g unit / dx^2 (1 / units).
    pub drive: f32,
    /// 3 dt nu / unit^2 (units^2).
    pub drag: f32,
    /// [`FAST_WAVES`](super::fast_films::FAST_WAVES) divided by `drive` (units). Divided by a depth: the factor by which the inertia of a fast film is reduced.
    pub lighter: f32,
    /// The part of a column's depth that a pipe of a fast film moves in a step at most.
    pub fastest: f32,
    /// Greatest depth in the section A (units), for stability; where the section is whole, as in the thesis, its depth dx.
    pub section: f32,
    /// Whether all sections are whole.
    pub is_whole: bool,
    /// How the liquid thins; none: it does not.
    pub thinning: Option<Thinning>,
    /// Surface of the liquid at rest beyond the border (units), or BOTTOMLESS: there is none.
    pub still: i32,
    /// dt (g unit)^1/2 / dx: times the root of a depth (units) it is the way of a wave in a step, in cells.
    pub wave: f32,
    /// What gravity adds to the fall of the surface over a cell along x and along z (units).
    pub tilt: [i32; 2],
    /// 6/5 nu dt / dx^2: friction beside pipes (`walls`); 0: there is none.
    pub lateral: f32,
    /// The step over the last one, in whose measure fluxes are kept.
    pub again: f32,
    /// Edge of a cell (units).
    pub cell: f32,
    /// Liquid comes to rest in a pipe whose surfaces differ by so much at most (units),
    pub level: i32,
    /// and whose flux is at most this part of the depth in its section: both drive nothing visible.
    pub slow: f32,
}

/// Carreau's law, of a flux and the depth of the column that gives it.
#[derive(Debug, Clone, Copy)]
pub struct Thinning {
    /// 3 lambda dx / (dt unit), with the step in whose measure fluxes are: times flux / depth^2 it is lambda times the shear rate at the ground.
    pub shear: f32,
    /// The least viscosity, as part of that at rest.
    pub thinnest: f32,
    /// (n - 1) / 2.
    pub power: f32,
}

/// What the steps of a flow have in common: chosen once a step, not for each pipe.
pub trait Kind {
    /// Whether there is viscosity.
    const VISCOUS: bool;
    /// Whether A is dx^2.
    const WHOLE: bool;
    /// Whether viscosity depends on the flux.
    const THINS: bool;
}

/// A kind of flow: viscous, with whole sections, thinning, or not.
pub struct Of<const VISCOUS: bool, const WHOLE: bool, const THINS: bool>;

impl<const VISCOUS: bool, const WHOLE: bool, const THINS: bool> Kind for Of<VISCOUS, WHOLE, THINS> {
    const VISCOUS: bool = VISCOUS;
    const WHOLE: bool = WHOLE;
    const THINS: bool = THINS;
}

/// The greater number; a single instruction, as neither is ever NaN.
#[inline(always)]
pub fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lesser number.
#[inline(always)]
pub fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// What a pipe is to transfer (units): the nearest integer to its flux and what earlier transfers left of theirs; and what this one leaves. Cut
/// toward zero, what is left would push on in the direction of the flux. A pipe without flux keeps nothing.
#[inline(always)]
pub fn split(flux: f32, left: f32) -> [f32; 2] {
    let asked = if flux == 0.0 { 0.0 } else { flux + left };
    let whole = asked.round_ties_even();
    [whole, asked - whole]
}

/// The flux through a pipe from i to j after a step (units of depth): `fall` is eta_i - eta_j, `depth` H of both (units), `flux` the last flux;
/// the liquid's inertia counts `light` times less.
#[inline(always)]
pub fn flux_of<K: Kind>(step: &Step, fall: i32, depth: [f32; 2], flux: f32, open: f32, light: f32) -> f32 {
    let kept = step.kept * flux;
    let drive = step.drive * light * fall as f32;
    // The mean depth drives, the same uphill and downhill: with that of the column that gives, waves would gain by each swing.
    let section = if K::WHOLE { step.section } else { lesser(0.5 * (depth[0] + depth[1]), step.section) };
    let driven = kept + drive * section;
    let giver = if driven > 0.0 { depth[0] } else { depth[1] };
    if K::VISCOUS {
        let square = giver * giver;
        let drag = light * if K::THINS { step.drag * step.thinned(flux, square) } else { step.drag };
        let open = square * open;
        driven * (open / (open + drag))
    } else {
        // Nothing is held back, but a dry column gives nothing, and a closed pipe lets nothing pass.
        if giver * open > 0.0 { driven } else { 0.0 }
    }
}

impl Step {
    /// A flux, or none, where the surface is level but for less than can be seen and it is slow: all of it comes to rest, so that it can sleep.
    #[inline(always)]
    pub fn rested<K: Kind>(&self, fall: i32, depth: [f32; 2], flux: f32) -> f32 {
        let section = if K::WHOLE { self.section } else { lesser(0.5 * (depth[0] + depth[1]), self.section) };
        let moves = (fall.abs() > self.level) | (flux.abs() > self.slow * section);
        // A zero has one sign.
        if moves { flux + 0.0 } else { 0.0 }
    }

    /// The flux of a pipe whose inertia counts `light` times less: where that is over 1, it moves so much of the giver's depth at most. Marks
    /// where it would be more.
    #[inline(always)]
    fn held_back(&self, light: f32, depth: [f32; 2], flux: f32, held: &mut i32) -> f32 {
        let most =
            if light > 1.0 { self.fastest * if flux > 0.0 { depth[0] } else { depth[1] } } else { f32::MAX };
        let within = lesser(greater(flux, -most), most);
        *held |= i32::from(within != flux);
        within
    }

    /// The viscosity of a flux, as part of that at rest; `square` is the square of the depth (units^2).
    #[inline(always)]
    pub fn thinned(&self, flux: f32, square: f32) -> f32 {
        let Some(law) = self.thinning else { return 1.0 };
        let rate = lesser(law.shear * flux.abs() / greater(square, 1.0), 1e15);
        law.thinnest + (1.0 - law.thinnest) * power(1.0 + rate * rate, law.power)
    }
}

/// x^p for x from 1 and p from -1/2 to 0, to 1e-5 of it; the same on every processor, and for whole vectors at once.
#[inline(always)]
fn power(x: f32, p: f32) -> f32 {
    const MANTISSA: u32 = 0x7f_ffff;
    const ONE: u32 = 0x3f80_0000;
    let exponent = ((x.to_bits() >> 23) as i32 - 127) as f32;
    let mantissa = f32::from_bits(x.to_bits() & MANTISSA | ONE);
    // log2 by its series in (m - 1) / (m + 1), which is at most 1/3.
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    let series = s * (1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0))));
    let log = p * (exponent + 2.0 * std::f32::consts::LOG2_E * series);
    // 2^log: the nearest integer below or above, and the series of the rest, at most 1/2.
    let nearest = (log - 0.5) as i32;
    let rest = (log - nearest as f32) * std::f32::consts::LN_2;
    let whole = f32::from_bits(((127 + nearest) as u32) << 23);
    whole
        * (1.0
            + rest
                * (1.0
                    + rest * (1.0 / 2.0 + rest * (1.0 / 6.0 + rest * (1.0 / 24.0 + rest * (1.0 / 120.0))))))
}

/// Columns of a span of a row, and those to the south of them; each array has the span's length, `base` and `depth` one more: the columns
/// to the east.
pub struct Row<'a> {
    /// b (units).
    pub base: &'a [i32],
    /// H (units).
    pub depth: &'a [i32],
    /// b to the south.
    pub south_base: &'a [i32],
    /// H to the south.
    pub south_depth: &'a [i32],
    /// Openness to the east and to the south.
    pub open: [&'a [f32]; 2],
    /// How much less inertia counts to the east and to the south, where it does (`fast::packed`).
    pub light: &'a [u32],
    /// In which strips it does.
    pub is_light: &'a [bool],
}

/// What the pipes of a span carry, to the east and to the south.
pub struct Carried<'a> {
    /// Flux (units a step).
    pub flux: [&'a mut [f32]; 2],
    /// What transfers left (units).
    pub left: [&'a mut [f32]; 2],
    /// What is to be transferred (units).
    pub transfer: [&'a mut [f32]; 2],
}

/// Computes the fluxes of a span's pipes, and what these are to transfer; whether one of a fast film was held back. What is slow comes to rest, if it
/// may.
#[inline(always)]
pub fn flux_row<K: Kind, const LIGHT: bool, const RESTS: bool>(
    step: &Step,
    row: &Row,
    carried: Carried,
) -> bool {
    let mut held = [0; STRIP];
    let Carried { flux: [east, south], left: [left_east, left_south], transfer: [to_east, to_south] } =
        carried;
    for strip in 0..east.len() / STRIP {
        let first = strip * STRIP;
        let base = strip_of(row.base, strip);
        let depth = strip_of(row.depth, strip);
        let is_light = LIGHT && row.is_light[strip];
        let light = if is_light { strip_of(row.light, strip) } else { &[0; STRIP] };
        let ends = Ends {
            base: [base, strip_from(row.base, first + 1)],
            depth: [depth, strip_from(row.depth, first + 1)],
            open: strip_of(row.open[0], strip),
            light,
        };
        let (flux, left, to) =
            (strip_mut(east, strip), strip_mut(left_east, strip), strip_mut(to_east, strip));
        if is_light {
            flux_strip::<K, true, RESTS, 0>(step, &ends, flux, left, to, &mut held);
        } else {
            flux_strip::<K, false, RESTS, 0>(step, &ends, flux, left, to, &mut held);
        }
        let ends = Ends {
            base: [base, strip_of(row.south_base, strip)],
            depth: [depth, strip_of(row.south_depth, strip)],
            open: strip_of(row.open[1], strip),
            light,
        };
        let (flux, left, to) =
            (strip_mut(south, strip), strip_mut(left_south, strip), strip_mut(to_south, strip));
        if is_light {
            flux_strip::<K, true, RESTS, 1>(step, &ends, flux, left, to, &mut held);
        } else {
            flux_strip::<K, false, RESTS, 1>(step, &ends, flux, left, to, &mut held);
        }
    }
    LIGHT && held != [0; STRIP]
}

/// As [`flux_row`], with fluxes to the east and to the south that are known (`walls`).
#[inline(always)]
pub fn solved_row<const LIGHT: bool>(step: &Step, row: &Row, solved: [&[f32]; 2], carried: Carried) -> bool {
    let mut held = [0; STRIP];
    let Carried { flux: [east, south], left: [left_east, left_south], transfer: [to_east, to_south] } =
        carried;
    for strip in 0..east.len() / STRIP {
        let depth = strip_of(row.depth, strip);
        let light = if LIGHT { strip_of(row.light, strip) } else { &[0; STRIP] };
        let ends = [depth, strip_from(row.depth, strip * STRIP + 1)];
        let (flux, left, to) =
            (strip_mut(east, strip), strip_mut(left_east, strip), strip_mut(to_east, strip));
        solved_strip::<LIGHT, 0>(step, ends, light, strip_of(solved[0], strip), flux, left, to, &mut held);
        let ends = [depth, strip_of(row.south_depth, strip)];
        let (flux, left, to) =
            (strip_mut(south, strip), strip_mut(left_south, strip), strip_mut(to_south, strip));
        solved_strip::<LIGHT, 1>(step, ends, light, strip_of(solved[1], strip), flux, left, to, &mut held);
    }
    LIGHT && held != [0; STRIP]
}

#[inline(always)]
#[expect(clippy::too_many_arguments)]
fn solved_strip<const LIGHT: bool, const AXIS: usize>(
    step: &Step,
    depth: [&[i32; STRIP]; 2],
    light: &[u32; STRIP],
    solved: &[f32; STRIP],
    flux: &mut [f32; STRIP],
    left: &mut [f32; STRIP],
    transfer: &mut [f32; STRIP],
    held: &mut [i32; STRIP],
) {
    for x in 0..STRIP {
        let mut f = solved[x];
        if LIGHT {
            let depth = [depth[0][x] as f32, depth[1][x] as f32];
            f = step.held_back(unpacked(light[x])[AXIS], depth, f, &mut held[x]);
        }
        flux[x] = f;
        [transfer[x], left[x]] = split(f, left[x]);
    }
}

/// The columns at both ends of the pipes of a strip in one direction.
struct Ends<'a> {
    base: [&'a [i32; STRIP]; 2],
    depth: [&'a [i32; STRIP]; 2],
    open: &'a [f32; STRIP],
    light: &'a [u32; STRIP],
}

/// Fluxes of a strip's pipes to the east or to the south. A strip has a fixed length, and each array that changes is an argument of its own:
/// the compiled code then neither tests for overlapping arrays before a row nor ends it column by column.
#[inline(always)]
fn flux_strip<K: Kind, const LIGHT: bool, const RESTS: bool, const AXIS: usize>(
    step: &Step,
    ends: &Ends,
    flux: &mut [f32; STRIP],
    left: &mut [f32; STRIP],
    transfer: &mut [f32; STRIP],
    held: &mut [i32; STRIP],
) {
    let Ends { base, depth, open, light } = ends;
    for x in 0..STRIP {
        let fall = base[0][x] + depth[0][x] - (base[1][x] + depth[1][x]) + step.tilt[AXIS];
        let depth = [depth[0][x] as f32, depth[1][x] as f32];
        let light = if LIGHT { unpacked(light[x])[AXIS] } else { 1.0 };
        let mut f = flux_of::<K>(step, fall, depth, flux[x], open[x], light);
        if RESTS {
            f = step.rested::<K>(fall, depth, f);
        }
        if LIGHT {
            f = step.held_back(light, depth, f, &mut held[x]);
        }
        flux[x] = f;
        [transfer[x], left[x]] = split(f, left[x]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_libm() {
        for step in 0..2000 {
            let x = libm::exp(f64::from(step) * 0.034);
            for p in [-0.5, -0.3216, -0.01, 0.0] {
                let (ours, theirs) = (f64::from(power(x as f32, p as f32)), libm::pow(x, p));
                assert!((ours / theirs - 1.0).abs() < 2e-5, "{x}^{p}: {ours} is not {theirs}");
            }
        }
    }

    impl Step {
        /// A step of nothing.
        pub(in crate::shallow::solver) fn still() -> Self {
            Self {
                kept: 1.0,
                drive: 0.0,
                drag: 0.0,
                lighter: 1.0,
                fastest: 0.3,
                section: 1e9,
                is_whole: false,
                thinning: None,
                still: 0,
                wave: 0.0,
                tilt: [0; 2],
                lateral: 0.0,
                again: 1.0,
                cell: 1.0,
                level: 4,
                slow: 1e-9,
            }
        }
    }

    #[test]
    fn a_flux_is_the_same_seen_from_both_ends() {
        let step = Step { kept: 0.9, drive: 1e-7, drag: 1e9, lighter: 3.5e6, section: 5e4, ..Step::still() };
        for (fall, depth, last) in
            [(700, [3e4, 2e4], 20.0), (-90, [6e4, 0.0], 31.5), (40, [2e4, 2e4], -0.1), (-5, [0.0, 1e4], 0.0)]
        {
            let [there, back] =
                [(fall, depth, last), (-fall, [depth[1], depth[0]], -last)].map(|(fall, depth, last)| {
                    flux_of::<Of<true, false, false>>(&step, fall, depth, last, 0.7, 1.5)
                });
            assert_eq!(there, -back, "{fall} {depth:?} {last}");
        }
    }
}
