use std::fmt::Write;
use std::time::Duration;

use anyhow::{Context, Result};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::args::Threads;

/// A progress bar with the time left, on standard error if that is a terminal.
pub fn bar(what: &'static str, total: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
    let draw = |state: &ProgressState, out: &mut dyn Write| {
        // A bar that cannot be drawn is no failure.
        let _ = out.write_str(&share_done(state.pos(), state.len().unwrap_or(0), state.eta()));
    };
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {share}") {
        bar.set_style(style.with_key("share", draw));
    }
    bar.set_message(what);
    bar
}

/// The percentage, and from 1 % on the time left: before, there is too little to tell it from.
fn share_done(done: u64, total: u64, left: Duration) -> String {
    let percent = (100.0 * done as f64 / total.max(1) as f64) as u64;
    match percent {
        0 => "  0 %".to_owned(),
        _ => format!("{percent:>3} %, {:#} left", HumanDuration(left)),
    }
}

/// Runs `work` on a pool with the given number of threads.
pub fn on_threads<T: Send>(threads: Threads, work: impl FnOnce() -> T + Send) -> Result<T> {
    Ok(pool(threads.count.map_or(0, usize::from))?.install(work))
}

/// A pool with the given number of threads; 0 stands for all cores.
pub fn pool(threads: usize) -> Result<ThreadPool> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.context("cannot start all threads: give a smaller --threads, or raise the limit of processes")
}
