//! The flux of a pipe: driven by gravity, reduced by viscous drag (thesis Eq. 4.1 and 4.5).
//!
//! A flux is stored as the depth (units) that it moves in a step: w = f dt / (dx^2 unit). In this form, Eq. 4.1 with the wetted section A =
//! dx H reads w' = zeta w + (dt^2 g unit / dx^2) H (eta_i - eta_j), and Eq. 4.5 w'' = w' H^2 / (H^2 + 3 dt nu (1 + S^2)^2); in Eq. 4.5 H is
//! the donor's depth.

use crate::shallow::columns::{STRIP, strip_from, strip_mut, strip_of};

/// The coefficients of a step that all pipes share.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// zeta = omega^dt, times the length of this step divided by that of the last one, which stored fluxes refer to.
    pub kept: f32,
    /// dt^2 g unit / dx^2 (1 / units).
    pub drive: f32,
    /// 3 dt nu / unit^2 (units^2).
    pub drag: f32,
    /// [`FAST_WAVES`](super::fast_films::FAST_WAVES) divided by `drive` (units). This divided by a depth is the inertia divisor of a fast
    /// film.
    pub light_depth: f32,
    /// The maximum transfer of a pipe of a fast film in a step, as a fraction of the donor's depth.
    pub max_film_transfer: f32,
    /// Upper limit of H in the section A = dx H (units), for stability; with whole sections (A = dx^2, as in the thesis) it is dx.
    pub section: f32,
    /// Whether all sections are dx^2.
    pub is_whole: bool,
    /// The shear-thinning law; None: constant viscosity.
    pub thinning: Option<Thinning>,
    /// Surface of the liquid at rest beyond the border (units), or BOTTOMLESS: there is none.
    pub still_level: i32,
    /// dt (g unit)^1/2 / dx: multiplied by the square root of a depth (units), it gives the distance (cells) that a wave travels in a step.
    pub wave: f32,
    /// What gravity adds to the drop of the surface over a cell, along x and along z (units).
    pub tilt: [i32; 2],
    /// 6/5 nu dt / dx^2: lateral friction (`lateral_friction`); 0: there is none.
    pub lateral: f32,
    /// The length of this step divided by that of the last one, which stored fluxes refer to.
    pub step_ratio: f32,
    /// Edge of a cell (units).
    pub cell: f32,
    /// Maximum surface difference (units) at which the liquid in a pipe comes to rest.
    pub rest_drop: i32,
    /// Maximum flux at which the liquid in a pipe comes to rest, as a fraction of the depth in its section. Below this and
    /// `rest_drop` no motion is visible.
    pub rest_flux: f32,
}

/// Carreau's law, as a function of a flux and the donor's depth.
#[derive(Debug, Clone, Copy)]
pub struct Thinning {
    /// 3 lambda dx / (dt unit), where dt is the length of the step that fluxes refer to: multiplied by flux / depth^2, it gives lambda
    /// times the shear rate at the ground.
    pub shear: f32,
    /// The minimum viscosity, as a fraction of that at rest.
    pub thinnest: f32,
    /// (n - 1) / 2.
    pub power: f32,
}

/// Compile-time variants of a step: selected once per step, not for each pipe.
pub trait StepKind {
    /// Whether there is viscosity.
    const VISCOUS: bool;
    /// Whether A is dx^2.
    const WHOLE: bool;
    /// Whether viscosity depends on the flux.
    const THINS: bool;
}

/// A variant, by three independent flags: viscous or not, whole sections or not, shear-thinning or not.
pub struct Variant<const VISCOUS: bool, const WHOLE: bool, const THINS: bool>;

impl<const VISCOUS: bool, const WHOLE: bool, const THINS: bool> StepKind for Variant<VISCOUS, WHOLE, THINS> {
    const VISCOUS: bool = VISCOUS;
    const WHOLE: bool = WHOLE;
    const THINS: bool = THINS;
}

/// Evaluates `$run` with the type `$kind` bound to the step's variant. `$run` is compiled once for each variant.
macro_rules! by_kind {
    ($step:expr, $kind:ident => $run:expr) => {
        by_kind!($step, $kind => $run;
            true true true, true true false, true false true, true false false, false true false, false false false)
    };
    ($step:expr, $kind:ident => $run:expr; $($viscous:literal $whole:literal $thins:literal),+) => {
        match ($step.drag > 0.0, $step.is_whole, $step.drag > 0.0 && $step.thinning.is_some()) {
            $(($viscous, $whole, $thins) => {
                type $kind = $crate::shallow::solver::viscous_flux::Variant<$viscous, $whole, $thins>;
                $run
            })+
            (false, _, true) => unreachable!("only viscosity thins"),
        }
    };
}
pub(in crate::shallow) use by_kind;

/// Maximum; a single instruction, as neither number is ever NaN.
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Minimum.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The transfer of a pipe (units), which is its flux plus the remainder of earlier transfers, rounded to nearest; and the new remainder. If
/// it were truncated toward zero, the remainder would keep driving in the direction of the flux. A pipe without flux keeps no remainder.
#[inline(always)]
pub fn whole_and_remainder(flux: f32, remainder: f32) -> [f32; 2] {
    let asked = if flux == 0.0 { 0.0 } else { flux + remainder };
    let whole = asked.round_ties_even();
    [whole, asked - whole]
}

/// The flux through a pipe from i to j after a step (units of depth): `fall` is eta_i - eta_j, `depth` H of both (units), `flux` the last
/// flux; `light` is what the inertia of the liquid is divided by.
#[inline(always)]
pub fn flux_of<K: StepKind>(
    step: &Step,
    fall: i32,
    depth: [f32; 2],
    flux: f32,
    open: f32,
    light: f32,
) -> f32 {
    let kept = step.kept * flux;
    let drive = step.drive * light * fall as f32;
    // The mean depth drives, the same uphill and downhill: with the donor's depth, waves would gain energy in each oscillation.
    let section = if K::WHOLE { step.section } else { min(0.5 * (depth[0] + depth[1]), step.section) };
    let driven = kept + drive * section;
    let donor = if driven > 0.0 { depth[0] } else { depth[1] };
    if K::VISCOUS {
        let square = donor * donor;
        let drag = light * if K::THINS { step.drag * step.thinned(flux, square) } else { step.drag };
        let open = square * open;
        driven * (open / (open + drag))
    } else {
        // No drag, but a dry column gives nothing, and a closed pipe lets nothing pass.
        if donor * open > 0.0 { driven } else { 0.0 }
    }
}

impl Step {
    /// Sets a flux to 0 where it is slow and the surface differs from level by less than is visible, so that the liquid can sleep.
    #[inline(always)]
    pub fn rest_if_slow<K: StepKind>(&self, fall: i32, depth: [f32; 2], flux: f32) -> f32 {
        let section = if K::WHOLE { self.section } else { min(0.5 * (depth[0] + depth[1]), self.section) };
        let moves = (fall.abs() > self.rest_drop) | (flux.abs() > self.rest_flux * section);
        // Turns -0 into 0.
        if moves { flux + 0.0 } else { 0.0 }
    }

    /// Limits the flux of a pipe whose inertia is reduced (`light` above 1) to a part of the donor's depth; sets `limited` if that
    /// changes it.
    #[inline(always)]
    fn limit_fast_film(&self, light: f32, depth: [f32; 2], flux: f32, limited: &mut i32) -> f32 {
        let bound = if light > 1.0 {
            self.max_film_transfer * if flux > 0.0 { depth[0] } else { depth[1] }
        } else {
            f32::MAX
        };
        let within = min(max(flux, -bound), bound);
        *limited |= i32::from(within != flux);
        within
    }

    /// The viscosity at a flux, as a fraction of that at rest; `square` is the square of the depth (units^2).
    #[inline(always)]
    pub fn thinned(&self, flux: f32, square: f32) -> f32 {
        let Some(law) = self.thinning else { return 1.0 };
        let rate = min(law.shear * flux.abs() / max(square, 1.0), 1e15);
        law.thinnest + (1.0 - law.thinnest) * power(1.0 + rate * rate, law.power)
    }
}

/// x^p for x >= 1 and -1/2 <= p <= 0, with a relative error of about 1e-5; the same on every processor, and vectorisable.
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
    // 2^log: the nearest integer exponent, and the series of the rest, at most 1/2.
    let nearest = (log - 0.5) as i32;
    let rest = (log - nearest as f32) * std::f32::consts::LN_2;
    let whole = f32::from_bits(((127 + nearest) as u32) << 23);
    whole
        * (1.0
            + rest
                * (1.0
                    + rest * (1.0 / 2.0 + rest * (1.0 / 6.0 + rest * (1.0 / 24.0 + rest * (1.0 / 120.0))))))
}

/// Columns of a span of a row, and those to the south of them. Each array has the span's length; `base` and `depth` have one more element,
/// for the column to the east.
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
    /// Inertia divisors of the pipes to the east and to the south (`fast_films::packed`); only valid in the strips that `is_light` marks.
    pub light: &'a [u32],
    /// Whether the inertia of some pipes is reduced, for each strip.
    pub is_light: &'a [bool],
}

/// State of a span's pipes, to the east and to the south.
pub struct PipeState<'a> {
    /// Flux (units per step).
    pub flux: [&'a mut [f32]; 2],
    /// Remainders of transfers (units).
    pub remainder: [&'a mut [f32]; 2],
    /// Transfers of this step (units).
    pub transfer: [&'a mut [f32]; 2],
}

/// Computes the fluxes and transfers of a span's pipes; returns whether a flux of a fast film was limited. With `RESTS`, slow liquid comes
/// to rest.
#[inline(always)]
pub fn flux_row<K: StepKind, const LIGHT: bool, const RESTS: bool>(
    step: &Step,
    row: &Row,
    state: PipeState,
) -> bool {
    let mut limited = [0; STRIP];
    let PipeState {
        flux: [east, south],
        remainder: [remainder_east, remainder_south],
        transfer: [to_east, to_south],
    } = state;
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
        let (flux, remainder, to) =
            (strip_mut(east, strip), strip_mut(remainder_east, strip), strip_mut(to_east, strip));
        if is_light {
            flux_strip::<K, true, RESTS, 0>(step, &ends, flux, remainder, to, &mut limited);
        } else {
            flux_strip::<K, false, RESTS, 0>(step, &ends, flux, remainder, to, &mut limited);
        }
        let ends = Ends {
            base: [base, strip_of(row.south_base, strip)],
            depth: [depth, strip_of(row.south_depth, strip)],
            open: strip_of(row.open[1], strip),
            light,
        };
        let (flux, remainder, to) =
            (strip_mut(south, strip), strip_mut(remainder_south, strip), strip_mut(to_south, strip));
        if is_light {
            flux_strip::<K, true, RESTS, 1>(step, &ends, flux, remainder, to, &mut limited);
        } else {
            flux_strip::<K, false, RESTS, 1>(step, &ends, flux, remainder, to, &mut limited);
        }
    }
    LIGHT && limited != [0; STRIP]
}

/// As [`flux_row`], for fluxes to the east and to the south that are already solved (`lateral_friction`).
#[inline(always)]
pub fn solved_row<const LIGHT: bool>(step: &Step, row: &Row, solved: [&[f32]; 2], state: PipeState) -> bool {
    let mut limited = [0; STRIP];
    let PipeState {
        flux: [east, south],
        remainder: [remainder_east, remainder_south],
        transfer: [to_east, to_south],
    } = state;
    for strip in 0..east.len() / STRIP {
        let depth = strip_of(row.depth, strip);
        let light = if LIGHT { strip_of(row.light, strip) } else { &[0; STRIP] };
        let ends = [depth, strip_from(row.depth, strip * STRIP + 1)];
        let (flux, remainder, to) =
            (strip_mut(east, strip), strip_mut(remainder_east, strip), strip_mut(to_east, strip));
        solved_strip::<LIGHT, 0>(
            step,
            ends,
            light,
            strip_of(solved[0], strip),
            flux,
            remainder,
            to,
            &mut limited,
        );
        let ends = [depth, strip_of(row.south_depth, strip)];
        let (flux, remainder, to) =
            (strip_mut(south, strip), strip_mut(remainder_south, strip), strip_mut(to_south, strip));
        solved_strip::<LIGHT, 1>(
            step,
            ends,
            light,
            strip_of(solved[1], strip),
            flux,
            remainder,
            to,
            &mut limited,
        );
    }
    LIGHT && limited != [0; STRIP]
}

#[inline(always)]
#[expect(clippy::too_many_arguments)]
fn solved_strip<const LIGHT: bool, const AXIS: usize>(
    step: &Step,
    depth: [&[i32; STRIP]; 2],
    light: &[u32; STRIP],
    solved: &[f32; STRIP],
    flux: &mut [f32; STRIP],
    remainder: &mut [f32; STRIP],
    transfer: &mut [f32; STRIP],
    limited: &mut [i32; STRIP],
) {
    for x in 0..STRIP {
        let mut f = solved[x];
        if LIGHT {
            let depth = [depth[0][x] as f32, depth[1][x] as f32];
            f = step.limit_fast_film(unpacked(light[x])[AXIS], depth, f, &mut limited[x]);
        }
        flux[x] = f;
        [transfer[x], remainder[x]] = whole_and_remainder(f, remainder[x]);
    }
}

/// The columns at both ends of the pipes of a strip in one direction.
struct Ends<'a> {
    base: [&'a [i32; STRIP]; 2],
    depth: [&'a [i32; STRIP]; 2],
    open: &'a [f32; STRIP],
    light: &'a [u32; STRIP],
}

/// Fluxes of a strip's pipes to the east or to the south. A strip has a fixed length, and each array that changes is a separate argument:
/// so the compiler emits neither overlap tests before a row nor a scalar loop at its end.
#[inline(always)]
fn flux_strip<K: StepKind, const LIGHT: bool, const RESTS: bool, const AXIS: usize>(
    step: &Step,
    ends: &Ends,
    flux: &mut [f32; STRIP],
    remainder: &mut [f32; STRIP],
    transfer: &mut [f32; STRIP],
    limited: &mut [i32; STRIP],
) {
    let Ends { base, depth, open, light } = ends;
    for x in 0..STRIP {
        let fall = base[0][x] + depth[0][x] - (base[1][x] + depth[1][x]) + step.tilt[AXIS];
        let depth = [depth[0][x] as f32, depth[1][x] as f32];
        let light = if LIGHT { unpacked(light[x])[AXIS] } else { 1.0 };
        let mut f = flux_of::<K>(step, fall, depth, flux[x], open[x], light);
        if RESTS {
            f = step.rest_if_slow::<K>(fall, depth, f);
        }
        if LIGHT {
            f = step.limit_fast_film(light, depth, f, &mut limited[x]);
        }
        flux[x] = f;
        [transfer[x], remainder[x]] = whole_and_remainder(f, remainder[x]);
    }
}

/// Unpacks the divisors of `packed`.
#[inline(always)]
pub fn unpacked(both: u32) -> [f32; 2] {
    [both << 16, both & 0xffff_0000].map(f32::from_bits)
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
        /// A step in which no force acts.
        pub(in crate::shallow::solver) fn without_forces() -> Self {
            Self {
                kept: 1.0,
                drive: 0.0,
                drag: 0.0,
                light_depth: 1.0,
                max_film_transfer: 0.3,
                section: 1e9,
                is_whole: false,
                thinning: None,
                still_level: 0,
                wave: 0.0,
                tilt: [0; 2],
                lateral: 0.0,
                step_ratio: 1.0,
                cell: 1.0,
                rest_drop: 4,
                rest_flux: 1e-9,
            }
        }
    }

    #[test]
    fn a_flux_is_the_same_seen_from_both_ends() {
        let step = Step {
            kept: 0.9,
            drive: 1e-7,
            drag: 1e9,
            light_depth: 3.5e6,
            section: 5e4,
            ..Step::without_forces()
        };
        for (fall, depth, last) in
            [(700, [3e4, 2e4], 20.0), (-90, [6e4, 0.0], 31.5), (40, [2e4, 2e4], -0.1), (-5, [0.0, 1e4], 0.0)]
        {
            let [there, back] =
                [(fall, depth, last), (-fall, [depth[1], depth[0]], -last)].map(|(fall, depth, last)| {
                    flux_of::<Variant<true, false, false>>(&step, fall, depth, last, 0.7, 1.5)
                });
            assert_eq!(there, -back, "{fall} {depth:?} {last}");
        }
    }
}
