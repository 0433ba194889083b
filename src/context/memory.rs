//! The machine's memory, as Linux reports it.

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

/// The line `NAME   1234 kB` in bytes.
fn kilobytes_of(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| kilobytes * 1024)
}
