use anyhow::{Result, bail};
use sdf_field::memory::{ASSUMED_BYTES, free_bytes};

/// Refuses work that needs more memory than is free, before it starts. `what` names the work, `smaller` says what to change.
pub fn require(bytes: f64, what: &str, smaller: &str) -> Result<()> {
    let free = free_bytes();
    if bytes > free.unwrap_or(ASSUMED_BYTES) {
        bail!("{what} {}: {smaller}", shortage(Some(bytes), free));
    }
    Ok(())
}

/// Describes the memory needed and free; the predicate of a sentence about the work.
pub fn shortage(bytes: Option<f64>, free: Option<f64>) -> String {
    match (bytes, free) {
        (Some(bytes), Some(free)) => format!("needs {}, and {} are free here", words(bytes), words(free)),
        (Some(bytes), None) => format!("needs {}", words(bytes)),
        (None, _) => "is too large".to_owned(),
    }
}

/// As [`shortage`], where --memory sets the limit.
pub fn shortage_of_budget(bytes: Option<f64>, budget: Option<f64>) -> String {
    match (bytes, budget) {
        (Some(bytes), Some(budget)) => format!("needs {}, and --memory allows {}", words(bytes), words(budget)),
        _ => shortage(bytes, budget),
    }
}

/// A number of bytes, and the same in the largest unit that fits.
pub fn words(bytes: f64) -> String {
    if bytes >= 1e18 {
        return format!("{bytes:.1e} bytes");
    }
    let units = [(1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB")];
    let (size, unit) = units.into_iter().find(|(size, _)| bytes >= *size).unwrap_or((1e3, "kB"));
    format!("{bytes:.0} bytes ({:.1} {unit})", bytes / size)
}
