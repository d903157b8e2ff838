//! On which threads does a call run? On pools that are kept between calls, one for each count of threads.
//!
//! A process that was forked has the memory of its parent's pools but none of their threads, and would wait for them forever. So
//! a pool belongs to the process that started it.

use std::collections::BTreeMap;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::{PyResult, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};
use sdf_field::Threads;

use crate::errors::value_error;
use crate::integers;

/// Pools by process and count of threads; a count of 0 stands for all cores.
static POOLS: Mutex<BTreeMap<(u32, usize), Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// Runs `work` on so many threads; `None` stands for all cores.
pub fn run<T: Send>(threads: Option<i64>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(pool(threads)?.install(work))
}

/// Elements below which a call stays on the caller's thread: to wake others takes longer.
const FEW: usize = 512;

/// Runs `work` without the interpreter's lock, on the caller's thread if one thread is wanted or there is little to do.
pub fn on_threads<T: Send>(
    py: Python,
    threads: Option<i64>,
    count: usize,
    work: impl FnOnce(Threads) -> T + Send,
) -> PyResult<T> {
    if threads == Some(1) || (threads.is_none() && count <= FEW) {
        return Ok(py.detach(|| work(Threads::ONE)));
    }
    py.detach(|| run(threads, || work(Threads::ALL)))
}

fn pool(threads: Option<i64>) -> PyResult<Arc<ThreadPool>> {
    let given = |count| integers::within("threads", count, 1..=Threads::MOST as u32, ", or None for all cores");
    let count = threads.map_or(Ok(0), given)? as usize;
    let key = (process::id(), count);
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = pools.get(&key) {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().num_threads(count).build();
    let pool = Arc::new(pool.map_err(|error| value_error(format!("threads={count}: {error}")))?);
    pools.insert(key, pool.clone());
    Ok(pool)
}
