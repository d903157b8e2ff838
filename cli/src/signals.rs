//! Ctrl-C and its like: temporary files are removed, and the exit status is 128 and the signal's number.
//!
//! A run that is worth keeping defers the first signal: it writes what it has, and then ends with the same status. A later signal ends
//! it at once, unless it comes within half a second: one Ctrl-C may be two, where a process group gets it and a supervisor sends SIGTERM.
//!
//! On Unix the signals are blocked, and a thread waits for them: a handler would not be told which one came. SIGXFSZ is blocked, too,
//! and nobody waits for it: a write beyond the file size limit (`ulimit -f`) fails with an error, as on a full disk. What the program is
//! started to ignore, as `nohup` does with SIGHUP, it goes on ignoring.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

/// Is the next signal deferred?
static IS_DEFERRED: AtomicBool = AtomicBool::new(false);

/// Exit status that a deferred signal asks for; 0 if none came.
static STATUS: AtomicU8 = AtomicU8::new(0);

/// When the deferred signal came.
static DEFERRED: OnceLock<Instant> = OnceLock::new();

/// Signals that come within so long of the deferred one are the same.
const AT_ONCE: Duration = Duration::from_millis(500);

/// From now on the first signal only sets [`status`].
pub fn defer() {
    IS_DEFERRED.store(true, Ordering::SeqCst);
}

/// The exit status that a deferred signal asks for.
pub fn status() -> Option<u8> {
    Some(STATUS.load(Ordering::SeqCst)).filter(|status| *status != 0)
}

/// Takes notice of a signal; `true` if it is the one that is deferred, or comes at once with it.
fn is_deferred(status: u8) -> bool {
    if IS_DEFERRED.swap(false, Ordering::SeqCst) {
        DEFERRED.get_or_init(Instant::now);
        STATUS.store(status, Ordering::SeqCst);
    }
    DEFERRED.get().is_some_and(|deferred| deferred.elapsed() < AT_ONCE)
}

/// Calls `clean_up` and ends the program when it is told to end, from now on and in threads that start from now on.
#[cfg(unix)]
pub fn end_with<T>(clean_up: impl Fn() -> T + Send + 'static) -> Result<()> {
    use nix::sys::signal::{SigSet, Signal};
    let ignored = ignored();
    let is_wanted = |signal: &Signal| ignored >> (*signal as i32 - 1) & 1 == 0;
    let signals: SigSet = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP].into_iter().filter(is_wanted).collect();
    signals.thread_block()?;
    SigSet::from(Signal::SIGXFSZ).thread_block()?;
    std::thread::Builder::new()
        .spawn(move || {
            while let Ok(signal) = signals.wait() {
                let status = 128 + signal as i32;
                if !is_deferred(status as u8) {
                    let _held = clean_up();
                    std::process::exit(status);
                }
            }
        })
        .context("cannot start a thread")?;
    Ok(())
}

/// The signals that the program is started to ignore, from the lowest bit on; none where the system does not say. A blocked signal comes
/// even where it is ignored.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Calls `clean_up` and ends the program with status 130 at Ctrl-C.
#[cfg(not(unix))]
pub fn end_with<T>(clean_up: impl Fn() -> T + Send + 'static) -> Result<()> {
    ctrlc::set_handler(move || {
        if !is_deferred(130) {
            let _held = clean_up();
            std::process::exit(130);
        }
    })?;
    Ok(())
}
