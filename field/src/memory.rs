//! Memory that is free, so that work which needs more is refused before it begins.

/// Memory that is assumed to be free where the system does not say.
pub const ASSUMED_BYTES: f64 = 64e9;

/// Free memory in bytes. Linux says it in a file; WebAssembly has addresses of 32 bits; elsewhere it is not known.
#[cfg(target_arch = "wasm32")]
pub fn free_bytes() -> Option<f64> {
    let pages = 65536 - core::arch::wasm32::memory_size(0);
    // One allocation has at most half of the addresses.
    Some((pages as f64 * 65536.0).min(isize::MAX as f64))
}

/// Free memory in bytes. Linux says it in a file; WebAssembly has addresses of 32 bits; elsewhere it is not known.
#[cfg(not(target_arch = "wasm32"))]
pub fn free_bytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024.0)
}
