//! Scalars that shallow liquid carries: dyes, ages, and quantities that decay.

use std::ffi::c_char;

use super::calls::informs;
use super::handle::frz_shallow;
use super::read::Requested;
use crate::capi::ffi::*;
use crate::error::Result;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::{Law, Scalar, ScalarBalance};

/// Maximum number of scalars that a liquid carries.
pub const FRZ_SHALLOW_MOST_SCALARS: u32 = 4;

const _: () = assert!(FRZ_SHALLOW_MOST_SCALARS as usize == MAX_SCALARS);

/// How a scalar changes, besides being carried.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_shallow_law {
    /// Not at all: dye, salt, heat.
    FRZ_SHALLOW_DYE = 0,
    /// It decays by half in each frz_shallow_scalar.half_life.
    FRZ_SHALLOW_DECAYS = 1,
    /// It is the time (s) since the liquid came in, averaged over a column, up to frz_shallow_scalar.range.
    FRZ_SHALLOW_AGES = 2,
}

use frz_shallow_law::*;

/// The laws; the argument is the half-life, which only [`Law::Decays`] uses.
const LAWS: Meanings<fn(f64) -> Law, 3> = [
    (FRZ_SHALLOW_DYE as u32, |_| Law::Dye),
    (FRZ_SHALLOW_DECAYS as u32, Law::Decays),
    (FRZ_SHALLOW_AGES as u32, |_| Law::Ages),
];

/// A scalar that the liquid carries. Zero it, then set struct_size.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_scalar {
    /// sizeof(frz_shallow_scalar), the same in all scalars of a call.
    pub struct_size: u32,
    /// A frz_shallow_law.
    pub law: u32,
    /// Its name in messages, not empty and different from those of the other scalars; it is copied.
    pub name: *const c_char,
    /// Bound of the concentrations, 1e-9 to 1e9, in the scalar's own unit: they lie within -range to range, with a resolution of 2^-20 of
    /// the range. Suitable values are 1 for a dye and 3600 (s) for an age.
    pub range: f64,
    /// Half-life of a scalar that decays: 1e-6 to 1e12 (s); otherwise ignored.
    pub half_life: f64,
}

sized32!(frz_shallow_scalar);

impl frz_shallow_scalar {
    /// # Safety
    /// The name must be NULL or a zero-terminated text.
    unsafe fn scalar(&self) -> Outcome<Scalar> {
        let law = meaning("law", "frz_shallow_law", self.law, &LAWS)?(self.half_life);
        // SAFETY: guaranteed by the caller.
        let name = unsafe { required_text(self.name, "name") }?.to_string();
        let scalar = Scalar { name, law, range: self.range };
        scalar.validate()?;
        Ok(scalar)
    }
}

/// Reads the scalars of a host.
///
/// # Safety
/// As [`read_list`]; names must be NULL or zero-terminated texts.
pub(in crate::capi) unsafe fn read_scalars(
    scalars: *const frz_shallow_scalar,
    count: usize,
) -> Outcome<Vec<Scalar>> {
    refuse(count > MAX_SCALARS, || format!("{count} scalars: at most {MAX_SCALARS} are allowed"))?;
    let mut given = Vec::new();
    // SAFETY: guaranteed by the caller.
    let scalar = |scalar: frz_shallow_scalar| unsafe { scalar.scalar() };
    // SAFETY: as above.
    unsafe { read_list(scalars, count, ["scalar", "scalars"], &mut given, scalar) }?;
    Ok(given)
}

/// Sets the scalars that the liquid carries, replacing the previous ones. They are 0 everywhere at first; poured liquid has 0 until
/// frz_shallow_set_poured is called, and liquid from sources until frz_shallow_set_sourced is. The next frame may allocate.
///
/// scalars: count scalars; NULL with a count of 0: none. FRZ_ERROR_ARGUMENT names the index of one that is out of range; the old scalars
///     are then kept.
/// count: number of scalars, up to FRZ_SHALLOW_MOST_SCALARS.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_scalars(
    shallow: *mut frz_shallow,
    scalars: *const frz_shallow_scalar,
    count: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { Ok(change(shallow)?.shallow.set_scalars(&read_scalars(scalars, count)?)?) })
}

/// Sets the concentrations of scalars in liquid that frz_shallow_pour, _fill and _set_depths add from now on; initially 0.
///
/// concentrations: double for each scalar, in their order, within its range.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_poured(
    shallow: *mut frz_shallow,
    concentrations: frz_view,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive; the view is valid.
    guard(|| unsafe {
        let shallow = &mut change(shallow)?.shallow;
        with_concentrations(shallow.scalars().len(), &concentrations, |given| shallow.set_poured(given))
    })
}

/// Sets the concentrations of scalars in liquid from a source; 0 after frz_shallow_set_flows.
///
/// flow: index of the flow point, from 0.
/// concentrations: double for each scalar, in their order, within its range.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_sourced(
    shallow: *mut frz_shallow,
    flow: usize,
    concentrations: frz_view,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive; the view is valid.
    guard(|| unsafe {
        let shallow = &mut change(shallow)?.shallow;
        with_concentrations(shallow.scalars().len(), &concentrations, |given| {
            shallow.set_sourced(flow, given)
        })
    })
}

/// Passes on a host's numbers, one for each of `count` scalars.
///
/// # Safety
/// The view must describe memory that can be read.
pub(in crate::capi) unsafe fn with_concentrations(
    count: usize,
    concentrations: &frz_view,
    set: impl FnOnce(&[f64]) -> Result<()>,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    let given =
        unsafe { one_for_each::<f64>(concentrations, "concentrations", count, ["there are", "scalars"]) }?;
    let mut numbers = [0.0; MAX_SCALARS];
    numbers.iter_mut().zip(given).for_each(|(number, given)| *number = given);
    Ok(set(&numbers[..count])?)
}

/// Copies the concentrations of a scalar (a real-time call: see frz_shallow); 0 where it is dry.
///
/// scalar: its index, from 0.
/// columns: uint32_t, the index of each requested column; data NULL with a count of 0: all indices, in order.
/// dst: room for a float for each; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_read_scalar(
    shallow: *const frz_shallow,
    scalar: u32,
    columns: frz_view,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive; view and span are valid.
    guard(|| unsafe {
        let shallow = &read(shallow)?.shallow;
        let scalar = check_index("scalar", scalar as usize, shallow.scalars().len())?;
        let count = shallow.columns().len();
        Requested { columns, dst, count }.copy(|index| shallow.concentration(scalar, index))
    })
}

/// Where all of a scalar is, and where it came from: concentration x volume (its own unit x m3). inside + held + falling = poured + sourced
/// + gained + grown - drained - absorbed - lost - dried.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_scalar_balance {
    /// sizeof(frz_shallow_scalar_balance), set by the caller.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// In the columns.
    pub inside: f64,
    /// Poured in so far, minus what was taken out.
    pub poured: f64,
    /// From sources.
    pub sourced: f64,
    /// To drains.
    pub drained: f64,
    /// To absorbers.
    pub absorbed: f64,
    /// Lost over the border, or where there is no ground.
    pub lost: f64,
    /// From beyond an absorbing border.
    pub gained: f64,
    /// Waiting for room, where ground or a body displaced it.
    pub held: f64,
    /// In the air.
    pub falling: f64,
    /// Added by its law; negative: removed.
    pub grown: f64,
    /// Left by rounding in columns that ran dry.
    pub dried: f64,
    /// Error of the balance above, in units of the smallest amount: always 0, since all amounts are integers.
    pub error: i64,
}

sized32!(frz_shallow_scalar_balance);

fields_of!(ScalarBalance => frz_shallow_scalar_balance {
    inside, poured, sourced, drained, absorbed, lost, gained, held, falling, grown, dried
});

impl frz_shallow_scalar_balance {
    pub(in crate::capi) fn of(sum: ScalarBalance) -> Self {
        Self { error: sum.error.clamp(i64::MIN.into(), i64::MAX.into()) as i64, ..sum.into() }
    }
}

/// Reports where all of a scalar is, and where it came from.
///
/// scalar: its index, from 0.
/// balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_get_scalar_balance(
    shallow: *const frz_shallow,
    scalar: u32,
    balance: *mut frz_shallow_scalar_balance,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        informs(balance, || {
            let shallow = &read(shallow)?.shallow;
            let sum =
                shallow.scalar_balance(check_index("scalar", scalar as usize, shallow.scalars().len())?)?;
            Ok(frz_shallow_scalar_balance::of(sum))
        })
    }
}
