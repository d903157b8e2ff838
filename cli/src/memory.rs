use anyhow::{Result, bail};

/// Refuses work that needs more memory than there is, before any of it is done.
///
/// `what` says in words what is asked for, and `smaller` what to change.
pub fn require(bytes: f64, what: &str, smaller: &str) -> Result<()> {
    match available() {
        Some(available) if bytes > available => {
            bail!("{what} needs {}, and {} are free here: {smaller}", in_words(bytes), in_words(available))
        }
        None if bytes > ASSUMED => bail!("{what} needs {}: {smaller}", in_words(bytes)),
        _ => Ok(()),
    }
}

/// Where the system does not say what is free.
pub const ASSUMED: f64 = 64e9;

/// Linux says so in a file; elsewhere it is not known.
pub fn available() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024.0)
}

/// The most memory that this process has held at a time, where the system says it.
pub fn peak() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024)
}

fn in_words(bytes: f64) -> String {
    if bytes >= 1e18 {
        return format!("{bytes:.1e} bytes");
    }
    let units = [(1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB")];
    let (size, unit) = units.into_iter().find(|(size, _)| bytes >= *size).unwrap_or((1e3, "kB"));
    format!("{bytes:.0} bytes ({:.1} {unit})", bytes / size)
}
