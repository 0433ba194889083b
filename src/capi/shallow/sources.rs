//! Where shallow liquid comes in and goes out, and where all of it is.

use super::liquid::{Spill, frz_shallow};
use super::lists::each_sized;
use super::terrain::Terrain;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::{change, clear, read, required};
use crate::capi::ffi::views::{Sized32, fill, finite, frz_view, meaning};
use crate::capi::mesh::triangles::no_flags;
use crate::shallow::Balance;
use crate::shallow::sources::{FlowPoint, Kind, Pulse};

/// Flag of a flow point: it lies on a triangle of the mesh that the liquid was made with, and moves with it.
pub const FRZ_SHALLOW_ON_TRIANGLE: u32 = 1;

/// What a flow point does.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_flow_kind {
    /// Liquid comes in.
    FRZ_SHALLOW_SOURCE = 0,
    /// Liquid goes out, as long as there is some below it: suction.
    FRZ_SHALLOW_DRAIN = 1,
    /// As a drain, until it has taken frz_shallow_flow.capacity: gauze.
    FRZ_SHALLOW_ABSORBER = 2,
    /// A hole in the ground, through which liquid runs out by its own weight: frz_shallow_flow.opening times (2 g H)^(1/2) a second, of the mean depth H
    /// in its circle (Torricelli's law), at most its rate.
    FRZ_SHALLOW_ORIFICE = 3,
}

use frz_shallow_flow_kind::*;

const KINDS: [(u32, frz_shallow_flow_kind); 4] = [
    (FRZ_SHALLOW_SOURCE as u32, FRZ_SHALLOW_SOURCE),
    (FRZ_SHALLOW_DRAIN as u32, FRZ_SHALLOW_DRAIN),
    (FRZ_SHALLOW_ABSORBER as u32, FRZ_SHALLOW_ABSORBER),
    (FRZ_SHALLOW_ORIFICE as u32, FRZ_SHALLOW_ORIFICE),
];

/// A position where liquid comes in or goes out. It begins zeroed, and then struct_size.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_flow {
    /// sizeof(frz_shallow_flow), the same in all flow points of a call.
    pub struct_size: u32,
    /// 0 or FRZ_SHALLOW_ON_TRIANGLE.
    pub flags: u32,
    /// A frz_shallow_flow_kind.
    pub kind: u32,
    /// With FRZ_SHALLOW_ON_TRIANGLE: the triangle, of those that frz_mesh_read lists as FRZ_MESH_TRIANGLES; else 0.
    pub triangle: u32,
    /// With FRZ_SHALLOW_ON_TRIANGLE: shares of its three vertices in the place, finite, whose sum is 1; else they are not looked at.
    pub shares: [f64; 3],
    /// Without: the position (m). It acts on the ground that is nearest above or below it.
    pub at: [f64; 3],
    /// It acts on cells whose middles lie within so much of the position, seen from above (m), 0 or more; on the nearest one, if none
    /// does.
    pub radius: f64,
    /// Volume in a second (m3/s), 0 or more: 1 ml/s is 1e-6. Of an orifice the most that goes out.
    pub rate: f64,
    /// Volume that an absorber takes (m3), 0 or more; of others it is not looked at.
    pub capacity: f64,
    /// How often in a second the rate swings, 0 or more; 0: it does not.
    pub pulse_frequency: f64,
    /// By which share of itself the rate swings up and down, 0 to 1, in a sine from the start of the simulated time.
    pub pulse_share: f64,
    /// Of an orifice: its area (m2) times the share of it that the jet fills, 0.6 to 0.65 for a sharp edge, 0 or more; of others it is not looked at.
    pub opening: f64,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_flow {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_flow";
}

impl frz_shallow_flow {
    const NONE: Self = Self {
        struct_size: 0,
        flags: 0,
        kind: 0,
        triangle: 0,
        shares: [0.0; 3],
        at: [0.0; 3],
        radius: 0.0,
        rate: 0.0,
        capacity: 0.0,
        pulse_frequency: 0.0,
        pulse_share: 0.0,
        opening: 0.0,
    };
}

/// A flow point, and the triangle with which it moves.
pub(in crate::capi) struct Attached {
    /// The flow point where it is now.
    pub point: FlowPoint,
    /// Index of the triangle, and the shares of its corners.
    pub on: Option<(u32, [f64; 3])>,
}

impl Attached {
    /// The flow points of a host.
    ///
    /// # Safety
    /// As [`each_sized`].
    pub(in crate::capi) unsafe fn all(
        flows: *const frz_shallow_flow,
        count: usize,
        terrain: &Terrain,
    ) -> Outcome<Vec<Self>> {
        let mut attached = Vec::with_capacity(count.min(1 << 16));
        let take = |given: frz_shallow_flow| {
            attached.push(Self::of(&given, terrain)?);
            Ok(())
        };
        // SAFETY: the caller's promise.
        unsafe { each_sized(flows, count, ["flow", "flows"], frz_shallow_flow::NONE, take) }?;
        Ok(attached)
    }

    fn of(given: &frz_shallow_flow, terrain: &Terrain) -> Outcome<Self> {
        no_flags(given.flags, FRZ_SHALLOW_ON_TRIANGLE)?;
        let kind = match meaning("kind", "frz_shallow_flow_kind", given.kind, &KINDS)? {
            FRZ_SHALLOW_SOURCE => Kind::Source,
            FRZ_SHALLOW_DRAIN => Kind::Drain,
            FRZ_SHALLOW_ABSORBER => Kind::Absorber(given.capacity),
            FRZ_SHALLOW_ORIFICE => Kind::Orifice(given.opening),
        };
        let is_attached = given.flags & FRZ_SHALLOW_ON_TRIANGLE != 0;
        let on = is_attached.then_some((given.triangle, given.shares));
        if let Some((_, shares)) = &on {
            let sum: f64 = shares.iter().sum();
            if sum.is_nan() || (sum - 1.0).abs() >= 1e-6 {
                return Err(Failure::argument(format!("the sum of the shares {shares:?} is not 1")));
            }
        }
        let at = match &on {
            None => given.at,
            Some(on) => terrain.position(on)?,
        };
        let pulse = Pulse { frequency: given.pulse_frequency, share: given.pulse_share };
        let pulse = (pulse.frequency != 0.0).then_some(pulse);
        Ok(Self { point: FlowPoint { kind, at, radius: given.radius, rate: given.rate, pulse }, on })
    }
}

/// Sets sources, drains and absorbers, in place of those before; what these have moved stays in frz_shallow_balance. An absorber
/// that is set again is dry. The frame after it may allocate.
///
/// flows: count flow points; NULL with a count of 0: there is none. FRZ_ERROR_ARGUMENT names one that is out of range, lies inside of
///     solid or outside of the domain, counted from 0; the old ones then stay.
/// count: number of flow points.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_flows(
    shallow: *mut frz_shallow,
    flows: *const frz_shallow_flow,
    count: usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let mut spill = change(shallow)?;
            let attached = Attached::all(flows, count, &spill.terrain)?;
            let points: Vec<FlowPoint> = attached.iter().map(|flow| flow.point.clone()).collect();
            spill.shallow.set_flows(&points, |at| format!("flow {at}"))?;
            spill.flows = attached;
            Ok(())
        }
    })
}

/// Reports how much a flow point has moved since it was set: what came in, or went out.
///
/// flow: which, counted from 0.
/// volume: receives it (m3); 0 after a failure.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_flow_moved(
    shallow: *const frz_shallow,
    flow: usize,
    volume: *mut f64,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(volume);
            let volume = required(volume, "volume")?;
            let spill = read(shallow)?;
            let count = spill.flows.len();
            if flow >= count {
                return Err(Failure::argument(format!("flow = {flow} is none of the {count} that were set")));
            }
            volume.write_unaligned(spill.shallow.moved(flow));
            Ok(())
        }
    })
}

/// Pours a volume at a position, shared by the columns that a flow point there would act on; each takes what it has room for, or gives what
/// it has.
///
/// at: double[3], the position (m): FRZ_ERROR_ARGUMENT where it lies inside of solid or outside of the domain.
/// radius: as in frz_shallow_flow (m).
/// volume: what to pour (m3); negative: what to take.
/// poured: receives what came in (m3), or went out (negative); 0 after a failure. May be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_pour(
    shallow: *mut frz_shallow,
    at: *const f64,
    radius: f64,
    volume: f64,
    poured: *mut f64,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(poured);
            let mut spill = change(shallow)?;
            let at = required(at.cast_mut(), "at")?.cast::<[f64; 3]>().read_unaligned();
            finite("volume", volume)?;
            let moved = spill.shallow.pour_at(at, radius, volume)?;
            if !poured.is_null() {
                poured.write_unaligned(moved);
            }
            Ok(())
        }
    })
}

/// Fills all columns up to a height, or their ceiling; those that are fuller stay as they are.
///
/// height: where the surface is to be (m).
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_fill(shallow: *mut frz_shallow, height: f64) -> frz_status {
    guard(|| {
        // SAFETY: the liquid is NULL or was not destroyed.
        let mut spill = unsafe { change(shallow) }?;
        finite("height", height)?;
        spill.shallow.fill(height);
        Ok(())
    })
}

/// Sets the depths of all columns: a first state that a host has made, or the liquid of a solver of its own, of which a surface is wanted.
/// What it adds and takes counts as poured; what flows stays as it is.
///
/// depths: float for each column index (m), as frz_shallow_read lists them: 0 or more, finite; beyond a ceiling the column is full. Of an
///     index without a column it is not looked at.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_depths(shallow: *mut frz_shallow, depths: frz_view) -> frz_status {
    guard(|| {
        // SAFETY: the liquid is NULL or was not destroyed; the view is the caller's.
        unsafe {
            let mut spill = change(shallow)?;
            let count = spill.shallow.columns().len();
            let wanted = depths.in_place::<f32>("depths")?;
            if wanted.len() != count {
                let text = format!("depths: {} elements, but there are {count} column indices", wanted.len());
                return Err(Failure::argument(text));
            }
            let is_bad = |&(index, depth): &(usize, f32)| {
                spill.shallow.columns().is_column(index) && !(depth >= 0.0 && depth.is_finite())
            };
            if let Some((at, depth)) = wanted.clone().enumerate().find(is_bad) {
                return Err(Failure::argument(format!("depths: element {at}, {depth} m, is not 0 or more")));
            }
            set_depths(&mut spill, wanted);
            Ok(())
        }
    })
}

fn set_depths(spill: &mut Spill, wanted: impl Iterator<Item = f32>) {
    let shallow = &mut spill.shallow;
    let heights = shallow.columns().heights;
    for (index, depth) in wanted.enumerate() {
        if shallow.columns().is_column(index) {
            let now = heights.length(f64::from(shallow.depths()[index]));
            shallow.pour(index, f64::from(depth) - now);
        }
    }
}

/// Where all liquid is, and came from (m3; 1 ml is 1e-6). inside + held + falling = poured + sourced + gained - drained - absorbed -
/// lost.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_balance {
    /// sizeof(frz_shallow_balance), set by the caller.
    pub struct_size: u32,
    /// Nothing.
    pub reserved: u32,
    /// In the columns.
    pub inside: f64,
    /// Poured in so far, less what was taken.
    pub poured: f64,
    /// Came in through sources.
    pub sourced: f64,
    /// Went out through drains.
    pub drained: f64,
    /// Went into absorbers.
    pub absorbed: f64,
    /// Went over the border, or fell where there is no ground.
    pub lost: f64,
    /// Came in over a border that absorbs waves.
    pub gained: f64,
    /// Waits for room, where ground or a body has swallowed it.
    pub held: f64,
    /// Units (2^-30 of the range of heights, of a cell) that the sum above is off: 0, as all are integers.
    pub error: i64,
    /// In the air.
    pub falling: f64,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_balance {
    const SIZES: &'static [usize] = &[std::mem::offset_of!(frz_shallow_balance, falling), size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_balance";
}

impl From<Balance> for frz_shallow_balance {
    fn from(sum: Balance) -> Self {
        Self {
            struct_size: 0,
            reserved: 0,
            inside: sum.inside,
            poured: sum.poured,
            sourced: sum.sourced,
            drained: sum.drained,
            absorbed: sum.absorbed,
            lost: sum.lost,
            gained: sum.gained,
            held: sum.held,
            error: sum.error,
            falling: sum.falling,
        }
    }
}

/// Reports where all liquid is.
///
/// balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_get_balance(
    shallow: *const frz_shallow,
    balance: *mut frz_shallow_balance,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            fill(balance, None, Balance::default().into())?;
            fill(balance, None, read(shallow)?.shallow.balance().into())
        }
    })
}
