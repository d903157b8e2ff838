//! How does a bake report its progress? To a function of the caller, which gets one call at a time and may call this library.
//!
//! While such a call waits for threads of its own, rayon may have its thread do another part of the bake, whose step must not wait for
//! the call to end. So no step waits: one that ends during a call is counted, and the next call reports it. A call at the end reports
//! the last.

use std::ffi::c_void;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use sdf_field::Progress;

use crate::border::Callback;

/// `progress` of `sdf_bake`: its user, steps done, and all as far as known. Anything but 0 ends the bake.
pub type ProgressFunction = extern "C" fn(*mut c_void, u64, u64) -> i32;

/// Steps of a bake.
pub struct Steps {
    callback: Option<Callback<ProgressFunction>>,
    done: AtomicU64,
    total: AtomicU64,
    /// Done and total of the last call; locked during a call.
    last: Mutex<[u64; 2]>,
    /// Whether the bake is to end.
    pub cancel: AtomicBool,
}

impl Steps {
    pub fn new(callback: Option<Callback<ProgressFunction>>) -> Self {
        let [done, total] = [AtomicU64::new(0), AtomicU64::new(0)];
        Self { callback, done, total, last: Mutex::new([0; 2]), cancel: AtomicBool::new(false) }
    }

    pub fn count(&self, step: Progress) {
        match step {
            Progress::Total(count) => self.total.fetch_add(count, Ordering::SeqCst),
            Progress::Done(count) => self.done.fetch_add(count, Ordering::SeqCst),
        };
        self.report();
    }

    /// Reports the counts, unless a call is under way, the bake is to end, or the last call had them.
    pub fn report(&self) {
        let Some(callback) = &self.callback else { return };
        let Ok(mut last) = self.last.try_lock() else { return };
        // In this order: what is done was in the total before.
        let now = [&self.done, &self.total].map(|count| count.load(Ordering::SeqCst));
        if *last == now || self.cancel.load(Ordering::SeqCst) {
            return;
        }
        *last = now;
        if (callback.function)(callback.user, now[0], now[1]) != 0 {
            self.cancel.store(true, Ordering::SeqCst);
        }
    }
}
