//! The grids of a .vdb file, without their values.

use std::ffi::c_char;
use std::path::Path;

use super::sparse::frz_grid_class;
use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter, frz_context};
use crate::vdb::grid_info::GridInfo;
use crate::vdb::{DENSITY_SCALE_KEY, MetaValue, file};

/// Longest name in a frz_grid_entry, in bytes.
const LONGEST_NAME: usize = 127;

/// A grid of a file, as its description says.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grid_entry {
    /// Name in UTF-8, zero-terminated.
    pub name: [c_char; 128],
    /// OpenVDB's name of the type of its values, zero-terminated: "float", "vec3s", "ptdataidx32" for points ...
    pub value_type: [c_char; 32],
    /// Edge of a voxel along x (m).
    pub voxel_size: f64,
    /// Extinction (1/m) of a density of 1, as the file states it; negative: it does not.
    pub density_scale: f64,
    /// A frz_grid_class.
    pub grid_class: u32,
    /// 1 if its values have 16 bits in the file, else 0.
    pub half: u32,
}

// SAFETY: characters and numbers, without padding.
unsafe impl Plain for frz_grid_entry {}

/// Lists the grids of a .vdb file, of any type, sorted by name, without reading their values.
///
/// path: UTF-8.
/// dst: room for a frz_grid_entry for each grid; FRZ_ERROR_CAPACITY if it is too small, and nothing is written. With data NULL only the count
///     is reported.
/// count: receives the number of grids; 0 after a failure. May be NULL.
///
/// FRZ_ERROR_FILE for a file that is damaged, or has a name of over 127 bytes. One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_list(
    context: *mut frz_context,
    path: *const c_char,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        lists(count, || {
            let call = enter(context)?;
            let path = Path::new(required_text(path, "path")?);
            let grids = call.ctx().phase("read", || file::describe(path))?;
            let entries = grids.iter().map(|grid| entry(path, grid)).collect::<Outcome<Vec<_>>>()?;
            list(entries.into_iter(), &dst, count)
        })
    }
}

fn entry(path: &Path, grid: &GridInfo) -> Outcome<frz_grid_entry> {
    refuse(grid.name.len() > LONGEST_NAME || grid.name.contains('\0'), || {
        format!("{}: it has a grid whose name is too long, or has a zero byte", path.display())
    })?;
    // Tree_float_5_4_3
    let value_type = grid.value_type.trim_start_matches("Tree_").split('_').next().unwrap_or_default();
    let scale = grid.metadata.iter().find(|(key, _)| key == DENSITY_SCALE_KEY).map(|(_, value)| value);
    let density_scale = match scale {
        Some(MetaValue::Float(number)) => f64::from(*number),
        Some(MetaValue::Double(number)) => *number,
        Some(MetaValue::Int(number)) => *number as f64,
        _ => -1.0,
    };
    let grid_class = match &*grid.class {
        "level set" => frz_grid_class::FRZ_GRID_LEVEL_SET,
        "fog volume" => frz_grid_class::FRZ_GRID_FOG,
        "staggered" => frz_grid_class::FRZ_GRID_STAGGERED,
        _ => frz_grid_class::FRZ_GRID_UNKNOWN,
    };
    Ok(frz_grid_entry {
        name: padded(&grid.name),
        value_type: padded(value_type),
        voxel_size: grid.voxel,
        density_scale,
        grid_class: grid_class as u32,
        half: u32::from(grid.half),
    })
}

/// A text, cut so that a zero follows it.
fn padded<const N: usize>(text: &str) -> [c_char; N] {
    let mut out = [0; N];
    out.iter_mut().take(N - 1).zip(text.bytes()).for_each(|(to, byte)| *to = byte as c_char);
    out
}
