//! The library itself: versions, names of status codes, the last error.

use std::ffi::{CStr, c_char};

use crate::capi::ffi::guard::last_error;

/// Version of the interface that this header describes: major << 16 | minor.
pub const FRZ_ABI_VERSION: u32 = 0x10009;
/// Major version of frazil that this header belongs to.
pub const FRZ_VERSION_MAJOR: u32 = 0;
/// Minor version of frazil.
pub const FRZ_VERSION_MINOR: u32 = 2;
/// Patch version of frazil.
pub const FRZ_VERSION_PATCH: u32 = 0;

/// Returns the version of the linked library: major * 1000000 + minor * 1000 + patch.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub extern "C" fn frz_version() -> u32 {
    FRZ_VERSION_MAJOR * 1_000_000 + FRZ_VERSION_MINOR * 1_000 + FRZ_VERSION_PATCH
}

/// Returns the name of a status: "FRZ_OK", "FRZ_ERROR_ARGUMENT" and so on; "unknown status" for other numbers.
///
/// Any thread, any time. The text must not be freed.
///
/// status: a frz_status.
#[unsafe(no_mangle)]
pub extern "C" fn frz_status_name(status: u32) -> *const c_char {
    const NAMES: [&CStr; 13] = [
        c"FRZ_OK",
        c"FRZ_ERROR_ARGUMENT",
        c"FRZ_ERROR_FILE",
        c"FRZ_ERROR_IO",
        c"FRZ_ERROR_MEMORY",
        c"FRZ_CANCELLED",
        c"FRZ_ERROR_OPENVDB",
        c"FRZ_ERROR_INTERNAL",
        c"FRZ_ERROR_POISONED",
        c"FRZ_ERROR_BUSY",
        c"FRZ_ERROR_CAPACITY",
        c"FRZ_ERROR_VERSION",
        c"FRZ_ERROR_HANDLE",
    ];
    NAMES.get(status as usize).copied().unwrap_or(c"unknown status").as_ptr()
}

/// Returns the message of this thread's last call that did not return FRZ_OK: one sentence in UTF-8 that names what is at fault; empty
/// before the first failure.
///
/// Any thread, any time. The text is owned by the library and valid until the next failing call of this thread. Calls that succeed do not
/// change it: query it only after a failure.
#[unsafe(no_mangle)]
pub extern "C" fn frz_last_error() -> *const c_char {
    last_error()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_has_the_packages_version() {
        let numbers = [FRZ_VERSION_MAJOR, FRZ_VERSION_MINOR, FRZ_VERSION_PATCH];
        assert_eq!(numbers.map(|number| number.to_string()).join("."), env!("CARGO_PKG_VERSION"));
    }
}
