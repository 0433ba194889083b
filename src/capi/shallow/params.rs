//! The liquid, its parameters and its domain, in C.

use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::context::Context;
use crate::shallow::columns::grid::{Grid, Heights};
use crate::shallow::free_fall::Falls;
use crate::shallow::material::{Carreau, Liquid};
use crate::shallow::params::{Friction, Section, TimeStepping};
use crate::shallow::pipes::Border;
use crate::shallow::{Params, Thickening};

/// Liquids that frz_shallow_params_liquid knows.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_liquid {
    /// Water at 20 C: 1e-6 m2/s.
    FRZ_LIQUID_WATER = 0,
    /// Blood, without shear thinning: 4e-6 m2/s.
    FRZ_LIQUID_BLOOD = 1,
    /// Paint: 4e-5 m2/s.
    FRZ_LIQUID_PAINT = 2,
    /// Honey at 20 C: 7e-3 m2/s.
    FRZ_LIQUID_HONEY = 3,
    /// Blood with shear thinning: from 5.28e-5 m2/s at rest to 3.25e-6 m2/s.
    FRZ_LIQUID_THINNING_BLOOD = 4,
}

/// How a frame is divided into steps.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_pace {
    /// Steps of at most frz_shallow_params.longest_step: waves in liquid that is too deep for such a step are slowed down, and so are films
    /// on slopes that are too fast for it.
    FRZ_SHALLOW_REALTIME = 0,
    /// As many steps as stability requires.
    FRZ_SHALLOW_EXACT = 1,
}

/// What lies beyond the border of the domain.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_border {
    /// A wall.
    FRZ_SHALLOW_CLOSED = 0,
    /// Nothing: liquid flows off along the slope of the ground near the border, and is lost.
    FRZ_SHALLOW_OPEN = 1,
    /// Liquid at rest, at the height of the last fill (frz_shallow_fill, frz_shallow_detail_fill): waves leave, and do not come back. Before
    /// the first fill, and where the ground is higher, as FRZ_SHALLOW_OPEN.
    FRZ_SHALLOW_ABSORBING = 2,
}

/// The cross-section of a pipe between two columns.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_section {
    /// Its wetted part: films flow as fast as theory says.
    FRZ_SHALLOW_WETTED = 0,
    /// The whole cell, as in the thesis: for comparison.
    FRZ_SHALLOW_WHOLE = 1,
}

/// Where viscous drag acts.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_friction {
    /// At the ground: accurate where the liquid is far wider than deep.
    FRZ_SHALLOW_GROUND = 0,
    /// Also at walls and ceilings, and between liquids that flow side by side: flow rates in ducts and channels match theory. Slower.
    FRZ_SHALLOW_WALLS = 1,
}

/// A scalar index that means no scalar.
pub const FRZ_SHALLOW_NO_SCALAR: u32 = 0xFFFF_FFFF;

use frz_liquid::*;
use frz_shallow_border::*;
use frz_shallow_friction::*;
use frz_shallow_pace::*;
use frz_shallow_section::*;

const LIQUIDS: [(u32, Liquid); 5] = [
    (FRZ_LIQUID_WATER as u32, Liquid::WATER),
    (FRZ_LIQUID_BLOOD as u32, Liquid::BLOOD),
    (FRZ_LIQUID_PAINT as u32, Liquid::PAINT),
    (FRZ_LIQUID_HONEY as u32, Liquid::HONEY),
    (FRZ_LIQUID_THINNING_BLOOD as u32, Liquid::THINNING_BLOOD),
];

const PACES: Meanings<frz_shallow_pace, 2> = numbered! { FRZ_SHALLOW_REALTIME, FRZ_SHALLOW_EXACT };

const BORDERS: [(u32, Border); 3] = [
    (FRZ_SHALLOW_CLOSED as u32, Border::Closed),
    (FRZ_SHALLOW_OPEN as u32, Border::Open),
    (FRZ_SHALLOW_ABSORBING as u32, Border::Absorbing),
];

const SECTIONS: [(u32, Section); 2] =
    [(FRZ_SHALLOW_WETTED as u32, Section::Wetted), (FRZ_SHALLOW_WHOLE as u32, Section::Whole)];

const FRICTIONS: [(u32, Friction); 2] =
    [(FRZ_SHALLOW_GROUND as u32, Friction::Ground), (FRZ_SHALLOW_WALLS as u32, Friction::Walls)];

/// Parameters of a liquid. All but border, friction and the falls_ fields may change between frames.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_params {
    /// sizeof(frz_shallow_params).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Kinematic viscosity (m2/s), 0 to 1e6; with shear thinning, at rest. Default 4e-6, that of blood: see frz_shallow_params_liquid.
    pub viscosity: f64,
    /// Viscosity under strong shear (m2/s), 0 to viscosity, by Carreau's law; only with a thinning_time.
    pub thinnest: f64,
    /// Time of Carreau's law (s), 1e-9 to 1e9; default 0: no shear thinning.
    pub thinning_time: f64,
    /// Power of Carreau's law, 0 to 1; only with a thinning_time.
    pub thinning_power: f64,
    /// Gravity (m/s2), default (0, -9.81, 0). Its y is -1000 to -0.001, and neither x nor z exceeds it in magnitude. It may rotate from
    /// frame to frame.
    pub gravity: [f64; 3],
    /// Share of the flux that is kept in a second, 0 to 1; default 0.5. At 1 only viscosity slows the flow.
    pub kept: f64,
    /// Maximum length of a step (s), 1e-6 to 1; only with FRZ_SHALLOW_REALTIME. Default 0.003.
    pub longest_step: f64,
    /// A frz_shallow_pace; default FRZ_SHALLOW_REALTIME.
    pub pace: u32,
    /// A frz_shallow_border; default FRZ_SHALLOW_CLOSED. It cannot change.
    pub border: u32,
    /// A frz_shallow_section; default FRZ_SHALLOW_WETTED.
    pub section: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Height (m) from which liquid falls freely over an edge, 0 or more; default 0.01. Where the ground drops by less than the edge of a
    /// cell, liquid never falls freely. This and the following falls_ fields apply only if falls_most is over 0, and cannot change.
    pub falls_height: f64,
    /// Time between the drops that leave one position (s), 0.0001 to 1; default 1/120.
    pub falls_interval: f64,
    /// Volume of a drop (m3), 0 or more; default 6.5e-11, a sphere with a diameter of half a millimetre. Where a drop takes longer than 8
    /// intervals to fill, liquid drips.
    pub falls_drop: f64,
    /// Maximum number of drops in the air, up to 1048576, for which memory is allocated at the start; 8192 is a good value. Default 0:
    /// nothing falls freely, and liquid that goes over an edge is below at once.
    pub falls_most: u32,
    /// Must be 0.
    pub reserved2: u32,
    /// Velocity (m/s) below which liquid with a level surface comes to rest, and then costs no time, 0 to 0.01; default 0: never. 1e-6 is a
    /// good value.
    pub rest: f64,
    /// A frz_shallow_friction; default FRZ_SHALLOW_GROUND. It cannot change.
    pub friction: u32,
    /// Index of the scalar that viscosity depends on (frz_shallow_set_scalars), from 0: for clotting blood its age. It must exist when a
    /// frame begins. Default FRZ_SHALLOW_NO_SCALAR: the following fields are ignored.
    pub thickening_scalar: u32,
    /// Concentration up to which viscosity is that of the liquid, finite.
    pub thickening_from: f64,
    /// Concentration from which viscosity is that of the liquid times thickening_times, and linear in between; finite, more or less than
    /// thickening_from.
    pub thickening_to: f64,
    /// Factor on viscosity, 1e-6 to 1e9.
    pub thickening_times: f64,
}

sized32!(frz_shallow_params, [falls_height], {
    let (defaults, falls) = (Params::default(), Falls::default());
    let longest_step = if let TimeStepping::Realtime(longest) = defaults.pace { longest } else { 0.0 };
    // Enums keep 0, their first value, which is the default.
    let mut params = Self {
        longest_step,
        falls_height: falls.height,
        falls_interval: falls.interval,
        falls_drop: falls.drop,
        thickening_scalar: FRZ_SHALLOW_NO_SCALAR,
        thickening_times: 1.0,
        ..Params::default().into()
    };
    params.set_liquid(&defaults.liquid);
    params
});

fields_of!(Params <=> frz_shallow_params { gravity, kept, rest });

impl frz_shallow_params {
    fn set_liquid(&mut self, liquid: &Liquid) {
        let law = liquid.thinning.unwrap_or(Carreau { thinnest: 0.0, time: 0.0, power: 0.0 });
        self.viscosity = liquid.viscosity;
        self.thinnest = law.thinnest;
        self.thinning_time = law.time;
        self.thinning_power = law.power;
    }

    /// The library's own parameters; an error names a field that is out of range.
    pub(in crate::capi) fn params(&self) -> Outcome<Params> {
        no_flags(self.flags, 0)?;
        within("reserved", f64::from(self.reserved), 0.0..=0.0, "")?;
        within("reserved2", f64::from(self.reserved2), 0.0..=0.0, "")?;
        let falls = Falls {
            height: self.falls_height,
            interval: self.falls_interval,
            drop: self.falls_drop,
            max_packets: self.falls_most as usize,
        };
        let pace = match meaning("pace", "frz_shallow_pace", self.pace, &PACES)? {
            FRZ_SHALLOW_EXACT => TimeStepping::Exact,
            FRZ_SHALLOW_REALTIME => {
                within("longest_step", self.longest_step, 1e-6..=1.0, " s")?;
                TimeStepping::Realtime(self.longest_step)
            }
        };
        let thickening = Thickening {
            scalar: self.thickening_scalar as usize,
            from: self.thickening_from,
            to: self.thickening_to,
            times: self.thickening_times,
        };
        let law = Carreau { thinnest: self.thinnest, time: self.thinning_time, power: self.thinning_power };
        let params = Params {
            liquid: Liquid {
                viscosity: self.viscosity,
                thinning: (self.thinning_time != 0.0).then_some(law),
            },
            pace,
            border: meaning("border", "frz_shallow_border", self.border, &BORDERS)?,
            section: meaning("section", "frz_shallow_section", self.section, &SECTIONS)?,
            friction: meaning("friction", "frz_shallow_friction", self.friction, &FRICTIONS)?,
            thickening: (self.thickening_scalar != FRZ_SHALLOW_NO_SCALAR).then_some(thickening),
            falls: (self.falls_most > 0).then_some(falls),
            ..self.over(Params::default())
        };
        params.validate()?;
        Ok(params)
    }
}

/// The library's own parameters from a host's; the defaults for NULL.
///
/// # Safety
/// As [`sized`].
pub(in crate::capi) unsafe fn params(pointer: *const frz_shallow_params) -> Outcome<Params> {
    if pointer.is_null() {
        return Ok(Params::default());
    }
    // SAFETY: guaranteed by the caller.
    unsafe { given(pointer) }?.params()
}

/// Fills parameters with the defaults: blood, in real time.
///
/// params: receives the defaults.
/// size: sizeof(frz_shallow_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_params_init(params: *mut frz_shallow_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have `size` bytes.
    guard(|| unsafe { fill(params, Some(size), Sized32::defaults()) })
}

/// Sets the viscosity of parameters, and its shear thinning, to those of a known liquid; the other fields stay.
///
/// params: filled before, for instance by frz_shallow_params_init.
/// liquid: a frz_liquid.
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_params_liquid(
    params: *mut frz_shallow_params,
    liquid: u32,
) -> frz_status {
    // SAFETY: the parameters are NULL or have as many bytes as they state.
    guard(|| unsafe {
        let mut changed = given(params.cast_const())?;
        changed.set_liquid(&meaning("liquid", "frz_liquid", liquid, &LIQUIDS)?);
        fill(params, None, changed)
    })
}

/// Where liquid can be: square cells on the ground, and a range of heights. Heights and depths are stored as integers, in units of 2^-30 of
/// this range.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_domain {
    /// sizeof(frz_shallow_domain).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Edge of a cell (m), 1e-9 to 1e9.
    pub cell: f64,
    /// The corner with the minimum x and z (m).
    pub origin: [f64; 2],
    /// Number of cells along x and along z, 1 to 65536 each.
    pub cells: [u32; 2],
    /// The minimum height (m): lower ground is clamped to it.
    pub low: f64,
    /// The maximum height (m), above low; no liquid stands higher.
    pub high: f64,
}

sized32!(frz_shallow_domain);

/// Memory (bytes) for a cell with one solid while a terrain is made: solids and crossings, then columns, pipes and the surface.
const CELL_BYTES: u64 = 160;

/// The cells and heights of a host's domain; an error if the context does not allow them.
///
/// # Safety
/// As [`sized`].
pub(in crate::capi) unsafe fn domain(
    ctx: &Context,
    pointer: *const frz_shallow_domain,
) -> Outcome<(Grid, Heights)> {
    // SAFETY: guaranteed by the caller.
    let given = unsafe { given(pointer) }?;
    no_flags(given.flags, 0)?;
    let grid = Grid { cell: given.cell, origin: given.origin, size: given.cells.map(|count| count as usize) };
    grid.validate()?;
    let heights = Heights::between(given.low, given.high)?;
    let [nx, nz] = given.cells;
    let what = format!("a domain of {nx} x {nz} cells of {} m", given.cell);
    ctx.allow(&what, u64::from(nx) * u64::from(nz) * CELL_BYTES)?;
    Ok((grid, heights))
}
