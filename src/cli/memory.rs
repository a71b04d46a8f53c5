//! What the kernel says of this process.

/// Peak resident memory in bytes (VmHWM), where the kernel tells it.
pub fn peak_resident_bytes() -> Option<u64> {
    of_status("VmHWM:")
}

/// Resident memory now, in bytes (VmRSS), where the kernel tells it.
pub fn resident_bytes() -> Option<u64> {
    of_status("VmRSS:")
}

fn of_status(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

/// Processor time of all threads so far, in seconds.
pub fn cpu_seconds() -> f64 {
    let ticks = || -> Option<u64> {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        let after_name = stat.rsplit_once(')')?.1;
        let fields: Vec<&str> = after_name.split_whitespace().collect();
        Some(fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?)
    };
    // USER_HZ is 100 on every Linux that Rust runs on.
    ticks().map_or(0.0, |ticks| ticks as f64 / 100.0)
}
