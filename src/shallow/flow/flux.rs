//! What drives the liquid through a pipe, and what holds it back (thesis Eq. 4.1 and 4.5).
//!
//! A flux is kept as the depth (units) that it moves in a step: w = f dt / (dx^2 unit). In these, Eq. 4.1 with the wetted section
//! A = dx H reads w' = zeta w + (dt^2 g unit / dx^2) H (eta_i - eta_j), and Eq. 4.5 w'' = w' H^2 / (H^2 + 3 dt nu (1 + S^2)^2); H is the depth
//! of the column that gives.

use super::fast::unpacked;

/// The numbers of a step that all pipes share.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// zeta = omega^dt, times the step over the last one, in whose measure fluxes are kept.
    pub kept: f32,
    /// dt^2 g unit / dx^2 (1 / units).
    pub drive: f32,
    /// 3 dt nu / unit^2 (units^2).
    pub drag: f32,
    /// [`FAST_WAVES`](super::fast::FAST_WAVES) over `drive` (units): over a depth, by how much the inertia of a fast film counts less.
    pub lighter: f32,
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

/// A transfer whose integer part is the nearest integer: always cut toward zero, what is left would push on in the direction of the flux.
#[inline(always)]
pub fn rounded(transfer: f32) -> f32 {
    transfer + 0.5f32.copysign(transfer)
}

/// The flux through a pipe from i to j after a step (units of depth): `fall` is eta_i - eta_j, `depth` H of both (units), `flux` the last flux;
/// the liquid's inertia counts `light` times less.
#[inline(always)]
pub fn flux<K: Kind>(step: &Step, fall: i32, depth: [f32; 2], flux: f32, open: f32, light: f32) -> f32 {
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
    /// Openness to the east.
    pub open_east: &'a [f32],
    /// Openness to the south.
    pub open_south: &'a [f32],
    /// What truncation left of the last transfers to the east (units).
    pub left_east: &'a [f32],
    /// The same to the south.
    pub left_south: &'a [f32],
    /// How much less inertia counts to the east and to the south, where it does (`fast::packed`).
    pub light: &'a [u32],
}

/// Computes the fluxes of a span's pipes, and what they are to transfer: the flux and what was left.
#[inline(always)]
pub fn flux_row<K: Kind, const LIGHT: bool>(
    step: &Step,
    row: &Row,
    east: &mut [f32],
    south: &mut [f32],
    to_east: &mut [f32],
    to_south: &mut [f32],
) {
    let count = east.len();
    let (base, depth) = (&row.base[..count + 1], &row.depth[..count + 1]);
    let (south_base, south_depth) = (&row.south_base[..count], &row.south_depth[..count]);
    let (open_east, open_south) = (&row.open_east[..count], &row.open_south[..count]);
    let (left_east, left_south) = (&row.left_east[..count], &row.left_south[..count]);
    let light = if LIGHT { &row.light[..count] } else { row.light };
    let (south, to_east, to_south) = (&mut south[..count], &mut to_east[..count], &mut to_south[..count]);
    for x in 0..count {
        let eta = base[x] + depth[x];
        let own = depth[x] as f32;
        let fall = eta - (base[x + 1] + depth[x + 1]) + step.tilt[0];
        let [light_east, light_south] = if LIGHT { unpacked(light[x]) } else { [1.0; 2] };
        let f = flux::<K>(step, fall, [own, depth[x + 1] as f32], east[x], open_east[x], light_east);
        east[x] = f;
        to_east[x] = if f == 0.0 { 0.0 } else { rounded(f + left_east[x]) };
        let fall = eta - (south_base[x] + south_depth[x]) + step.tilt[1];
        let f = flux::<K>(step, fall, [own, south_depth[x] as f32], south[x], open_south[x], light_south);
        south[x] = f;
        to_south[x] = if f == 0.0 { 0.0 } else { rounded(f + left_south[x]) };
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

    #[test]
    fn a_flux_is_the_same_seen_from_both_ends() {
        let step = Step {
            kept: 0.9,
            drive: 1e-7,
            drag: 1e9,
            lighter: 3.5e6,
            section: 5e4,
            is_whole: false,
            thinning: None,
            still: 0,
            wave: 0.0,
            tilt: [0; 2],
        };
        for (fall, depth, last) in
            [(700, [3e4, 2e4], 20.0), (-90, [6e4, 0.0], 31.5), (40, [2e4, 2e4], -0.1), (-5, [0.0, 1e4], 0.0)]
        {
            let [there, back] =
                [(fall, depth, last), (-fall, [depth[1], depth[0]], -last)].map(|(fall, depth, last)| {
                    flux::<Of<true, false, false>>(&step, fall, depth, last, 0.7, 1.5)
                });
            assert_eq!(there, -back, "{fall} {depth:?} {last}");
        }
    }
}
