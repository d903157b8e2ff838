//! Threads of the card, one after the other on one thread of the CPU.

use std::cell::Cell;

thread_local! {
    static CURRENT: Cell<usize> = const { Cell::new(0) };
}

/// Index of the thread of the card that runs now.
pub fn thread() -> usize {
    CURRENT.get()
}

/// Runs so many threads, each once. Which comes when changes from launch to launch, as it may on a card.
pub fn run_all(count: usize, launch: usize, one: impl Fn()) {
    // Steps of a prime that does not divide the count lead to every thread once.
    let steps = [7919, 104_729, 1_299_709];
    let step = steps.into_iter().cycle().skip(launch % 3).take(3).find(|step| !count.is_multiple_of(*step));
    for index in 0..count {
        CURRENT.set((index * step.unwrap_or(1) + launch) % count);
        one();
    }
}
