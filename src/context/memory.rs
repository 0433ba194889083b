//! The machine's memory, as Linux reports it, and what this process has of it.

/// Bytes that this process may use: the machine's memory, or its control group's limit if that is less.
pub fn machine_memory() -> Option<u64> {
    let machine = kilobytes_of(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemTotal:")?;
    let group = std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let group = group.and_then(|text| text.trim().parse::<u64>().ok());
    Some(group.map_or(machine, |limit| limit.min(machine)))
}

/// Peak memory of this process (bytes), if the system reports it.
pub fn peak_memory() -> Option<u64> {
    kilobytes_of(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Gives memory that this process has freed back to the system: glibc keeps most of it for each thread that allocated it.
#[cfg(feature = "scene")]
pub fn release_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: it may be called from any thread at any time.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// The line `NAME   1234 kB` in bytes.
fn kilobytes_of(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}
