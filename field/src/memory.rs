//! Memory that is free, so that work which needs more is refused before it begins.

#[cfg(not(target_arch = "wasm32"))]
use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, System};

/// Memory that is assumed to be free where the system does not say.
pub const ASSUMED_BYTES: f64 = 64e9;

/// Free memory in bytes: what the machine has, and no more than the limits of the process (`ulimit -v` on Linux) and of its container or
/// batch job (cgroups of Linux) leave. Caches of files count as free. WebAssembly has addresses of 32 bits. `None` where the system does not
/// say.
#[cfg(target_arch = "wasm32")]
pub fn free_bytes() -> Option<f64> {
    let pages = 65536 - core::arch::wasm32::memory_size(0);
    // One allocation has at most half of the addresses.
    Some((pages as f64 * 65536.0).min(isize::MAX as f64))
}

/// Free memory in bytes: what the machine has, and no more than the limits of the process (`ulimit -v` on Linux) and of its container or
/// batch job (cgroups of Linux) leave. Caches of files count as free. WebAssembly has addresses of 32 bits. `None` where the system does not
/// say.
#[cfg(not(target_arch = "wasm32"))]
pub fn free_bytes() -> Option<f64> {
    let mut system = System::new().ok()?;
    system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
    let of_machine = Some(system.available_memory()).filter(|bytes| *bytes > 0);
    [of_machine, free_of_group(&mut system), free_addresses()].into_iter().flatten().min().map(|bytes| bytes as f64)
}

/// Bytes that the limit of the process' addresses leaves; `None` without a limit.
#[cfg(not(target_arch = "wasm32"))]
fn free_addresses() -> Option<u64> {
    // A limit that is not set is a word.
    let limit = number("/proc/self/limits", "Max address space")?;
    Some(limit.saturating_sub(status_bytes("VmSize:")?))
}

/// The most memory that the process has held so far, in bytes; `None` if the system does not say.
#[cfg(not(target_arch = "wasm32"))]
pub fn peak_bytes() -> Option<u64> {
    status_bytes("VmHWM:")
}

/// A size in the status of the process, in bytes.
#[cfg(not(target_arch = "wasm32"))]
fn status_bytes(label: &str) -> Option<u64> {
    Some(number("/proc/self/status", label)? * 1024)
}

/// The number behind a label at the beginning of a line.
#[cfg(not(target_arch = "wasm32"))]
fn number(file: &str, label: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    text.lines().find_map(|line| line.strip_prefix(label)?.split_whitespace().next()?.parse().ok())
}

/// Bytes that the limits of the process' control group and of those around it leave; `None` without a limit. Of the memory that is counted
/// against it, the system takes back the caches of files.
#[cfg(not(target_arch = "wasm32"))]
fn free_of_group(system: &mut System) -> Option<u64> {
    let process = sysinfo::get_current_pid().ok()?;
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[process]), false, ProcessRefreshKind::nothing());
    let limits = system.process(process)?.cgroup_limits()?;
    Some(limits.total_memory.saturating_sub(limits.rss))
}
