//! The machine's disks.

/// Bytes that this user may still write where a folder is.
pub fn free_space(folder: &std::path::Path) -> Option<u64> {
    let file_system = rustix::fs::statvfs(folder).ok()?;
    Some(file_system.f_bavail * file_system.f_frsize)
}
