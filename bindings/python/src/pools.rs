//! On which threads does a call run? On pools that are kept between calls, one for each count of threads.
//!
//! A process that was forked has the memory of its parent's pools but none of their threads, and would wait for them forever. So
//! a pool belongs to the process that started it. Pools are looked up with the interpreter's lock held, which a fork by Python waits for:
//! it never copies the list of pools while another thread has locked it.

use std::collections::BTreeMap;
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::{PyResult, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};
use sdf_field::Threads;

use crate::bake::POLL;
use crate::errors::value_error;
use crate::integers;

/// Pools by process and count of threads; a count of 0 stands for all cores.
static POOLS: Mutex<BTreeMap<(u32, usize), Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// Pools that a process keeps: a program has one count of threads, or a few. Those in use are kept beside them.
const MAX_POOLS: usize = 4;

/// Runs `work` on so many threads, without the interpreter's lock; `None` stands for all cores.
pub fn run<T: Send>(py: Python, threads: Option<i64>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool(py, threads)?;
    Ok(py.detach(|| pool.install(work)))
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
    run(py, threads, || work(Threads::ALL))
}

/// Runs what may take long: the caller's thread looks for signals meanwhile. Where a handler raises, the flag is set that `work` is given, and
/// that is raised when it has ended.
pub fn interruptible<T: Send>(
    py: Python,
    threads: Option<i64>,
    work: impl FnOnce(Threads, &AtomicBool) -> T + Send,
) -> PyResult<T> {
    let cancel = &AtomicBool::new(false);
    let pool = if threads == Some(1) { None } else { Some(pool(py, threads)?) };
    let work = || match pool {
        None => work(Threads::ONE, cancel),
        Some(pool) => pool.install(|| work(Threads::ALL, cancel)),
    };
    let (send, receive) = mpsc::channel();
    // A receiver alone must not be lent to the closure below.
    let receive = Mutex::new(receive);
    py.detach(|| {
        std::thread::scope(|scope| {
            let worker = std::thread::Builder::new().name("sdftool-search".to_owned());
            worker.spawn_scoped(scope, move || drop(send.send(work())))?;
            let receive = receive.lock().unwrap_or_else(PoisonError::into_inner);
            loop {
                match receive.recv_timeout(POLL) {
                    Ok(done) => return Ok(done),
                    Err(RecvTimeoutError::Timeout) => {
                        let looked = Python::attach(|py| py.check_signals());
                        looked.inspect_err(|_| cancel.store(true, Ordering::Relaxed))?;
                    }
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(PyRuntimeError::new_err("the search ended in a panic: please report this"));
                    }
                }
            }
        })
    })
}

/// The pool of so many threads, started where this process has none; `None` stands for all cores. Taken while the interpreter's lock is held.
pub fn pool(_: Python, threads: Option<i64>) -> PyResult<Arc<ThreadPool>> {
    let given = |count| integers::within("threads", count, 1..=Threads::MOST as u32, ", or None for all cores");
    let count = threads.map_or(Ok(0), given)? as usize;
    let key = (process::id(), count);
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = pools.get(&key) {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().num_threads(count).build();
    let pool = Arc::new(pool.map_err(|error| value_error(format!("threads={count}: {error}")))?);
    // Pools of the process that this one was forked from have no threads here that could end.
    let own = pools.range((key.0, 0)..=(key.0, usize::MAX));
    let unused = own.clone().find(|(_, pool)| Arc::strong_count(pool) == 1).map(|(key, _)| *key);
    if let Some(unused) = unused.filter(|_| own.count() >= MAX_POOLS) {
        pools.remove(&unused);
    }
    pools.insert(key, pool.clone());
    Ok(pool)
}
