//! A file mapped into memory.

use std::fs::File;
use std::ops::Deref;

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

/// The bytes of a file that no longer changes.
pub(in crate::vdb) struct Mapping {
    address: *mut std::ffi::c_void,
    length: usize,
}

impl Mapping {
    /// Maps a whole file.
    ///
    /// # Safety
    /// The file must not be written or truncated while the mapping lives.
    ///
    /// # Errors
    /// What the operating system reports; an empty file.
    pub(in crate::vdb) unsafe fn new(file: &File) -> std::io::Result<Self> {
        let length = usize::try_from(file.metadata()?.len()).map_err(std::io::Error::other)?;
        let flags = MapFlags::PRIVATE | MapFlags::POPULATE;
        // SAFETY: the system chooses an unused address.
        let address = unsafe { mmap(std::ptr::null_mut(), length, ProtFlags::READ, flags, file, 0) }?;
        Ok(Self { address, length })
    }
}

impl Deref for Mapping {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        // SAFETY: the mapping lives as long as this, is readable, and does not change (see `new`).
        unsafe { std::slice::from_raw_parts(self.address.cast(), self.length) }
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: this is our own mapping, and no borrow of it outlives us.
        let _ = unsafe { munmap(self.address, self.length) };
    }
}
