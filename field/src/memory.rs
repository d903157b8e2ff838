//! Memory that is free, so that work which needs more is refused before it begins.

/// Memory that is assumed to be free where the system does not say.
pub const ASSUMED_BYTES: f64 = 64e9;

/// Free memory in bytes. Linux says it in a file; elsewhere it is not known.
pub fn free_bytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024.0)
}
