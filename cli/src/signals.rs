//! Ctrl-C and its like: temporary files are removed, and the exit status is 128 and the signal's number.
//!
//! On Unix the signals are blocked, and a thread waits for them: a handler would not be told which one came.

use anyhow::Result;

/// Calls `clean_up` and ends the program when it is told to end, from now on and in threads that start from now on.
#[cfg(unix)]
pub fn end_with<T>(clean_up: impl Fn() -> T + Send + 'static) -> Result<()> {
    use nix::sys::signal::{SigSet, Signal};
    let signals: SigSet = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP].into_iter().collect();
    signals.thread_block()?;
    std::thread::Builder::new().spawn(move || {
        if let Ok(signal) = signals.wait() {
            let _held = clean_up();
            std::process::exit(128 + signal as i32);
        }
    })?;
    Ok(())
}

/// Calls `clean_up` and ends the program with status 130 at Ctrl-C.
#[cfg(not(unix))]
pub fn end_with<T>(clean_up: impl Fn() -> T + Send + 'static) -> Result<()> {
    ctrlc::set_handler(move || {
        let _held = clean_up();
        std::process::exit(130);
    })?;
    Ok(())
}
